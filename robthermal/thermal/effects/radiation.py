"""Heat radiated between a lump and an ambient, with the fourth powers of their temperatures."""

from __future__ import annotations

from ._builders import new_link
from ._effect import Effect, Quantity
from ._places import ambient_pairs_without
from ._response import Array, Values
from ._signatures import exchanged

_add = new_link(lambda values: {"radiation": values["coefficient"]}, {"coefficient": "radiation"})


def _flow(Ta: Array, Tb: Array, values: Values) -> Array:
    return Tb**4 - Ta**4


EFFECT = Effect(
    name="radiation",
    rank=110,
    meaning="Heat radiated between a lump and an ambient, with the fourth powers of their temperatures.",
    where=("lump", "ambient"),
    places=ambient_pairs_without("radiation"),
    quantities=(Quantity("coefficient", "W/K⁴", 0.0, 5.67e-7, typical=1e-10),),
    nonnegative=("coefficient",),
    add=_add,
    signature=exchanged(_flow),
    confused_with=("natural_convection", "missing_ambient_link"),
    separated_by="another absolute level at equal differences",
)
