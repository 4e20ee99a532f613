"""A ramp of the set-points in a design: from command line and project file into simulation, design.json and C."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import Run

import robthermal as rt

pytestmark = pytest.mark.usefixtures("sketched")
RATE = 0.02  # K/s: from 22 °C to 12 °C takes 500 s
SYSTEM = """
[system]
name = "stage"
temperature_unit = "degC"
[ambients.room]
temperature = 22.0
[lumps.sink]
capacity = 120.0
[lumps.stage]
capacity = 35.0
[[links]]
between = ["sink", "room"]
conductance = 0.9
[[links]]
between = ["stage", "room"]
conductance = 0.05
[modules.m1]
hot = "sink"
cold = "stage"
seebeck = { value = 0.0529, slope = 0.0 }
resistance = { value = 2.1, slope = 0.0 }
conductance = { value = 0.5, slope = 0.0 }
reference_temperature = 25.0
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("ramp") / "stage.toml"
    place.write_text(SYSTEM, encoding="utf-8")
    return place


@pytest.mark.exhaustive
def test_the_simulation_and_the_files_follow_the_ramp(run: Run, file: Path, tmp_path: Path,
                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    simulated = []
    write = rt.jobs.write_design
    monkeypatch.setattr(rt.jobs, "write_design", lambda result, *more: simulated.append(result) or write(result, *more))
    out = tmp_path / "out"
    said = run("design", file, "--setpoint", "m1=12", "--setpoint-ramp", f"m1={RATE}", "--bandwidth", "0.05",
               "--export", "c", "--out", out)
    assert said.status == 0, said.out + said.err
    loop = simulated[0].loop
    expected = np.maximum(295.15 - RATE * loop.time, 285.15)
    assert loop.reference[:, 0] == pytest.approx(expected, abs=1e-3)  # at rest the stage has the room's temperature
    assert loop.time[-1] > 500.0 and loop.outcome.code == "settled"
    late = loop.time > 200.0  # the transient of the start is over: it follows with a lag of a few seconds
    assert np.abs(loop.cold[late] - loop.reference[late]).max() < 20.0 * RATE
    written = json.loads((out / "design.json").read_text(encoding="utf-8"))["setpoint_ramp"]
    assert written["modules"] == {"m1": {way: {"value": RATE, "unit": "K/s"} for way in ("up", "down")}}
    assert "ramp_step" in (out / "ramp.c").read_text(encoding="utf-8") and (out / "ramp.h").is_file()
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Ramp to the set-points" in page and "no faster than m1 0.02\u00a0K/s" in page.replace(" K/s", "\u00a0K/s")


@pytest.mark.parametrize(("given", "words"), [
    ("m1=fast", "MODULE=RATE in K/s"), ("m1=-1", "rate of 'm1'"), ("m2=0.02", "there is no module 'm2'"),
    ("m1", "MODULE=RATE in K/s")])
def test_rates_that_make_no_sense_are_refused(run: Run, file: Path, tmp_path: Path, given: str, words: str) -> None:
    said = run("design", file, "--setpoint", "m1=12", "--setpoint-ramp", given, "--out", tmp_path / "out")
    assert said.status == 2 and words in said.err and not (tmp_path / "out").exists()


def test_the_project_file_has_the_same_key(file: Path) -> None:
    system = rt.read_system(file)
    table = {"setpoint": {"m1": 12.0}, "setpoint_ramp": {"m1": RATE}}
    wanted = rt.jobs.design.design_from_table(system, table, rt.jobs.Boxes())
    ramp = wanted.ramp(["m1"])
    assert ramp is not None and (ramp.names, ramp.up, ramp.down) == (("m1",), (RATE,), (RATE,))
    assert rt.jobs.DesignRequest(setpoint={"m1": 285.15}).ramp(["m1"]) is None
    two = rt.systems.two_module()
    with pytest.raises(rt.InputError, match="module 'm2' has no rate"):
        rt.jobs.design.design_from_table(two, {"setpoint_ramp": {"m1": RATE}}, rt.jobs.Boxes())
