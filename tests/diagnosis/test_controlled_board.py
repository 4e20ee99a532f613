"""Three effects at once on a board under control: the first one accepted is chosen far from the truth."""

from __future__ import annotations

import pytest
from controlled_board import LAGS, NOISE, PATH, STEP, day, model

import robthermal as rt

PATH_AT = ("missing_link", ("heater_1", "heater_2"))
FEW = ["missing_link", "missing_ambient_link", "sensor_lag", "input_lag", "input_delay", "hidden_mass", "heat_source",
       "conductance_step", "periodic_load", "input_feedthrough"]


def listed(found: rt.diagnosis.Diagnosis) -> list[set]:
    """Every effect with what the records cannot tell from it."""
    return [{one.key, *others} for one, others in zip(found.effects, found.alternatives, strict=True)]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_wrong_first_effect_is_chosen_again_beside_the_others(seed: int) -> None:
    """Seed 1: a drift of the room came first, then "unexplained" with 0.74 of 2.5 K left."""
    found = rt.diagnose(model(), day(seed), validation=day(seed + 10), effects=FEW)
    sets = listed(found)
    assert found.verdict in ("named", "ambiguous") and len(sets) == 3 and {PATH_AT} in sets
    for i, lag in enumerate(LAGS, start=1):
        (at,) = [k for k, one in enumerate(sets) if {("sensor_lag", (f"T{i}",)), ("input_lag", (f"q{i}",))} & one]
        value, _, _ = found.effects[at].values["time_constant"]
        assert value == pytest.approx(lag, rel=0.05)
    value, std, _ = next(one for one in found.effects if one.key == PATH_AT).values["conductance"]
    assert abs(value - PATH) < 4 * std < 0.1 * PATH
    assert found.means == ""


def test_commands_that_act_a_row_late_leave_the_names_and_are_said() -> None:
    """The same three effects are chosen in both readings of the log."""
    found = rt.diagnose(model(), day(1, late=STEP), validation=day(11, late=STEP), effects=FEW[:-4])
    assert {PATH_AT} in listed(found) and len(found.effects) == 3
    assert "a row too early" in found.means and "input_shift = 1" in found.means
    assert "with the same effects of other sizes" in found.means and found.means in found.outcome.text
    shifted = [rt.signals.shift_inputs(day(seed, late=STEP), 1) for seed in (1, 11)]
    again = rt.diagnose(model(), shifted[0], validation=shifted[1], effects=FEW[:-4])
    assert {PATH_AT} in listed(again) and len(again.effects) == 3 and again.means == ""
    assert again.gap["validation"].after < 1.2 * NOISE < 0.5 * found.gap["validation"].after
