"""What loggers write where a thermometer is broken is no reading, and what a furnace or a cryostat reads is no code."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import robthermal as rt

CODES = [850.0, 999.0, 999.9, 1000.0, 1370.0, 1372.0, 3276.7, 6553.5, 9999.0, 32767.0,
         -127.0, -200.0, -242.02, -250.0, -270.0, -273.1, -273.15, -300.0, -999.9, -9999.0]
WARM = [round(30.0 + 0.1 * k, 1) for k in range(40)]


@pytest.fixture
def machine() -> rt.System:
    return rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"plate": {"capacity": 400.0}},
                     links=[{"between": ("plate", "room"), "conductance": 0.5}],
                     inputs={"speed": {"lump": "plate", "gain": 0.0, "unit": "rpm"}},
                     sensors={"T": {"lump": "plate", "noise": 0.5}})


def log(folder: Path, readings: list[float], header: str = "T [°C]", speed: float = 1500.0) -> Path:
    path = folder / "run.csv"
    rows = "".join(f"{10 * k},{T},{speed}\n" for k, T in enumerate(readings))
    path.write_text(f"time [s],{header},speed [rpm]\n{rows}", encoding="utf-8")
    return path


def spoilt(code: float, rows: list[int]) -> list[float]:
    return [code if k in rows else T for k, T in enumerate(WARM)]


def declared(error: str) -> list[float]:
    """What the message says to write."""
    line = re.search(r"missing = \[[^]]*\]", error)
    assert line is not None, error
    return list(tomllib.loads(line[0])["missing"])


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("rows", [[7], [7, 8, 30], [36, 37, 38, 39], [0, 1, 2]], ids=["one", "some", "end", "start"])
def test_a_code_of_a_broken_thermometer_is_refused_and_the_remedy_reads_the_log(
        tmp_path: Path, machine: rt.System, code: float, rows: list[int]) -> None:
    path = log(tmp_path, spoilt(code, rows))
    for hottest in (None, 40000.0):
        with pytest.raises(rt.InputError, match=rf"{code:g}.*like a fault code \({len(rows)} such cells\)") as refused:
            rt.read_records(path, machine, hottest=hottest)
    missing = declared(str(refused.value))
    assert missing == [code]
    parts = rt.read_records(path, machine, missing=missing)
    np.testing.assert_allclose(np.concatenate([part["T"] for part in parts]),
                               [T + 273.15 for k, T in enumerate(WARM) if k not in rows])


@pytest.mark.parametrize(("header", "code"), [("T [K]", 1123.15), ("T [°F]", 1562.0), ("T [°F]", -328.0)])
def test_ends_of_ranges_are_told_in_every_unit(tmp_path: Path, machine: rt.System, header: str, code: float) -> None:
    zero = 273.15 if "K" in header else 0.0
    path = log(tmp_path, [code if k == 9 else zero + T for k, T in enumerate(WARM)], header)
    with pytest.raises(rt.InputError, match="jumps there and back, like a fault code") as refused:
        rt.read_record(path, machine)
    assert declared(str(refused.value)) == [code]


def test_codes_of_tenths_of_a_degree_are_told_as_they_stand_in_the_file(tmp_path: Path, machine: rt.System) -> None:
    path = log(tmp_path, [-2000 if k == 9 else 10 * T for k, T in enumerate(WARM)], "raw")
    columns = {"T": {"column": "raw", "unit": "degC", "scale": 0.1}}
    with pytest.raises(rt.InputError, match="-2000 jumps there and back") as refused:
        rt.read_record(path, machine, columns=columns)
    assert declared(str(refused.value)) == [-2000.0]


def test_several_codes_are_proposed_together_beside_those_declared(tmp_path: Path, machine: rt.System) -> None:
    readings = [{5: 850.0, 9: -200.0, 20: -127.0}.get(k, T) for k, T in enumerate(WARM)]
    with pytest.raises(rt.InputError, match="850 jumps.*2 such cells") as refused:
        rt.read_records(log(tmp_path, readings), machine, missing=(-127.0, "OL"))
    assert declared(str(refused.value)) == [-127.0, "OL", -200.0, 850.0]


def test_a_thermometer_that_is_not_connected_says_so(tmp_path: Path, machine: rt.System) -> None:
    for code in (-127.0, -200.0, -242.02, 32767.0):
        with pytest.raises(rt.InputError, match=f"{code:g} stands in every row.*leave 'T' out"):
            rt.read_record(log(tmp_path, [code] * 20), machine)


def test_another_value_that_is_too_hot_in_few_rows_may_be_a_code_too(tmp_path: Path, machine: rt.System) -> None:
    with pytest.raises(rt.InputError, match="looks like kelvin") as refused:
        rt.read_record(log(tmp_path, spoilt(777.0, [5, 6])), machine)
    assert declared(str(refused.value)) == [777.0]
    with pytest.raises(rt.InputError, match="looks like kelvin") as refused:
        rt.read_record(log(tmp_path, [T + 273.1 for T in WARM]), machine)
    assert "missing" not in str(refused.value)


RISE = [21.0, 60.0, 110.0, 160.0, 205.0, 255.0, 330.0, 400.0, 520.0, 600.0, 680.0, 760.0]
FURNACES = {
    "holds a set-point": [*RISE, 820.0, 850.0, 850.0, 851.0, 850.0, 849.0, 850.0],
    "passes it": [*RISE, 850.0, 930.0, 999.0, 1000.0, 1060.0, 1000.0, 935.0],
    "ends at it": [*RISE, 800.0, 850.0, 850.0, 850.0],
    "begins at it, quenched": [1000.0, 1000.0, 1000.0, 905.0, 810.0, 720.0, *reversed(RISE[:-1])],
}


@pytest.mark.parametrize("readings", FURNACES.values(), ids=FURNACES)
def test_a_furnace_reads_what_is_a_code_elsewhere(tmp_path: Path, machine: rt.System, readings: list[float]) -> None:
    record = rt.read_record(log(tmp_path, readings), machine)
    np.testing.assert_allclose(record["T"], np.array(readings) + 273.15)


def test_a_cryostat_gets_there_row_by_row(tmp_path: Path, machine: rt.System) -> None:
    readings = np.round(np.concatenate([np.linspace(20.0, -262.0, 60), [-262.1, -262.0, -262.2]]), 1).tolist()
    for one in (readings, readings[::-1], readings[-20:]):
        record = rt.read_record(log(tmp_path, one), machine)
        np.testing.assert_allclose(record["T"], np.array(one) + 273.15)


@pytest.mark.parametrize("speed", [-200.0, 850.0, 999.9, 1372.0])
def test_other_columns_may_have_such_numbers(tmp_path: Path, machine: rt.System, speed: float) -> None:
    assert rt.read_record(log(tmp_path, WARM, speed=speed), machine)["speed"].max() == speed
