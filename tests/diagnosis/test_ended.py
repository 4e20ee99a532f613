"""Descents that a search asks for again are not made again, and no other one is taken for them."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis.effects import candidates
from robthermal.diagnosis.fit import Refit, _refitting, extended


@pytest.fixture(scope="module")
def fit() -> Refit:
    system = rt.System(ambients={"room": {"temperature": 295.0}},
                       lumps={"a": {"capacity": 50.0}, "b": {"capacity": 80.0}},
                       links=[{"between": ("a", "b"), "conductance": 1.0},
                              {"between": ("b", "room"), "conductance": 0.3}],
                       inputs={"heater": {"lump": "a"}}, sensors={"Ta": {"lump": "a", "noise": 0.02}},
                       fit={"links.a-b.conductance": {"lower": 0.1, "upper": 10.0}})
    rng = np.random.default_rng(0)
    drive = rt.Record(sample_time=5.0, inputs=np.repeat(rng.uniform(0.0, 6.0, 15), 20), outputs=np.zeros((300, 0)),
                      input_names=["heater"], output_names=[])
    run = rt.thermal.simulate(system.with_parameters({"links.a-b.conductance": 1.5}), drive)
    return rt.diagnosis.refit(system, run.with_outputs(run.outputs + 0.02 * rng.standard_normal(run.outputs.shape)))


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """Starts of the descents that are made."""
    starts: list[np.ndarray] = []
    descend = _refitting.descend

    def counted(problem: object, v: np.ndarray, *rest: object) -> object:
        starts.append(v)
        return descend(problem, v, *rest)

    monkeypatch.setattr(_refitting, "descend", counted)
    return starts


def test_a_descent_is_made_once(fit: Refit, made: list[np.ndarray]) -> None:
    v = fit.v + 0.01
    first = extended(fit, fit.structure, v)
    again = extended(replace(fit, whiteners=tuple(replace(one) for one in fit.whiteners)), fit.structure, v)
    assert len(made) == 1 and np.array_equal(again.v, first.v) and again.rss == pytest.approx(first.rss, rel=1e-12)
    assert again.outcome == first.outcome


def test_a_fit_can_be_pickled(fit: Refit, made: list[np.ndarray]) -> None:
    first = extended(fit, fit.structure, fit.v + 0.03)
    again = pickle.loads(pickle.dumps(first))
    assert first.structure.ended.of and not again.structure.ended.of
    assert np.array_equal(again.v, first.v) and len(made) == 1


def test_what_it_depends_on_makes_it_another(fit: Refit, made: list[np.ndarray]) -> None:
    """Start, evaluations, filters, bounds, data and effects, an effect's fixed numbers among them."""
    v, structure = fit.v + 0.02, fit.structure
    extended(fit, structure, v)
    extended(fit, structure, v + 1e-9)
    extended(fit, structure, v, 3)
    louder = tuple(replace(one, roots=0.5 * one.roots) for one in fit.whiteners)
    other = extended(replace(fit, whiteners=louder), structure, v)
    wider = replace(structure, ranges=replace(structure.ranges, upper=2.0 * structure.ranges.upper))
    extended(fit, wider, v)
    changed = replace(structure.data[0], readings=structure.data[0].readings + np.linspace(0.0, 1.0, 300)[:, None])
    moved = extended(fit, replace(structure, data=(changed,)), v)
    lag = next(one for one in candidates(structure.base, ["sensor_lag"]))
    for shape in ({}, {"time_constant": 5.0}):
        with_lag = structure.with_effects((replace(lag, shape=shape),))
        extended(fit, with_lag, with_lag.carried(structure, fit.v, [{"time_constant": 5.0}]))
    assert len(made) >= 8 and other.rss == pytest.approx(0.25 * fit.rss, rel=0.01) and moved.rss > 2.0 * fit.rss
