"""A mass behind a lump, which the nominal parameters hide: found behind the next lump first, and then in its place."""

from __future__ import annotations

import sys
from pathlib import Path

import robthermal as rt

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from foreign.cases import Case, made  # noqa: E402 - beside the benchmarks


def test_a_mass_is_refitted_from_what_stands_in_for_it_at_the_next_lump() -> None:
    """Of this bar of 240 cells the right place stood at ΔBIC 652, and its optimum is at 10 370."""
    given = made(Case("bar", "hidden", "hidden_mass", 28))
    (effect, where, size), = given.truth
    fit = rt.diagnosis.refit(given.system, given.train)
    short = rt.diagnosis.refit_short_list(fit, rt.diagnosis.score(fit, [effect]))
    best, second = short.entries[:2]
    assert (effect, where) == ("hidden_mass", ("x4",)) and best.candidate.where == where
    assert second.candidate.where == ("x5",) and best.delta_bic > second.delta_bic + 1000.0
    assert abs(best.found["capacity"] - size) < 0.02 * size
