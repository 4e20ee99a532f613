"""Logs of firmware: readings rounded to steps, a clock of milliseconds with jitter, lags that two parts may have."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import robthermal as rt
from robthermal.jobs.diagnose._long_enough import long_enough

SYSTEM = """
[system]
name = "bed"
temperature_unit = "degC"
[ambients.room]
temperature = 22.0
[lumps.bed]
capacity = 500.0
[[links]]
between = ["bed", "room"]
conductance = 2.0
[inputs.duty]
lump = "bed"
gain = 3.0
unit = "%"
[sensors.T_bed]
lump = "bed"
noise = 0.02
"""
N = 900


def bed(noise: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
    """Duty [%] and temperature [°C]: a bed that is held at 60 °C by a PI law after it was cold for a while."""
    rng = np.random.default_rng(4)
    temperature, integral, duty, read = 22.0, 0.0, np.zeros(N), np.zeros(N)
    for k in range(N):
        read[k] = temperature + noise * rng.standard_normal()
        error = 60.0 - read[k] if k >= 200 else 0.0
        integral = float(np.clip(integral + 0.02 * error, 0.0, 100.0)) if abs(error) < 5.0 else 0.0
        duty[k] = round(float(np.clip(20.0 * error + integral, 0.0, 100.0)))
        temperature += (3.0 * duty[k] - 2.0 * (temperature - 22.0)) / 500.0
    return duty, read


def logged(columns: tuple[np.ndarray, np.ndarray], step: float) -> rt.Record:
    """The record of a file as a microcontroller writes it."""
    stamps = 7000 + 1000 * np.arange(N) + np.random.default_rng(5).integers(-15, 16, N)
    duty, read = columns
    read = np.round(np.round(read / step) * step, 4)
    with pytest.warns(UserWarning, match="resampled"):
        return rt.read_record({"millis": stamps, "T_bed": read, "duty": duty}, rt.thermal.parse_system(SYSTEM))


def test_a_clock_called_millis_counts_milliseconds() -> None:
    assert logged(bed(), 0.1).sample_time == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("step", [0.1, 0.25])
def test_steps_between_interpolated_rows_are_steps_and_not_saturation(step: float) -> None:
    floor = rt.diagnosis.noise_floor(rt.thermal.parse_system(SYSTEM), logged(bed(), step))
    assert not any("saturated" in one for one in floor.remarks)
    assert floor.noise["T_bed"] == pytest.approx(max(step / 12**0.5, 0.02), rel=0.05)


def test_saturation_between_interpolated_rows_is_said() -> None:
    duty, read = bed()
    floor = rt.diagnosis.noise_floor(rt.thermal.parse_system(SYSTEM), logged((duty, np.minimum(read, 50.0)), 1e-4))
    assert any("largest reading, 50 °C" in one for one in floor.remarks)


def in_parts(n_first: int) -> tuple[rt.Record, ...]:
    """A file of which one row is missing: of the two parts the first has so many samples."""
    duty, read = bed()
    kept = np.arange(N) != n_first
    with pytest.warns(UserWarning, match="a new part begins"):
        return rt.read_records({"time": np.arange(N)[kept], "T_bed": read[kept], "duty": duty[kept]},
                               rt.thermal.parse_system(SYSTEM))


def test_a_part_that_is_too_short_does_not_refuse_the_file() -> None:
    parts = in_parts(31)
    with pytest.warns(UserWarning, match=r"part 1 has 31 samples, fewer than the 50 that a diagnosis needs: left out"):
        assert long_enough(parts) == [parts[1]]
    assert long_enough(parts[:1]) == [parts[0]]  # nothing longer of this file: refused as before


HOT_END = """
[system]
name = "hot end"
temperature_unit = "degC"
[ambients.room]
temperature = 22.0
[lumps.block]
capacity = 15.0
[lumps.sink]
capacity = 40.0
[[links]]
between = ["block", "sink"]
conductance = 0.06
[[links]]
between = ["block", "room"]
conductance = 0.08
[[links]]
between = ["sink", "room"]
conductance = 0.7
[inputs.heater]
lump = "block"
gain = 0.4
unit = "%"
[sensors.T_block]
lump = "block"
noise = 0.03
[sensors.T_sink]
lump = "sink"
noise = 0.03
[fit]
"lumps.block.capacity" = { lower = 5.0, upper = 50.0 }
"lumps.sink.capacity" = { lower = 10.0, upper = 200.0 }
"links.block-sink.conductance" = { lower = 0.01, upper = 0.5 }
"links.block-room.conductance" = { lower = 0.005, upper = 0.5 }
"links.sink-room.conductance" = { lower = 0.1, upper = 5.0 }
"""


def hot_end(lag: float, seed: int, n: int) -> rt.Record:
    """A hot end of 22 cells, by a matrix exponential, behind a PI law whose power follows `lag` seconds late.

    Cells: cartridge 2, block 6, heat break 8, heat sink 6; the last row is the power.
    """
    rng = np.random.default_rng(seed)
    C = np.r_[[1.0] * 2, [1.8] * 6, [0.4] * 8, [7.0] * 6]
    A, b = np.zeros((23, 23)), np.zeros(23)
    along = [*((a, a + 1, 3.0) for a in range(2, 7)), *((a, a + 1, 0.55) for a in range(8, 15)),
             *((a, a + 1, 2.0) for a in range(16, 21))]
    for i, j, g in [(0, 1, 1.0), (1, 4, 0.8), (2, 8, 0.7), (15, 16, 0.9), *along]:
        A[[i, j], [i, j]] -= g
        A[[i, j], [j, i]] += g
    A[range(22), range(22)] -= np.r_[[0.0] * 2, [0.015] * 6, [0.001] * 8, [0.12] * 6]
    A[:22] /= np.append(C, 1.0)[:22, None]
    A[:2, 22] = 0.2
    A[22, 22], b[22] = -1.0 / lag, 1.0 / lag
    step = expm(np.block([[A, b[:, None]], [np.zeros((1, 24))]]))
    x, u, y, integral, wanted = np.zeros(23), np.zeros(n), np.zeros((n, 2)), 0.0, 0.0
    for k in range(n):
        wanted = rng.uniform(60.0, 180.0) if k % 120 == 0 else wanted
        y[k] = x[[5, 18]] + 0.03 * rng.standard_normal(2)
        error = wanted - y[k, 0]
        integral = float(np.clip(integral + 0.01 * error, 0.0, 100.0)) if abs(error) < 10.0 else 0.98 * integral
        u[k] = round(float(np.clip(3.0 * error + integral, 0.0, 100.0)))
        x = step[:23, :23] @ x + step[:23, 23] * u[k]
    return rt.Record(sample_time=1.0, inputs=u, outputs=y + 295.15, input_names=["heater"],
                     output_names=["T_block", "T_sink"])


def test_beside_a_remainder_a_late_heater_is_not_called_a_late_thermometer() -> None:
    """The refit of the other lag ended far from its best, and the thermometer alone was named."""
    found = rt.diagnose(rt.thermal.parse_system(HOT_END), hot_end(6.0, 21, 400), effects=["input_lag", "sensor_lag"])
    listed = {one.key for one in found.effects} | {name for others in found.alternatives for name in others}
    assert found.verdict == "ambiguous" and found.remainder is not None
    assert listed == {("input_lag", ("heater",)), ("sensor_lag", ("T_block",))}
    assert len(found.effects) == 1  # no accepted effect is its own alternative
    assert "A lag at block may also be the time that heat takes within block" in found.outcome.text
