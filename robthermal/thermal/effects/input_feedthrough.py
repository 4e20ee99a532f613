"""A share of a heater's heat goes into another lump."""

from __future__ import annotations

from itertools import product

from .._system import System
from ._builders import Builder, content_of
from ._effect import Effect, Quantity
from ._response import Values, Where
from ._signatures import by_heat


def _places(system: System) -> list[Where]:
    return [(name, lump) for (name, part), lump in product(system.inputs.items(), system.lumps)
            if lump != part.lump and part.feedthrough is None]


def _add(system: System, where: Where, values: Values) -> System:
    heater, lump = where
    own = system.inputs[heater].model_dump(exclude_unset=True)
    own["feedthrough"] = {"lump": lump, "share": values["share"]}
    return System(**(content_of(system) | {"inputs": {**system.inputs, heater: own}}))


_ADD = Builder(_add, lambda system, where: {"share": f"inputs.{where[0]}.feedthrough.share"},
               lambda system, where: system.inputs[where[0]].feedthrough is not None)

EFFECT = Effect(
    name="input_feedthrough",
    rank=240,
    meaning="A share of a heater's heat goes into another lump.",
    where=("input", "lump"),
    places=_places,
    quantities=(Quantity("share", "-", 0.0, 1.0),),
    add=_ADD,
    signature=by_heat(_ADD, "share", 1e-2),
    confused_with=("missing_link",),
    separated_by="the heater alone, in fast steps",
)
