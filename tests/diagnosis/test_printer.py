"""A printer of 44 cells against four lumps: its fan, and effects that another day confirms or does not."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis import _graded as graded
from robthermal.diagnosis._doubts import confirmed
from robthermal.diagnosis._found import Found
from robthermal.diagnosis._judge import Judged, Validation
from robthermal.diagnosis._lasting import evidence_of
from robthermal.diagnosis.evidence import Evidence, Stability
from robthermal.diagnosis.fit import Refit, Whitened, relinearized
from robthermal.diagnosis.search import SearchState, accept, begin, refit_candidates

from ..printer import bed_alone, measured, of_bed, program, system, without_fan


def test_a_fan_that_is_not_declared_its_law_and_a_late_thermometer_are_named_together() -> None:
    """Of the fan's power law, 0.8, the slope says how it bends; the bead lags by 4 s."""
    hot = [0.0, 50.0, 60.0]
    found = rt.diagnose(without_fan(), measured(11, *program(11, 700, [50.0, 60.0, 0.0])),
                        validation=measured(12, *program(12, 700, hot)))
    assert found.verdict == "named_with_remainder" and not any(found.alternatives)
    assert {one.label for one in found.effects} == {
        "driven_conductance(block-room, fan_duty)", "input_saturation(fan_duty)", "sensor_lag(hotend)"}
    lag, std, _ = next(one.values["time_constant"] for one in found.effects if one.effect == "sensor_lag")
    assert abs(lag - 4.0) < 2.0 * std and std < 0.5


def test_a_swing_that_fits_the_training_records_alone_is_not_named_beside_another_effect() -> None:
    """The loss of the block by radiation is not in the model; a periodic heat had taken its place on this day."""
    found = rt.diagnose(system(), measured(21, *program(21, 500, [50.0, 60.0, 0.0])),
                        validation=measured(22, *program(22, 500, [0.0, 50.0, 60.0])))
    assert [one.label for one in found.effects] == ["input_saturation(fan_duty)"]
    assert found.gap["validation"].after < 0.5 * found.gap["validation"].before


@pytest.fixture(scope="module")
def hardly_excited() -> tuple[SearchState, Refit]:
    """Natural convection found on a bed that gets 5 K warmer than the room."""
    nominal = rt.diagnosis.refit(bed_alone(), of_bed(measured(12, *program(12, 900, [0.0, 24.0, 27.0]))))
    return accept(refit_candidates(begin(nominal, ["natural_convection"]))), nominal


def test_an_effect_that_training_hardly_shows_is_confirmed_by_what_it_predicts(
        hardly_excited: tuple[SearchState, Refit]) -> None:
    state, nominal = hardly_excited
    alone, = evidence_of(state.rounds, state.fit, nominal)
    assert not alone.lasting and alone.stability.spread > 0.5 and alone.predicted == 0.0
    hot = Validation(of_bed(measured(13, *program(13, 900, [60.0, 80.0, 100.0]))))
    confirmed, = evidence_of(state.rounds, state.fit, nominal, hot)
    assert confirmed.lasting and confirmed.predicted > 0.99 and confirmed.stability == alone.stability


def test_a_size_that_may_be_zero_is_not_confirmed(
        hardly_excited: tuple[SearchState, Refit], monkeypatch: pytest.MonkeyPatch) -> None:
    """A share of 0.013 ± 0.118 was a name: beside it other numbers had moved, and these predicted."""
    state, nominal = hardly_excited
    hot = Validation(of_bed(measured(13, *program(13, 900, [60.0, 80.0, 100.0]))))
    at = state.fit.structure.column_of(0)
    for times, lasts in ((1.1, False), (0.9, True)):
        monkeypatch.setattr("robthermal.diagnosis._lasting.deviations",
                            lambda fit, plain, columns, of=times: np.array([of * abs(fit.v[at])]))
        found, = evidence_of(state.rounds, state.fit, nominal, hot)
        assert found.lasting is lasts and (found.predicted > 0.9) is lasts


