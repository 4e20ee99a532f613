"""A heater or amplifier gives less at large values than its record column says."""

from __future__ import annotations

import numpy as np

from .._system import System
from ._builders import Builder, numbers
from ._effect import Effect, Quantity
from ._places import driven, level
from ._response import RecordContext, Response, Values, Where
from ._signatures import altered, by_heat, column_of, driven_by

_add = numbers("", cubic="drive.cubic")
_level = numbers("", clip="drive.clip")
_falling = numbers("inputs", gain_slope="drive.gain_slope")


def _unclipped(system: System) -> list[Where]:
    """Inputs and modules without a clip."""
    return [*((name,) for name, part in system.inputs.items() if part.drive.clip is None),
            *((name,) for name, part in system.modules.items() if part.drive.clip is None)]


def _clips(record: RecordContext, where: Where) -> list[float]:
    """Levels within the record's range."""
    u = np.abs(column_of(record, where[0]))
    return [float(level) for level in u.max() * np.arange(0.3, 1.0, 0.05)] if u.max() > 0 else []


def _clipped(system: System, where: Where, values: Values) -> System:
    """Magnitudes above the clip are cut off; a clip of 0 says that there is none."""
    name = _level.names(system, where)["clip"]
    return system.with_parameters({name: values["clip"]}) if values["clip"] > 0 else system


def _cut_off(record: RecordContext, where: Where, values: Values) -> Response:
    """What a clip at the trial level cuts off, per unit of that level: the size is the level itself."""
    u, level = column_of(record, where[0]), values["clip"]
    return driven_by(record, where[0], np.clip(u, -level, level), level)


_CLIP = Effect(
    name="input_saturation",
    places=_unclipped,
    quantities=(Quantity("clip", "unit", 0.0, 1e6, grid=_clips, typical=1e6),),
    add=Builder(_clipped, _level.names, _level.present),
    signature=_cut_off,
    hidden=altered,
    confused_with=("joule_split", "lead_heating"),
    separated_by="a sweep of the amplitude",
)

_SLOPE = Effect(
    name="input_saturation",
    places=level,
    quantities=(Quantity("gain_slope", "1/unit", -10.0, 0.0, typical=1e-6),),
    add=_falling,
    signature=by_heat(_falling, "gain_slope", -1e-6),
    hidden=altered,
    confused_with=("input_gain", "heater_power_slope"),
    separated_by="a sweep of the amplitude",
)

EFFECT = Effect(
    name="input_saturation",
    rank=200,
    meaning="A heater or amplifier gives less at large values than its record column says.",
    where=("input or module",),
    places=driven,
    quantities=(Quantity("cubic", "1/unit²", 0.0, 10.0, typical=1e-6),),
    nonnegative=("clip",),
    add=_add,
    signature=by_heat(_add, "cubic", 1e-6),
    forms=(_CLIP, _SLOPE),
    confused_with=("joule_split", "lead_heating"),
    separated_by="a sweep of the amplitude",
)
