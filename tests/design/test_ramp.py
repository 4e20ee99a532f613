"""Ramps of set-points: no step is larger than allowed, the target is reached when it can be, C and Python agree."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robthermal as rt

GCC = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
RAMP = rt.design.setpoint_ramp({"m1": 0.05, "m2": 0.2}, cooling=0.02)


def test_it_moves_as_fast_as_allowed_and_arrives_in_time() -> None:
    found = RAMP.sequence([290.0, 300.0], [296.0, 299.0], samples=200, sample_time=2.0)
    t = 2.0 * np.arange(200)
    assert np.allclose(found[:, 0], np.minimum(290.0 + 0.05 * t, 296.0), atol=1e-9)  # 120 s up
    assert np.allclose(found[:, 1], np.maximum(300.0 - 0.02 * t, 299.0), atol=1e-9)  # 50 s down


def test_a_target_that_moves_is_followed_and_one_that_is_no_number_is_ignored() -> None:
    rng = np.random.default_rng(1)
    target = 295.0 + np.cumsum(rng.normal(0.0, 0.3, (400, 2)), axis=0)
    target[100:120] = np.nan
    found = RAMP.sequence(295.0, target, samples=400, sample_time=1.0)
    change = np.diff(found, axis=0)
    assert (change <= np.array([0.05, 0.2]) + 1e-12).all() and (change >= -0.02 - 1e-12).all()
    assert np.array_equal(found[100:120], np.tile(found[99], (20, 1)))
    free = (change < np.array([0.05, 0.2]) - 1e-9) & (change > -0.02 + 1e-9) & np.isfinite(target[1:])
    assert free.any() and np.allclose(found[1:][free], target[1:][free])


def test_a_loop_follows_a_ramp_with_less_current_than_a_step(system: rt.System) -> None:
    law = rt.design.feedback_linearization(system, current_limits=(-0.6, 1.4))
    pi = rt.design.pid(rt.design.cold_side(law), bandwidth=0.05, sample_time=1.0)
    ramp = rt.design.setpoint_ramp(law.names, 0.02)
    slow = rt.design.simulate_loop(system, pi, ramp.sequence(298.15, 283.15, samples=1200, sample_time=1.0), law=law,
                                   duration=1200.0)
    step = rt.design.simulate_loop(system, pi, 283.15, law=law, duration=1200.0)
    assert slow.outcome.code == step.outcome.code == "settled"
    assert slow.current.max() < 0.8 * step.current.max()
    speed = np.abs(np.diff(slow.regulated, axis=0)).max()  # K/s
    assert speed < 0.03 < np.abs(np.diff(step.regulated, axis=0)).max()


@pytest.mark.parametrize("bad", [((["m1"],), {}), (({"m1": 0.1}, 0.1), {}), (([], 0.1), {}), ((["m1"], 0.0), {}),
                                 (({"m1": float("nan")},), {}), ((["m1"], 0.1), {"cooling": -1.0})])
def test_what_is_no_rate_is_refused(bad: tuple[tuple[Any, ...], dict[str, Any]]) -> None:
    with pytest.raises(rt.InputError):
        rt.design.setpoint_ramp(*bad[0], **bad[1])


def test_shapes_that_do_not_fit_are_refused() -> None:
    for start, target, samples, words in (([1.0, 2.0, 3.0], 290.0, 5, "start"), (290.0, np.zeros((4, 2)), 5, "target"),
                                          (290.0, 290.0, 0, "samples")):
        with pytest.raises(rt.InputError, match=words):
            RAMP.sequence(start, target, samples=samples, sample_time=1.0)


def test_numbers_stand_in_the_json_file(tmp_path: Path) -> None:
    RAMP.export(tmp_path / "ramp.json")
    assert json.loads((tmp_path / "ramp.json").read_text("utf-8"))["modules"] == [
        {"name": "m1", "up": 0.05, "down": 0.02}, {"name": "m2", "up": 0.2, "down": 0.02}]


@pytest.mark.skipif(GCC is None, reason="no C compiler on this machine")
def test_the_c_source_is_the_same_ramp(tmp_path: Path) -> None:
    source = tmp_path / "ramp.c"
    RAMP.export(source)
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Werror", "-ffp-contract=off", "-DRAMP_TEST"]
    text = source.read_text(encoding="utf-8")
    for name, content, status in (("ramp", text, 0), ("wrong", text.replace("< low ? low", "< low ? target[i]"), 1)):
        assert (content == text) == (status == 0)
        source.write_text(content, encoding="utf-8")
        subprocess.run([str(GCC), *flags, str(source), "-o", str(tmp_path / name), "-lm"], check=True)
        assert subprocess.run([str(tmp_path / name)], capture_output=True, check=False).returncode == status
