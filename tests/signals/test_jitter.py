"""Stamps that jitter on a machine that is steep: what was read when, and what acted within a sample."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import thermocycler
from scipy.integrate import trapezoid

import robthermal as rt
from robthermal.signals.importing._jitter import followed
from robthermal.signals.importing._parts import _bent

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")
Log = Callable[..., tuple[np.ndarray, list[rt.Record]]]


@pytest.fixture
def log(tmp_path: Path) -> Log:
    def made(stamps_right: bool, **options: Any) -> tuple[np.ndarray, list[rt.Record]]:
        rows = thermocycler.run(500, late=0.2, stamps_right=stamps_right, seed=3)
        path = thermocycler.write(rows, tmp_path / "log.csv", gaps=(240,))
        return rows, list(rt.read_records(path, thermocycler.SYSTEM, jitter=0.4, **options))
    return made


def said(record: rt.Record, what: str) -> str:
    assert record.imported is not None
    return " ".join(action["text"] for action in record.imported.actions if action["what"] == what)


def test_rows_that_are_even_are_the_samples(log: Log) -> None:
    """Interpolating by stamps that are wrong moves readings on a ramp of 3 K/s by up to 0.6 K."""
    rows, (first, second) = log(stamps_right=False)
    assert "rows were counted on a uniform grid of 1 s" in said(first, "counted") and not first.ripple
    np.testing.assert_allclose(first["T_block"], 273.15 + rows[:240, 1], atol=0.006)
    np.testing.assert_array_equal(first["m1"], np.round(rows[:240, 4], 3))
    np.testing.assert_allclose(second["T_block"], 273.15 + rows[252:, 1], atol=0.006)
    assert abs(second.start_time - 252.0) < 0.1


def test_inputs_act_by_their_means_where_stamps_are_right(log: Log) -> None:
    rows, (first, _) = log(stamps_right=True)
    assert "the stamps are right" in said(first, "clock")
    times, held = np.round(rows[:240, 0], 3), np.round(rows[:240, 4], 3)
    fine = np.linspace(0.0, 1.0, 2001)
    for k in (5, 41, 87, 88, 136):
        within = held[np.searchsorted(times, first.time[k] + fine[:-1] + 2.5e-4, side="right") - 1]
        assert first["m1"][k] == pytest.approx(within.mean(), abs=0.005)
        assert first.ripple["m1"][k] == pytest.approx(within.std(), abs=0.02)
    assert first.ripple["m1"].max() > 1.0
    still = np.flatnonzero(first.ripple["m1"] == 0.0)
    assert still.size > 20 and set(first["m1"][still]) <= set(held)  # no rounding where nothing changes
    assert trapezoid(first["heater"]) == pytest.approx(trapezoid(rows[:240, 5], times), rel=0.02)


def test_the_model_then_leaves_the_noise_alone(log: Log) -> None:
    """Of the true parameters; before, rows a little late counted as on time and left 0.5 K."""
    system = thermocycler.SYSTEM.with_parameters(thermocycler.TRUE)
    for right in (True, False):
        _, records = log(stamps_right=right)
        fit = rt.calibrate(system, records, parameters={"links.block-room.conductance": (0.0, 0.5)})
        assert fit.parameters["links.block-room.conductance"] == pytest.approx(0.06, rel=0.02)
        assert all(error < 0.037 for part in fit.train for error in part.rmse.values())


def test_what_is_declared_wins(log: Log) -> None:
    _, (first, _) = log(stamps_right=True, clock="rows")
    assert "as declared" in said(first, "counted")
    _, (first, _) = log(stamps_right=False, clock="stamps")
    assert "as declared" in said(first, "clock")


def test_where_nothing_is_steep_nothing_is_decided() -> None:
    rng = np.random.default_rng(2)
    stamps = np.arange(400.0) + rng.uniform(-0.2, 0.2, 400)
    assert followed([stamps], [[300.0 + 0.03 * rng.standard_normal(400)]]) is None
    slow = followed([stamps], [[300.0 + 0.02 * stamps + 0.03 * rng.standard_normal(400)]])
    assert slow is None or slow.clock is None


@pytest.mark.parametrize("right", [True, False])
@pytest.mark.parametrize("step", [0.01, 0.5])
def test_readings_in_coarse_steps_do_not_decide_by_their_rounding(right: bool, step: float) -> None:
    wrong = 0
    for seed in range(10):
        rng = np.random.default_rng(seed)
        stamps = np.arange(600.0) + rng.uniform(-0.2, 0.2, 600)
        y = 300.0 + 20.0 * np.abs(((stamps if right else np.arange(600.0)) / 20.0) % 2.0 - 1.0)
        found = followed([stamps], [[np.round((y + 0.03 * rng.standard_normal(600)) / step) * step]])
        decided = None if found is None else found.clock
        wrong += decided == ("rows" if right else "stamps")
        if step == 0.01:
            assert decided == ("stamps" if right else "rows")
    assert not wrong


def test_corners_stay_and_bends_are_followed() -> None:
    rng = np.random.default_rng(4)
    x = np.arange(60.0) + rng.uniform(-0.2, 0.2, 60)
    x[30] = 30.0
    at = np.arange(2.0, 57.0)
    corner = lambda t: np.abs(t - 30.0)  # noqa: E731
    np.testing.assert_allclose(_bent(at, x, corner(x)), corner(at), atol=1e-12)
    bend = lambda t: 0.05 * t**2  # noqa: E731
    np.testing.assert_allclose(_bent(at, x, bend(x)), bend(at), atol=1e-9)
    assert np.abs(np.interp(at, x, bend(x)) - bend(at)).max() > 0.005
