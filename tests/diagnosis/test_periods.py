"""A periodic heat in records of different times: minima at every period that fits a whole number of times between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis import Refit
from robthermal.diagnosis.effects import Candidate
from robthermal.diagnosis.evidence import score_candidates
from robthermal.diagnosis.search._periods import _with_periods, between_trials, on_all_records, other_periods

PERIOD, APART = 700.0, 20_000.0  # s
Fits = Callable[..., Refit]


@pytest.fixture(scope="module")
def fitted(plant: rt.System, rate: Callable, inputs_of: Callable, integrated: Callable, recorded: Callable) -> Fits:
    """The plant refitted to two records with a periodic heat into its plate, integrated by scipy."""
    def made(heat: float, apart: float = APART, n: int = 500, records: int = 2) -> Refit:
        out = []
        for k in range(records):
            def loaded(t: float, T: np.ndarray, u: np.ndarray, start: float = k * apart) -> np.ndarray:
                return rate(T, u, np.array([heat * np.sin(2.0 * np.pi * (t + start) / PERIOD + 1.0), 0.0]))

            u = inputs_of(n, 1 + k)
            one = recorded(integrated(loaded, np.full(2, 298.15), u), u, ["heater", "room"], ["Tp", "Tb"], 1 + k)
            out.append(replace(one, start_time=k * apart))
        return rt.diagnosis.refit(plant, out)

    return made


def load(period: float, phase: float = 0.0) -> Candidate:
    one = next(one for one in rt.diagnosis.candidates(two(), ["periodic_load"]) if one.where == ("plate",))
    return replace(one, shape={"period": period, "phase": phase})


def two() -> rt.System:
    return rt.System(ambients={"room": {"temperature": 298.15}}, lumps={"plate": {"capacity": 120.0}},
                     links=[{"between": ("plate", "room"), "conductance": 0.6}])


@pytest.mark.parametrize("teeth", [-2, 1, 3])
def test_a_start_at_an_alias_is_moved_to_the_period_that_all_records_support(fitted: Fits, teeth: int) -> None:
    fit = fitted(0.6)
    alias = load(1.0 / (1.0 / PERIOD + teeth / APART))
    before = score_candidates(fit, [_with_periods(alias, np.array([alias.shape["period"]]))])
    after = on_all_records(fit, before)
    period = after.candidates[0].shape["period"]
    assert abs(1.0 / period - 1.0 / PERIOD) < 0.3 / APART  # the right minimum, half of its width
    assert after.statistic[0] > 1.2 * before.statistic[0] and 0.4 < after.size[0] < 0.8
    assert after.n_trials > before.n_trials and np.linalg.norm(after.signatures[:, 0]) == pytest.approx(1.0)


def test_places_of_one_heat_are_compared_at_one_period(fitted: Fits) -> None:
    """At trial values of the first record alone each place had a period of its own."""
    fit = fitted(0.6)
    scores = on_all_records(fit, rt.diagnosis.score(fit, ["periodic_load", "sensor_lag"]))
    loads = [one for one in scores.candidates if one.effect.name == "periodic_load"]
    assert len(loads) == 2 and all(abs(1.0 / one.shape["period"] - 1.0 / PERIOD) < 0.3 / APART for one in loads)
    plain = rt.diagnosis.score(fit, ["sensor_lag"])
    lag = [one.label for one in scores.candidates].index(plain.candidates[0].label)
    assert scores.statistic[lag] == pytest.approx(plain.statistic[0])
    assert scores.candidates[lag].effect.name == "sensor_lag"


def test_the_diagnosis_names_the_true_period(fitted: Fits) -> None:
    """Refits began wherever the trial periods, 1/(2 T) apart, happened to lie."""
    fit = fitted(0.6)
    best = rt.diagnosis.refit_short_list(fit, rt.diagnosis.score(fit, ["periodic_load"])).entries[0]
    assert best.candidate.where == ("plate",)
    value, std = best.values["period"]
    assert abs(value - PERIOD) < 4.0 * std < 1.0
    assert other_periods(fit, load(value, best.found["phase"]), False) == []


def test_periods_that_a_weak_heat_leaves_possible_are_listed(fitted: Fits) -> None:
    """Seen by both records, and too weak for either to tell how many periods went by between them."""
    fit = fitted(0.012, apart=86_400.0)
    moved, = on_all_records(fit, score_candidates(fit, [_with_periods(load(PERIOD), np.array([PERIOD]))])).candidates
    others = other_periods(fit, moved, False)
    steps = [86_400.0 * (1.0 / one - 1.0 / moved.shape["period"]) for one in others]
    assert len(others) >= 2 and all(abs(step - round(step)) < 0.35 and round(step) != 0 for step in steps)


def test_one_record_and_effects_without_a_period_stay_as_they_are(fitted: Fits) -> None:
    alone = fitted(0.6, records=1)
    scores = rt.diagnosis.score(alone, ["periodic_load"])
    assert on_all_records(alone, scores) is scores and other_periods(alone, load(650.0), True) == []
    both = fitted(0.6)
    assert between_trials(alone.records) == between_trials([]) == 1.0
    assert between_trials(both.records) == pytest.approx(APART / (499 * 5.0), rel=0.01)
    lags = rt.diagnosis.score(both, ["sensor_lag"])
    assert on_all_records(both, lags) is lags
    drift = score_candidates(both, [_with_periods(load(1e5), np.array([1e5]))])
    assert on_all_records(both, drift) is drift  # longer than a record: no matter of whole periods
