"""Heat is conducted between a lump and an ambient that the model does not join."""

from __future__ import annotations

from itertools import product

from .._system import System
from ._builders import new_link
from ._effect import Effect, Quantity
from ._places import joined_pairs
from ._response import Where
from ._signatures import difference, exchanged

_add = new_link(lambda values: {"conductance": values["conductance"]}, {"conductance": "conductance"})


def _places(system: System) -> list[Where]:
    """Lumps and ambients that do not conduct yet."""
    joined = joined_pairs(system)
    return [pair for pair in product(system.lumps, system.ambients) if frozenset(pair) not in joined]


EFFECT = Effect(
    name="missing_ambient_link",
    rank=90,
    meaning="Heat is conducted between a lump and an ambient that the model does not join.",
    where=("lump", "ambient"),
    places=_places,
    quantities=(Quantity("conductance", "W/K", 0.0, 1e3),),
    nonnegative=("conductance",),
    add=_add,
    signature=exchanged(difference),
    confused_with=("natural_convection", "radiation", "missing_ambient_link"),
    separated_by="a step of the ambient temperature",
)
