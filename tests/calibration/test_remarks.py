"""What a calibration takes for granted is said: a room that is not recorded, and when means were taken."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from heated_bar import PROJECT, SYSTEM, closed_form, write_project
from unrecorded_room import NOISE, ROOM, model, records

import robthermal as rt

ROOM_NUMBER = "ambients.room.temperature"
BLOCK_ROOM = "links.block-room.conductance"


@pytest.fixture(scope="module")
def warm() -> list[rt.Record]:
    """The room is 1 K warmer than the file says, and nobody has recorded it; truth from a matrix exponential."""
    return records(room=ROOM + 1.0, both=True)


def test_an_ambient_that_was_not_recorded_is_said_with_what_it_does(warm: list[rt.Record]) -> None:
    fit = rt.calibrate(model(both=True), warm)
    said, beyond = fit.remarks
    assert beyond.startswith("At ") and "far more than the declared noise explains" in beyond
    assert "No record holds the temperature of room: it was taken to be 21.85 °C all the time" in said
    assert f'"{ROOM_NUMBER}" under [fit]' in said and "Record it as a column" in said
    assert said in str(fit) and fit.to_dict()["remarks"] == [said, beyond] and said in unescape(fit._repr_html_())
    better = rt.calibrate(model(both=True), records(room=ROOM + 1.0, both=True, recorded=True))
    assert better.remarks == ()
    share, way = re.search(r"With 1 K more the conductance of link block-room comes out (\d+) % (\w+)", said).groups()
    truly = better.parameters[BLOCK_ROOM] / fit.parameters[BLOCK_ROOM] - 1.0  # the room is 1 K warmer indeed
    assert way == "higher" and 0.01 * float(share) == pytest.approx(truly, rel=0.1)


def test_an_ambient_that_is_estimated_needs_no_remark(warm: list[rt.Record]) -> None:
    system = model(both=True)
    ranges = {**system.fit, ROOM_NUMBER: (285.0, 305.0)}
    fit = rt.calibrate(system, warm, parameters=ranges)
    assert fit.remarks == () and fit.parameters[ROOM_NUMBER] == pytest.approx(ROOM + 1.0, abs=0.1)


def test_a_validation_record_of_another_sign_is_said_to_be_another_matter() -> None:
    """A current counted the other way round on the validation day: fitted 0.07 K, that day 1.4 K, without a word."""
    first, second = (records(room=ROOM, both=True, recorded=True)[i] for i in (0, 1))
    fit = rt.calibrate(model(both=True), first, validation=second)
    assert fit.remarks == ()
    wrong = rt.calibrate(model(both=True), first, validation=second.changed(inputs=second.inputs * [-1.0, 1.0]))
    said, = wrong.remarks
    worst = max(wrong.validation_rmse, key=lambda name: wrong.validation_rmse[name] / max(wrong.rmse[name], NOISE))
    assert said.startswith(f"{worst} of the validation record ")
    assert f" is {wrong.validation_rmse[worst]:.2g} K rms off the model" in said and "look at the sign" in said


def test_which_record_lacks_it_is_said(warm: list[rt.Record]) -> None:
    held = records(room=ROOM + 1.0, both=True, recorded=True)
    fit = rt.calibrate(model(both=True), [held[0], warm[1]])
    assert fit.remarks[0].startswith("record does not hold the temperature of room")


def late_means(n: int, h: float, late: bool) -> rt.Record:
    """A bar of 100 J/K and 0.5 W/K, 10 W on and off: means of ten samples at the beginnings of tenths of a step."""
    part, tau = h / 10.0, 200.0
    keep, level = np.exp(-part / tau), 0.0
    heat = np.repeat(np.tile([10.0, 0.0], n), 20)[:n]
    out = np.empty((n, 1))
    for k, q in enumerate(heat):
        samples = []
        for _ in range(10):
            before, level = level, keep * level + (1.0 - keep) * q / 0.5
            samples.append(before if late else 0.5 * (before + level))
        out[k] = np.mean(samples)  # written when the step ends
    return rt.Record(sample_time=h, inputs=heat[1:, None], outputs=ROOM + out[:-1], input_names=["q"],
                     output_names=["T"], averaged=True)


def test_late_means_are_said_with_what_they_do() -> None:
    system = rt.System(ambients={"room": {"temperature": ROOM}}, lumps={"bar": {"capacity": 90.0}},
                       links=[{"between": ("bar", "room"), "conductance": 0.6}], inputs={"q": {"lump": "bar"}},
                       sensors={"T": {"lump": "bar", "noise": 0.01}})
    ranges = {"lumps.bar.capacity": (10.0, 500.0), "links.bar-room.conductance": (0.1, 5.0)}
    late, even = (rt.calibrate(system, late_means(400, 20.0, which), parameters=ranges) for which in (True, False))
    assert even.parameters["lumps.bar.capacity"] == pytest.approx(100.0, rel=1e-3)
    (said,) = (one for one in late.remarks if "hold means" in one)
    (size,) = re.findall(r"late and of 10 samples each, the heat capacity of bar comes out ([\d.]+) % higher", said)
    truly = late.parameters["lumps.bar.capacity"] / even.parameters["lumps.bar.capacity"] - 1.0
    assert truly > 0.002 and 0.01 * float(size) == pytest.approx(truly, rel=0.15)
    assert "robthermal diagnose" in said


def test_the_verdict_of_a_job_says_so(tmp_path: Path) -> None:
    time, noise = np.arange(600.0), np.random.default_rng(3)
    heat = np.full(600, 100.0)
    table = {name: (heat, 20.0 + closed_form(time, 1.0) + noise.normal(0.0, 0.02, 600))
             for name in ("train", "validation")}
    result = rt.jobs.run_job(rt.jobs.read_project(write_project(tmp_path, table, system=SYSTEM, project=PROJECT)))
    (one,) = [one for one in result.reasons if one.code == "ambient_not_recorded"]
    assert one.level == "remark" and one.about == "room" and "taken to be 20 °C" in one.text


def test_what_a_model_leaves_beyond_the_declared_noise_is_said() -> None:
    system = model(both=True)
    exact = records(room=ROOM, both=True, recorded=True)
    assert rt.calibrate(system, exact).remarks == ()
    bent = [replace(one, outputs=one.outputs + 2.0 * np.sin(np.arange(len(one)) / 40.0)[:, None]) for one in exact]
    (said,) = rt.calibrate(system, bent).remarks
    left, times = map(float, re.search(r"explains: ([\d.]+) K, (\d+) times", said).groups())
    fit = rt.calibrate(system, bent)
    worst = said.split()[1].rstrip(",")
    assert left == pytest.approx(fit.rmse[worst], rel=0.05)
    assert times == pytest.approx(left / system.sensors[worst].noise, rel=0.05)
    assert "`robthermal diagnose`" in said and "standard deviations do not say" in said


def test_an_undeclared_noise_is_estimated_and_nothing_is_beyond_it() -> None:
    system = rt.System(ambients={"room": {"temperature": ROOM}}, lumps={"bar": {"capacity": 90.0}},
                       links=[{"between": ("bar", "room"), "conductance": 0.6}], inputs={"q": {"lump": "bar"}},
                       sensors={"T": {"lump": "bar"}})
    ranges = {"lumps.bar.capacity": (10.0, 500.0), "links.bar-room.conductance": (0.1, 5.0)}
    one = replace(late_means(400, 20.0, False), averaged=False)
    fit = rt.calibrate(system, replace(one, outputs=one.outputs + np.sin(np.arange(len(one)) / 20.0)[:, None]),
                       parameters=ranges)
    assert not any("far more than the declared noise" in said for said in fit.remarks)


def test_glitches_are_nothing_that_a_model_lacks() -> None:
    system = model(both=True)
    exact = records(room=ROOM, both=True, recorded=True)
    struck = []
    for one in exact:
        outputs = one.outputs.copy()
        outputs[::50] += 8.0
        struck.append(replace(one, outputs=outputs))
    assert not any("far more than the declared noise" in said for said in rt.calibrate(
        system, struck, loss="huber").remarks)
