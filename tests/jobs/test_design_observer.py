"""Designs with and without an observer: which sensors it reads, and why there is none."""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path

import pytest
from commands import Run, Said

import robthermal as rt

pytestmark = pytest.mark.usefixtures("sketched", "without_linearity")
LATE = {"stage_late": {"lump": "stage", "noise": 0.01, "time_constant": 2.0},
        "sink_late": {"lump": "sink", "noise": 0.01, "time_constant": 0.5, "delay": 1.0}}
PROMPT = {"T_stage": {"lump": "stage", "noise": 0.01}, "T_sink": {"lump": "sink", "noise": 0.01}}
REMEDY = "Describe its mass as a lump, linked to the lump it measures, or leave it out."


@pytest.fixture
def without_linearity(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robthermal.jobs.design._design._collapse", lambda *given: None)


def machine(sensors: dict[str, dict[str, object]], **sink: object) -> rt.System:
    return rt.System(
        ambients={"room": {"temperature": 295.15}}, lumps={"sink": {"capacity": 120.0}, "stage": {"capacity": 35.0}},
        links=[{"between": ("sink", "room"), "conductance": 0.9, **sink},
               {"between": ("stage", "room"), "conductance": 0.05}],
        modules={"m1": rt.systems.surrogate_module("sink", "stage")}, sensors=sensors)


def designed(run: Run, folder: Path, system: rt.System, *options: str) -> tuple[Said, str]:
    """What the terminal says, and the words of the report."""
    rt.thermal.write_system(system, folder / "machine.toml")
    said = run("design", folder / "machine.toml", "--setpoint", "m1=288.15", "--bandwidth", "0.02", *options,
               "--out", folder / "out")
    page = folder / "out" / "report.html"
    words = unescape(re.sub(r"<[^>]*>", "", page.read_text(encoding="utf-8"))) if page.exists() else ""
    return said, words.replace("\N{NO-BREAK SPACE}", " ")


def test_sensors_left_out_because_they_lag_are_said(run: Run, tmp_path: Path) -> None:
    said, page = designed(run, tmp_path, machine(LATE))
    assert said.status == 0 and "no sensors" not in page
    assert "stage_late (time constant 2 s), sink_late (time constant 0.5 s, delay 1 s)" in page
    assert "There is none. Left out, because an observer is certified only with sensors that read their lump" in page
    assert "taken as measured, without an observer" in page


def test_those_beside_the_ones_that_are_read_are_said_too(run: Run, tmp_path: Path) -> None:
    said, page = designed(run, tmp_path, machine({**PROMPT, **LATE}))
    assert said.status == 0 and "All lumps are reconstructed from T_stage, T_sink" in page
    assert "stage_late (time constant 2 s), sink_late" in page


@pytest.mark.parametrize("name", list(LATE))
def test_one_criterion_refuses_what_lags(run: Run, tmp_path: Path, name: str) -> None:
    """Whether the lag is shorter than a sample or longer."""
    said, _ = designed(run, tmp_path, machine(LATE), "--sensors", name)
    assert said.status == 2 and f"sensor '{name}' lags" in said.err
    assert f"Expected sensors that read their lump at once, without time constant and delay. {REMEDY}" in said.err


def test_no_observer_where_none_is_asked_for(run: Run, tmp_path: Path) -> None:
    said, page = designed(run, tmp_path, machine(PROMPT), "--sensors", "")
    assert said.status == 0 and "None was asked for. The feedback law needs" in page
    assert json.loads((tmp_path / "out" / "design.json").read_text(encoding="utf-8"))["observer"] is None
    table = {"sensors": [], "setpoint": {"m1": 288.15}}
    assert rt.jobs.design.design_from_table(machine(PROMPT), table, rt.jobs.Boxes()).sensors == ()


def test_natural_convection_beside_an_observer_has_a_remedy_that_holds(run: Run, tmp_path: Path) -> None:
    natural = {"natural": {"gain": 0.05, "exponent": 0.25}}
    for method in ("energy", "sum"):
        said, page = designed(run, tmp_path, machine(PROMPT, **natural), "--method", method)
        assert said.status == 1 and "The observer's error shrinks: natural convection from lump 'sink'" in said.out
        assert "use energy" not in page and "leave the observer out, or describe the link by a conductance" in page
        (tmp_path / "out").rename(tmp_path / method)
    assert designed(run, tmp_path, machine(PROMPT, **natural), "--sensors", "")[0].status == 0
    (tmp_path / "out").rename(tmp_path / "without")
    ranged, _ = designed(run, tmp_path, machine(PROMPT), "--parameters", "links.sink-room.conductance=0.9:1.1")
    assert ranged.status == 0


def test_other_methods_are_named_where_they_help() -> None:
    """A full matrix has no bound of the slope either; the methods with a diagonal one need none."""
    system, box = machine({}, natural={"gain": 0.05, "exponent": 0.25}), {"m1": (0.0, 0.5)}
    found = rt.certify.contraction(system, current=box, temperature=(273.15, 323.15), method="lyapunov")
    assert not found.holds and found.reason.endswith("; use energy, sum or max")
