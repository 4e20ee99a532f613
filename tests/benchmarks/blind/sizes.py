"""Which effects are hidden where, and how large: from about half the declared detection limit to a sensible largest."""

from __future__ import annotations

import numpy as np

from .plants import N_TRAIN, H

Found = tuple[str, tuple[str, ...], dict[str, float]]
STEPS = 20  # sizes on a logarithmic scale, in shuffled order over the seeds

# effect: (where, quantity, smallest, largest, either sign). Smallest: half the median declared limit of data with
# nothing hidden.
SIZES: dict[str, dict[str, tuple[tuple[str, ...], str, float, float, bool]]] = {
    "A": {
        "seebeck_slope": (("m1",), "slope", 1.7e-6, 1e-4, True),
        "thomson": (("m1",), "coefficient", 5e-4, 0.01, True),
        "joule_split": (("m1",), "split", 0.003, 0.2, True),
        "hysteresis": (("m1",), "heat", 0.007, 0.5, True),
        "natural_convection": (("sink", "room"), "gain", 0.01, 0.5, False),
        "missing_link": (("plate", "sink"), "conductance", 0.01, 0.2, False),
        "missing_ambient_link": (("plate", "room"), "conductance", 6e-4, 0.03, False),
        "lead_heating": (("plate", "m1"), "resistance", 0.007, 0.15, False),
        "hidden_mass": (("sample",), "capacity", 0.15, 10.0, False),
        "path_mass": (("sink-room",), "capacity", 100.0, 3000.0, False),
        "input_saturation": (("m1",), "cubic", 2e-4, 0.006, False),
        "sensor_lag": (("Ts",), "time_constant", 0.15, 6.0, False),
        "sensor_gain": (("Tp",), "gain", 5e-4, 0.02, True),
        "conductance_step": (("hot-sink",), "relative", 0.008, 0.4, True),
        "condensation": (("plate",), "conductance", 0.001, 0.1, False)},
    "B": {
        "seebeck_slope": (("m2",), "slope", 4e-6, 1e-4, True),
        "resistance_slope": (("m1",), "slope", 8e-4, 0.015, True),
        "joule_split": (("m2",), "split", 0.006, 0.3, True),
        "hysteresis": (("m1",), "heat", 0.006, 0.5, True),
        "radiation": (("left", "room"), "coefficient", 8e-11, 1.5e-9, False),
        "missing_link": (("left", "sink1"), "conductance", 0.01, 0.2, False),
        "missing_ambient_link": (("right", "room"), "conductance", 0.001, 0.06, False),
        "lead_heating": (("right", "m2"), "resistance", 0.015, 0.3, False),
        "hidden_mass": (("right",), "capacity", 1.0, 25.0, False),
        "path_mass": (("sink1-room",), "capacity", 100.0, 3000.0, False),
        "input_saturation": (("m2",), "cubic", 4e-4, 0.01, False),
        "input_lag": (("m1",), "time_constant", 0.1, 6.0, False),
        "sensor_lag": (("Tr",), "time_constant", 0.15, 6.0, False),
        "conductance_step": (("hot2-sink2",), "relative", 0.02, 0.5, True),
        "periodic_load": (("sink1",), "heat", 0.013, 0.6, False)},
    "C": {
        "natural_convection": (("right", "room"), "gain", 9e-4, 0.04, False),
        "radiation": (("left", "room"), "coefficient", 8e-11, 1.5e-9, False),
        "missing_link": (("left", "right"), "conductance", 0.001, 0.05, False),
        "missing_ambient_link": (("right", "room"), "conductance", 0.0027, 0.08, False),
        "hidden_mass": (("left",), "capacity", 0.35, 12.0, False),
        "path_mass": (("frame-room",), "capacity", 10.0, 500.0, False),
        "input_saturation": (("q1",), "cubic", 4e-6, 2e-4, False),
        "input_lag": (("q2",), "time_constant", 0.35, 8.0, False),
        "input_delay": (("q1",), "delay", 0.1, 4.0, False),
        "sensor_lag": (("Tl",), "time_constant", 0.15, 6.0, False),
        "sensor_gain": (("Tr",), "gain", 0.0013, 0.03, True),
        "conductance_step": (("frame-base",), "relative", 0.0015, 0.2, True),
        "periodic_load": (("frame",), "heat", 0.01, 0.5, False),
        "heater_power_slope": (("q1",), "slope", 9e-5, 0.004, True),
        "input_feedthrough": (("q1", "frame"), "share", 0.0035, 0.1, False),
        "heat_source": (("frame",), "heat", 0.01, 0.5, True)}}


def drawn(topology: str, effect: str, seed: int | None, rng: np.random.Generator) -> Found:
    """An effect of the size that belongs to the seed, or, without one, in the upper 30 % of the logarithmic scale."""
    where, quantity, smallest, largest, either = SIZES[topology][effect]
    share = rng.uniform(0.7, 1.0) if seed is None else ((7 * seed + 13) % STEPS) / (STEPS - 1)
    size = float(smallest * (largest / smallest) ** share)
    if effect == "input_delay":
        size = round(size, 1)  # a whole number of the integrator's sub-steps
    if either and rng.random() < 0.5:
        size = -min(size, 0.5) if effect == "conductance_step" else -size
    return effect, where, {quantity: size, **_shape(effect, rng)}


def _shape(effect: str, rng: np.random.Generator) -> dict[str, float]:
    """The other quantities of an effect."""
    length = N_TRAIN * H
    if effect == "hidden_mass":
        return {"time_constant": float(np.exp(rng.uniform(np.log(40.0), np.log(200.0))))}
    if effect == "path_mass":
        return {"ratio": float(np.exp(rng.uniform(np.log(0.3), np.log(3.0))))}
    if effect == "hysteresis":
        return {"time_constant": float(np.exp(rng.uniform(np.log(30.0), np.log(150.0))))}
    if effect == "natural_convection":
        return {"exponent": 0.25}
    if effect == "conductance_step":
        return {"time": float(H * round(length * rng.uniform(0.25, 0.75) / H))}
    if effect == "periodic_load":
        return {"period": float(rng.uniform(150.0, 900.0)), "phase": float(rng.uniform(0, 2 * np.pi))}
    if effect == "condensation":
        return {"dew_point": float(rng.uniform(294.0, 298.0))}
    return {}
