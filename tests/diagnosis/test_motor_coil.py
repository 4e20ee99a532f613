"""A motor whose current was logged: that copper's resistance rises is found, and not found where it does not."""

from __future__ import annotations

from pathlib import Path

import motor_coil
import pytest
from motor_coil import ALPHA, Motor

import robthermal as rt


def diagnosed(folder: Path, alpha: float) -> rt.diagnosis.Diagnosis:
    motor, system = Motor(alpha), rt.thermal.parse_system(motor_coil.SYSTEM)
    first = motor_coil.log(folder / "day1.csv", motor, seed=1, n=1500, water=20.0, room=22.5)
    second = motor_coil.log(folder / "day2.csv", motor, seed=2, n=900, water=18.0, room=24.0)
    return rt.diagnose(system, rt.read_record(first, system), validation=rt.read_record(second, system))


def test_copper_is_named_by_its_coefficient(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, ALPHA)
    assert [effect.label for effect in found.effects] == ["heater_power_slope(coil)"]
    assert found.alternatives == ((),)
    slope, std, unit = found.effects[0].values["slope"]
    assert unit == "1/K" and abs(slope - ALPHA) < 1.96 * std and std < 0.2 * ALPHA
    assert found.gap["validation"].after < 0.4 * found.gap["validation"].before
    slope = found.system.parameter("inputs.coil.power_slope")  # calibrated again it is a number like the others
    limits = found.system.fit["inputs.coil.power_slope"]
    assert limits.lower < 0.0 < slope < ALPHA * 2 < limits.upper
    assert set(found.system.fit) == {*rt.thermal.parse_system(motor_coil.SYSTEM).fit, "inputs.coil.power_slope"}


@pytest.mark.exhaustive
def test_a_wire_of_constant_resistance_is_not_blamed(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, 0.0)
    assert not found.effects and found.verdict == "unexplained"
