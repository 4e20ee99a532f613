"""Thermistors on import: published tables, a circuit worked out by hand, faults that are no readings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

import robthermal as rt
from robthermal.signals import Thermistor

# BetaTherm 10K3A1 (Vishay, Measurement Specialties): coefficients and resistances of its data sheet.
TABLE = {-40.0: 336098.0, 0.0: 32650.8, 25.0: 10000.0, 50.0: 3602.7, 70.0: 1752.0, 100.0: 678.63}
SHEET = {"A": 1.129241e-3, "B": 2.341077e-4, "C": 8.775468e-8}
SYSTEM = rt.System(temperature_unit="degC", ambients={"room": {"temperature": 295.15}},
                   lumps={"bar": {"capacity": 100.0}}, links=[{"between": ("bar", "room"), "conductance": 0.5}],
                   inputs={"heater": {"lump": "bar"}}, sensors={"T": {"lump": "bar", "noise": 0.05}})


def test_steinhart_and_hart_is_the_published_table() -> None:
    found = Thermistor(**SHEET).temperature(list(TABLE.values())) - 273.15
    assert np.abs(found - list(TABLE)).max() < 0.03  # K, as many digits as the table has


def test_the_simple_law_is_the_other_one_between_its_two_points() -> None:
    beta = np.log(TABLE[0.0] / TABLE[50.0]) / (1 / 273.15 - 1 / 323.15)  # the definition of the constant
    simple = Thermistor(r0=TABLE[50.0], t0=50.0, beta=beta)
    assert np.allclose(simple.temperature([TABLE[0.0], TABLE[50.0]]), [273.15, 323.15], atol=1e-9)
    assert abs(simple.temperature(TABLE[25.0]) - 298.15) < 0.5


@pytest.mark.parametrize(("end", "volts"), [("ground", 3.3 / 3), ("supply", 3.3 * 2 / 3)])
def test_a_divider_is_the_law_of_ohm(end: Any, volts: float) -> None:
    # 20 kΩ fixed and 10 kΩ of the thermistor: a third of 3.3 V is across the thermistor, two thirds across the other.
    ntc = Thermistor(r0=10000.0, beta=3950.0, divider=20000.0, full_scale=3.3, thermistor_at=end)
    assert abs(ntc.temperature(volts) - 298.15) < 1e-9


def log(path: Path, cells: list[float], header: str = "NTC [ohm]") -> Path:
    rows = "".join(f"{k},0,{cell:.10g}\n" for k, cell in enumerate(cells))
    path.write_text(f"time,heater,{header}\n{rows}", encoding="utf-8")
    return path


def read(path: Path, thermistor: dict[str, Any], **more: Any) -> rt.Record:
    return rt.read_record(path, SYSTEM, columns={"T": {"column": "NTC", "thermistor": thermistor, **more}}, gaps="fill")


def test_a_column_of_ohms_becomes_kelvin_and_is_said(tmp_path: Path) -> None:
    record = read(log(tmp_path / "a.csv", list(TABLE.values())), SHEET)
    assert np.abs(record["T"] - 273.15 - list(TABLE)).max() < 0.03
    column = next(one for one in record.imported.columns if one.name == "T")
    assert (column.unit_read, column.unit, column.role) == ("ohm", "K", "sensor")
    said = [one["text"] for one in record.imported.actions if one["what"] == "converted"]
    assert any("thermistor with A = 0.00112924" in text for text in said)


def test_kiloohms_have_a_scale(tmp_path: Path) -> None:
    path = log(tmp_path / "k.csv", [cell / 1000.0 for cell in TABLE.values()], "NTC")
    assert np.abs(read(path, SHEET, scale=1000.0)["T"] - 273.15 - list(TABLE)).max() < 0.03


@pytest.mark.filterwarnings("ignore:adc.csv:UserWarning")
def test_an_open_and_a_shorted_thermistor_are_missing_readings(tmp_path: Path) -> None:
    counts = [500.0, 501.0, 1023.0, 503.0, 504.0, 0.0, 506.0, 507.0, 508.0]
    ntc = {"r0": 10000.0, "beta": 3950.0, "divider": 10000.0, "full_scale": 1023.0}
    record = read(log(tmp_path / "adc.csv", counts, "NTC"), ntc)
    faults = [(one["n"], one["lines"]) for one in record.imported.actions if one["what"] == "fault_code"]
    assert faults == [(1, [4]), (1, [7])]
    texts = " ".join(one["text"] for one in record.imported.actions)
    assert "1 reading of an open thermistor, below -55 °C" in texts
    assert "1 reading of a shorted thermistor, above 150 °C" in texts
    good = Thermistor(**ntc).temperature([500.0, 501.0, 502.0, 503.0, 504.0, 505.0, 506.0, 507.0, 508.0])
    assert np.abs(record["T"] - good).max() < 1e-3, "a gap of one sample is filled in the middle of its neighbors"


def test_a_thermistor_that_is_never_connected_is_no_column(tmp_path: Path) -> None:
    ntc = {"r0": 10000.0, "beta": 3950.0, "divider": 10000.0, "full_scale": 1023.0}
    with pytest.raises(rt.InputError, match="holds no value at all"):
        read(log(tmp_path / "open.csv", [1023.0] * 9, "NTC"), ntc)


def test_the_command_line_takes_the_same_table_as_json(tmp_path: Path) -> None:
    text = 'T={"column": "NTC", "thermistor": {"r0": 10000.0, "beta": 3950.0}}'
    _, columns = rt.signals.options_from_text((), [text])
    record = rt.read_record(log(tmp_path / "a.csv", [10000.0, 10000.0, 9000.0]), SYSTEM, columns=columns)
    assert record["T"][0] == 298.15
    with pytest.raises(rt.InputError, match="--column.*JSON"):
        rt.signals.options_from_text((), ["T={column"])


@pytest.mark.parametrize("bad", [
    {}, {"r0": 1e4}, {**SHEET, "r0": 1e4, "beta": 3950.0}, {**SHEET, "beta": 3950.0}, {"A": 1e-3, "B": 2e-4},
    {**SHEET, "B": -1e-4}, {**SHEET, "divider": 1e4}, {**SHEET, "full_scale": 5.0}, {**SHEET, "range": (50.0, 0.0)},
    {"r0": 1e4, "beta": float("nan")}, {**SHEET, "thermistor_at": "roof"}, {**SHEET, "pull_up": 1e4}])
def test_what_is_no_thermistor_is_refused(bad: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(ValidationError):
        Thermistor(**bad)
    with pytest.raises(rt.InputError, match=r"call \[columns\] T|\[columns\] T"):
        read(log(tmp_path / "a.csv", [1e4, 1e4, 1e4]), bad)


@pytest.mark.parametrize(("header", "ntc", "words"), [
    ("NTC [°C]", SHEET, "the column is in degC"), ("NTC [ohm]", {**SHEET, "divider": 1e4, "full_scale": 5.0}, "ohm"),
    ("NTC [A]", SHEET, "the column is in A")])
def test_units_that_are_no_resistance_are_refused(header: str, ntc: dict[str, Any], words: str, tmp_path: Path) -> None:
    with pytest.raises(rt.InputError, match=words):
        read(log(tmp_path / "a.csv", [1e4, 1e4, 1e4], header), ntc)


def test_a_heater_is_no_thermistor(tmp_path: Path) -> None:
    path = log(tmp_path / "a.csv", [1e4, 1e4, 1e4])
    with pytest.raises(rt.InputError, match="'heater' is a heater, and a thermistor is declared"):
        rt.read_record(path, SYSTEM, columns={"T": {"column": "NTC", "thermistor": SHEET},
                                              "heater": {"column": "heater", "thermistor": SHEET}})
