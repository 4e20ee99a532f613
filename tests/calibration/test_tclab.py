"""Calibration on measured data of Temperature Control Lab boards, through the example's own functions."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

import robthermal as rt

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "tclab"


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"example_{name}", EXAMPLES / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def measured(shared: Path) -> Path:
    folder = shared / "data"
    if not (folder / "tclab_dowling").is_dir() or not (folder / "tclab_saopaulo").is_dir():
        pytest.skip("no measured data of the Temperature Control Lab boards in the folder 'shared'")
    return folder


@pytest.mark.parametrize(("run", "limit", "published"),
                         [("5-min sine", 0.20, 1.21), ("step", 0.15, 0.20), ("50-min sine", 0.25, 4.29)])
def test_two_state_model_fits_each_run(measured: Path, run: str, limit: float, published: float) -> None:
    two_state = example("two_state")
    record = two_state.read_runs(measured)[run]
    assert two_state.published(record) == pytest.approx(published, abs=0.01)
    assert two_state.fit(record).rmse["T1"] <= limit


@pytest.fixture(scope="module")
def two_heaters(measured: Path) -> rt.calibration.Fit:
    module = example("two_heaters")
    return module.fit(module.read_run(measured, module.TRAINING), module.read_run(measured, module.HEATER_1))


def test_two_heater_model_fits_its_run_and_free_runs_the_other(two_heaters: rt.calibration.Fit) -> None:
    assert two_heaters.rmse["T1"] <= 0.70 and two_heaters.rmse["T2"] <= 0.75
    assert two_heaters.validation_rmse["T1"] <= 1.0 and two_heaters.validation_rmse["T2"] <= 0.6


def test_room_does_not_hang_on_the_window(measured: Path) -> None:
    module = example("two_heaters")
    runs = [module.read_run(measured, file) for file in (module.TRAINING, module.HEATER_1)]
    rooms = [module.rest_value(runs, seconds) for seconds in (10.0, 15.0, 30.0)]
    assert max(rooms) - min(rooms) < 0.25  # half a step of the converter
