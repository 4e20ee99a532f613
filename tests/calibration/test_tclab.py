"""Calibration on measured data of Temperature Control Lab boards, through the example's own functions."""

from __future__ import annotations

from pathlib import Path

import pytest
from example_files import example

import robthermal as rt


@pytest.mark.parametrize(("run", "limit", "published"),
                         [("5-min sine", 0.20, 1.21), ("step", 0.15, 0.20), ("50-min sine", 0.25, 4.29)])
def test_two_state_model_fits_each_run(tclab: Path, run: str, limit: float, published: float) -> None:
    two_state = example("tclab", "two_state")
    record = two_state.read_runs(tclab)[run]
    assert two_state.published(record) == pytest.approx(published, abs=0.01)
    assert two_state.fit(record).rmse["T1"] <= limit


@pytest.fixture(scope="module")
def two_heaters(tclab: Path) -> rt.calibration.Fit:
    module = example("tclab", "two_heaters")
    return module.fit(module.read_run(tclab, module.TRAINING), module.read_run(tclab, module.HEATER_1))


def test_two_heater_model_fits_its_run_and_free_runs_the_other(two_heaters: rt.calibration.Fit) -> None:
    assert two_heaters.rmse["T1"] <= 0.70 and two_heaters.rmse["T2"] <= 0.75
    assert two_heaters.validation_rmse["T1"] <= 1.0 and two_heaters.validation_rmse["T2"] <= 0.6


def test_room_does_not_hang_on_the_window(tclab: Path) -> None:
    module = example("tclab", "two_heaters")
    runs = [module.read_run(tclab, file) for file in (module.TRAINING, module.HEATER_1)]
    rooms = [module.rest_value(runs, seconds) for seconds in (10.0, 15.0, 30.0)]
    assert max(rooms) - min(rooms) < 0.25  # half a step of the converter
