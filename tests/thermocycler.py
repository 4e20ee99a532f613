"""A thermocycler in plain scipy: a block on a thermoelectric module over a sink with a fan, a tube, a heated lid.

A loop reads the thermometers, chooses current and heater, and writes a row; its turns are not evenly apart, or they are
and the stamps are wrong.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

import robthermal as rt

ROOM, NOISE, MOST = 296.15, 0.03, 7.0  # K, K, A
BLOCK, TUBE, SINK, LID = 30.0, 1.6, 320.0, 45.0  # J/K
SEEBECK, RESISTANCE, CONDUCTANCE, AT = (0.052, 5e-5), (1.7, 0.008), 0.6, 308.15
CYCLE = ((95.0, 40.0), (55.0, 45.0), (72.0, 50.0))  # degC, s

SYSTEM = rt.System(
    name="thermocycler", temperature_unit="degC", ambients={"room": {"temperature": ROOM}},
    lumps={"block": {"capacity": 26.0}, "tube": {"capacity": 1.8}, "sink": {"capacity": 360.0},
           "lid": {"capacity": 50.0}},
    links=[{"between": ("block", "tube"), "conductance": 0.4}, {"between": ("tube", "lid"), "conductance": 0.01},
           {"between": ("block", "lid"), "conductance": 0.07}, {"between": ("block", "room"), "conductance": 0.05},
           {"between": ("sink", "room"), "conductance": 3.4}, {"between": ("lid", "room"), "conductance": 0.22}],
    inputs={"heater": {"lump": "lid", "limits": (0.0, 60.0)}},
    modules={"m1": {"hot": "block", "cold": "sink", "seebeck": {"value": 0.047, "slope": SEEBECK[1]},
                    "resistance": {"value": 1.9, "slope": RESISTANCE[1]}, "conductance": 0.68,
                    "reference_temperature": AT, "current_limits": (-8.0, 8.0)}},
    sensors={f"T_{name}": {"lump": name, "noise": 0.05} for name in ("block", "sink", "lid")},
    fit={"lumps.block.capacity": {"lower": 10.0, "upper": 80.0, "sigma": 5.0},
         "lumps.tube.capacity": {"lower": 0.5, "upper": 5.0, "sigma": 0.3},
         "lumps.sink.capacity": {"lower": 100.0, "upper": 1000.0, "sigma": 60.0},
         "lumps.lid.capacity": {"lower": 20.0, "upper": 120.0, "sigma": 8.0},
         "links.block-tube.conductance": {"lower": 0.05, "upper": 2.0, "sigma": 0.08},
         "links.block-lid.conductance": {"lower": 0.0, "upper": 0.5, "sigma": 0.02},
         "links.block-room.conductance": {"lower": 0.0, "upper": 0.5, "sigma": 0.02},
         "links.sink-room.conductance": {"lower": 0.5, "upper": 15.0, "sigma": 0.8},
         "links.lid-room.conductance": {"lower": 0.02, "upper": 1.0, "sigma": 0.05},
         "modules.m1.seebeck.value": {"lower": 0.02, "upper": 0.08, "sigma": 0.006},
         "modules.m1.resistance.value": {"lower": 0.5, "upper": 4.0, "sigma": 0.3},
         "modules.m1.conductance.value": {"lower": 0.2, "upper": 2.0, "sigma": 0.1}})
TRUE = {"lumps.block.capacity": BLOCK, "lumps.tube.capacity": TUBE, "lumps.sink.capacity": SINK,
        "lumps.lid.capacity": LID, "links.block-tube.conductance": 0.45, "links.block-lid.conductance": 0.08,
        "links.block-room.conductance": 0.06, "links.sink-room.conductance": 4.0, "links.lid-room.conductance": 0.25,
        "modules.m1.seebeck.value": SEEBECK[0], "modules.m1.resistance.value": RESISTANCE[0],
        "modules.m1.conductance.value": CONDUCTANCE}


def run(n: int, *, late: float, stamps_right: bool, seed: int = 0, noise: float = NOISE, lag: float = 0.0,
        current_lag: float = 0.0) -> np.ndarray:
    """Rows of a log at a nominal second: stamp [s], block, sink, lid [degC], current [A], heater [W].

    Every turn is up to `late` seconds off the second, or its stamp is. `lag` [s] of the block's thermometer.
    """
    rng = np.random.default_rng(seed)
    off = late * rng.uniform(-1.0, 1.0, n)
    stamps = np.arange(n) + off
    times = stamps if stamps_right else np.arange(n, dtype=float)
    state, integral, q, rows = np.array([298.0, 298.0, ROOM, 370.0, 298.0, 0.0]), 0.0, 0.0, []
    for k in range(n):
        read = state[[4 if lag else 0, 2, 3]] - 273.15 + noise * rng.standard_normal(3)
        error = _set_point(times[k]) - read[0]
        wanted = 2.0 * error + integral
        current = float(np.clip(wanted, -MOST, MOST))
        integral += 0.05 * error * (current == wanted)
        q = 60.0 * (read[2] < (105.5 if q else 104.5))
        rows.append([stamps[k], *read, current, q])
        if k + 1 < n:
            state = solve_ivp(rate, (0.0, times[k + 1] - times[k]), state, args=(current, q, lag, current_lag),
                              method="LSODA", rtol=1e-8, atol=1e-8).y[:, -1]
    return np.array(rows)


def write(rows: np.ndarray, path: Path, gaps: tuple[int, ...] = ()) -> Path:
    """As a logger writes it: milliseconds, hundredths of a kelvin, twelve rows lost at every gap."""
    lost = {k for gap in gaps for k in range(gap, gap + 12)}
    lines = [f"{t:.3f},{a:.2f},{b:.2f},{c:.2f},{i:.3f},{q:.0f}" for k, (t, a, b, c, i, q) in enumerate(rows)
             if k not in lost]
    path.write_text("\n".join(["Time [s],T_block [degC],T_sink [degC],T_lid [degC],m1 [A],heater", *lines]) + "\n")
    return path


def _set_point(time: float) -> float:
    left = time % sum(length for _, length in CYCLE)
    for level, length in CYCLE:
        if left < length:
            return level
        left -= length
    return CYCLE[-1][0]


def rate(_: float, state: np.ndarray, current: float, q: float, lag: float, current_lag: float) -> list[float]:
    block, tube, sink, lid, shown, flows = state
    I = flows if current_lag else current  # noqa: E741
    above = 0.5 * (block + sink) - AT
    pump, joule = (SEEBECK[0] + SEEBECK[1] * above) * I, 0.5 * (RESISTANCE[0] + RESISTANCE[1] * above) * I**2
    back, to_tube, to_lid = CONDUCTANCE * (block - sink), 0.45 * (block - tube), 0.08 * (block - lid)
    return [(pump * block + joule - back - to_tube - to_lid - 0.06 * (block - ROOM)) / BLOCK,
            (to_tube + 0.01 * (lid - tube)) / TUBE, (joule - pump * sink + back - 4.0 * (sink - ROOM)) / SINK,
            (q - 0.25 * (lid - ROOM) + to_lid - 0.01 * (lid - tube)) / LID, (block - shown) / lag if lag else 0.0,
            (current - flows) / current_lag if current_lag else 0.0]
