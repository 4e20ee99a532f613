"""What the search spends its evaluations on: curved valleys followed, phases solved at once, lost races left."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from voltage_rig import drive, system

import robthermal as rt
from robthermal.diagnosis.effects import Candidate
from robthermal.diagnosis.evidence import Scores, explains
from robthermal.diagnosis.fit import Point, Refit, descend, extended
from robthermal.diagnosis.fit._descent import _solve
from robthermal.diagnosis.search import _revise, _short_list
from robthermal.diagnosis.search._implausible import implausible
from robthermal.diagnosis.search._stages import too_much_left

Hide = Callable[..., tuple[rt.Record, rt.Record]]


class Winding:
    """A steep valley along y = sin(p x) / p that falls gently to x = 3."""

    def __init__(self, steep: float, p: float):
        self.steep, self.p = steep, p

    def residual(self, v: np.ndarray) -> np.ndarray:
        return np.array([self.steep * (v[1] - np.sin(self.p * v[0]) / self.p), 3.0 - v[0]])

    def slopes(self, v: np.ndarray) -> np.ndarray:
        return np.array([[self.steep * np.cos(self.p * v[0]), -self.steep], [1.0, 0.0]])


@pytest.fixture(scope="module")
def convected(plant: rt.System, hide: Hide, rate: Callable) -> rt.Record:
    """Strong natural convection from the plate."""
    def hidden(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        dT = u[1] - T[0]
        return rate(T, u, np.array([0.3 * abs(dT) ** 0.25 * dT, 0.0]))

    return hide(hidden)[0]


def labels(scores: Scores) -> list[str]:
    return [candidate.label for candidate in scores.candidates]


# Steps


@pytest.mark.parametrize("rank", [5, 3])
def test_steps_are_the_shortest_of_least_squares(rank: int) -> None:
    """A descent on a linear problem, beside the pseudoinverse; with directions that change nothing, too."""
    rng = np.random.default_rng(rank)
    J = rng.standard_normal((12, rank)) @ rng.standard_normal((rank, 5)) * np.geomspace(1e-3, 1e3, 5)
    z = rng.standard_normal(12)
    scale = np.linalg.norm(J, axis=0)
    step = _solve(J, z)
    assert step * scale == pytest.approx(np.linalg.pinv(J / scale, rcond=1e-10) @ z, rel=1e-9, abs=1e-9)



@pytest.mark.parametrize(("steep", "p"), [(30.0, 4.0), (100.0, 2.0)])
def test_a_winding_valley_is_followed_along_its_curvature(steep: float, p: float) -> None:
    # Damped steps alone, each with the damping of the step before, take 112 and 97 evaluations.
    wide = np.full(2, 50.0)
    found = descend(Winding(steep, p), np.zeros(2), (-wide, wide), 200, 1e-8)
    assert found.converged and found.iterations < 10
    assert np.allclose(found.at.v, [3.0, np.sin(3.0 * p) / p], atol=1e-3)


@pytest.mark.parametrize("noise", [1e-3, 1e-5])
def test_two_decays_known_precisely_are_told_apart_in_few_evaluations(noise: float) -> None:
    # The better the readings, the narrower the valley: with 40 evaluations of damped steps it ended unconverged, and
    # the next candidate refitted from there seemed to explain what only further steps explained.
    t = np.linspace(0.05, 10.0, 200)

    def decays(v: np.ndarray) -> np.ndarray:
        return np.exp(-t[:, None] / np.exp(v[2:]))

    truth = np.array([1.0, 0.6, 0.0, np.log(2.0)])
    y = decays(truth) @ truth[:2] + noise * np.random.default_rng(0).standard_normal(t.size)
    problem = SimpleNamespace(
        residual=lambda v: (y - decays(v) @ v[:2]) / noise,
        slopes=lambda v: np.column_stack([decays(v), decays(v) * v[:2] * t[:, None] / np.exp(v[2:])]) / noise)
    found = descend(problem, np.array([1.0, 1.0, 0.0, 1.5]), (np.full(4, -5.0), np.full(4, 5.0)), 40, 3e-5)
    assert found.converged and found.iterations < 25
    distance = found.at.v - truth
    spread = np.linalg.inv(found.at.J.T @ found.at.J)
    assert distance @ np.linalg.solve(spread, distance) < 18.5  # chi-squared with four degrees of freedom, 99.9 %


@pytest.mark.parametrize("seed", range(40))
def test_nothing_is_evaluated_outside_the_bounds(seed: int) -> None:
    # Not by a rounding either: a conductance of -3e-23 is no conductance, and the system refuses it.
    rng = np.random.default_rng(seed)
    J, y = rng.standard_normal((30, 6)) @ (np.eye(6) + 3.0 * rng.standard_normal((6, 6))), rng.standard_normal(30)
    low, high = -rng.uniform(0.0, 0.3, 6), rng.uniform(0.0, 0.3, 6)
    asked: list[np.ndarray] = []
    problem = SimpleNamespace(residual=lambda v: asked.append(v) or y - J @ v - (J @ v) ** 2, slopes=lambda v: (
        J + 2.0 * (J @ v)[:, None] * J))
    descend(problem, np.zeros(6), (low, high), 60, 1e-9)
    assert all(np.all((v >= low) & (v <= high)) for v in asked)


@pytest.mark.parametrize("rows", [1, 4, 5, 60, 1024, 1025, 3000])  # some are turned at a time
def test_the_triangle_stands_for_all_rows(rows: int) -> None:
    rng = np.random.default_rng(rows)
    J, z = rng.standard_normal((rows, 4)), rng.standard_normal(rows)
    problem = SimpleNamespace(residual=lambda v: z, slopes=lambda v: J)
    small, rest = Point(problem, np.zeros(4)).small
    for _ in range(5):
        step = rng.standard_normal(4)
        assert np.sum((rest - small @ step) ** 2) == pytest.approx(np.sum((z - J @ step) ** 2), rel=1e-10)


# Scores


def test_scores_are_the_same_however_many_signatures_are_formed_at_once(
        plant: rt.System, convected: rt.Record, monkeypatch: pytest.MonkeyPatch) -> None:
    fit = rt.diagnosis.refit(plant, convected)
    found = []
    for together in (1, 64, 10**6):
        monkeypatch.setattr(sys.modules["robthermal.diagnosis.evidence._score"], "_TOGETHER", together)
        found.append(rt.diagnosis.score(fit))
    for one in found[1:]:
        assert [c.label for c in one.candidates] == labels(found[0]) and one.n_trials == found[0].n_trials
        assert [c.shape for c in one.candidates] == [pytest.approx(c.shape, rel=1e-12) for c in found[0].candidates]
        for name in ("size", "std", "statistic", "p_value", "identifiability", "limit", "signatures"):
            np.testing.assert_allclose(getattr(one, name), getattr(found[0], name), rtol=1e-6, atol=1e-9, err_msg=name)
        assert np.array_equal(one.possible, found[0].possible)
    none = rt.diagnosis.score(fit, [])
    assert none.candidates == () and none.n_trials == 0 and none.order == []


def test_the_phase_of_a_load_is_that_of_least_squares(plant: rt.System, convected: rt.Record) -> None:
    fit = rt.diagnosis.refit(plant, convected)
    scores = rt.diagnosis.score(fit, ["periodic_load"])
    assert len(scores.candidates) == 2
    for i, found in enumerate(scores.candidates):
        pair = [replace(found, shape={**found.shape, "phase": phase}) for phase in (0.0, np.pi / 2)]
        both = fit.whiten([path.columns(pair) for path in fit.paths])
        sine, cosine = np.linalg.lstsq(np.column_stack([both, fit.J]), fit.z, rcond=None)[0][:2]
        assert np.angle(np.exp(1j * (found.shape["phase"] - np.arctan2(cosine, sine)))) == pytest.approx(0.0, abs=1e-6)
        assert scores.size[i] == pytest.approx(np.hypot(sine, cosine), rel=1e-6)
        whole = np.linalg.norm(both @ np.array([sine, cosine]) / np.hypot(sine, cosine))
        own = abs(scores.size[i]) / scores.std[i] / np.sqrt(scores.statistic[i])  # 1: the same deviation in both
        assert own == pytest.approx(1.0, rel=1e-6)
        left = fit.project(both) @ np.array([sine, cosine]) / np.hypot(sine, cosine)
        assert scores.identifiability[i] == pytest.approx(np.linalg.norm(left) / whole, rel=1e-6)


def test_exact_aliases_stand_in_the_order_of_the_catalog(plant: rt.System, convected: rt.Record) -> None:
    scores = rt.diagnosis.score(rt.diagnosis.refit(plant, convected),
                                ["heat_source", "ambient_gradient", "sensor_self_heating"])
    first = labels(scores).index("heat_source(plate)")
    alike = sorted([first, *scores.aliases(first)])
    assert len(alike) == 3
    rng = np.random.default_rng(4)
    for _ in range(10):
        rounded = replace(scores, statistic=scores.statistic * (1 + 1e-9 * rng.uniform(-1, 1, len(scores.statistic))))
        assert [i for i in rounded.order if i in alike] == alike


def test_the_share_promised_is_the_share_explained_where_all_is_linear(plant: rt.System, hide: Hide) -> None:
    train, _ = hide(read=lambda T: T + [0.5, 0.0])
    fit = rt.diagnosis.refit(plant, train)
    scores = rt.diagnosis.score(fit, ["sensor_offset"])
    after = rt.diagnosis.refit_short_list(fit, scores).entries[0].fit
    got = (fit.rss - after.rss) / (fit.rss - fit.n_readings)
    assert got > 0.9  # otherwise nothing was tested
    assert explains(fit, scores) == pytest.approx(got, abs=0.01)


# Where a refit starts


def test_a_lag_far_shorter_than_a_sample_is_found_by_its_refit(
        plant: rt.System, rate: Callable, inputs_of: Callable, integrated: Callable, recorded: Callable) -> None:
    """Of 0.15 s at samples of 5 s; begun near the shortest trial value, 3 or 10 s, refits were given up one by one."""
    def late(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        return np.append(rate(T[:2], u), (T[1] - T[2]) / 0.15)

    u = inputs_of(600, 1) * [10.0, 1.0]
    T = integrated(late, np.full(3, 298.15), u)
    train = recorded(T[:, [0, 2]], u, ["heater", "room"], ["Tp", "Tb"], 1)
    fit = rt.diagnosis.refit(plant, train)
    names = ["sensor_lag", "input_lag", "input_delay"]
    short = rt.diagnosis.refit_short_list(fit, rt.diagnosis.score(fit, names))
    found = {entry.candidate.label: entry for entry in short.entries}
    assert {"sensor_lag(Tb)", "input_lag(heater)", "input_delay(heater)"} <= set(found)
    value, std = found["sensor_lag(Tb)"].values["time_constant"]
    assert abs(value - 0.15) < 3.0 * std < 0.1
    lag, delay = found["input_lag(heater)"], found["input_delay(heater)"]
    assert abs(lag.delta_bic - delay.delta_bic) < 10.0  # within a sample a heater with a lag is one with a delay


# What is not tried further


def test_a_misfit_that_no_single_effect_could_remove_is_left_to_the_verdict(
        plant: rt.System, convected: rt.Record, hide: Hide) -> None:
    fit = rt.diagnosis.refit(plant, convected)
    assert fit.variance > 3.0
    helpless, helpful = (rt.diagnosis.score(fit, [name]) for name in ("sensor_offset", "natural_convection"))
    assert explains(fit, helpless) < 0.3 < 0.8 < explains(fit, helpful)
    assert too_much_left(fit, helpless) and not too_much_left(fit, helpful)
    good = rt.diagnosis.refit(plant, hide()[0])
    assert good.variance < 1.5 and not too_much_left(good, rt.diagnosis.score(good, ["sensor_offset"]))


def test_where_the_search_gave_up_there_is_no_name(
        plant: rt.System, hide: Hide, rate: Callable, monkeypatch: pytest.MonkeyPatch) -> None:
    def hidden(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        return rate(T, u, np.array([0.3 * abs(u[1] - T[0]) ** 0.25 * (u[1] - T[0]), 0.0]))

    train, validation = hide(hidden)
    names = ["natural_convection"]
    assert rt.diagnose(plant, train, validation=validation, effects=names).verdict == "named"
    # whatever the other gates say
    monkeypatch.setattr("robthermal.diagnosis.search._stages.leaves_large_misfit", lambda *_: True)
    # and where no search beside a finer network follows, which asks again
    monkeypatch.setattr(sys.modules["robthermal.diagnosis.diagnose"], "graded", lambda judged, *_: judged)
    found = rt.diagnose(plant, train, validation=validation, effects=names)
    assert found.verdict == "unexplained" and not found.effects and "A large misfit stays" in found.outcome.text
    assert "whitened variance" not in found.outcome.text  # which is near 1 here, and no large number
    assert [effect.label for effect in found.provisional] == ["natural_convection(plate, room)"]


def test_candidates_that_promise_next_to_nothing_beside_the_best_are_not_refitted(
        plant: rt.System, convected: rt.Record, monkeypatch: pytest.MonkeyPatch) -> None:
    fit = rt.diagnosis.refit(plant, convected)
    scores = rt.diagnosis.score(fit)
    tried: list[str] = []
    whole = _short_list.entry_of

    def noted(origin: object, candidate: Candidate, *args: object) -> object:
        tried.append(candidate.label)
        return whole(origin, candidate, *args)

    monkeypatch.setattr(_short_list, "entry_of", noted)
    short = rt.diagnosis.refit_short_list(fit, scores)
    assert short.entries[0].candidate.label == tried[0] == "natural_convection(plate, room)"
    first = np.arange(len(scores.statistic)) == scores.order[0]
    far = replace(scores, signatures=np.where(first, scores.signatures, 0.0))
    tried.clear()
    rt.diagnosis.refit_short_list(fit, far)
    assert tried == ["natural_convection(plate, room)"]


@pytest.mark.parametrize(("gain", "reached", "evaluations"), [(1000.0, 4000.0, 2), (500.0, 2000.0, 1)])
def test_a_candidate_that_promises_what_the_best_has_reached_is_followed(
        monkeypatch: pytest.MonkeyPatch, gain: float, reached: float, evaluations: int) -> None:
    """A path of a housing stood at ΔBIC 2835 after its first evaluations, promised 10 594 and ended at 13 131; the best
    of the others had 13 013 then. One that comes no nearer is left."""
    asked: list[int] = []

    def further(fit: SimpleNamespace, structure: object, v: object, limit: int) -> SimpleNamespace:
        asked.append(limit)
        return SimpleNamespace(structure=structure, v=v, bic=fit.bic + gain)

    monkeypatch.setattr(_short_list, "extended", further)
    monkeypatch.setattr(_short_list, "delta_bic", lambda before, after: after.bic)
    start = SimpleNamespace(structure=None, v=None, bic=2000.0)
    assert _short_list._into_reach(start, start, 13000.0, 10600.0).bic == reached
    assert len(asked) == evaluations
    assert _short_list._into_reach(start, start, 1000.0, 10600.0) is start and len(asked) == evaluations


def test_no_water_condenses_from_air_colder_than_its_dew_point(plant: rt.System, convected: rt.Record) -> None:
    """A board that was warmer than all about it had "condensation" at 42 °C, in a room of 23 °C."""
    fit = rt.diagnosis.refit(plant, convected)
    one = rt.diagnosis.candidates(plant, ["condensation"])[0]
    warmest = max(fit.paths[0].x.max(), *(room.temperature for room in plant.ambients.values()))
    coldest = fit.paths[0].x.min()
    why = implausible(one, fit, {"conductance": 0.1, "dew_point": warmest + 2.0}, ())
    assert f"{warmest + 2.0 - 273.15:.3g} °C: no air holds that much water" in why
    room = min(room.temperature for room in plant.ambients.values())
    for dew_point in (room - 1.0, coldest - 1.0):
        assert implausible(one, fit, {"conductance": 0.1, "dew_point": dew_point}, ()) == ""


@pytest.mark.parametrize(("currents", "named"), [((1.5, 0.0), False), ((1.5, -1.5), False), ((1.5, "on and off"), True),
                                                 (("reversed", 0.0), True)])
def test_a_memory_of_the_polarity_shows_where_the_polarity_changes(currents: tuple[Any, ...], named: bool) -> None:
    """A measured Peltier cell, at 1.5 A in one record and at rest in the other, had a "hysteresis" of 7.6 ± 3.7 W."""
    cell = system()
    pattern = {"on and off": [1.5, 0.0, 1.5, 0.0], "reversed": [1.0, -1.0, 1.0, -1.0]}
    records = [rt.thermal.simulate(cell, drive(np.repeat(pattern.get(one, [one] * 4), 25), 4.0)) for one in currents]
    memory = rt.diagnosis.candidates(cell, ["hysteresis"])[0]
    why = implausible(memory, rt.diagnosis.refit(cell, records), {"heat": -7.6, "time_constant": 26.0}, ())
    assert (why == "") == named
    assert named or "the current of m1 is on, or off, throughout every record" in why


def test_leaving_an_effect_out_starts_from_what_is_known(plant: rt.System, convected: rt.Record) -> None:
    nominal = rt.diagnosis.refit(plant, convected)
    best = rt.diagnosis.decide(rt.diagnosis.refit_short_list(nominal, rt.diagnosis.score(nominal))).best
    assert best is not None
    cold, warm = (_revise.without(best.fit, 0, nominal, before) for before in (None, nominal))
    assert cold is not None and warm is not None
    assert warm.structure.effects == () and warm.rss <= cold.rss * (1 + 1e-4)
    assert int(warm.outcome.text.split()[2]) <= int(cold.outcome.text.split()[2])
    wrong = extended(best.fit, best.fit.structure, best.fit.v)  # has the effect that is to be left out
    other = _revise.without(best.fit, 0, nominal, wrong)
    assert isinstance(other, Refit) and other.rss == pytest.approx(cold.rss, rel=1e-9)
