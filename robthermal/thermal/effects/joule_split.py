"""The Joule heat of a module is not shared half and half by its faces."""

from __future__ import annotations

from ._builders import numbers
from ._effect import Effect, Quantity
from ._places import modules
from ._signatures import by_heat

_add = numbers("modules", split="joule_split")

EFFECT = Effect(
    name="joule_split",
    rank=50,
    meaning="The Joule heat of a module is not shared half and half by its faces.",
    where=("module",),
    places=modules,
    quantities=(Quantity("split", "-", -0.5, 0.5),),
    add=_add,
    signature=by_heat(_add, "split", 1e-2),
    confused_with=("lead_heating", "resistance_slope"),
    separated_by="fast current, so that the faces respond one after the other",
    measure="measure the voltage of {0}: it gives its resistance alone",
)
