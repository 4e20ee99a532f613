"""The ambient at one lump is warmer or colder than the measured one, by a constant."""

from __future__ import annotations

from .._system import System
from ._builders import numbers
from ._effect import Effect, Quantity
from ._response import Where
from ._signatures import by_heat, constant

_add = numbers("lumps", difference="gradient")


def _places(system: System) -> list[Where]:
    """Lumps with a path of their own to an ambient."""
    ends = {end for link in system.links if set(link.between) & set(system.ambients) for end in link.between}
    return [(name,) for name in system.lumps if name in ends]


EFFECT = Effect(
    name="ambient_gradient",
    rank=140,
    meaning="The ambient at one lump is warmer or colder than the measured one, by a constant.",
    where=("lump",),
    places=_places,
    quantities=(Quantity("difference", "K", -100.0, 100.0),),
    add=_add,
    signature=by_heat(_add, "difference", 1.0),
    hidden=constant,
    confused_with=("heat_source", "sensor_offset"),
    separated_by="an ambient sensor beside the lump",
    measure="a second ambient sensor beside {0}",
)
