"""A heated bar in a room: system file, project, and step responses in closed form."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

CAPACITY, CONDUCTANCE, POWER, ROOM, NOISE = 60.0, 0.4, 8.0, 20.0, 0.02  # of the machine the records come from
SYSTEM = """
[system]
name = "bar"
temperature_unit = "degC"
[ambients.room]
temperature = 20.0
[lumps.bar]
capacity = 50.0
initial = 20.0
[[links]]
between = ["bar", "room"]
conductance = 0.5
[inputs.Q]
lump = "bar"
gain = 0.08
limits = [0.0, 100.0]
[sensors.T]
lump = "bar"
noise = 0.02
[fit]
"lumps.bar.capacity" = { lower = 10.0, upper = 200.0 }
"links.bar-room.conductance" = { lower = 0.1, upper = 2.0 }
"""
PROJECT = """
[project]
name = "bar"
system = "bar.toml"
train = ["train.csv"]
validation = ["validation.csv"]
[calibrate]
initial = "system"
[certify]
temperature = [15.0, 45.0]
ambient = { room = [19.0, 21.0] }
heat = { bar = [0.0, 8.0] }
"""


def closed_form(time: np.ndarray, share: float, start: float = 0.0, lag: float = 0.0) -> np.ndarray:
    """Rise [K] that a sensor with a time constant [s] reads after a step of the heater by a share of its power."""
    after, slow = np.clip(time - start, 0.0, None), CAPACITY / CONDUCTANCE
    left = np.exp(-after / slow)
    if lag:
        left = (slow * left - lag * np.exp(-after / lag)) / (slow - lag)
    return share * POWER / CONDUCTANCE * (1 - left)


def write_project(folder: Path, records: Mapping[str, tuple[np.ndarray, np.ndarray]], *, system: str = SYSTEM,
                  project: str = PROJECT) -> Path:
    """Project with records of heater [%] and readings [°C], one sample per second; the path of its file."""
    for name, (heater, readings) in records.items():
        rows = [f"{t},{q:.12g},{T:.4f}" for t, (q, T) in enumerate(zip(heater, readings, strict=True))]
        (folder / f"{name}.csv").write_text("\n".join(["time,Q,T", *rows]))
    (folder / "bar.toml").write_text(system)
    (folder / "project.toml").write_text(project)
    return folder / "project.toml"


def write_bar(folder: Path, lag: float = 0.0, project: str = PROJECT) -> Path:
    """Project of a bar in a room, steps of its heater in closed form; the sensor lags by a time constant [s]."""
    noise, time, records = np.random.default_rng(1), np.arange(900.0), {}
    for name, share in (("train", 1.0), ("validation", 0.5)):
        steps = ((0.0, share), (300.0, -share), (500.0, 0.6 * share))
        rise = sum(closed_form(time, step, start, lag) for start, step in steps)
        heater = 100 * share * np.select([time < 300, time < 500], [1.0, 0.0], 0.6)
        records[name] = heater, ROOM + rise + noise.normal(0, NOISE, time.size)
    return write_project(folder, records, project=project)
