"""Heat is conducted between two lumps that the model does not join."""

from __future__ import annotations

from itertools import combinations

from .._system import System
from ._builders import new_link
from ._effect import Effect, Quantity
from ._places import joined_pairs
from ._response import Where
from ._signatures import difference, exchanged

_add = new_link(lambda values: {"conductance": values["conductance"]}, {"conductance": "conductance"})


def _places(system: System) -> list[Where]:
    """Pairs of lumps that do not conduct yet."""
    joined = joined_pairs(system)
    return [pair for pair in combinations(system.lumps, 2) if frozenset(pair) not in joined]


EFFECT = Effect(
    name="missing_link",
    rank=80,
    meaning="Heat is conducted between two lumps that the model does not join.",
    where=("lump", "lump"),
    places=_places,
    quantities=(Quantity("conductance", "W/K", 0.0, 1e3),),
    nonnegative=("conductance",),
    add=_add,
    signature=exchanged(difference),
    confused_with=("missing_link", "missing_ambient_link", "hidden_mass"),
    separated_by="a large temperature difference between the two lumps without moving the others",
)
