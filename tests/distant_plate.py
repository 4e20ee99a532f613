"""A machine in plain scipy: sink, stage, a plate on it, and a sensor on the plate that lags 20 s and reads offset.

Nothing of the package computes here: it is the independent side of the tests of loops that regulate a distant sensor.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

import robthermal as rt

ROOM, SINK, STAGE, PLATE = 295.15, 120.0, 35.0, 60.0  # K, J/K
TO_ROOM, LEAK, JOINT, PLATE_LEAK = 0.9, 0.05, 0.8, 0.02  # W/K
S, R, K, T_REF = (0.0537, 7.4e-5), (4.63, 0.0228), (0.297, 0.0005), 308.15
LAG, OFFSET, GAIN = 20.0, 0.4, 1.03


def machine(lag: float = LAG, offset: float = OFFSET, gain: float = GAIN, delay: float = 0.0) -> rt.System:
    """The same as a system of the package."""
    return rt.System(
        ambients={"room": {"temperature": ROOM}},
        lumps={"sink": {"capacity": SINK}, "stage": {"capacity": STAGE}, "plate": {"capacity": PLATE}},
        links=[{"between": ("sink", "room"), "conductance": TO_ROOM},
               {"between": ("stage", "room"), "conductance": LEAK},
               {"between": ("stage", "plate"), "conductance": JOINT},
               {"between": ("plate", "room"), "conductance": PLATE_LEAK}],
        modules={"m1": {"hot": "sink", "cold": "stage", "seebeck": {"value": S[0], "slope": S[1]},
                        "resistance": {"value": R[0], "slope": R[1]}, "conductance": {"value": K[0], "slope": K[1]},
                        "reference_temperature": T_REF, "current_limits": (-3.3, 3.3)}},
        sensors={"T_plate": {"lump": "plate", "time_constant": lag, "offset": offset, "gain": gain, "delay": delay,
                             "noise": 0.01},
                 "T_sink": {"lump": "sink", "noise": 0.01}})


def properties(hot: float, cold: float) -> tuple[float, float, float]:
    """S, R, K of the module."""
    T = 0.5 * (hot + cold) - T_REF
    return S[0] + S[1] * T, R[0] + R[1] * T, K[0] + K[1] * T


def cold_heat(current: float, hot: float, cold: float) -> float:
    """Heat into the cold face [W]."""
    s, r, k = properties(hot, cold)
    return k * (hot - cold) + 0.5 * r * current**2 - s * cold * current


def rates(x: np.ndarray, current: float, lag: float = LAG) -> np.ndarray:
    """Time derivatives of sink, stage, plate and the lagged temperature [K/s]."""
    sink, stage, plate, seen = x
    s, r, k = properties(sink, stage)
    hot_heat = s * sink * current + 0.5 * r * current**2 - k * (sink - stage)
    across = JOINT * (stage - plate)
    return np.array([(hot_heat - TO_ROOM * (sink - ROOM)) / SINK,
                     (cold_heat(current, sink, stage) - LEAK * (stage - ROOM) - across) / STAGE,
                     (across - PLATE_LEAK * (plate - ROOM)) / PLATE, (plate - seen) / lag])


def reading(x: np.ndarray, offset: float = OFFSET, gain: float = GAIN) -> float:
    """What the sensor says [K]."""
    return float(ROOM + gain * (x[3] - ROOM) + offset)


def law(heat: float, hot: float, cold: float) -> float:
    """Current that gives a heat, by root finding: the smaller root of the parabola."""
    s, r, _ = properties(hot, cold)
    best = s * cold / r
    return float(brentq(lambda i: cold_heat(i, hot, cold) - heat, -20.0, best, xtol=1e-14, rtol=1e-14))


def advance(x: np.ndarray, current: float, h: float, lag: float = LAG) -> np.ndarray:
    """State after a sample with a held current."""
    done = solve_ivp(lambda _, z: rates(z, current, lag), (0.0, h), x, rtol=1e-10, atol=1e-10)
    return np.asarray(done.y[:, -1])


def loop(setpoint: float, kp: float, ki: float, h: float, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Readings and currents of a PI on the reading, no limit active, from rest."""
    x = np.full(4, ROOM)
    z = 0.0
    rows = []
    for _ in range(samples):
        y = reading(x)
        current = law(kp * (setpoint - y) + z, x[0], x[1])
        z += h * ki * (setpoint - y)
        rows.append((y, current))
        x = advance(x, current, h)
    return tuple(np.array(rows).T)


def held(setpoint: float, guess: float = 0.5) -> tuple[np.ndarray, float]:
    """Steady temperatures and current at which the sensor reads the set-point."""
    plate = ROOM + (setpoint - OFFSET - ROOM) / GAIN
    def misses(u: np.ndarray) -> np.ndarray:
        x = np.array([u[0], u[1], plate, plate])
        return rates(x, u[2])[:3]
    done = root(misses, [ROOM + 5.0, plate, guess], tol=1e-12)
    return np.array([done.x[0], done.x[1], plate, plate]), float(done.x[2])
