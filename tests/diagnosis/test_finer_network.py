"""A network a little too coarse: the misfit is hardly above the noise, and effects could make it up."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import robthermal as rt

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from foreign import cases  # noqa: E402 - beside the benchmarks


@pytest.mark.parametrize("seed", [306, pytest.param(301, marks=pytest.mark.exhaustive),
                                  pytest.param(304, marks=pytest.mark.exhaustive)])
def test_coarseness_alone_is_no_effect(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    """A plate of 216 cells as six lumps; a mass and a share of heat elsewhere explain it down to the noise."""
    monkeypatch.setattr(cases, "DISCRETE", (1.03, 1.3))
    one = cases.made(cases.Case("plate", "nothing", "nothing", seed))
    assert 1.02 < one.discrete < 1.35
    found = rt.diagnose(one.system, one.train, validation=one.unseen)
    assert not found.effects and found.verdict in ("unexplained", "consistent")


def test_an_effect_beside_slight_coarseness_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cases, "DISCRETE", (1.03, 1.3))
    one = cases.made(cases.Case("housing", "hidden", "missing_link", 301))
    found = rt.diagnose(one.system, one.train, validation=one.unseen)
    assert [(effect.effect, effect.where) for effect in found.effects] == [truth[:2] for truth in one.truth]
    assert not found.caveats


def test_one_effect_that_a_finer_network_makes_up_for_keeps_its_name_with_a_caveat(monkeypatch: pytest.MonkeyPatch
                                                                                   ) -> None:
    """Nothing is hidden in this stack; its whitened variance is 1.09."""
    monkeypatch.setattr(cases, "DISCRETE", (1.03, 1.3))
    one = cases.made(cases.Case("stack", "nothing", "nothing", 322))
    found = rt.diagnose(one.system, one.train, validation=one.unseen)
    assert any("the network may be too coarse instead" in said for said in found.caveats)
    assert "the network may be too coarse instead" in found.outcome.text
