"""Logs of the one-Peltier machine as a German Windows logger writes them, from an integration that knows no robthermal.

The machine's true numbers differ from those of setup.toml. Run: python make_logs.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

HERE = Path(__file__).parent
NAMES = ("plate", "cold", "hot", "sink")
CAPACITY = np.array([118.0, 9.0, 9.0, 171.0])  # J/K
PLATE_COLD, HOT_SINK, SINK_WATER, PLATE_ROOM = 4.6, 6.7, 9.1, 0.18  # W/K
SEEBECK, RESISTANCE, CONDUCTANCE = (0.0497, 9.0e-5), (2.07, 0.0090), 0.53  # at 25 °C, slopes per kelvin
ZERO, STEP, NOISE = 273.15, 1.0, 0.02  # K, s, K


def rate(_: float, x: np.ndarray, current: float, load: float, water: float, room: float) -> np.ndarray:
    """Rates of the four temperatures [K/s]."""
    plate, cold, hot, sink = x
    dT = 0.5 * (hot + cold) - ZERO - 25.0
    S, R = SEEBECK[0] + SEEBECK[1] * dT, RESISTANCE[0] + RESISTANCE[1] * dT
    through, joule = CONDUCTANCE * (hot - cold), 0.5 * R * current**2
    heat = np.array([PLATE_COLD * (cold - plate) + PLATE_ROOM * (room - plate) + load,
                     PLATE_COLD * (plate - cold) + through - S * cold * current + joule,
                     HOT_SINK * (sink - hot) - through + S * hot * current + joule,
                     HOT_SINK * (hot - sink) + SINK_WATER * (water - sink)])
    return heat / CAPACITY


def run(levels: list[tuple[float, float]], hold: float, seed: int) -> np.ndarray:
    """Columns current, load, water, room, plate, hot, sink; one row a second."""
    rng = np.random.default_rng(seed)
    n = int(hold / STEP)
    rows, x = [], np.full(4, 20.0 + ZERO)
    for k, (current, load) in enumerate(level for level in levels for _ in range(n)):
        water, room = 18.0 + ZERO + 0.3 * np.sin(k / 400.0), 22.0 + ZERO + 0.5 * np.sin(k / 700.0)
        rows.append([current, load, water, room, x[0], x[2], x[3]])
        x = solve_ivp(rate, (0.0, STEP), x, args=(current, load, water, room), rtol=1e-8, atol=1e-8).y[:, -1]
    table = np.array(rows)
    table[:, 4:] += NOISE * rng.standard_normal(table[:, 4:].shape)
    return table


def write(path: Path, table: np.ndarray) -> None:
    """A log with a preamble, semicolons, decimal commas, milliampere and Windows letters."""
    lines = ["Messdatenlogger ML-4", "Seriennummer;0815", "",
             "Zeitstempel;NTC Platte [°C];NTC heiß [°C];NTC Kühler [°C];Wasser [°C];Raum [°C];I_TEC [mA];Heizer [mW];"]
    for k, (current, load, water, room, plate, hot, sink) in enumerate(table):
        stamp = f"03.11.2025 {9 + k // 3600:02d}:{k // 60 % 60:02d}:{k % 60:02d}"
        cells = [f"{T - ZERO:.3f}" for T in (plate, hot, sink, water, room)]
        cells += [f"{1e3 * current:.1f}", f"{1e3 * load:.1f}"]
        lines.append(";".join([stamp, *(cell.replace(".", ",") for cell in cells), ""]))
    path.write_bytes(("\r\n".join(lines) + "\r\n").encode("cp1252"))


if __name__ == "__main__":
    steps = [(0.0, 0.0), (1.0, 0.0), (2.2, 0.0), (0.5, 3.0), (0.0, 3.0), (-0.8, 0.0), (1.5, 1.5)]  # A, W
    write(HERE / "train.csv", run(steps, 300.0, 1))
    write(HERE / "validation.csv", run([(0.3, 0.0), (1.8, 1.0), (0.0, 2.0), (2.4, 0.0)], 240.0, 2))
    print("train.csv and validation.csv written; now: robthermal run project.toml --out results")
