"""A battery cell of 113 cells against three lumps: heat in proportion to the current, and heat of the busbar."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis import _searching as searching
from robthermal.diagnosis import search
from robthermal.diagnosis.fit import Structure, _refitting, coarsened, exact

from ..cycled_cell import BUSBAR, ENTROPY, RESISTANCE, SYSTEM, WITH_HEATS, write

CELL = rt.thermal.parse_system(SYSTEM)
FITTED = rt.thermal.parse_system(WITH_HEATS)


@cache
def log(seed: int, n: int, older: float = 1.0) -> rt.Record:
    with TemporaryDirectory() as folder:
        return rt.signals.read_record(write(Path(folder) / "log.csv", seed, n, older), CELL)


@cache
def found() -> rt.Diagnosis:
    return rt.diagnose(CELL, log(1, 1200), validation=log(2, 720),
                       effects=["driven_heat", "input_feedthrough", "hidden_mass"])


def test_heat_with_the_sign_of_the_current_and_heat_of_the_busbar_are_named() -> None:
    answer = found()
    assert [one.label for one in answer.effects] == ["driven_heat(Current, roll)", "input_feedthrough(Heat, busbar)"]
    (gain, std, _), (share, of_share, _) = answer.effects[0].values["gain"], answer.effects[1].values["share"]
    assert abs(gain - ENTROPY) < 3.0 * std and std < 0.1 * ENTROPY
    assert abs(share - BUSBAR / RESISTANCE) < 2.0 * of_share
    assert answer.gap["validation"].after < 0.2 * answer.gap["validation"].before


def test_the_augmented_system_reads_the_log_that_it_came_from(tmp_path: Path) -> None:
    path = tmp_path / "augmented.toml"
    rt.thermal.write_system(found().system, path)
    again = rt.thermal.read_system(path)
    assert again.inputs["Current"].unit == "A" and "W/A" in str(found())
    record = rt.signals.read_record(write(tmp_path / "log.csv", 1, 1200), again)
    assert np.array_equal(record["Current"], log(1, 1200)["Current"])


@cache
def beside_a_finer_network() -> rt.diagnosis.Refit:
    nominal = rt.diagnosis.refit(CELL, log(1, 2400), rt.diagnosis.noise_floor(CELL, log(1, 2400)))
    state = searching.begin(coarsened(nominal), ["driven_heat"])
    return search.accept(search.refit_candidates(search.shortlist(state))).fit


def from_one_start(structure: Structure, v: np.ndarray, floor: rt.diagnosis.NoiseEstimate,
                   levels: _refitting.NoiseScaling) -> rt.diagnosis.Refit:
    return _refitting.fitted(structure, v, floor, levels)


def test_without_the_finer_network_a_fit_that_ends_before_it_converges_starts_once_more(
        monkeypatch: pytest.MonkeyPatch) -> None:
    fit = beside_a_finer_network()
    plain = exact(fit)
    assert plain.outcome.ok and plain.rms < 0.3
    monkeypatch.setattr(_refitting, "_from_either", from_one_start)
    once = _refitting.exact(rt.diagnosis.Refit(fit.structure, fit.v, fit.floor, fit.levels, fit.paths, fit.whiteners,
                                               fit.z, fit.outcome))
    assert not once.outcome.ok and once.rms > 2.0 * plain.rms


def test_a_fit_that_ends_beside_its_best_is_no_sign_of_means(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_refitting, "_from_either", from_one_start)
    answer = rt.diagnose(CELL, log(1, 2400), validation=log(2, 720), effects=["driven_heat"])
    assert "means" not in answer.outcome.text


@pytest.mark.parametrize(("older", "said"), [(1.0, False), (1.1, True)])
def test_a_new_day_farther_from_the_model_than_any_reference_day_is_said(older: float, said: bool) -> None:
    answer = rt.diagnose(FITTED, log(34, 600, older), reference=[log(seed, 600) for seed in (31, 32, 33)],
                         effects=["sensor_lag"])
    assert answer.verdict == "consistent" and answer.reference is not None
    assert ("More of them would tell whether something has changed." in answer.outcome.text) == said
    rms = answer.reference.unchanged
    assert answer.reference.to_dict()["unchanged"] == rms and (rms["new"] > 3.0 * rms["reference"]) == said
