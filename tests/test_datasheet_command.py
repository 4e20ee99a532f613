"""`robthermal datasheet`: sheets typed, read and compared; what it prints, writes and refuses."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest
from commands import Run

import robthermal as rt

ONE = "Th=27, Vmax=15.5, Imax=3.9, dTmax=70, Qmax=32"
TWO = ("Th=27, Vmax=14.3, Imax=4.4, dTmax=60, Qmax=37.7", "Th=50, Vmax=15.5, Imax=4300 mA, dTmax=64 K, Qmax=40.6 W")
CSV = ("name,Th_C,Vmax_V,Imax_A,Qmax_W,dTmax_K,source\n"
       "A,27,14.3,4.4,37.7,60,x\nA,50,15.5,4.3,40.6,64,x\nB,25,15.4,3.0,,67,y\n")


def both(columns: tuple[str, ...]) -> list[str]:
    return [word for column in columns for word in ("--rating", column)]


def test_two_typed_columns_make_a_table_that_a_system_file_takes(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "module.toml"
    said = run("datasheet", *both(TWO), "--name", "m1", "--out", str(out))
    assert said.status == 0 and "dTmax [%]" in said.out and "-10.1" in said.out and said.err == ""
    system = rt.thermal.parse_system(
        '[system]\ntemperature_unit = "degC"\n[ambients.room]\ntemperature = 25.0\n[lumps.hot]\ncapacity = 5.0\n'
        '[lumps.cold]\ncapacity = 5.0\n[[links]]\nbetween = ["hot", "room"]\nconductance = 2.0\n'
        + out.read_text(encoding="utf-8"))
    module = system.modules["m1"]
    assert module.resistance.slope == pytest.approx(0.01383, rel=1e-3) and module.current_limits is None
    for t_hot, v_max, i_max, dt_max in ((300.15, 14.3, 4.4, 60.0), (323.15, 15.5, 4.3, 64.0)):
        rated = rt.thermal.Properties.of(module).rated(t_hot)
        assert (rated.v_max, rated.i_max, rated.dt_max) == pytest.approx((v_max, i_max, dt_max), rel=1e-9)


def test_sheets_are_compared_at_an_operating_point(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "sheets.csv"
    path.write_text(CSV, encoding="utf-8")
    said = run("datasheet", str(path), "TM 127-1.4-4.0", "--cold", "10", "--ambient", "25", "--load", "8", "--sink",
               "0.4", "--json")
    found = json.loads(said.out)
    assert said.status == 0 and [one["name"] for one in found["modules"]] == ["A", "B", "TM 127-1.4-4.0"]
    assert [len(one["ratings"]) for one in found["modules"]] == [2, 1, 1]
    assert found["modules"][1]["heat"] is None and found["modules"][1]["outcome"]["code"] == "unchecked"
    for one in found["modules"]:
        point = one["point"]
        assert point["outcome"]["ok"] and point["load"] == pytest.approx(8.0, abs=1e-6)
        assert point["hot"] == pytest.approx(298.15 + 0.4 * point["rejected"], abs=1e-6)
        assert point["cop"] == pytest.approx(8.0 / point["power"], rel=1e-6) and one["largest_sink"] > 0.4


@pytest.mark.parametrize(("options", "status"), [
    (["--hot", "40", "--cold", "10", "--load", "5"], 0), (["--hot", "40", "--cold", "10", "--current", "2"], 0),
    (["--hot", "40", "--cold", "10", "--load", "90"], 1), (["--ambient", "25", "--cold", "10", "--load", "8"], 0),
    (["--ambient", "25", "--cold", "10", "--load", "8", "--sink", "5"], 1), (["--basis", "heat"], 0),
])
def test_status_says_whether_the_point_is_held(run: Run, options: list[str], status: int) -> None:
    said = run("datasheet", "--rating", ONE, *options)
    assert said.status == status and ("are wanted" in said.out or "hold" in said.out.split("K/W")[-1]) >= (status == 1)
    assert "S [V/K]" in said.out


@pytest.mark.parametrize(("arguments", "message"), [
    ([], "no datasheet is given.*--rating 'Th=27"), (["TM 12"], "there is no datasheet 'TM 12'.*TM 127-1.4-4.0"),
    (["no.csv"], "no.csv: there is no such file"),
    (["--rating", "Th=300, Vmax=15.5, Imax=3.9, dTmax=70"], "looks like kelvin.*Th=300K"),
    (["--rating", "Th=27K, Vmax=15.5, Imax=3.9, dTmax=70"], "looks like degrees Celsius.*without K"),
    (["--rating", "Th=27, Vmax=15.5, Imax=3900, dTmax=70"], "--rating, Imax: .*milliampere"),
    (["--rating", "Th=27, Vmax=15.5, Imax=39, dTmax=70, Qmax=32"], "--rating, Qmax: .*Vmax · Imax"),
    (["--rating", "Th=27, Vmax=15.5, Imax=3.9, dTmax=149"], "--rating, dTmax: .*Fahrenheit"),
    (["--rating", "Th=27, Vmax=15.5, Imax=3.9"], "dTmax is missing"),
    (["--rating", "Th=27, Vmax=15.5, Imax=3.9, dTmax=70, Vmax=16"], "Vmax is given twice"),
    (["--rating", "Th=27, Vmax=15.5, Imax=3.9 kA, dTmax=70"], "unit 'kA'.*A, mA"),
    (["--rating", "Th=27, Umax=15.5, Imax=3.9, dTmax=70"], "'Umax=15.5' is no rated value"),
    (["--rating", ONE, "--load", "3"], "without the cold face"),
    (["--rating", ONE, "--cold", "283", "--hot", "40", "--load", "3"], "--cold: 283 °C.*kelvin"),
    (["--rating", ONE, "--cold", "10", "--load", "3"], "neither a hot side nor an ambient"),
    (["--rating", ONE, "--cold", "10", "--hot", "40"], "neither a load nor a current"),
    (["--rating", ONE, "--cold", "10", "--hot", "40", "--load", "3", "--sink", "1"], "--sink: a sink needs"),
    (["--rating", ONE, "--cold", "10", "--ambient", "25", "--current", "3"], "a sink is sized for a load"),
    (["--rating", ONE, "--basis", "power"], '--basis.*"voltage" or "heat"'),
    (["TEC1-12706 class", "--basis", "heat"], "TEC1-12706 class.*needs Qmax"),
    (["--rating", ONE, "--rating", ONE], "within 5 K"), (["--rating", ONE, "--cold", "30", "--ambient", "25", "--load",
                                                          "3"], "not below the ambient"),
])
def test_bad_input_is_one_message(run: Run, tmp_path: Path, arguments: list[str], message: str) -> None:
    out = tmp_path / "module.toml"
    said = run("datasheet", *arguments, "--out", str(out))
    assert said.status == 2 and said.out == "" and not out.exists()
    assert re.search(message, said.err, re.S) and "Traceback" not in said.err
    assert len(said.err) <= 700


@pytest.mark.parametrize(("text", "message"), [
    ("name,Th_C,Vmax_V,Imax_A\nA,27,14,4\n", "no column 'dTmax_K'"),
    ("name,Th_C,Vmax_V,Imax_A,dTmax_K\n", "has no row"),
    (CSV.replace("14.3", "about 14"), r"line 2 \(A\).*Vmax_V is 'about 14'"),
    (CSV.replace("50,15.5,4.3", "50,15.5,4300"), "line 3.*Imax"),
    ("\0\0", "no column 'name'|not a table"),
])
def test_damaged_sheets_are_refused(run: Run, tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "sheets.csv"
    path.write_text(text, encoding="utf-8")
    said = run("datasheet", str(path))
    assert said.status == 2 and re.search(message, said.err, re.S)


def test_names_that_need_quotes_are_quoted(tmp_path: Path) -> None:
    sheets = rt.jobs.read_sheets(["TM 127-1.4-4.0"])
    rt.jobs.write_modules(rt.jobs.compare_modules(sheets), tmp_path / "m.toml")
    table = tomllib.loads((tmp_path / "m.toml").read_text(encoding="utf-8"))["modules"]["TM 127-1.4-4.0"]
    assert table["reference_temperature"] == -8.0 and table["seebeck"]["value"] == pytest.approx(15.5 / 300.15)


@pytest.mark.parametrize(("current", "notes"), [
    ("2", []), ("18.72", ["18.72 A are 4.8 times the Imax of the sheet, 3.9 A", "The load is negative: the cold face"]),
    ("-2", ["The load is negative"])])
def test_a_current_beyond_the_sheet_and_a_negative_load_are_said(run: Run, current: str, notes: list[str]) -> None:
    point = ("datasheet", "--rating", ONE, "--cold", "10", "--hot", "40", "--current", current)
    said, found = run(*point), json.loads(run(*point, "--json").out)["modules"][0]
    assert said.status == 0 and len(found["notes"]) == len(notes)
    assert all(one.startswith(note) for one, note in zip(found["notes"], notes, strict=True))
    assert all(one in said.out for one in found["notes"]) and ("Imax of the sheet" in said.out) == (current == "18.72")
    assert not notes or f"gives off {-found['point']['load']:.4g} W, nothing is cooled" in found["notes"][-1]
