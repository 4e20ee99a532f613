"""Heaters logged as on and off, in words: programs in Python write True and False, controllers of plants ON and OFF."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import robthermal as rt

BOX = """
system = { name = "box", temperature_unit = "degC" }
ambients.room = { temperature = 20.0 }
lumps.box = { capacity = 300.0 }
links = [{ between = ["box", "room"], conductance = 1.0 }]
inputs.heat = { lump = "box" }
sensors.T = { lump = "box", noise = 0.05 }
"""
STATES = [True, True, False, True, False, False]
ON = np.array(STATES, float)


def box(heat: str = "") -> rt.System:
    return rt.thermal.parse_system(BOX.replace('lump = "box" }\nsensors', f'lump = "box"{heat} }}\nsensors'))


def logged(folder: Path, words: tuple[str, str], column: str = "heater_on") -> Path:
    path = folder / "log.csv"
    rows = [f"{3 * k},{words[state]},{20.0 + 0.1 * k},20.0" for k, state in enumerate(STATES)]
    path.write_text("\n".join([f"time [s],{column},T,room", *rows]), encoding="utf-8")
    return path


DECLARED = {"heat": {"column": "heater_on", "scale": 120.0}}


@pytest.mark.parametrize("words", [("False", "True"), ("false", "true"), ("OFF", "ON"), ("off", "on"), ("Off", "On")])
def test_words_are_the_power_that_on_was_declared_to_be(tmp_path: Path, words: tuple[str, str]) -> None:
    record = rt.read_record(logged(tmp_path, words), box(), columns=DECLARED)
    assert record["heat"].tolist() == (120.0 * ON).tolist()
    assert "True and on taken as 1, False and off as 0" in str(record.imported)


def test_a_frame_of_truth_values(tmp_path: Path) -> None:
    frame = pd.DataFrame({"time [s]": 3.0 * np.arange(6), "heater_on": STATES, "T": 20.0, "room": 20.0})
    frame["T"] += 0.1 * np.arange(6)
    record = rt.read_record(frame, box(), columns=DECLARED)
    assert record["heat"].tolist() == (120.0 * ON).tolist()


def test_on_is_not_one_per_cent(tmp_path: Path) -> None:
    system, path = box(', unit = "%", gain = 1.2'), logged(tmp_path, ("off", "on"), "heat")
    with pytest.raises(rt.InputError, match="scale = \\(% when on\\)"):
        rt.read_record(path, system)
    record = rt.read_record(path, system, columns={"heat": {"column": "heat", "scale": 100.0}})
    assert record["heat"].tolist() == (100.0 * ON).tolist()


def test_on_without_a_power_is_refused_with_what_to_write(tmp_path: Path) -> None:
    """As a number True was refused with the advice to take False for a missing reading."""
    with pytest.raises(rt.InputError, match="6 such cells") as said:
        rt.read_record(logged(tmp_path, ("False", "True")), box(), columns={"heat": "heater_on"})
    assert 'heat = { column = "heater_on", scale = (W when on) }' in str(said.value)
    assert "missing" not in str(said.value)


def test_a_thermometer_that_is_off_is_not_at_zero(tmp_path: Path) -> None:
    path = logged(tmp_path, ("False", "True"))
    text = path.read_text(encoding="utf-8").replace("20.2,", "off,").replace("False", "0").replace("True", "1")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(rt.InputError, match="'off' is not a number"):
        rt.read_record(path, box(), columns=DECLARED)


def test_other_words_are_still_refused(tmp_path: Path) -> None:
    with pytest.raises(rt.InputError, match="'heating' is not a number"):
        rt.read_record(logged(tmp_path, ("off", "heating")), box(), columns=DECLARED)
