"""A periodic heat in records of different times: minima at every period that fits a whole number of times between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis import Refit
from robthermal.diagnosis.effects import Candidate
from robthermal.diagnosis.search._periods import other_periods, supported

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
    alias = 1.0 / (1.0 / PERIOD + teeth / APART)
    moved, size = supported(fit, load(alias), 0.3)
    assert abs(1.0 / moved.shape["period"] - 1.0 / PERIOD) < 0.3 / APART  # the right minimum, half of its width
    assert 0.4 < size < 0.8 and moved.effect is not None and moved.where == ("plate",)


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
    moved, _ = supported(fit, load(PERIOD), 0.01)
    others = other_periods(fit, moved, False)
    steps = [86_400.0 * (1.0 / one - 1.0 / moved.shape["period"]) for one in others]
    assert len(others) >= 2 and all(abs(step - round(step)) < 0.35 and round(step) != 0 for step in steps)


def test_one_record_and_effects_without_a_period_stay_as_they_are(fitted: Fits) -> None:
    alone = fitted(0.6, records=1)
    assert supported(alone, load(650.0), 0.3) == (load(650.0), 0.3) and other_periods(alone, load(650.0), True) == []
    lag = rt.diagnosis.candidates(alone.system, ["sensor_lag"])[0]
    both = fitted(0.6)
    assert supported(both, lag, 3.0) == (lag, 3.0)
    drift = load(1e5)  # longer than a record: no matter of whole periods
    assert supported(both, drift, 1.0) == (drift, 1.0)
