"""A heated box of air with two late thermometers, by Euler steps: a network with its lumps split explains less.

The truth has a wall in two layers that the model lacks, and another loss on the other day, so that nothing fits down
to the noise. Nothing is shared with robthermal.
"""

from __future__ import annotations

from functools import cache

import numpy as np

import robthermal as rt
from robthermal.diagnosis._explained_away import leaves_far_more
from robthermal.diagnosis.fit import coarsened

H, N, POWER, ROOM = 3.0, 220, 120.0, 22.0
LATE = (85.0, 128.0)  # s, of both thermometers
EFFECTS = ["sensor_lag", "hidden_mass", "input_lag", "natural_convection", "sensor_offset"]

BOX = rt.thermal.parse_system("""
system = { name = "box", temperature_unit = "degC" }
ambients.room = { temperature = 22.0 }
lumps = { heater = { capacity = 60.0 }, air = { capacity = 180.0 } }
links = [{ between = ["heater", "air"], conductance = 4.0 }, { between = ["air", "room"], conductance = 0.8 }]
inputs.heat = { lump = "heater" }
sensors = { T2 = { lump = "air", noise = 0.02 }, T3 = { lump = "air", noise = 0.02 } }
[fit]
"lumps.heater.capacity" = { lower = 20.0, upper = 1000.0 }
"lumps.air.capacity" = { lower = 20.0, upper = 1000.0 }
"links.heater-air.conductance" = { lower = 0.05, upper = 20.0 }
"links.air-room.conductance" = { lower = 0.05, upper = 10.0 }
""")


@cache
def day(seed: int, loss: float, late: tuple[float, float] = LATE) -> rt.Record:
    """A heater switched at random for a while, then off; readings of both thermometers."""
    rng = np.random.default_rng(seed)
    on = np.repeat(rng.random(N) < 0.6, rng.integers(2, 9, N))[:N] * (np.arange(N) < 150)
    C = np.array([40.0, 170.0, 60.0, 120.0])  # heater, air, layers of the wall
    T, read, shown = np.full(4, ROOM), np.full(2, ROOM), []
    for state in on:
        shown.append(read.copy())
        for _ in range(30):
            flow = np.array([5.5, 1.2, 0.9]) * -np.diff(T)
            heat = np.concatenate([[POWER * state], flow]) - np.append(flow, loss * (T[3] - ROOM))
            heat[1] -= 0.3 * (T[1] - ROOM)
            T = T + H / 30 * heat / C
            read = read + H / 30 * (T[1] - read) / np.array(late)
    outputs = np.array(shown) + 0.02 * rng.standard_normal((N, 2)) + 273.15
    return rt.Record(sample_time=H, inputs=np.column_stack([POWER * on, np.full(N, ROOM + 273.15)]), outputs=outputs,
                     input_names=["heat", "room"], output_names=["T2", "T3"])


def test_both_lags_are_named_although_nothing_lasts_beside_a_network_with_its_lumps_split() -> None:
    """An incubator was "unexplained" so: 1.7 to 0.09 K on training, 0.98 to 0.43 K on a run four months later."""
    found = rt.diagnose(BOX, day(1, 0.6), validation=day(2, 1.8), effects=EFFECTS)
    assert found.verdict in ("named_with_remainder", "ambiguous")
    assert {"sensor_lag(T2)", "sensor_lag(T3)"} <= {effect.label for effect in found.effects}
    assert "A network with its lumps split, with" in found.outcome.text
    assert found.gap["validation"].after < 0.6 * found.gap["validation"].before


def test_a_finer_network_that_fits_leaves_no_more() -> None:
    """Without late thermometers the wall is all that is missing, which a finer network has."""
    nominal = rt.diagnosis.refit(BOX, day(1, 0.6, (0.5, 0.5)))
    assert not leaves_far_more(coarsened(nominal), nominal)
