"""What an answer "unexplained" says: what came nearest, what it takes off the error, and why it is no name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis import Diagnosis
from robthermal.diagnosis._judge import Judged
from robthermal.diagnosis._nearest import nearest
from robthermal.diagnosis.evidence import Evidence, Stability
from robthermal.diagnosis.search import SearchState, ShortList
from robthermal.jobs.diagnose import Diagnosed, diagnosis_report

Hide = Callable[..., tuple[rt.Record, rt.Record]]


@pytest.fixture(scope="module")
def records(hide: Hide, rate: Callable) -> tuple[rt.Record, rt.Record]:
    """Natural convection is hidden, and the catalog is cut so that it has no name for it."""
    def convected(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        return rate(T, u, np.array([0.3 * abs(u[1] - T[0]) ** 0.25 * (u[1] - T[0]), 0.0]))

    return hide(convected)


@pytest.fixture(scope="module")
def unexplained(plant: rt.System, records: tuple[rt.Record, rt.Record]) -> Diagnosis:
    return rt.diagnose(plant, records[0], validation=records[1], effects=["sensor_gain", "sensor_lag"])


def test_it_names_the_effect_and_both_errors_on_unseen_data(unexplained: Diagnosis) -> None:
    (tried,), gap = unexplained.provisional, unexplained.gap["validation"]
    assert unexplained.verdict == "unexplained" and not unexplained.effects
    said = unexplained.nearest
    assert said.startswith(f"Nearest comes {tried.label}: with it the error on the validation records falls from ")
    assert f"from {gap.before:.2g} to {gap.after:.2g} K, noise alone would give {gap.noise:.2g}. No name, " in said
    assert gap.after < gap.before and said in unexplained.outcome.text


def test_the_reason_is_a_test_that_fails_with_its_number(unexplained: Diagnosis) -> None:
    """Most of the gap is left with it, as the residuals say without any evidence."""
    gap = unexplained.gap["train"]
    taken = (gap.before**2 - gap.after**2) / (gap.before**2 - gap.noise**2)
    assert taken < 0.3
    assert f"takes {100 * taken:.0f} % off what is left without it, less than the 30 %" in unexplained.nearest


def test_a_share_just_below_its_limit_is_not_said_to_be_the_limit() -> None:
    one = Evidence(share=0.3, reproducible=1.0, stability=Stability(6, 0.1), needed=0.2999)
    assert one.short_of.startswith("takes 29.9 % off") and "less than the 30 %" in one.short_of
    often = Evidence(share=0.5, reproducible=0.9496, stability=Stability(6, 0.1), needed=0.5)
    assert "in 94.9 % of draws" in often.short_of


def test_two_errors_that_differ_look_different(unexplained: Diagnosis) -> None:
    judged = Judged(state=SearchState(nominal=unexplained.nominal, names=None, scores=unexplained.scores,
                                      fit=unexplained.fit, current=unexplained.scores,
                                      short=ShortList(unexplained.fit, (), {}), complete=True,
                                      rounds=unexplained.rounds),
                    adequacy=unexplained.adequacy, hold_out=None, verdict="unexplained", outcome=unexplained.outcome,
                    why="of something")
    gap = {"train": replace(unexplained.gap["train"], before=0.01544, after=0.01508)}
    assert "falls from 0.0154 to 0.0151 K" in nearest(judged, gap)


def test_without_validation_it_speaks_of_the_training_records(
        plant: rt.System, records: tuple[rt.Record, rt.Record]) -> None:
    found = rt.diagnose(plant, records[0], effects=["sensor_gain"])
    assert "the error on the training records falls" in found.nearest and "validation" not in found.nearest


def test_where_it_does_not_help_on_unseen_data_it_says_so(plant: rt.System, unexplained: Diagnosis) -> None:
    nominal, scores = unexplained.nominal, unexplained.scores
    state = SearchState(nominal=nominal, names=None, scores=scores, fit=unexplained.fit, current=scores,
                        short=ShortList(nominal, (), {}), rounds=unexplained.rounds)
    judged = Judged(state=state, adequacy=unexplained.adequacy, hold_out=None, verdict="unexplained",
                    outcome=unexplained.outcome, why="of something")
    worse = replace(unexplained.gap["validation"], before=0.1, after=0.2)
    said = nearest(judged, {**unexplained.gap, "validation": worse})
    assert said.endswith("with which the error on the validation records does not fall (0.1 to 0.2 K): no name.")
    assert nearest(replace(judged, why=""), unexplained.gap) == ""  # not graded
    assert nearest(replace(judged, state=replace(state, rounds=())), unexplained.gap) == ""


def test_named_consistent_and_empty_answers_have_none(plant: rt.System, records: tuple[rt.Record, rt.Record],
                                                      hide: Hide) -> None:
    named = rt.diagnose(plant, records[0], effects=["natural_convection"])
    assert named.verdict == "named" and named.nearest == ""
    fine = rt.diagnose(plant, hide()[0], effects=["sensor_lag"])
    assert fine.verdict == "consistent" and fine.nearest == ""
    empty = rt.diagnose(plant, records[0], effects=["input_gain_slope"])
    assert empty.verdict == "unexplained" and not empty.provisional and empty.nearest == ""


def test_the_first_sentence_of_the_report_says_it_in_words(unexplained: Diagnosis) -> None:
    report = diagnosis_report(Diagnosed(unexplained, (), (), ()))
    assert "Nearest comes a gain error of sensor T" in report.headline
    assert "No name, because a gain error of sensor T" in report.headline
    section, = (one for one in report.sections if one.anchor == "effects")
    assert unexplained.nearest not in section.text  # said once


@pytest.mark.parametrize(("found", "words"), [
    (Evidence(0.9, 1.0, Stability(6, 0.1), 0.9), ""),
    (Evidence(0.9, 1.0, Stability(6, 0.1), 0.12), "takes 12 % off"),
    (Evidence(-0.1, 1.0, Stability(6, 0.1), -0.1), "takes 0 % off"),
    (Evidence(0.9, 0.62, Stability(6, 0.1), 0.9), "in 62 % of draws of parts of the records, less than 95 %"),
    (Evidence(0.9, 1.0, Stability(1, 0.0), 0.9), "in a single part of the records"),
    (Evidence(0.9, 1.0, Stability(6, 0.8), 0.9), "differs by 80 % between parts of the records, more than 50 %"),
    (Evidence(0.9, 1.0, Stability(6, float("nan")), 0.9), "differs by nan %"),
    (Evidence(0.9, 0.62, Stability(6, 0.8), 0.9, predicted=0.9), ""),
    (Evidence(0.9, 0.62, Stability(6, 0.1), 0.9, predicted=0.89), "in 62 % of draws"),
    (Evidence(0.9, 1.0, Stability(6, 0.1), 0.12, predicted=0.99), "takes 12 % off")])
def test_every_test_of_an_effect_has_its_words(found: Evidence, words: str) -> None:
    assert (words in found.short_of) and found.lasting is (found.short_of == "") and found.lasting is (words == "")


@pytest.mark.parametrize(("lasting", "why", "words"), [
    ((False, False), "of all", "a takes 12 % off{}; b takes 12 % off{}."),
    ((True, False), "more is left", "b takes 12 % off{}; a holds over parts of the records, but more is left."),
    ((False, True), "b take too little", "a takes 12 % off{}; b take too little."),
    ((True, True), "of all", "of all."),
    ((True, True), "c(x) takes 9 % off", "they are not what lasts: c(x) takes 9 % off.")])
def test_every_effect_has_a_reason(unexplained: Diagnosis, monkeypatch: pytest.MonkeyPatch, why: str, words: str,
                                   lasting: tuple[bool, bool]) -> None:
    def round_(label: str) -> SimpleNamespace:
        return SimpleNamespace(best=SimpleNamespace(candidate=SimpleNamespace(label=label)))

    monkeypatch.setattr("robthermal.diagnosis._nearest.evidence_of", lambda *fits: [
        Evidence(0.9, 1.0, Stability(6, 0.1), 0.9 if one else 0.12) for one in lasting])
    state = SimpleNamespace(rounds=(round_("a"), round_("b")), fit=None, nominal=None)
    judged = SimpleNamespace(why=why, alone="", compared=False, state=state, validation=None)
    said = nearest(judged, unexplained.gap)  # type: ignore[arg-type]
    rest = " what is left without it, less than the 30 % of an effect that is needed"
    assert said.partition("No name, because ")[2] == words.format(*[rest] * words.count("{}"))


@pytest.mark.exhaustive
def test_a_step_is_named_beside_heat_that_nothing_describes(plant: rt.System, rate: Callable, integrated: Callable,
                                                            recorded: Callable, inputs_of: Callable) -> None:
    """A draught that starts after 1500 s, and gusts: the effect that made up for these is dropped, the step stays."""
    def law(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        gusts = 0.5 * np.sign(np.sin(t / 37.0) + np.sin(t / 91.0 + 1.0) + 0.3 * np.sin(t / 13.0)) * (u[0] > 4.0)
        return rate(T, u, np.array([-0.186 * (t > 1500.0) * (T[0] - u[1]), gusts]))

    days = []
    for seed in (5, 6):
        u = inputs_of(600, seed)
        days.append(recorded(integrated(law, np.full(2, 298.15), u), u, ["heater", "room"], ["Tp", "Tb"], seed))
    found = rt.diagnose(plant, days[0], validation=days[1], effects=["conductance_step", "hidden_mass", "sensor_offset",
                                                                     "missing_link"])
    (step,) = found.effects
    assert found.verdict == "named_with_remainder" and step.label == "conductance_step(plate-room)"
    size, std, _ = step.values["relative"]
    assert size == pytest.approx(0.186 / 0.62, abs=2.0 * std)
    assert step.values["time"][0] == pytest.approx(1500.0, abs=20.0)
    assert found.gap["validation"].after < 0.3 * found.gap["validation"].before
