"""A row of a current that the logger misread, and one in which the current really was elsewhere: a module in scipy."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import robthermal as rt

Array = NDArray[np.float64]
N, H, NOISE = 300, 2.0, 0.02
S, R, K = 0.04, 1.6, 0.3  # V/K, Ω, W/K
C_FINGER, C_SINK, G, ROOM = 45.0, 400.0, 4.0, 298.15
ROWS = (101, 212)
RANGES = {"lumps.finger.capacity": (10.0, 300.0), "links.sink-room.conductance": (0.2, 40.0),
          "modules.tec.conductance.value": (0.05, 3.0)}


def _current() -> Array:
    """Steps held for 50 samples [A]."""
    return np.repeat([0.5, 3.0, 1.5, 4.0, 2.0, 3.5], N // 6)


def _with_rows(current: Array) -> Array:
    out = current.copy()
    out[list(ROWS)] = 0.4
    return out


@cache
def _readings(acted: bool, lag: float, seed: int) -> Array:
    """Cold finger and sink [K], every sample integrated by itself; the finger's thermometer with a lag [s]."""
    driven = _with_rows(_current()) if acted else _current()
    x, out = np.array([ROOM, ROOM, ROOM]), []
    for current in driven.tolist():
        out.append([x[2] if lag else x[0], x[1]])

        def slopes(t: float, x: Array, current: float = current) -> list[float]:
            heating, through = 0.5 * R * current**2, K * (x[1] - x[0])
            return [(heating + through - S * current * x[0]) / C_FINGER,
                    (S * current * x[1] + heating - through - G * (x[1] - ROOM)) / C_SINK,
                    (x[0] - x[2]) / lag if lag else 0.0]

        x = solve_ivp(slopes, (0.0, H), x, rtol=1e-8, atol=1e-8).y[:, -1]
    return np.array(out) + NOISE * np.random.default_rng(seed).standard_normal((N, 2))


def _record(current: Array, readings: Array) -> rt.Record:
    return rt.Record(sample_time=H, inputs=np.column_stack([current, np.full(N, ROOM)]), outputs=readings,
                     input_names=["tec", "room"], output_names=["Tf", "Ts"], name="log.csv")


def _system() -> rt.System:
    """The machine with three numbers that nobody knows."""
    return rt.System(
        ambients={"room": {"temperature": ROOM}}, lumps={"finger": {"capacity": 35.0}, "sink": {"capacity": C_SINK}},
        links=[{"between": ("sink", "room"), "conductance": 3.0}],
        modules={"tec": {"hot": "sink", "cold": "finger", "seebeck": {"value": S}, "resistance": {"value": R},
                         "conductance": {"value": 0.4}}},
        sensors={"Tf": {"lump": "finger", "noise": NOISE}, "Ts": {"lump": "sink", "noise": NOISE}},
        fit={name: {"lower": low, "upper": high} for name, (low, high) in RANGES.items()})


def test_a_calibration_leaves_misread_rows_out_and_says_so() -> None:
    readings = _readings(False, 0.0, 1)
    right = rt.calibrate(_system(), _record(_current(), readings))
    fit = rt.calibrate(_system(), _record(_with_rows(_current()), readings))
    assert "'tec' in log.csv is 0.4 at 202 s, between 1.5 and 1.5, and so in 1 more row," in fit.remarks[0]
    assert "the readings did not follow: misread" in fit.remarks[0]
    assert fit.parameters == pytest.approx(right.parameters, rel=1e-9)
    assert not any("misread" in one for one in right.remarks)


def test_a_current_that_really_was_elsewhere_for_a_row_stays() -> None:
    fit = rt.calibrate(_system(), _record(_with_rows(_current()), _readings(True, 0.0, 1)))
    assert not any("misread" in one for one in fit.remarks)
    assert fit.parameters["lumps.finger.capacity"] == pytest.approx(C_FINGER, rel=0.01)
    assert fit.train[0].rmse["Tf"] == pytest.approx(NOISE, rel=0.1)


@pytest.mark.parametrize("acted", [False, True])
def test_nothing_is_missing_beside_rows_of_either_kind(acted: bool) -> None:
    found = rt.diagnose(_system(), _record(_with_rows(_current()), _readings(acted, 0.0, 2)))
    assert found.verdict == "consistent"
    assert ("misread" in found.outcome.text) == (not acted)


@pytest.mark.parametrize("acted", [False, True])
def test_what_is_missing_is_named_beside_them(acted: bool) -> None:
    found = rt.diagnose(_system(), _record(_with_rows(_current()), _readings(acted, 6.0, 3)))
    assert [one.label for one in found.effects] == ["sensor_lag(Tf)"] and found.alternatives == ((),)
    assert ("misread" in found.outcome.text) == (not acted)


def test_rows_that_act_much_later_are_not_misread() -> None:
    """A heater behind a long pipe, say: sixty samples late in a long record, and the delay is not in the model."""
    n = 20_000
    current = np.full(n, 2.0)
    current[[1000, 2500]] = 0.4
    late = np.concatenate([np.full(60, 2.0), current[:-60]])
    bar = rt.System(ambients={"room": {"temperature": ROOM}}, lumps={"bar": {"capacity": 30.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"q": {"lump": "bar"}},
                    sensors={"T": {"lump": "bar", "noise": NOISE}},
                    fit={"lumps.bar.capacity": {"lower": 10.0, "upper": 100.0}})
    empty = rt.Record(sample_time=H, inputs=late, outputs=np.zeros((n, 0)), input_names=["q"], output_names=[])
    readings = rt.thermal.simulate(bar, empty).outputs + NOISE * np.random.default_rng(7).standard_normal((n, 1))
    fit = rt.calibrate(bar, rt.Record(sample_time=H, inputs=current, outputs=readings, input_names=["q"],
                                      output_names=["T"]))
    assert not any("the readings did not follow" in one for one in fit.remarks)
    assert any("whether it acted the readings do not tell" in one for one in fit.remarks)


def test_of_a_row_that_nobody_can_see_nothing_is_said() -> None:
    weak = _current()
    weak[101] = 1.4
    fit = rt.calibrate(_system(), _record(weak, _readings(False, 0.0, 4)))
    assert not any("misread" in one for one in fit.remarks)


def test_a_validation_record_is_looked_at_too() -> None:
    readings = _readings(False, 0.0, 5)
    fit = rt.calibrate(_system(), _record(_current(), _readings(False, 0.0, 6)),
                       validation=_record(_with_rows(_current()), readings))
    assert fit.validation[0].rmse["Tf"] == pytest.approx(NOISE, rel=0.15)
    assert "misread" in fit.remarks[0]
