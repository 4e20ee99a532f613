"""What a log does not hold because it never changed, declared; and a time column whose unit alone says what it is."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import robthermal as rt
from robthermal.signals.importing import _text

CELL = """
system = { name = "cell", temperature_unit = "degC" }
ambients.room = { temperature = 20.0 }
lumps = { cold = { capacity = 10.0 }, hot = { capacity = 90.0 } }
links = [{ between = ["hot", "room"], conductance = 0.5 }]
[modules.m1]
cold = "cold"
hot = "hot"
seebeck = { value = 0.05 }
resistance = { value = 3.5 }
conductance = { value = 0.5 }
[inputs.foil]
lump = "cold"
[sensors.T]
lump = "cold"
noise = 0.05
"""
ALL = {"m1": {"constant": 1.5}, "foil": {"constant": 0.0}, "room": {"constant": 24.2}}


def cell(foil: str = "") -> rt.System:
    return rt.thermal.parse_system(CELL.replace("[sensors.T]", foil + "[sensors.T]"))


def logged(folder: Path, time: str = "Tiempo [s]", stamps: Any = range(0, 12, 2), more: str = "") -> Path:
    path = folder / "medicion.csv"
    rows = [f"{k},{stamp},{20.0 - 0.1 * k:.1f}" + more.replace("#", str(k)) for k, stamp in enumerate(stamps)]
    names = "".join(f",other {k}" for k in range(more.count(",")))
    path.write_text("\n".join([f",{time},T [degC]{names}", *rows]) + "\n", encoding="utf-8")
    return path


def read(path: Any, choice: Mapping[str, Any] = ALL, **options: Any) -> rt.Record:
    return rt.read_record(path, cell(), columns=choice, **options)


def test_a_number_stands_for_a_column(tmp_path: Path) -> None:
    record = read(logged(tmp_path))
    assert record.n_samples == 6 and record.sample_time == 2.0
    assert np.all(record["m1"] == 1.5) and np.all(record["foil"] == 0.0)
    np.testing.assert_allclose(record["room"], 297.35)
    assert record.imported is not None
    rows = {column.name: (column.column, column.role) for column in record.imported.columns if column.name}
    assert rows["m1"] == ("m1 = 1.5", "current") and rows["room"] == ("room = 24.2", "ambient")
    assert any(action["text"] == "m1 = 1.5 throughout, as declared" for action in record.imported.actions)


@pytest.mark.parametrize(("name", "constant", "unit", "kept"), [
    ("m1", 1500.0, "mA", 1.5), ("foil", 250.0, "mW", 0.25), ("room", 297.35, "K", 297.35),
    ("room", 24.2, "degC", 297.35),
    ("m1", -0.5, "A", -0.5)])
def test_in_a_unit(tmp_path: Path, name: str, constant: float, unit: str, kept: float) -> None:
    record = read(logged(tmp_path), {**ALL, name: {"constant": constant, "unit": unit}})
    np.testing.assert_allclose(record[name], kept, rtol=1e-14)


def test_a_heater_in_per_cent() -> None:
    frame = pd.DataFrame({"time": [0.0, 1.0, 2.0], "T": [20.0, 20.5, 21.0]})
    record = rt.read_record(frame, cell('unit = "%"\ngain = 0.05\n'), columns={**ALL, "foil": {"constant": 40.0}})
    assert np.all(record["foil"] == 40.0)


def test_in_memory_and_block_by_block_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = logged(tmp_path, stamps=range(0, 400, 2))
    whole = read(path)
    monkeypatch.setattr(_text, "BLOCK", 100)
    small = read(path)
    memory = read(pd.read_csv(path))
    for name in ("m1", "foil", "room", "T"):
        np.testing.assert_array_equal(small[name], whole[name])
        np.testing.assert_array_equal(memory[name], whole[name])
    assert whole.n_samples == small.n_samples == memory.n_samples == 200


def test_from_the_system_file_and_the_command_line(tmp_path: Path) -> None:
    system = rt.thermal.parse_system(CELL + "[columns]\nm1 = { constant = 1.5 }\nfoil = { constant = 0 }\n")
    assert np.all(rt.read_record(logged(tmp_path), system)["m1"] == 1.5)
    _, columns = rt.signals.options_from_text(column=['m1={"constant": 0.5}'])
    assert np.all(rt.read_record(logged(tmp_path), system, columns=columns)["m1"] == 0.5)


@pytest.mark.parametrize(("choice", "words"), [
    ({"T": {"constant": 3.0}}, "'T' is a sensor, and a constant is declared for it"),
    ({"m1": {"constant": 1.0, "scale": 2.0}}, r"\[columns\] m1: a constant has a unit and nothing else"),
    ({"m1": {"constant": 1.0, "column": "I"}}, "a constant has a unit and nothing else"),
    ({"m1": {"unit": "A"}}, "names neither a column nor a constant"),
    ({"m1": {"constant": float("nan")}}, "constant = 'nan'"),
    ({"m1": {"constant": 1.0, "unit": "W"}}, r"the current 'm1' is in \[W\]"),
    ({"m2": {"constant": 1.0}}, "no name of the system"),
    ({"Strom [A]": "m1"}, r"""no name of the system.*The name of the system comes first: m1 = "Strom \[A\]"\."""),
])
def test_what_is_no_constant(tmp_path: Path, choice: Mapping[str, Any], words: str) -> None:
    with pytest.raises(rt.InputError, match=words):
        read(logged(tmp_path), {**ALL, **choice})


def test_a_file_that_has_the_column_is_not_overruled(tmp_path: Path) -> None:
    path = logged(tmp_path, more=",1.5")
    path.write_text(path.read_text(encoding="utf-8").replace("other 0", "m1 [A]"), encoding="utf-8")
    with pytest.raises(rt.InputError, match=r"a constant is declared for 'm1', and there is a column 'm1 \[A\]'"):
        read(path)


def test_by_names_alone(tmp_path: Path) -> None:
    record = rt.read_record(logged(tmp_path), inputs=["I"], outputs=["T"], columns={"I": {"constant": 2, "unit": "A"}})
    assert np.all(record["I"] == 2.0) and record.input_names == ("I",)
    with pytest.raises(rt.InputError, match="'T' is a sensor"):
        rt.read_record(logged(tmp_path), inputs=[], outputs=["T"], columns={"T": {"constant": 2.0}})


def test_a_missing_current_says_how_a_constant_is_written(tmp_path: Path) -> None:
    with pytest.raises(rt.InputError, match=r"m1 = \{ constant = 0.0 \}"):
        read(logged(tmp_path), {"foil": {"constant": 0.0}})


def test_a_room_in_celsius_of_a_machine_in_kelvin_is_caught(tmp_path: Path) -> None:
    system = rt.thermal.parse_system(CELL.replace('"degC"', '"K"').replace("20.0 }", "293.15 }"))
    with pytest.raises(rt.InputError, match="room"):
        rt.read_record(logged(tmp_path), system, columns={**ALL, "room": {"constant": 24.2}})


def test_a_thermocouple_and_a_resistance_thermometer_as_documented() -> None:
    page = (Path(__file__).parents[2] / "docs" / "measured_files.md").read_text(encoding="utf-8")
    lines = [line for line in page.splitlines() if line.startswith(("T1 = { column = \"TC", "T2 = { column = \"Pt100"))]
    assert len(lines) == 2
    tables = tomllib.loads("\n".join(lines))
    frame = pd.DataFrame({"time": [0.0, 1.0, 2.0], "TC K [mV]": [0.0, 1.0, 1.485],
                          "Pt100 [ohm]": [100.0, 107.79, 119.40]})
    system = rt.thermal.parse_system(CELL + '[sensors.T1]\nlump = "cold"\nnoise = 0.1\n[sensors.T2]\nlump = "cold"\n'
                                     'noise = 0.1\n')
    record = rt.read_record(frame, system, columns={**ALL, **tables})
    # Tables of IEC 60584 (2.436 mV at 60 °C less 0.951 mV at 23.8 °C) and IEC 60751.
    assert record["T1"][[0, 2]] - 273.15 == pytest.approx([23.8, 60.0], abs=0.5)
    assert record["T2"] - 273.15 == pytest.approx([0.0, 20.0, 50.0], abs=0.5)


# Time


@pytest.mark.parametrize(("header", "stamps", "step"), [
    ("Tiempo [s]", range(0, 12, 2), 2.0), ("Temps (ms)", range(0, 6000, 1000), 1.0), ("Tempo/min", range(6), 60.0)])
def test_the_only_column_in_a_unit_of_time_that_rises(tmp_path: Path, header: str, stamps: range, step: float) -> None:
    record = read(logged(tmp_path, header, stamps))
    assert record.sample_time == step and record.imported is not None
    assert f"time taken from {header!r}, the only column in a unit of time that rises" in [
        action["text"] for action in record.imported.actions]


def test_another_column_in_seconds_that_does_not_rise_is_none(tmp_path: Path) -> None:
    path = logged(tmp_path, more=",5")
    path.write_text(path.read_text(encoding="utf-8").replace("other 0", "integration [ms]"), encoding="utf-8")
    with pytest.warns(UserWarning, match="not read: 'integration"):
        assert read(path).sample_time == 2.0


@pytest.mark.parametrize(("header", "stamps"), [("Tiempo [s]", [0, 2, 4, 0, 2, 4]), ("Tiempo", range(6))])
def test_what_does_not_say_that_it_is_the_time(tmp_path: Path, header: str, stamps: Any) -> None:
    with pytest.raises(rt.InputError, match="there is no column 'time'") as caught:
        read(logged(tmp_path, header, stamps))
    assert f'time = "{header if "[" in header else "HEADER"}"' in str(caught.value)


def test_two_that_rise_are_a_guess(tmp_path: Path) -> None:
    path = logged(tmp_path, more=",#")
    path.write_text(path.read_text(encoding="utf-8").replace("other 0", "uptime [h]"), encoding="utf-8")
    with pytest.raises(rt.InputError, match="there is no column 'time'"):
        read(path)
    with pytest.warns(UserWarning, match="not read: 'uptime"):
        assert read(path, time="Tiempo [s]").sample_time == 2.0
