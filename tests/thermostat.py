"""A foil heater on a block, switched by a thermostat with hysteresis, integrated by a matrix exponential.

Its pulses are shorter than a sample: the foil leaves and comes back within one or two of them.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

import robthermal as rt

FOIL, BLOCK, BETWEEN, LOSS, POWER, ROOM = 3.0, 300.0, 1.5, 0.05, 20.0, 22.0  # J/K, W/K, W, °C
STEP, PART, HYSTERESIS, QUANTUM, ZERO = 5.0, 0.5, 0.05, 0.1, 273.15


def log(*, n: int = 1200, recorded: bool = True, spikes: tuple[int, ...] = (), loss: float = LOSS) -> rt.Record:
    """Readings in steps of 0.1 K at two set-points; the heater is a column, or stands in it with a constant."""
    capacity = np.array([[FOIL], [BLOCK]])
    A = np.array([[-BETWEEN, BETWEEN], [BETWEEN, -BETWEEN - loss]]) / capacity
    B = np.array([[1.0, 0.0], [0.0, loss]]) / capacity
    step = expm(np.block([[A, B], [np.zeros((2, 4))]]) * PART)[:2]
    T, on, readings, heat = np.full(2, 44.0), False, [], []
    parts = round(STEP / PART)
    for k in range(n):
        readings.append(T)
        pulses = 0
        for _ in range(parts):
            off = T[1] - (45.0 if k < n // 2 else 60.0)
            on = off < -HYSTERESIS or (on and off < HYSTERESIS)
            pulses += on
            T = step @ [*T, POWER * on, ROOM]
        heat.append(POWER * pulses / parts)
    rounded = QUANTUM * np.round(np.array(readings) / QUANTUM) + ZERO
    rounded[list(spikes), 0] += 60.0
    column = np.array(heat) if recorded else np.full(n, 2.0)
    return rt.Record(sample_time=STEP, inputs=column[:, None], outputs=rounded, input_names=["heater"],
                     output_names=["T_foil", "T_block"])


def model() -> rt.System:
    """The same network with sensors of 0.03 K."""
    return rt.System(ambients={"room": {"temperature": ROOM + ZERO}}, inputs={"heater": {"lump": "foil"}},
                     lumps={"foil": {"capacity": FOIL}, "block": {"capacity": BLOCK}},
                     links=[{"between": ("foil", "block"), "conductance": BETWEEN},
                            {"between": ("block", "room"), "conductance": LOSS}],
                     sensors={f"T_{name}": {"lump": name, "noise": 0.03} for name in ("foil", "block")})
