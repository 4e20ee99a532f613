"""A lump is heated in proportion to a recorded column that heats nothing: friction and eddy currents of a rotor."""

from __future__ import annotations

from itertools import product

from .._system import System
from ._builders import Builder, content_of
from ._effect import Effect, Quantity
from ._response import Values, Where
from ._signatures import by_heat


def _places(system: System) -> list[Where]:
    return [(name, lump) for (name, part), lump in product(system.inputs.items(), system.lumps)
            if not part.gain and (part.feedthrough is None or part.feedthrough.lump != lump)]


def _add(system: System, where: Where, values: Values) -> System:
    column, lump = where
    own = system.inputs[column].model_dump(exclude_unset=True) | {"lump": lump, "gain": values["gain"]}
    return System(**(content_of(system) | {"inputs": {**system.inputs, column: own}}))


_ADD = Builder(_add, lambda system, where: {"gain": f"inputs.{where[0]}.gain"},
               lambda system, where: system.inputs[where[0]].gain != 0.0)

EFFECT = Effect(
    name="driven_heat",
    rank=245,
    meaning="A lump is heated in proportion to a recorded column that heats nothing, such as a speed.",
    where=("input", "lump"),
    places=_places,
    quantities=(Quantity("gain", "W/unit", 0.0, 1e6, typical=1e-6),),
    nonnegative=("gain",),
    add=_ADD,
    signature=by_heat(_ADD, "gain", 1e-4),
    confused_with=("driven_conductance", "input_feedthrough", "heat_source"),
    separated_by="the column alone, with all heaters off and everything else as cold as the room",
    measure="measure the power that {0} takes",
)
