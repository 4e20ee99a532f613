"""A constant heat into a lump that the model does not know."""

from __future__ import annotations

from ._builders import numbers
from ._effect import Effect, Quantity
from ._places import lumps
from ._signatures import by_heat, constant

_add = numbers("lumps", heat="heat")

EFFECT = Effect(
    name="heat_source",
    rank=130,
    meaning="A constant heat into a lump that the model does not know.",
    where=("lump",),
    places=lumps,
    quantities=(Quantity("heat", "W", -1e3, 1e3),),
    add=_add,
    signature=by_heat(_add, "heat", 1.0),
    hidden=constant,
    confused_with=("ambient_gradient", "sensor_self_heating", "input_offset"),
    separated_by="inputs off, another ambient temperature",
    measure="switch off what could heat {0}, or a heat-flux sensor there",
)
