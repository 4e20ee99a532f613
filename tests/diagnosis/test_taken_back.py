"""What validation data take back changes what is left: it is tested again."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from robthermal.diagnosis import _graded
from robthermal.diagnosis._judge import Validation


@dataclass(frozen=True)
class State:
    """What the stages of the graded verdict hand on."""

    rounds: tuple[str, ...]
    nominal: SimpleNamespace
    misfit_left: bool = False


@dataclass(frozen=True)
class Answer:
    state: State
    verdict: str = "unexplained"
    why: str = ""
    validation: Validation | None = None
    hold_out: None = None


@pytest.mark.parametrize(("kept", "tested", "answer"), [
    (("path", "heat"), [("path", "step", "heat")] * 2 + [("path", "heat")], ("path",)),
    (("path", "step", "heat"), [("path", "step", "heat")] * 2, ("path", "step", "heat"))])
def test_what_is_left_is_tested_again(monkeypatch: pytest.MonkeyPatch, kept: tuple[str, ...],
                                      tested: list[tuple[str, ...]], answer: tuple[str, ...]) -> None:
    """A heat that holds beside a step of a conductance, and not without it (a water-cooled stage of 130 cells)."""
    asked: list[tuple[str, ...]] = []

    def lasting(state: State, finer: object, validation: object) -> State:
        asked.append(state.rounds)
        return State(state.rounds if "step" in state.rounds else ("path",), state.nominal)

    nominal = SimpleNamespace(records=(0,))
    begun = State(("path", "step", "heat"), nominal)
    monkeypatch.setattr(_graded, "coarsened", lambda fit: SimpleNamespace(structure=SimpleNamespace(n_coarse=3)))
    monkeypatch.setattr(_graded, "coarsely_searched", lambda finer, state, progress: begun)
    monkeypatch.setattr(_graded, "lasting", lasting)
    monkeypatch.setattr(_graded, "revise", lambda state: state)
    monkeypatch.setattr(_graded, "predicting", lambda state, finer, validation: None)
    monkeypatch.setattr(_graded, "validated", lambda state, validation, progress: State(kept, nominal))
    monkeypatch.setattr(_graded, "with_rivals", lambda state, finer, validation: state)
    monkeypatch.setattr(_graded, "_graded", lambda judged, state, finer, validation: Answer(state, "named"))
    found = _graded.graded(Answer(begun), Validation(None), lambda stage: None)  # type: ignore[arg-type]
    assert asked == tested and found.state.rounds == answer
