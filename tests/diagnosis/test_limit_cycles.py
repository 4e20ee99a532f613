"""A thermostat makes a reading leave and come back within a sample or two: that is heat, no outlier."""

from __future__ import annotations

import numpy as np
import pytest
from thermostat import log, model

import robthermal as rt
from robthermal._rhythm import in_rhythm
from robthermal.diagnosis import noise_floor
from robthermal.signals import find_glitches


def excursions(record: rt.Record) -> int:
    """Readings of the foil more than 1 K above those three samples before and after."""
    T = record["T_foil"]
    return int(np.sum((T[3:-3] > T[:-6] + 1.0) & (T[3:-3] > T[6:] + 1.0)))


@pytest.mark.parametrize("loss", [0.05, 0.1])
def test_pulses_of_a_thermostat_are_no_glitches(loss: float) -> None:
    record = log(loss=loss)
    assert excursions(record) > 100
    assert all(len(rows) <= 2 for rows in find_glitches(record).values())  # where the set-point changes


def test_a_spike_among_the_pulses_is_found() -> None:
    found = find_glitches(log(spikes=(501, 850)))["T_foil"]
    assert {501, 850} <= set(found) and len(found) <= 4


def test_the_diagnosis_leaves_them_in() -> None:
    """Not recorded, the pulses were 18 % "isolated outliers", and the record was refused."""
    assert noise_floor(model(), log()).glitches == {}
    hidden = noise_floor(model(), log(recorded=False, spikes=(501,))).glitches
    assert 1 <= hidden.pop("T_foil") <= 3 and not hidden


def test_a_jump_of_three_converter_steps_is_no_outlier() -> None:
    """Readings in steps of 0.1 K at rest, three steps up for one sample: 8 standard deviations of step/√12 are less."""
    system = model()
    readings = np.full((300, 2), 318.1) + 0.1 * (np.arange(300) // 40 % 2)[:, None]
    readings[[61, 175], 0] += 0.3
    readings[[100], 1] += 0.6
    record = rt.Record(sample_time=5.0, inputs=np.full(300, 1.0), outputs=readings, input_names=["heater"],
                       output_names=["T_foil", "T_block"])
    assert noise_floor(system, record, noise=0.03).glitches == {"T_block": 1}


@pytest.mark.parametrize(("n", "count"), [(300, 15), (1000, 30), (5000, 250)])
def test_excursions_at_random_have_no_rhythm(n: int, count: int) -> None:
    rng = np.random.default_rng(9)
    drawn = [np.sort(rng.choice(n, count, replace=False)) for _ in range(500)]
    assert sum(bool(in_rhythm(rows, np.ones(count)).any()) for rows in drawn) == 0


@pytest.mark.parametrize("distances", [[8, 8, 9], [17, 25], [5, 5, 11], [60, 61, 59, 62]])
def test_a_rhythm_is_found_whatever_the_samples_make_of_it(distances: list[int]) -> None:
    rows = np.cumsum(np.tile(distances, 12))
    assert in_rhythm(rows, np.where(np.arange(rows.size) % 2, 3.0, 5.0)).all()
    assert not in_rhythm(rows[:6], np.ones(6)).any()  # too few to tell
