"""Names that validation records speak against are taken back; the density behind it is the dense Gaussian one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis.evidence import negative_log_predictive_density, validation_data
from robthermal.diagnosis.evidence._hold_out import _filters, _own_unknowns
from robthermal.diagnosis.fit import Refit
from robthermal.diagnosis.search import without_contradicted

Hide = Callable[..., tuple[rt.Record, rt.Record]]
FEW = ["missing_ambient_link", "natural_convection", "sensor_lag", "heat_source"]


@pytest.fixture(scope="module")
def late(hide: Hide, rate: Callable[..., np.ndarray]) -> tuple[rt.Record, rt.Record]:
    """Records with a plate sensor that lags by fifteen seconds."""
    def lagged(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        return np.append(rate(T[:2], u), (T[0] - T[2]) / 15.0)

    return hide(lagged, extra_states=1, read=lambda T: T[:, [2, 1]])


@pytest.fixture(scope="module")
def found(plant: rt.System, late: tuple[rt.Record, rt.Record]) -> rt.diagnosis.Diagnosis:
    return rt.diagnose(plant, late[0], validation=late[1], effects=FEW)


def test_a_name_that_holds_is_kept(found: rt.diagnosis.Diagnosis, late: tuple[rt.Record, rt.Record]) -> None:
    assert [effect.effect for effect in found.effects] == ["sensor_lag"]
    data = validation_data(found.fit, late[1], None)
    rounds, fit = without_contradicted(found.rounds, found.fit, found.nominal, data)
    assert rounds == found.rounds and fit is found.fit
    without, with_it = negative_log_predictive_density([found.nominal, found.fit], found.fit, data)
    assert without - with_it > 100.0


def test_a_name_that_is_gone_on_validation_records_is_taken_back(
        plant: rt.System, hide: Hide, late: tuple[rt.Record, rt.Record], found: rt.diagnosis.Diagnosis) -> None:
    without = hide()[1]  # the sensor was changed in between
    data = validation_data(found.fit, without, None)
    assert without_contradicted(found.rounds, found.fit, found.nominal, data) == ((), found.nominal)
    again = rt.diagnose(plant, late[0], validation=without, effects=FEW)
    assert (again.verdict, again.effects, again.provisional) == ("unexplained", (), ())


def test_surprise_is_the_dense_gaussian_density(found: rt.diagnosis.Diagnosis, hide: Hide) -> None:
    data = validation_data(found.fit, hide(n=120)[1], None)
    fit = found.fit
    _, only, n = _own_unknowns(fit, data, _filters(fit, fit, data))
    p = fit.structure.n_parameters + fit.structure.n_effects
    own = np.concatenate([np.zeros(p), only.v[p:]])
    at_prior = only.z + only.J @ own  # initial temperatures act linearly here: back to their prior mean
    J, prior = only.J[:n], only.J[n:]
    S = np.eye(n) + J @ np.linalg.inv(prior.T @ prior) @ J.T
    dense = at_prior[:n] @ np.linalg.solve(S, at_prior[:n]) / fit.variance + np.linalg.slogdet(S)[1]
    assert negative_log_predictive_density([fit], fit, data) == [pytest.approx(dense, rel=1e-6)]


def test_a_name_whose_model_runs_away_on_validation_records_is_taken_back(
        found: rt.diagnosis.Diagnosis, late: tuple[rt.Record, rt.Record], monkeypatch: pytest.MonkeyPatch) -> None:
    data = validation_data(found.fit, late[1], None)
    first, second = found.nominal, found.fit

    def runs_away(fit: Refit, *others: object) -> object:
        if fit.structure is second.structure:
            raise rt.errors.Diverged("runs away", time=3.0)
        return _own_unknowns(fit, *others)

    def no_filter(fit: Refit, *others: object) -> object:
        if fit.structure is second.structure:
            raise rt.errors.Diverged("runs away", time=3.0)
        return _filters(fit, *others)

    monkeypatch.setattr("robthermal.diagnosis.evidence._hold_out._own_unknowns", runs_away)
    monkeypatch.setattr("robthermal.diagnosis.evidence._hold_out._filters", no_filter)
    assert negative_log_predictive_density([second], second, data) == [np.inf]
    assert np.isfinite(negative_log_predictive_density([second, first], second, data)[1])
    assert without_contradicted(found.rounds, second, first, data) == ((), first)
