"""Two days of a machine that is only heated, its room not recorded: a warmer room is no excuse for a weaker fan."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis.data import as_measured, warmest_rooms
from robthermal.diagnosis.fit import Sessions

N, STEP = 240, 10.0
SYSTEM = """
[system]
name = "plate"
temperature_unit = "degC"
[ambients.room]
temperature = 22.0
[lumps.plate]
capacity = 200.0
[[links]]
between = ["plate", "room"]
conductance = 1.0
[inputs.heater]
lump = "plate"
[inputs.fan]
lump = "plate"
gain = 0.0
[sensors.T]
lump = "plate"
noise = 0.05
[fit]
"lumps.plate.capacity" = { lower = 50.0, upper = 900.0 }
"links.plate-room.conductance" = { lower = 0.1, upper = 8.0 }
"""


@pytest.fixture(scope="module")
def plate() -> rt.System:
    return rt.thermal.parse_system(SYSTEM)


def day(seed: int, fan: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Inputs and readings [K] of a plate that starts as warm as its room, by Euler steps of half a second.

    On it hangs a mass that no file has.
    """
    rng = np.random.default_rng(seed)
    g, capacity, mass = np.array([fan, 200.0, 150.0]) * np.exp(0.02 * rng.standard_normal(3))
    room = 295.15 + rng.normal()
    heater, x, read = np.zeros(N), np.full(2, room), np.zeros(N)
    heater[24:] = np.repeat(rng.choice([8.0, 12.0, 16.0], 10), 22)[:N - 24]
    for k in range(N):
        read[k] = x[0]
        for _ in range(20):
            flow = 1.5 * (x[1] - x[0])
            x = x + 0.05 * STEP * np.array([(heater[k] + flow - g * (x[0] - room)) / capacity, -flow / mass])
    return np.column_stack([heater, np.full(N, 50.0)]), read + 0.05 * rng.standard_normal(N)


def record(seed: int, fan: float = 1.0) -> rt.Record:
    inputs, read = day(seed, fan)
    return rt.Record(sample_time=STEP, inputs=inputs, outputs=read, input_names=["heater", "fan"], output_names=["T"])


def test_a_weaker_fan_is_no_warmer_room(plate: rt.System) -> None:
    """Left free, the room of the new day came out 1.5 K above the first readings, and hid a part of the change."""
    old = [record(100 + k) for k in range(3)]
    found = rt.diagnose(plate, record(150, 0.6), reference=old, effects=["sensor_gain", "missing_ambient_link"])
    (effect,), (room,) = found.effects, found.ambients
    value, std, _ = effect.values["relative"]
    assert effect.where == ("links.plate-room.conductance",) and abs(value + 0.4) < 3 * std
    assert room.value <= room.warmest + 1e-6 and found.nominal.structure.only_heated
    assert "Left free, room came out warmer than the machine's coolest readings" in found.outcome.text


def test_parts_of_a_file_stand_in_one_room(plate: rt.System) -> None:
    """A part that begins while the machine is hot says nothing of the room; the part before it does."""
    inputs, read = day(150)
    kept = np.arange(N) != 80
    with pytest.warns(UserWarning, match="a new part begins"):
        parts = rt.read_records({"time": STEP * np.arange(N)[kept], "T": read[kept] - 273.15, "heater": inputs[kept, 0],
                                 "fan": inputs[kept, 1]}, plate)
    cold, hot = warmest_rooms(plate, as_measured(plate, list(parts), "records"))
    assert cold == hot == pytest.approx(read[:24].mean() + 1.0, abs=0.1)


def test_a_number_that_scatters_out_of_its_range_does_not_refuse_the_system(plate: rt.System) -> None:
    """At the end of its range on healthy days, beyond it on the new one: the user wrote nothing wrong."""
    sessions = Sessions(("lumps.plate.capacity",), ("lumps.plate.capacity",), (10.0,))
    beside = plate.with_parameters({"lumps.plate.capacity": 50.0})
    system = sessions.applied(beside, np.array([-0.5]))
    added = rt.thermal.add_effect(system, "sensor_lag", ["T"], {"time_constant": 5.0}).system
    assert added.parameter("lumps.plate.capacity") == 45.0
