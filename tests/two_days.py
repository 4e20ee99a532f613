"""A block on a plate on a sink with a fan, on healthy and on changed days: integrated by scipy alone.

Every day has parameters of its own: each of the six is off by `scatter`, relative. Five of them are in the fit table.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm

import robthermal as rt

STEP, LENGTH, NOISE, ROOM = 10.0, 600, 0.05, 25.0
ZERO = 273.15
SYSTEM = """
[system]
name = "rig"
temperature_unit = "degC"

[ambients.room]
temperature = 25.0

[lumps.block]
capacity = 60.0
[lumps.plate]
capacity = 90.0
[lumps.sink]
capacity = 250.0

[[links]]
between = ["block", "plate"]
conductance = 1.2
[[links]]
between = ["plate", "sink"]
conductance = 2.0
[[links]]
between = ["sink", "room"]
conductance = 0.8

[inputs.heater]
lump = "block"
limits = [0.0, 30.0]

[sensors.T_block]
lump = "block"
noise = 0.05
[sensors.T_plate]
lump = "plate"
noise = 0.05
[sensors.T_sink]
lump = "sink"
noise = 0.05

[fit]
"lumps.block.capacity" = { lower = 10.0, upper = 300.0 }
"lumps.sink.capacity" = { lower = 50.0, upper = 1000.0 }
"links.block-plate.conductance" = { lower = 0.1, upper = 10.0 }
"links.plate-sink.conductance" = { lower = 0.1, upper = 10.0 }
"links.sink-room.conductance" = { lower = 0.05, upper = 8.0 }
"""


@dataclass(frozen=True)
class Day:
    """What is different on a day.

    Parameters
    ----------
    factors : dict
        Factor on "contact" (block to plate), "middle" (plate to sink), "fan" (sink to room), "block" or "sink" (heat
        capacities), or "power" of the heater.
    offset : float
        Of the reading of the block [K].
    room : float
        How much warmer the room is than its column says; without the column, than 25 °C [K].
    loss : float
        Conductance of a path from the block to the room that no file has [W/K].
    draught : float
        Heat into the plate that comes and goes at random, a few minutes at a time [W]: in no catalog.
    power : float
        Factor on the heat that is asked for, and recorded.
    drift : float
        How much more the block's sensor reads at the end of the record than at its start [K]: in no catalog.
    """

    factors: dict[str, float] = field(default_factory=dict)
    offset: float = 0.0
    room: float = 0.0
    loss: float = 0.0
    draught: float = 0.0
    drift: float = 0.0
    power: float = 1.0


HEALTHY = Day()


def record(seed: int, day: Day = HEALTHY, *, scatter: float = 0.03, length: int = LENGTH, room: bool = True
           ) -> rt.Record:
    """One record of a day; with `room`, its temperature (3 K apart from day to day) has a column."""
    rng = np.random.default_rng(seed)
    off = np.exp(scatter * rng.standard_normal(6))
    factor = {name: day.factors.get(name, 1.0) for name in ("contact", "middle", "fan", "block", "sink", "power")}
    g1, g2, g3 = (value * factor[name] * away for value, name, away in
                  zip((1.2, 2.0, 0.8), ("contact", "middle", "fan"), off[:3], strict=True))
    capacity = np.array([60.0 * factor["block"], 90.0, 250.0 * factor["sink"]]) * off[3:]
    said = ROOM + 3.0 * rng.standard_normal() if room else ROOM
    there = said + day.room
    heater = day.power * np.repeat(rng.choice([0.0, 5.0, 10.0, 20.0, 30.0], -(-length // 40)), 40)[:length]
    flows = np.array([[-g1 - day.loss, g1, 0.0], [g1, -g1 - g2, g2], [0.0, g2, -g2 - g3]])
    rate = np.zeros((6, 6))
    rate[:3, :3] = flows / capacity[:, None]
    rate[0, 3], rate[1, 4] = 1.0 / capacity[0], 1.0 / capacity[1]
    rate[0, 5], rate[2, 5] = day.loss / capacity[0], g3 / capacity[2]
    step = expm(rate * STEP)  # exact for held inputs
    T, rows = there + rng.uniform(0.0, 3.0, 3), []
    gusts = np.cumsum(rng.random(length) < 0.05) % 2  # on and off, 200 s on the mean
    for k in range(length):
        rows.append(T)
        T = step[:3] @ np.array([*T, factor["power"] * heater[k], day.draught * gusts[k], there])
    readings = np.array(rows) + NOISE * rng.standard_normal((length, 3))
    readings[:, 0] += day.offset + day.drift * np.linspace(0.0, 1.0, length)
    columns = [heater, np.full(length, said + ZERO)] if room else [heater]
    return rt.Record(sample_time=STEP, inputs=np.column_stack(columns), outputs=readings + ZERO,
                     input_names=["heater", "room"][:len(columns)], output_names=["T_block", "T_plate", "T_sink"])