def test_a_size_that_is_three_times_too_large_is_not_confirmed(hardly_excited: tuple[SearchState, Refit]) -> None:
    """The right effect at a wrong size, everything else as it is: the hot day is hardly better than without it."""
    state, nominal = hardly_excited
    v = state.fit.v.copy()
    v[state.fit.structure.column_of(0)] *= 3.0
    wrong = relinearized(replace(state.fit, v=v, z=Whitened(state.fit.structure, state.fit.whiteners).residual(v)))
    hot = Validation(of_bed(measured(13, *program(13, 900, [60.0, 80.0, 100.0]))))
    found, = evidence_of(state.rounds, wrong, nominal, hot)
    assert wrong.structure.quantities(v)[0]["gain"] == pytest.approx(
        3.0 * state.fit.structure.quantities(state.fit.v)[0]["gain"])
    assert not found.lasting and found.predicted < 0.9


def test_an_effect_that_another_day_confirms_says_so() -> None:
    def named(predicted: float) -> Found:
        evidence = Evidence(share=0.3, reproducible=0.9, stability=Stability(4, 0.57), needed=0.98, predicted=predicted)
        return Found("natural_convection", ("plate", "room"), {"gain": (0.2, 0.1, "W/K^1.25")}, 1e-9, 500.0, evidence)

    assert "augmented" not in replace(named(0.0), augmented={"gain": 0.29}).quantities
    assert replace(named(0.0), augmented={"gain": 0.31}).quantities == (
        "gain = 0.2 ± 0.1 W/K^1.25 (0.31 W/K^1.25 in the augmented system)")
    assert confirmed([named(0.0)]) == [] and "predicted" not in named(0.0).to_dict()
    sentence, = confirmed([named(0.984), named(0.0)])
    assert sentence.startswith("Over parts of the training records natural_convection(plate, room) does not hold; ")
    assert "98 % off" in sentence
    assert named(0.984).to_dict()["predicted"] == 0.984


def test_a_day_that_shows_it_no_better_confirms_nothing(hardly_excited: tuple[SearchState, Refit]) -> None:
    state, nominal = hardly_excited
    again = Validation(of_bed(measured(14, *program(14, 900, [0.0, 24.0, 27.0]))))
    found, = evidence_of(state.rounds, state.fit, nominal, again)
    assert not found.lasting and found.predicted < 0.9


@pytest.mark.parametrize(("instead", "closes", "verdict", "asked", "kept"), [
    (False, False, "unexplained", True, True), (True, False, "named_with_remainder", False, False),
    (True, True, "named_with_remainder", True, True), (True, True, "unexplained", True, False)])
def test_what_the_network_as_it_is_had_is_asked_again(monkeypatch: pytest.MonkeyPatch, instead: bool, closes: bool,
                                                      verdict: str, asked: bool, kept: bool) -> None:
    """Instead of an answer without a name only where all of it closes the gaps, and only with a name."""
    tried: list[object] = []
    judged = SimpleNamespace(state=SimpleNamespace(nominal=None), verdict="unexplained")
    answer = SimpleNamespace(verdict=verdict)
    monkeypatch.setattr(graded, "closing", lambda state, validation: closes)
    monkeypatch.setattr(graded, "predicting_alone", lambda *given: tried.append(given) or judged.state)
    monkeypatch.setattr(graded, "_graded", lambda *given: answer)
    monkeypatch.setattr(graded, "saying_so", lambda one, finer: one)
    finer = SimpleNamespace(structure=SimpleNamespace(n_coarse=4))
    other: Judged | None = judged if instead else None  # type: ignore[assignment]
    found = graded._alone(judged, finer, Validation(None), other)  # type: ignore[arg-type]
    assert bool(tried) is asked and (found is answer) is kept
