"""Stages of the search, one by one: each takes a state and returns one, and can be printed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis import _searching, search
from robthermal.diagnosis.evidence import validation_data
from robthermal.diagnosis.fit import NoiseScaling, extended
from robthermal.diagnosis.search import _revise

Hide = Callable[..., tuple[rt.Record, rt.Record]]
FEW = ("natural_convection", "sensor_lag", "sensor_offset")


@pytest.fixture(scope="module")
def convected(hide: Hide, rate: Callable[..., np.ndarray]) -> tuple[rt.Record, rt.Record]:
    """Records of a plate that also loses heat by natural convection."""
    def hidden(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        return rate(T, u, np.array([0.3 * abs(u[1] - T[0]) ** 0.25 * (u[1] - T[0]), 0.0]))

    return hide(hidden)


@pytest.fixture(scope="module")
def begun(plant: rt.System, convected: tuple[rt.Record, rt.Record]) -> search.SearchState:
    return search.begin(rt.diagnosis.refit(plant, convected[0]), FEW)


@pytest.fixture(scope="module")
def accepted(begun: search.SearchState) -> search.SearchState:
    return search.accept(search.refit_candidates(search.shortlist(begun)))


def test_the_search_begins_with_every_candidate_scored_and_nothing_accepted(begun: search.SearchState) -> None:
    assert {candidate.effect.name for candidate in begun.scores.candidates} == set(FEW)
    assert begun.fit is begun.nominal and begun.current is begun.scores
    assert not begun.rounds and not begun.complete and not begun.short.entries
    assert str(begun).startswith("0 effects accepted") and "the search goes on" in str(begun)


def test_refitting_lists_candidates_and_accepting_takes_the_best(begun: search.SearchState,
                                                                 accepted: search.SearchState) -> None:
    listed = search.refit_candidates(search.shortlist(begun))
    assert listed.short.entries[0].candidate.label == "natural_convection(plate, room)" and not listed.rounds
    best = accepted.rounds[0].best
    assert best.candidate.label == "natural_convection(plate, room)" and accepted.fit is best.fit
    assert not accepted.complete and not accepted.misfit_left
    assert accepted.fit.variance < 1.2 < accepted.nominal.variance
    assert "natural_convection(plate, room)" in str(accepted)


def test_the_search_is_complete_when_nothing_promises_more(accepted: search.SearchState) -> None:
    done = search.shortlist(accepted)
    assert done.complete and not done.misfit_left and done.rounds == accepted.rounds
    assert done.current is not accepted.current  # scored again beside what was accepted
    assert "no further effect" in str(done)


def test_nothing_is_accepted_without_evidence(plant: rt.System, hide: Hide) -> None:
    state = search.begin(rt.diagnosis.refit(plant, hide()[0]), FEW)
    none = search.accept(search.refit_candidates(state))
    assert none.complete and not none.rounds and none.fit is state.nominal


def test_at_most_three_effects_are_looked_for(accepted: search.SearchState) -> None:
    full = replace(accepted, rounds=accepted.rounds * 3)
    assert search.shortlist(full).complete
    last = replace(accepted, rounds=accepted.rounds * 2, fit=accepted.nominal, names=("sensor_offset",))
    given_up = search.shortlist(last)  # the last one allowed promises little of a large misfit
    assert given_up.complete and given_up.misfit_left and "large misfit" in str(given_up)


def test_where_a_large_misfit_is_left_no_later_stage_touches_the_state(
        accepted: search.SearchState, convected: tuple[rt.Record, rt.Record]) -> None:
    left = replace(accepted, rounds=accepted.rounds * 2, complete=True, misfit_left=True)
    assert search.revise(left) is left and search.compare(left) is left
    data = validation_data(left.fit, convected[1], None)
    assert search.validate(left, data).rounds == left.rounds


def test_one_effect_is_kept_by_revision_and_not_compared(accepted: search.SearchState) -> None:
    revised = search.revise(accepted)
    assert [round_.best.candidate.key for round_ in revised.rounds] == [
        ("natural_convection", ("plate", "room"))]
    assert search.compare(revised) is revised and revised.joint is None


def test_an_effect_that_needs_no_place_is_dropped_by_revision(plant: rt.System, hide: Hide) -> None:
    fit = rt.diagnosis.refit(plant, hide()[0])  # nothing is hidden
    offset = next(c for c in rt.diagnosis.candidates(plant, ["sensor_offset"]) if c.where == ("Tp",))
    found = search.refit_set(fit, (offset,), [0.01])
    state = replace(search.begin(fit, FEW), fit=found.fit, complete=True, rounds=(
        search.Accepted(fit, best=rt.diagnosis.Entry(offset, found.fit, 100.0, 0.0)),))
    assert search.revise(state).rounds == ()


@pytest.mark.parametrize(("removed", "share", "asked"), [
    (0.1, 0.0, "babc"),  # where no share is asked for, the second time too, but not at once what was chosen last
    (0.6, 0.5, "babc"),
    (0.1, 0.5, "ba")])
def test_effects_are_chosen_a_second_time_where_the_first_removed_enough(
        removed: float, share: float, asked: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def chosen(name: str) -> SimpleNamespace:
        return SimpleNamespace(best=SimpleNamespace(fit=name, candidate=SimpleNamespace(key=name)))

    seen: list[str] = []

    def again(rounds: list[SimpleNamespace], fit: str, place: int, *_: object) -> SimpleNamespace:
        seen.append(rounds[place].best.candidate.key[0])
        return chosen(seen[-1] + "2" * (len(seen) == 1))  # the first one asked is another effect now

    monkeypatch.setattr(_revise, "_chosen_again", again)
    monkeypatch.setattr(_revise, "_removed", lambda before, after: removed)
    monkeypatch.setattr(_revise, "needed", lambda rounds, fit, nominal: (rounds, fit))
    rounds, fit = _revise.revised(tuple(map(chosen, "abc")), None, None, last_is_new=True, share=share)
    assert "".join(seen) == asked and fit == rounds[-1].best.fit
    assert sorted(one.best.candidate.key[0] for one in rounds) == ["a", "b", "c"]


def test_the_share_of_a_misfit_that_is_gone_is_that_of_the_same_filters(accepted: search.SearchState) -> None:
    """What is left in the end is noise: all but 1 / (variance before) is gone, whatever filters the later fit has."""
    before, after = accepted.nominal, accepted.fit
    assert _revise._removed(before, before) == pytest.approx(0.0, abs=1e-9)
    removed = _revise._removed(before, after)
    alike = extended(before, after.structure, after.v, 1)
    assert removed == pytest.approx((before.rss - alike.rss) / (before.rss - before.n_readings)) and 0.9 < removed < 1.1


def test_validation_data_keep_an_effect_that_holds_and_take_back_one_that_does_not(
        accepted: search.SearchState, convected: tuple[rt.Record, rt.Record], hide: Hide) -> None:
    kept = search.validate(accepted, validation_data(accepted.fit, convected[1], None))
    assert kept.rounds == accepted.rounds and kept.fit is accepted.fit
    gone = search.validate(accepted, validation_data(accepted.fit, hide()[1], None))  # nothing is hidden there
    assert gone.rounds == () and gone.fit is accepted.nominal


def test_diagnose_is_the_stages_in_a_row(plant: rt.System, convected: tuple[rt.Record, rt.Record],
                                         accepted: search.SearchState) -> None:
    said: list[str] = []
    found = rt.diagnose(plant, convected[0], validation=convected[1], effects=FEW, progress=said.append)
    by_hand = search.validate(search.compare(search.revise(search.shortlist(accepted))),
                              validation_data(accepted.fit, convected[1], None))
    assert found.verdict == "named"
    assert [r.best.candidate.key for r in found.rounds] == [r.best.candidate.key for r in by_hand.rounds]
    assert found.fit.v.tolist() == by_hand.fit.v.tolist()
    assert said.index("refitting the best candidates") < said.index("testing whether anything is left")
    assert len(said) == len(set(said)) and len(said) >= 7


@pytest.mark.parametrize(("promise", "random_heat", "sensor", "stops"), [
    (1500.0, 1.0, 1.0, True), (1500.0, 1.4, 1.0, True), (1500.0, 1.0, 1.4, False), (1100.0, 1.0, 1.0, False),
    (1020.0, 1.0, 1.0, False)])
def test_one_more_effect_is_tried_where_it_needs_fewer_unknowns_than_a_finer_network(
        monkeypatch: pytest.MonkeyPatch, promise: float, random_heat: float, sensor: float, stops: bool) -> None:
    # 1000 readings: 14 unknowns of a finer network cost as much as a sum of squares that is larger by a factor 1.102.
    exact = told(2000.0, 0, NoiseScaling(1.4, {"T": 1.4}))
    finer = told(1000.0, 14, NoiseScaling(random_heat, {"T": sensor}))
    assert _searching._price(finer) == pytest.approx(1000.0 * np.log(1.102), rel=5e-3)  # type: ignore[arg-type]
    monkeypatch.setattr(_searching, "coarsened", lambda one: finer)
    monkeypatch.setattr(_searching, "extended", lambda one, structure, v, limit: finer)
    monkeypatch.setattr(_searching, "promised", lambda one, scores, i: promise)
    state = SimpleNamespace(fit=exact, complete=False, current=SimpleNamespace(order=[0]))
    assert _searching._only_coarse(state) is stops  # type: ignore[arg-type]


def told(rss: float, columns: int, levels: NoiseScaling) -> SimpleNamespace:
    """A fit to 1000 readings; of every unknown of a finer network they say as much as 999 times its prior."""
    structure = SimpleNamespace(coarse=(0,) * bool(columns), n_coarse=columns, n_common=columns)
    J = np.concatenate([np.sqrt(999.0) * np.eye(columns), np.eye(columns)])
    return SimpleNamespace(rss=rss, variance=rss / 1000.0, n_readings=1000, records=(0,), levels=levels, J=J,
                           structure=structure, v=np.zeros(1))


@pytest.mark.parametrize(("level", "stops"), [(1.0, False), (1.05, False), (1.2, True)])
def test_a_raised_level_of_noise_may_hold_what_a_finer_network_would_change(
        monkeypatch: pytest.MonkeyPatch, level: float, stops: bool) -> None:
    exact, finer = told(1100.0, 0, NoiseScaling(1.0, {"T": level})), told(900.0, 14, NoiseScaling(1.0, {"T": 1.0}))
    monkeypatch.setattr(_searching, "coarsened", lambda one: finer)
    monkeypatch.setattr(_searching, "extended", lambda one, structure, v, limit: finer)
    state = SimpleNamespace(fit=exact, complete=True, current=None)
    assert _searching._only_coarse(state) is stops  # type: ignore[arg-type]


def test_the_price_of_unknowns_is_the_determinant_of_what_the_others_cannot_explain() -> None:
    rng = np.random.default_rng(4)
    rest, own = rng.standard_normal((40, 3)), 2.0 * rng.standard_normal((40, 5))
    J = np.concatenate([np.concatenate([rest, own], axis=1), np.eye(8)[3:]])  # priors of the last five
    fit = SimpleNamespace(J=J, structure=SimpleNamespace(n_common=8, n_coarse=5))
    P = np.eye(40) - rest @ np.linalg.pinv(rest)
    sign, log = np.linalg.slogdet(np.eye(5) + own.T @ P @ own)
    assert sign == 1 and _searching._price(fit) == pytest.approx(log, rel=1e-12)  # type: ignore[arg-type]
