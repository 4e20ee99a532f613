"""What sensors and inputs may do that the model does not say."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from ...thermal import System
from . import _adding as adding
from ._catalogue_lumps import TIMES
from ._effect import Effect, Quantity, Where
from ._signatures import Values, by_heat, input_clip, input_delay, input_lag, sensor_gain, sensor_lag, sensor_offset

if TYPE_CHECKING:
    from ..path import Along


def _sensors(system: System) -> list[Where]:
    return [(name,) for name in system.sensors]


def _driven(system: System) -> list[Where]:
    return [(name,) for name in (*system.inputs, *system.modules)]


def _prompt(key: str) -> Callable[[System], list[Where]]:
    """Inputs and modules that are not late already."""
    return lambda system: [*((name,) for name, part in system.inputs.items() if not getattr(part.drive, key)),
                           *((name,) for name, part in system.modules.items() if not getattr(part.drive, key))]


def _leaks(system: System) -> list[Where]:
    return [(name, lump) for (name, part), lump in product(system.inputs.items(), system.lumps)
            if lump != part.lump and part.feedthrough is None]


def _unclipped(system: System) -> list[Where]:
    """Inputs and modules without a clip."""
    return [*((name,) for name, part in system.inputs.items() if part.drive.clip is None),
            *((name,) for name, part in system.modules.items() if part.drive.clip is None)]


def _clips(path: Along, where: Where) -> list[float]:
    """Levels within the record's range."""
    u = np.abs(path.u[:, path.system.exogenous_names.index(where[0])])
    return [float(level) for level in u.max() * np.arange(0.3, 1.0, 0.05)] if u.max() > 0 else []


def _add_clip(system: System, where: Where, values: Values) -> System:
    """Magnitudes above the clip are cut off; a clip of 0 says that there is none."""
    table = "inputs" if where[0] in system.inputs else "modules"
    return system.with_parameters({f"{table}.{where[0]}.drive.clip": values["clip"]}) if values["clip"] > 0 else system


def _delays(path: Along, where: Where) -> list[float]:
    return [path.h * n for n in (0.5, 1.5, 5.0, 15.0)]


_lag = adding.number("sensors", {"time_constant": "time_constant"})
_offset = adding.number("sensors", {"offset": "offset"})
_gain = adding.number("sensors", {"gain": "gain"})
_warm = adding.number("sensors", {"heat": "self_heating"})
_power = adding.number("inputs", {"slope": "power_slope"})
_share = adding.by_name("input_feedthrough")
_drive_gain = adding.number("", {"gain": "drive.gain"})
_drive_offset = adding.number("", {"offset": "drive.offset"})
_drive_cubic = adding.number("", {"cubic": "drive.cubic"})
_drive_delay = adding.number("", {"delay": "drive.delay"})
_drive_lag = adding.number("", {"time_constant": "drive.time_constant"})

SENSOR_EFFECTS = (
    Effect("sensor_lag", lambda system: [(n,) for n, s in system.sensors.items() if not s.time_constant],
           (Quantity("time_constant", "s", 0.0, 1e5, grid=TIMES, typical=0.1),), _lag, sensor_lag,
           ("hidden_mass", "input_delay"), "frequencies above 0.3/time_constant"),
    Effect("sensor_offset", _sensors, (Quantity("offset", "K", -50.0, 50.0),), _offset, sensor_offset,
           ("heat_source", "sensor_offset"), "an isothermal soak"),
    Effect("sensor_gain", _sensors, (Quantity("gain", "-", -0.5, 0.5),), _gain, sensor_gain,
           ("sensor_gain",), "isothermal soaks at two temperatures"),
    Effect("sensor_self_heating", _sensors, (Quantity("heat", "W", -10.0, 10.0),), _warm, by_heat(_warm, "heat", 1.0),
           ("heat_source", "sensor_offset"), "another excitation of the sensor"),
)
INPUT_EFFECTS = (
    Effect("input_gain", _driven, (Quantity("gain", "-", -0.9, 9.0),), _drive_gain, by_heat(_drive_gain, "gain", 1e-4),
           ("input_saturation",), "a measured current or power"),
    Effect("input_offset", _driven, (Quantity("offset", "unit", -1e3, 1e3),), _drive_offset,
           by_heat(_drive_offset, "offset", 1e-4), ("heat_source",), "the input at zero, and both polarities"),
    Effect("input_saturation", _driven, (Quantity("cubic", "1/unit²", 0.0, 10.0, typical=1e-6),), _drive_cubic,
           by_heat(_drive_cubic, "cubic", 1e-6), ("joule_split", "lead_heating"), "a sweep of the amplitude"),
    Effect("input_delay", _prompt("delay"), (Quantity("delay", "s", 0.0, 1e4, grid=_delays, typical=0.1),),
           _drive_delay, input_delay, ("input_lag", "sensor_lag"), "fast switching"),
    Effect("input_lag", _prompt("time_constant"), (Quantity("time_constant", "s", 0.0, 1e5, grid=TIMES, typical=0.1),),
           _drive_lag, input_lag, ("input_delay", "sensor_lag"), "fast switching"),
    Effect("heater_power_slope", lambda system: [(name,) for name in system.inputs],
           (Quantity("slope", "1/K", -0.05, 0.05),), _power, by_heat(_power, "slope", 1e-3),
           ("radiation", "natural_convection"), "the same power at two temperatures"),
    Effect("input_feedthrough", _leaks, (Quantity("share", "-", 0.0, 1.0),), _share, by_heat(_share, "share", 1e-2),
           ("missing_link",), "the heater alone, in fast steps"),
)
# the second form of an effect: the same name, another law
CLIP = Effect("input_saturation", _unclipped, (Quantity("clip", "unit", 0.0, 1e6, grid=_clips, typical=1e6),),
              _add_clip, input_clip, ("joule_split", "lead_heating"), "a sweep of the amplitude")
