"""Alternatives that weak inputs cannot resolve: strong ones in the validation record can, weak ones there cannot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis.evidence import negative_log_predictive_density, validation_data
from robthermal.diagnosis.evidence._hold_out import _information_root
from robthermal.diagnosis.fit import extended
from robthermal.diagnosis.search import resolve_alternatives
from robthermal.jobs.diagnose._claims import diagnosis_claims
from robthermal.jobs.diagnose._diagnose import Diagnosed
from robthermal.jobs.diagnose._ranking import ranking

LATE = ["input_delay", "input_lag", "sensor_offset"]
DELAY, LAG = ("input_delay", ("heater",)), ("input_lag", ("heater",))
Run = Callable[[float, int], rt.Record]


@pytest.fixture(scope="module")
def delayed(rate: Callable[..., np.ndarray], integrated: Callable[..., np.ndarray],
            recorded: Callable[..., rt.Record]) -> Run:
    """Record of a heater that is two seconds late, with levels up to `top` W; 200 samples of five seconds."""
    def run(top: float, seed: int) -> rt.Record:
        levels = top * np.random.default_rng(seed).choice([0.0, 0.3, 0.6, 1.0], 20)
        u = np.column_stack([np.repeat(levels, 10), np.full(200, 298.15)])
        fine = np.repeat(u, 5, axis=0)
        fine[2:, 0] = fine[:-2, 0].copy()
        T = integrated(lambda t, x, u: rate(x, u), np.full(2, 298.15), fine, 1, 1.0)[::5]
        return recorded(T, u, ["heater", "room"], ["Tp", "Tb"], seed)

    return run


@pytest.fixture(scope="module")
def train(delayed: Run) -> rt.Record:
    return delayed(1.5, 1)


@pytest.fixture(scope="module")
def strong(delayed: Run) -> rt.Record:
    return delayed(11.0, 2)


@pytest.fixture(scope="module")
def unsure(plant: rt.System, train: rt.Record) -> rt.diagnosis.Diagnosis:
    return rt.diagnose(plant, train, effects=LATE)


def allowed(found: rt.diagnosis.Diagnosis) -> set[tuple[str, tuple[str, ...]]]:
    return {(effect.effect, effect.where) for effect in found.effects} | {n for o in found.alternatives for n in o}


def test_strong_validation_inputs_decide(plant: rt.System, train: rt.Record, strong: rt.Record,
                                   unsure: rt.diagnosis.Diagnosis) -> None:
    assert unsure.verdict == "ambiguous" and allowed(unsure) == {DELAY, LAG}
    found = rt.diagnose(plant, train, validation=strong, effects=LATE)
    assert found.verdict == "named" and allowed(found) == {DELAY}
    assert "rule out input_lag(heater)" in found.outcome.text
    value, std, _ = found.effects[0].values["delay"]
    assert abs(value - 2.0) < 4.0 * std
    told = found.rounds[0]
    assert [entry.candidate.key for entry in told.ruled_out] == [LAG] and not told.contenders
    assert [candidate.key for candidate in found.ruled_out] == [LAG]
    answers = ranking(found).set_index("candidate")["answer"]
    assert answers["input_lag(heater)"].endswith("the validation records could")
    verdict, _, predicted = diagnosis_claims(Diagnosed(found, (), (), ()))
    assert "but the lag of input heater" in verdict.how and "not corrected" in predicted.how


def test_weak_validation_inputs_do_not(plant: rt.System, train: rt.Record, delayed: Run) -> None:
    found = rt.diagnose(plant, train, validation=delayed(0.5, 3), effects=LATE)
    assert found.verdict == "ambiguous" and allowed(found) == {DELAY, LAG}
    assert not found.rounds[0].ruled_out and "rule out" not in found.outcome.text


def test_the_first_name_gives_way(unsure: rt.diagnosis.Diagnosis, strong: rt.Record) -> None:
    round_ = unsure.rounds[0]
    entries = {entry.candidate.key: entry for entry in (round_.best, *round_.contenders) if entry is not None}
    wrong = replace(round_, best=entries[LAG], contenders=(entries[DELAY],))
    data = validation_data(entries[LAG].fit, strong, None)
    (told,), fit = resolve_alternatives((wrong,), entries[LAG].fit, data)
    assert told.best is not None and told.best.candidate.key == DELAY and told.best.fit is fit
    assert [c.key for c in fit.structure.effects] == [DELAY] and not told.contenders
    # both were fitted with the same filters and have as many quantities: ΔBIC is the logarithm of the sums of squares
    lag, delay = entries[LAG].fit, entries[DELAY].fit
    by_training = lag.n_readings * np.log(lag.rss / delay.rss)
    by_validation = np.subtract(*negative_log_predictive_density([lag, delay], lag, data))
    assert abs(by_training) < 10.0 < by_training + by_validation
    assert told.best.delta_bic - entries[LAG].delta_bic == pytest.approx(by_training, abs=0.1)


def test_a_name_fitted_beside_other_effects_is_not_weighed(unsure: rt.diagnosis.Diagnosis, strong: rt.Record) -> None:
    round_ = unsure.rounds[0]
    best, rival = round_.best, round_.contenders[0]
    assert best is not None
    offset = next(c for c in unsure.scores.candidates if c.effect.name == "sensor_offset")
    both = rival.fit.structure.with_effects((*rival.fit.structure.effects, offset))
    values = [*rival.fit.structure.quantities(rival.fit.v), {offset.effect.size.name: 0.0, **offset.shape}]
    beside = extended(rival.fit, both, both.carried(rival.fit.structure, rival.fit.v, values))
    stale = replace(round_, contenders=(replace(rival, fit=beside),))
    rounds, fit = resolve_alternatives((stale,), best.fit, validation_data(best.fit, strong, None))
    assert rounds == (stale,) and fit is best.fit


def test_other_effects_keep_their_places(plant: rt.System, unsure: rt.diagnosis.Diagnosis, strong: rt.Record) -> None:
    """With two effects accepted, the rounds stay in the order of the effects of the fit."""
    round_ = unsure.rounds[0]
    entries = {entry.candidate.key: entry for entry in (round_.best, *round_.contenders) if entry is not None}
    offset = next(c for c in unsure.scores.candidates if c.effect.name == "sensor_offset")
    fits = {}
    for key, order in ((LAG, (0, 1)), (DELAY, (1, 0))):  # the rival was fitted with the effects the other way round
        fit = entries[key].fit
        own = [(fit.structure.effects[0], fit.structure.quantities(fit.v)[0]),
               (offset, {offset.effect.size.name: 0.0, **offset.shape})]
        structure = fit.structure.with_effects(tuple(own[i][0] for i in order))
        fits[key] = extended(fit, structure, structure.carried(fit.structure, fit.v, [own[i][1] for i in order]))
    first = replace(round_, best=replace(entries[LAG], fit=fits[LAG]),
                    contenders=(replace(entries[DELAY], fit=fits[DELAY]),))
    second = replace(round_, best=replace(entries[LAG], candidate=offset, fit=fits[LAG]), contenders=())
    rounds, fit = resolve_alternatives((first, second), fits[LAG], validation_data(fits[LAG], strong, None))
    keys = [one.best.candidate.key for one in rounds if one.best is not None]
    assert keys == [c.key for c in fit.structure.effects] == [offset.key, DELAY]


def test_what_training_says_of_common_unknowns_leaves_the_others_free(plant: rt.System, train: rt.Record) -> None:
    """Against the inverse of a block of the covariance: RᵀR is the information with the initial temperatures free."""
    fit = rt.diagnosis.refit(plant, train)
    p = fit.structure.n_common
    assert 0 < p < fit.v.size
    R = _information_root(fit, p)
    expected = np.linalg.inv(np.linalg.inv(fit.J.T @ fit.J)[:p, :p])
    assert R.shape == (p, p) and np.allclose(R.T @ R, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())
