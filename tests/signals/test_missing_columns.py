"""A column that a file lacks: only what may be it is proposed, and what is proposed reads the file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import robthermal as rt

MOTOR = """
[system]
temperature_unit = "degC"
[ambients.room]
temperature = 21.0
[lumps.winding]
capacity = 260.0
[lumps.head]
capacity = 180.0
[[links]]
between = ["winding", "head"]
conductance = 2.0
[[links]]
between = ["head", "room"]
conductance = 1.0
[inputs.copper]
lump = "winding"
[inputs.speed]
lump = "head"
gain = 0.0
unit = "1/min"
[sensors.T_wick]
lump = "winding"
[sensors.T_kopf]
lump = "head"
[columns]
copper = { column = "Strom", resistance = 2.2 }
speed = "Drehzahl"
T_wick = "T Wicklung"
T_kopf = "T Kopf"
"""
GERMAN = {"Zeit": "s", "Strom": "A", "Drehzahl": "1/min", "T Wicklung": "°C", "T Kopf": "°C"}
CELLS = dict(zip(GERMAN, ["{}", "2.0", "1500", "25.{}", "24.{}"], strict=True))


def german(folder: Path, *without: str) -> Path:
    kept = [header for header in GERMAN if header not in without]
    rows = [";".join(CELLS[header].format(k) for header in kept) for k in range(8)]
    path = folder / "german.csv"
    path.write_text("\n".join([";".join(kept), ";".join(GERMAN[header] for header in kept), *rows]), encoding="utf-8")
    return path


def english(folder: Path, headers: str = "T_head [degC],T_winding [degC],n [rpm],I_rms [A],torque [Nm]") -> Path:
    path = folder / "english.csv"
    n = headers.count(",") + 1
    rows = [",".join([str(2 * k), *(["24.5"] * (n - 3)), "1500", "2.0", "0.1"]) for k in range(8)]
    path.write_text("\n".join([f"timestamp [s],{headers}", *rows]), encoding="utf-8")
    return path


def said(path: Path, text: str = MOTOR, columns: list[str] | None = None) -> str:
    _, own = rt.signals.options_from_text([], columns or [])
    with pytest.raises(rt.InputError) as refused:
        rt.read_record(path, rt.thermal.parse_system(text), columns=own)
    assert len(str(refused.value)) <= 600
    return str(refused.value)


def proposed(message: str) -> str:
    found = re.search(r"Write --column '(.*?)' \(or", message)
    assert found is not None, message
    return found[1]


def test_a_current_is_proposed_for_a_current_with_its_resistance_until_the_file_is_read(tmp_path: Path) -> None:
    path = english(tmp_path)
    first = said(path)
    assert proposed(first) == 'copper={"column": "I_rms [A]", "resistance": 2.2}'
    assert 'project file, each with its own, { file = "english.csv", columns' in first
    assert "--column is for all files" in first
    second = said(path, columns=[proposed(first)])
    assert proposed(second) == "speed=n [rpm]"
    third = said(path, columns=[proposed(first), proposed(second)])
    assert proposed(third) == "T_wick=HEADER" and "one of: 'T_head [degC]', 'T_winding [degC]', 'torque" in third
    near = said(path, columns=[proposed(first), proposed(second), "T_wick=T_winding_1"])
    assert proposed(near) == "T_wick=T_winding [degC]" and "Did you mean 'T_winding'" in near
    last = [proposed(first), proposed(second), proposed(near)]
    assert proposed(said(path, columns=last)) == "T_kopf=HEADER"
    _, columns = rt.signals.options_from_text([], [*last, "T_kopf=T_head"])
    record = rt.read_record(path, rt.thermal.parse_system(MOTOR), columns=columns)
    np.testing.assert_allclose(record["copper"], 8.8)
    np.testing.assert_array_equal(record["speed"], 1500.0)


def test_a_column_that_another_name_has_is_not_proposed(tmp_path: Path) -> None:
    message = said(german(tmp_path, "T Kopf"))
    assert "no column 'T Kopf', declared for 'T_kopf' (sensor)" in message
    assert "Every column has a name already" in message and "--column '" not in message
    assert "A file without this sensor is read if T_kopf is not in [columns]" in message
    without = rt.thermal.parse_system(MOTOR.replace('T_kopf = "T Kopf"\n', ""))
    assert rt.read_record(german(tmp_path, "T Kopf"), without).output_names == ("T_wick",)


def test_names_of_the_system_in_the_file_are_theirs(tmp_path: Path) -> None:
    path = english(tmp_path, "T_kopf [degC],T_wick [degC],n [rpm],I_mot [A],torque [Nm]")
    message = said(path, columns=["speed=n"])
    assert proposed(message).startswith('copper={"column": "I_mot [A]"') and "T_wick [degC]" not in message
    now = said(path, columns=["speed=n", proposed(message)])
    assert proposed(now) == "T_wick=T_wick [degC]"


def test_an_ambient_is_not_taken_for_a_torque_by_its_name(tmp_path: Path) -> None:
    """'rom [A]' is nearly 'room', and a current."""
    path = german(tmp_path)
    text = path.read_text(encoding="utf-8").replace("T Kopf", "rom").replace("°C;°C", "°C;A")
    path.write_text(text, encoding="utf-8")
    with pytest.warns(UserWarning, match="not read: 'rom'"):
        record = rt.read_record(path, rt.thermal.parse_system(MOTOR.replace('T_kopf = "T Kopf"\n', "")))
    assert record.output_names == ("T_wick",)


def test_a_table_in_memory_has_no_project_file() -> None:
    with pytest.raises(rt.InputError) as refused:
        rt.read_record({"time": [0.0, 1.0, 2.0], "u": [0.0, 0.0, 1.0], "x": [300.0, 300.1, 300.2]}, inputs=["u"],
                       outputs=["T"], columns={"T": "NTC"})
    assert "project file" not in str(refused.value) and proposed(str(refused.value)) == "T=x"
