"""Heat radiated between two bodies, with the fourth powers of their temperatures."""

from __future__ import annotations

from itertools import combinations

from .._system import System
from ._builders import new_link
from ._effect import Effect, Quantity
from ._places import ambient_pairs_without, pairs_with
from ._response import Array, Values, Where
from ._signatures import exchanged

_SPAN = 80.0  # K: from 300 to 380 K the heat for the same difference doubles

_add = new_link(lambda values: {"radiation": values["coefficient"]}, {"coefficient": "radiation"})
_to_ambients = ambient_pairs_without("radiation")


def _flow(Ta: Array, Tb: Array, values: Values) -> Array:
    return Tb**4 - Ta**4


def _places(system: System) -> list[Where]:
    """Lumps and ambients, and pairs of lumps, that do not radiate to each other yet."""
    there = pairs_with("radiation", system)
    return [*_to_ambients(system), *(pair for pair in combinations(system.lumps, 2) if frozenset(pair) not in there)]


def _span(system: System, where: Where) -> float:
    """Between lumps only over a wide range: in a small one it is a conductance."""
    return _SPAN if where[1] in system.lumps else 0.0


EFFECT = Effect(
    name="radiation",
    rank=110,
    meaning="Heat radiated between a lump and an ambient, or between two lumps, with the fourth powers of their "
            "temperatures.",
    where=("lump", "lump or ambient"),
    places=_places,
    quantities=(Quantity("coefficient", "W/K⁴", 0.0, 5.67e-7, typical=1e-10),),
    nonnegative=("coefficient",),
    add=_add,
    signature=exchanged(_flow),
    span=_span,
    confused_with=("natural_convection", "missing_ambient_link"),
    separated_by="another absolute level at equal differences",
)
