"""Turns per minute and per second: one quantity in every spelling, and units that no table knows."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import robthermal as rt

SPEEDS = np.array([0.0, 1500.1, 4499.9, 997.3, 60.0])
PER_MINUTE = ["rpm", "RPM", "1/min", "min^-1", "min-1", "min⁻¹", "U/min", "r/min", "rev/min"]
PER_SECOND = ["1/s", "s^-1", "s-1", "Hz", "rps", "r/s", "rev/s"]


def machine(unit: str | None = None, gain: float = 0.0) -> rt.System:
    speed = {"lump": "housing", "gain": gain} | ({} if unit is None else {"unit": unit})
    return rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"housing": {"capacity": 400.0}},
                     links=[{"between": ("housing", "room"), "conductance": 0.5}], inputs={"speed": speed},
                     sensors={"T": {"lump": "housing", "noise": 0.5}})


def english(folder: Path, unit: str) -> Path:
    path = folder / "english.csv"
    rows = "".join(f"{2 * k},{value},{20 + 0.1 * k:.1f}\n" for k, value in enumerate(SPEEDS))
    path.write_text(f"time [s],speed [{unit}],T [degC]\n{rows}", encoding="utf-8")
    return path


def german(folder: Path, unit: str) -> Path:
    path = folder / "german.csv"
    rows = "".join(f"{2 * k};{value};{20 + 0.1 * k:.1f}\n".replace(".", ",") for k, value in enumerate(SPEEDS))
    path.write_text(f"Zeit;Drehzahl;T\ns;{unit};°C\n{rows}", encoding="utf-8")
    return path


def read(path: Path, system: rt.System, **choice: object) -> rt.Record:
    header = "Drehzahl" if path.name == "german.csv" else "speed"
    return rt.read_record(path, system, columns={"speed": {"column": header, **choice}})


@pytest.mark.parametrize("own", ["rpm", "1/min", "U/min"])
@pytest.mark.parametrize("unit", PER_MINUTE)
def test_spellings_of_one_unit_keep_the_numbers(tmp_path: Path, unit: str, own: str) -> None:
    for path in (english(tmp_path, unit), german(tmp_path, unit)):
        for gain in (0.0, 0.02):
            record = read(path, machine(own, gain))
            np.testing.assert_array_equal(record["speed"], SPEEDS)
            assert record.units["speed"] == own


@pytest.mark.parametrize("unit", PER_SECOND)
def test_per_second_and_per_minute_are_converted(tmp_path: Path, unit: str) -> None:
    np.testing.assert_allclose(read(english(tmp_path, unit), machine("rpm"))["speed"], 60.0 * SPEEDS, rtol=1e-15)
    np.testing.assert_allclose(read(german(tmp_path, "1/min"), machine(unit))["speed"], SPEEDS / 60.0, rtol=1e-15)


def test_a_declared_unit_may_be_another_spelling_of_that_of_the_file(tmp_path: Path) -> None:
    np.testing.assert_array_equal(read(english(tmp_path, "rpm"), machine("1/min"), unit="1/min")["speed"], SPEEDS)
    with pytest.raises(rt.InputError, match="header says rpm and the declaration Hz"):
        read(english(tmp_path, "rpm"), machine("1/min"), unit="Hz")
    with pytest.raises(rt.InputError, match="header says rpm and the declaration 'l/min'"):
        read(english(tmp_path, "rpm"), machine("l/min"), unit="l/min")


@pytest.mark.parametrize(("header", "name", "unit"), [
    ("speed_rpm", "speed", "rpm"), ("speed 1/min", "speed", "1/min"), ("n U/min", "n", "U/min"), ("f/Hz", "f", "Hz")])
def test_headers_without_brackets(tmp_path: Path, header: str, name: str, unit: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(f"time [s],{header},T [°C]\n0,1,20\n1,2,20.1\n2,3,20.2\n", encoding="utf-8")
    record = rt.read_record(path, inputs=[name], outputs=["T"])
    assert record.units[name] == unit


def test_numbers_of_sensors_are_no_units(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time [s],T s-1,T s-2\n0,20,20\n1,20.1,20\n2,20.2,20\n", encoding="utf-8")
    assert rt.read_record(path, inputs=["T s-2"], outputs=["T s-1"]).output_names == ("T s-1",)


def test_what_is_no_speed_is_refused(tmp_path: Path) -> None:
    path = english(tmp_path, "rpm")
    with pytest.raises(rt.InputError, match="the column is in rpm and .inputs.speed. in %"):
        read(path, machine("%"))
    with pytest.raises(rt.InputError, match='Write unit = "rpm" in .inputs.speed.'):
        read(path, machine(gain=0.02))


def test_every_remedy_of_a_unit_that_is_not_known_reads_the_file(tmp_path: Path) -> None:
    path, system = english(tmp_path, "inch/week"), machine("in/week")
    with pytest.raises(rt.InputError) as refused:
        read(path, system)
    in_system, in_columns = re.findall(r'unit = "([^"]*)"', str(refused.value))
    np.testing.assert_array_equal(read(path, machine(in_system))["speed"], SPEEDS)
    np.testing.assert_array_equal(read(path, system, unit=in_columns)["speed"], SPEEDS)
    with pytest.raises(rt.InputError, match="'yd/week' is not known.*Write unit = \"yd/week\" in .inputs.speed. too"):
        read(path, system, unit="yd/week")
    for one in (machine("yd/week"), machine()):
        np.testing.assert_array_equal(read(path, one, unit="yd/week")["speed"], SPEEDS)


@pytest.mark.parametrize("unit", ["1/min", "l/min"])
def test_the_report_shows_what_the_units_row_says(tmp_path: Path, unit: str) -> None:
    path = german(tmp_path, unit)
    imported = read(path, machine()).imported
    assert imported is not None
    units = {column.column: (column.unit_read, column.unit) for column in imported.columns}
    assert units["Drehzahl"] == (unit, unit) and units["T"] == ("degC", "K")
    assert {column.column: column.unit_read for column in rt.signals.inspect_file(path).columns} == {
        "Zeit": "", "Drehzahl": unit, "T": "degC"}
