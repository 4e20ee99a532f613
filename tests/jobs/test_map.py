"""What the command map refuses, and which heat it counts."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from commands import Run

import robthermal as rt
from robthermal.errors import InputError

pytestmark = pytest.mark.usefixtures("sketched")

MODULE = {"seebeck": {"value": 0.05}, "resistance": {"value": 2.0}, "conductance": {"value": 0.5},
          "current_limits": (0.0, 2.0)}
MACHINE = rt.System(
    ambients={"room": {"temperature": 296.15}},
    lumps={name: {"capacity": 50.0} for name in ("sink", "middle", "cold")},
    links=[{"between": ("sink", "room"), "conductance": 3.0}, {"between": ("middle", "room"), "conductance": 0.05},
           {"between": ("cold", "middle"), "conductance": 0.5}],
    modules={"lower": {"hot": "sink", "cold": "middle", **MODULE}})
ONE_ROW = ("--ambient", "296.15", "--load", "0", "--setpoint", "290", "--temperature", "263", "343")


def cascade() -> rt.System:
    return MACHINE.model_copy(update={"modules": {
        **MACHINE.modules, "upper": rt.thermal.Module(hot="middle", cold="cold", **MODULE)}})


def mapped(run: Run, folder: Path, heaters: dict[str, dict[str, object]]) -> tuple[str, list[dict[str, str]]]:
    """What the terminal says of one row, and the reasons in its summary."""
    inputs = {name: rt.thermal.Input(lump="cold", **more) for name, more in heaters.items()}
    rt.thermal.write_system(MACHINE.model_copy(update={"inputs": inputs}), folder / "machine.toml")
    said = run("map", folder / "machine.toml", *ONE_ROW, "--out", folder / "out")
    assert said.status == 0, said
    return said.out, json.loads((folder / "out" / "summary.json").read_text(encoding="utf-8"))["reasons"]


def test_a_cascade_is_refused_before_anything_is_computed(run: Run, tmp_path: Path) -> None:
    rt.thermal.write_system(cascade(), tmp_path / "stack.toml")
    said = run("map", tmp_path / "stack.toml", *ONE_ROW, "--out", tmp_path / "out")
    assert (said.status, said.out) == (2, "") and not (tmp_path / "out").exists()
    assert "map: a cascade: module 'lower' cools the hot face 'middle' of module 'upper'" in said.err
    assert "certify with a --setpoint for every stage" in said.err


def test_a_cascade_is_refused_in_python_too() -> None:
    with pytest.raises(InputError, match="a cascade: module 'lower'"):
        rt.certify.limit_map(cascade(), ambient=[296.15], setpoint=[290.0], load=[0.0], temperature=(263.0, 343.0))


def test_heaters_that_are_off_in_the_map_are_said(run: Run, tmp_path: Path) -> None:
    out, reasons = mapped(run, tmp_path, {"laser": {"limits": (0.0, 4.0)}, "speed": {"gain": 0.0}, "open": {}})
    assert [one["code"] for one in reasons] == ["heaters_off"]
    assert "off in every row: laser (into cold), open (into cold)." in out and "speed" not in out


def test_without_heaters_nothing_is_said_of_them(run: Run, tmp_path: Path) -> None:
    out, reasons = mapped(run, tmp_path, {"speed": {"gain": 0.0}})
    assert reasons == [] and "heaters_off" not in out
