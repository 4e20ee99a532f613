"""What sensors and heaters may do that the model does not say."""

from __future__ import annotations

from ..thermal import System
from . import _adding as adding
from ._catalogue_links import TIMES
from ._effect import Effect, Quantity, Where
from ._signatures import Values, by_heat, sensor_gain, sensor_lag, sensor_offset


def _lag(system: System, where: Where, values: Values) -> System:
    return adding.sensor(system, where, "time_constant", max(values["time_constant"], 0.0))


def _offset(system: System, where: Where, values: Values) -> System:
    return adding.sensor(system, where, "offset", values["offset"])


def _gain(system: System, where: Where, values: Values) -> System:
    return adding.sensor(system, where, "gain", 1.0 + values["gain"])


SENSOR_EFFECTS = (
    Effect("sensor_lag", lambda system: [(n,) for n, s in system.sensors.items() if not s.time_constant],
           (Quantity("time_constant", "s", 0.0, 1e5, grid=TIMES, typical=0.1),), _lag, sensor_lag,
           ("hidden_mass", "input_delay"), "frequencies above 0.3/time_constant"),
    Effect("sensor_offset", lambda system: [(n,) for n, s in system.sensors.items() if not s.offset],
           (Quantity("offset", "K", -50.0, 50.0),), _offset, sensor_offset,
           ("heat_source", "sensor_offset"), "an isothermal soak"),
    Effect("sensor_gain", lambda system: [(n,) for n, s in system.sensors.items() if s.gain == 1.0],
           (Quantity("gain", "-", -0.5, 0.5),), _gain, sensor_gain,
           ("sensor_gain",), "isothermal soaks at two temperatures"),
    Effect("input_gain", lambda system: [(n,) for n in system.inputs],
           (Quantity("gain", "-", -0.9, 9.0),), adding.heater_gain, by_heat(adding.heater_gain, "gain", 1e-3),
           ("input_gain",), "a measured heater power"),
)
