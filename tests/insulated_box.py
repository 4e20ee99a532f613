"""A heated box of some tons whose wall stores heat, eight layers of it, outdoors; every half hour for days."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.linalg import expm

H, LAYERS = 1800.0, 8  # s
AIR, WALL = 2.4e6, 1.6e7  # J/K
INSIDE, THROUGH, OUTSIDE = 500.0, 90.0, 400.0  # W/K: film inside, wall, film outside
TOTAL = 1.0 / (1.0 / INSIDE + 1.0 / THROUGH + 1.0 / OUTSIDE)
SYSTEM = """
system = {{ name = "box", temperature_unit = "degC" }}
ambients = {{ outside = {{ temperature = 15.0 }} }}
lumps = {{ air = {{ capacity = 1e7 }} }}
inputs.heater = {{ lump = "air", gain = 1.0 }}
links = [{{ between = ["air", "outside"], conductance = 40.0 }}]
sensors.inside = {{ lump = "air", noise = 0.02 }}
[fit]
"lumps.air.capacity" = {{ lower = 1e6, upper = 5e7 }}
"links.air-outside.conductance" = {{ lower = 10.0, upper = {most} }}
"""


def network() -> tuple[np.ndarray, np.ndarray]:
    """Rates of air and layers by their temperatures, and by the outside and the heat [1/s], [K/J]."""
    between = 1.0 / np.r_[1.0 / INSIDE + 0.5 / LAYERS / THROUGH, np.full(LAYERS - 1, 1.0 / LAYERS / THROUGH)]
    capacity = np.r_[AIR, np.full(LAYERS, WALL / LAYERS)]
    A, B = np.zeros((LAYERS + 1, LAYERS + 1)), np.zeros((LAYERS + 1, 2))
    for i, G in enumerate(between):
        A[i, i] -= G
        A[i, i + 1] += G
        A[i + 1, i + 1] -= G
        A[i + 1, i] += G
    last = 1.0 / (0.5 / LAYERS / THROUGH + 1.0 / OUTSIDE)
    A[-1, -1] -= last
    B[-1, 0], B[0, 1] = last, 1.0
    return A / capacity[:, None], B / capacity[:, None]


def write(path: Path, seed: int, n: int, swing: float) -> Path:
    """A log; the outside swings by so many kelvins in a day, more or less, or stands still."""
    rng = np.random.default_rng(seed)
    t = H * np.arange(n)
    outside = 15.0 + swing * (np.sin(2 * np.pi * t / 86400.0 + rng.uniform(0, 6)) + np.cumsum(rng.normal(0, 0.06, n)))
    heat = np.repeat(2000.0 * rng.integers(0, 2, n // 24 + 1), 24)[:n] * rng.uniform(0.9, 1.1, n)
    A, B = network()
    E = expm(np.block([[A * H, B * H], [np.zeros((2, LAYERS + 3))]]))
    T = np.empty((n, LAYERS + 1))
    T[0] = outside[0] + 5.0 * np.linspace(1.0, 0.0, LAYERS + 1)
    for k in range(n - 1):
        T[k + 1] = E[:-2, :-2] @ T[k] + E[:-2, -2:] @ [outside[k], heat[k]]
    rows = np.column_stack([t, outside, heat, T[:, 0] + 0.02 * rng.standard_normal(n)])
    np.savetxt(path, rows, delimiter=",", header="time,outside,heater,inside", comments="", fmt="%.4f")
    return path
