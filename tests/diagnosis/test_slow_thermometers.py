"""Thermometers slower than the lumps that they read: the other optimum of a lag, and what a lag leaves open."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from slow_thermometers import LAG, PATH, board, run, staircase

import robthermal as rt
from robthermal.diagnosis import _searching
from robthermal.diagnosis.fit import _exchanged, refit
from robthermal.diagnosis.search import _slow_thermometer, begin
from robthermal.errors import Diverged
from robthermal.jobs.diagnose import Diagnosed, diagnosis_report

ROOM = 295.0
Days = tuple[rt.Record, rt.Record]


@pytest.fixture(scope="module")
def days() -> Days:
    return run(staircase(900, 5), 2), run(staircase(900, 6, both=False), 3)


def test_lags_and_the_path_are_named_with_their_values(days: Days) -> None:
    found = rt.diagnose(board(), days[0], validation=days[1])
    values = {one.label: one.values for one in found.effects}
    assert found.verdict == "named" and found.alternatives == ((), (), ())
    assert values["missing_link(h1, h2)"]["conductance"][0] == pytest.approx(PATH, rel=0.02)
    for name in ("T1", "T2"):
        assert values[f"sensor_lag({name})"]["time_constant"][0] == pytest.approx(LAG, rel=0.02)
    assert found.gap["train"].after < 1.1 * found.gap["train"].noise
    assert found.gap["validation"].before > 2.0 and found.gap["validation"].after < 0.12  # K
    assert not any("change places" in one for one in found.caveats)  # the path tells


def test_without_the_other_beginning_a_share_of_heat_is_named_instead(days: Days,
                                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_searching, "from_slow_thermometer", lambda state: None)
    found = rt.diagnose(board(), days[0], validation=days[1])
    assert "missing_link(h1, h2)" not in [one.label for one in found.effects] and found.gap["train"].after > 0.4


def test_a_path_is_named_beside_lags_of_the_fit_table(days: Days) -> None:
    found = rt.diagnose(board(lag=20.0), days[0], validation=days[1])
    (one,) = found.effects
    assert found.verdict == "named" and one.label == "missing_link(h1, h2)"
    assert one.values["conductance"][0] == pytest.approx(PATH, rel=0.02)
    assert found.system.sensors["T1"].time_constant == pytest.approx(LAG, rel=0.02)


def test_the_nominal_fit_finds_the_other_optimum(days: Days) -> None:
    fit = refit(board(path=True, lag=20.0), list(days))
    assert fit.rms < 0.11 and fit.system.sensors["T2"].time_constant == pytest.approx(LAG, rel=0.02)


@pytest.mark.parametrize("where", [_exchanged, _slow_thermometer])
def test_an_exchange_from_which_the_model_runs_away_is_none(days: Days, monkeypatch: pytest.MonkeyPatch,
                                                             where: ModuleType) -> None:
    """Wherever it happens: after the exchange of the nominal fit, or at the other beginning of the search."""
    def away(*args: object) -> None:
        raise Diverged("too warm", time=1.0)

    system = board(path=where is _exchanged, lag=20.0)
    plain = refit(system, days[0])
    monkeypatch.setattr(where, "fitted", away)
    if where is _exchanged:
        assert plain.rms < 0.11 < 0.4 < refit(system, days[0]).rms
    else:
        assert _slow_thermometer.from_slow_thermometer(begin(plain)) is None


def bar(**own: float) -> rt.System:
    return rt.System(ambients={"room": {"temperature": ROOM}}, lumps={"bar": {"capacity": 100.0}},
                     links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
                     sensors={"T": {"lump": "bar", "noise": 0.05, **own}})


def told(sigma: float | None) -> rt.Diagnosis:
    heat = np.repeat(np.random.default_rng(0).uniform(0.0, 6.0, 12), 25)
    drive = rt.Record(sample_time=10.0, inputs=heat, outputs=np.zeros((300, 0)), input_names=["heater"],
                      output_names=[])
    exact = rt.thermal.simulate(bar(time_constant=30.0), drive)
    noise = 0.05 * np.random.default_rng(1).standard_normal(exact.outputs.shape)
    return rt.diagnose(bar().with_parameters({"lumps.bar.capacity": 110.0}), exact.with_outputs(exact.outputs + noise),
                       parameters={"lumps.bar.capacity": rt.thermal.FitRange(lower=5.0, upper=500.0, sigma=sigma),
                                   "links.bar-room.conductance": rt.thermal.FitRange(lower=0.05, upper=5.0)})


def test_a_lag_that_may_change_places_with_its_lump_is_said_with_both_values() -> None:
    found = told(None)
    (one,) = found.effects
    assert one.values["time_constant"][0] == pytest.approx(30.0, rel=0.05)
    assert one.to_dict()["either"] == {"time_constant": pytest.approx(200.0, rel=0.05)}
    assert "(or 200 s)" in str(found) and "change places" in found.outcome.text
    (table, _) = next(part for part in diagnosis_report(Diagnosed(found, (), (), ())).sections
                      if part.anchor == "effects").tables
    assert list(table.frame["or as well"]) == [one.either["time_constant"]]


def test_a_capacity_that_is_known_tells_the_lag_from_its_lump() -> None:
    found = told(20.0)
    (one,) = found.effects
    assert one.either == {} and "change places" not in found.outcome.text


def test_lags_that_are_alike_are_not_exchanged() -> None:
    found = rt.fitting.exchanged_lags(bar(time_constant=200.0), rt.fitting.chosen_ranges(bar(time_constant=200.0), {
        "lumps.bar.capacity": (5.0, 500.0)}), np.array([100.0]), {"bar": 200.0})
    assert found is None
