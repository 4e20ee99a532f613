"""Heaters whose voltage or current was logged: their power by a resistance, and what does not fit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robthermal as rt

COIL = """
system = { name = "coil", temperature_unit = "degC" }
ambients.water = { temperature = 20.0 }
lumps.coil = { capacity = 300.0 }
links = [{ between = ["coil", "water"], conductance = 5.0 }]
inputs.drive = { lump = "coil" }
sensors.T = { lump = "coil", noise = 0.05 }
"""
CELLS = np.array([0.0, 3.0, -1.5, 2.0, 2.0, 0.5])


def coil(drive: str = "") -> rt.System:
    return rt.thermal.parse_system(COIL.replace('lump = "coil" }\nsensors', f'lump = "coil"{drive} }}\nsensors'))


def logged(folder: Path, unit: str, cells: np.ndarray = CELLS) -> Path:
    path = folder / "log.csv"
    rows = [f"{2 * k},{cell!r},{20.0 + 0.1 * k},20.0" for k, cell in enumerate(cells.tolist())]
    path.write_text("\n".join([f"time,Drive [{unit}],T [degC],water [degC]", *rows]), encoding="utf-8")
    return path


def read(path: Path, choice: Mapping[str, Any], system: rt.System | None = None) -> rt.Record:
    return rt.read_record(path, system or coil(), columns={"drive": {"column": "Drive", **choice}})


@pytest.mark.parametrize(("unit", "power"), [
    ("A", CELLS**2 * 2.5), ("V", CELLS**2 / 2.5), ("mA", (1e-3 * CELLS) ** 2 * 2.5), ("mV", (1e-3 * CELLS) ** 2 / 2.5)])
def test_the_power_of_a_resistance(tmp_path: Path, unit: str, power: np.ndarray) -> None:
    record = read(logged(tmp_path, unit), {"resistance": 2.5})
    np.testing.assert_allclose(record["drive"], power, rtol=1e-14)


def test_scale_and_offset_act_before_it(tmp_path: Path) -> None:
    record = read(logged(tmp_path, "counts", CELLS + 512.0),
                  {"unit": "V", "scale": 0.05, "offset": -25.6, "resistance": 10.0})
    np.testing.assert_allclose(record["drive"], (0.05 * CELLS) ** 2 / 10.0, rtol=1e-9, atol=1e-15)


def test_by_names_alone(tmp_path: Path) -> None:
    record = rt.read_record(logged(tmp_path, "V"), inputs=["drive"], outputs=["T"],
                            columns={"drive": {"column": "Drive", "resistance": 4.0}})
    np.testing.assert_allclose(record["drive"], CELLS**2 / 4.0, rtol=1e-14)


@pytest.mark.parametrize("averaged", [None, "after"])
def test_the_report_says_the_law_and_its_limit_for_means(tmp_path: Path, averaged: str | None) -> None:
    imported = rt.read_record(logged(tmp_path, "V"), coil(), averaged=averaged,
                              columns={"drive": {"column": "Drive", "resistance": 4.0}}).imported
    assert imported is not None
    said = [action["text"] for action in imported.actions if "U² / 4 Ω" in action["text"]]
    assert len(said) == 1 and ("right where it is steady within a step" in said[0]) == (averaged is not None)


@pytest.mark.parametrize("unit", ["A", "V"])
def test_without_a_resistance_the_message_asks_for_it(tmp_path: Path, unit: str) -> None:
    with pytest.raises(rt.InputError, match="resistance"):
        read(logged(tmp_path, unit), {})


@pytest.mark.parametrize(("unit", "choice", "changes", "what"), [
    ("W", {"resistance": 2.5}, "", "the column is in W"),
    ("V", {"resistance": -1.0}, "", "greater than 0"),
    ("V", {"resistance": 2.5}, ', gain = 0.05, unit = "%"', "is in %")])
def test_what_does_not_fit_is_refused(tmp_path: Path, unit: str, choice: Mapping[str, Any], changes: str,
                                      what: str) -> None:
    with pytest.raises(rt.InputError, match=what):
        read(logged(tmp_path, unit), choice, coil(changes))


def test_only_heaters_have_one(tmp_path: Path) -> None:
    with pytest.raises(rt.InputError, match="is a sensor"):
        rt.read_record(logged(tmp_path, "W"), coil(), columns={"drive": "Drive", "T": {"column": "T", "resistance": 1}})
    with pytest.raises(rt.InputError, match="a heater"):
        rt.read_record(logged(tmp_path, "V"), inputs=["water"], outputs=["T"],
                       columns={"T": {"column": "T", "resistance": 1.0}})


@pytest.mark.parametrize(("drive", "unit", "words"), [
    (", limits = [0.0, 4.0]", "W", "reaches 3000 W, 750 times its declared limit of 4 W: this looks like mW"),
    (', gain = 5.0, unit = "V", limits = [0.0, 4.0]', "V", "3000 V, 750 times.* of 4 V: this looks like mV"),
    (', gain = 5.0, unit = "%", limits = [0.0, 4.0]', "%", "3000 %, 750 times.* of 4 %: this looks like another unit")])
def test_thousandths_of_the_unit_are_refused(drive: str, unit: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(rt.InputError, match=words) as refused:
        rt.read_record(logged(tmp_path, unit, np.abs(CELLS) * 1000.0), coil(drive),
                       columns={"drive": {"column": "Drive"}})
    assert "or correct limits in [inputs.drive]" in str(refused.value)


def test_a_misread_cell_of_a_heater_is_said_and_not_refused(tmp_path: Path) -> None:
    cells = np.where(np.arange(len(CELLS)) == 3, 3000.0, np.abs(CELLS))
    with pytest.warns(UserWarning, match="'drive' lies outside its declared limits 0 ... 4 in 1 of 6 rows"):
        rt.read_record(logged(tmp_path, "W", cells), coil(", limits = [0.0, 4.0]"),
                       columns={"drive": {"column": "Drive"}})
