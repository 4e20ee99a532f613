"""A tube furnace, 20 to 600 °C, under PI control: a muffle in forty layers of fibre, and a crucible it radiates to.

Integrated by scipy's LSODA; nothing of the package but the record. The crucible's thermocouple is 25 s late.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import robthermal as rt

Array = NDArray[np.float64]
SIGMA, ZERO, H = 5.670374e-8, 273.15, 10.0
LAYERS, LENGTH, NOISE, LAG = 40, 0.25, 0.4, 25.0
EDGES = np.linspace(0.04, 0.12, LAYERS + 1)
MIDDLE = 0.5 * (EDGES[1:] + EDGES[:-1])
INSULATION = np.pi * (EDGES[1:] ** 2 - EDGES[:-1] ** 2) * LENGTH * 180.0 * 900.0  # J/K
MUFFLE, CRUCIBLE = 420.0, 95.0  # J/K
FIBRE = 2.0 * np.pi * LENGTH * 0.11  # W/K, over the logarithm of two radii
COEFFICIENT = 0.6 * SIGMA * 0.012  # W/K⁴
EXCHANGED = 0.5  # W/K, where the crucible touches the muffle


def day(seed: int, levels: list[float], *, radiates: bool = True, n: int = 1000, room: float = 22.0) -> rt.Record:
    """Readings of muffle and crucible [K], rounded to 0.1 K, and the duty [%]; levels of the set-point [°C]."""
    rng = np.random.default_rng(seed)
    T_room, held = room + ZERO, n // len(levels)
    T, integral = np.full(LAYERS + 3, T_room), 0.0
    readings, duty = np.zeros((n, 2)), np.zeros(n)

    def rates(t: float, T: Array, power: float) -> Array:
        muffle, layers, crucible, reading = T[0], T[1:-2], T[-2], T[-1]
        flows = FIBRE / np.log(MIDDLE[1:] / MIDDLE[:-1]) * (layers[:-1] - layers[1:])
        first = FIBRE / np.log(MIDDLE[0] / EDGES[0]) * (muffle - layers[0])
        outside = 2.0 * np.pi * 0.125 * LENGTH * 11.0 * (layers[-1] - T_room)
        into = (COEFFICIENT * (muffle**4 - crucible**4) + 0.03 * (muffle - crucible) if radiates else
                EXCHANGED * (muffle - crucible))
        heats = np.concatenate([[first], flows]) - np.concatenate([flows, [outside]])
        return np.concatenate([[(power - first - into - 0.14 * (muffle - T_room)) / MUFFLE], heats / INSULATION,
                               [into / CRUCIBLE, (crucible - reading) / LAG]])

    for k in range(n):
        readings[k] = np.round(T[[0, -1]] - ZERO + NOISE * rng.standard_normal(2), 1)
        error = levels[min(k // held, len(levels) - 1)] - readings[k, 0]
        integral = float(np.clip(integral + 0.0008 * H * error, 0.0, 60.0))
        duty[k] = np.round(np.clip(0.9 * error + integral, 0.0, 100.0))
        T = solve_ivp(rates, (0.0, H), T, "LSODA", args=(12.0 * duty[k],), rtol=1e-6, atol=1e-4).y[:, -1]
    return rt.Record(sample_time=H, inputs=duty[:, None], outputs=readings + ZERO, input_names=["ssr"],
                     output_names=["T_muffle", "T_crucible"], name=f"furnace {seed}")


def declared() -> rt.System:
    """The user's model of three lumps: the crucible exchanges heat in proportion to a difference."""
    links = {("muffle", "insulation"): 0.6, ("insulation", "room"): 0.8, ("muffle", "crucible"): 0.6}
    capacities = {"muffle": 500.0, "insulation": 900.0, "crucible": 100.0}
    fit = {f"lumps.{name}.capacity": (value, 0.3) for name, value in capacities.items()}
    fit |= {f"links.{a}-{b}.conductance": (value, 0.5) for (a, b), value in links.items()}
    return rt.System(
        ambients={"room": {"temperature": 22.0 + ZERO}},
        lumps={name: {"capacity": value} for name, value in capacities.items()},
        links=[{"between": pair, "conductance": value} for pair, value in links.items()],
        inputs={"ssr": {"lump": "muffle", "gain": 12.0, "unit": "%"}},
        sensors={f"T_{name}": {"lump": name, "noise": NOISE} for name in ("muffle", "crucible")},
        fit={name: {"lower": value / 50.0, "upper": value * 20.0, "sigma": share * value}
             for name, (value, share) in fit.items()})
