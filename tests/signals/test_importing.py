"""Logger files as they come: what is understood, said and refused (docs/explanations/signals.md)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import robthermal as rt
from robthermal import InputError

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")
N = 60


@pytest.fixture
def stage() -> Any:
    return rt.System(
        temperature_unit="degC",
        ambients={"room": {"temperature": 296.15}},
        lumps={"cold": {"capacity": 20.0}, "hot": {"capacity": 80.0}},
        links=[{"between": ("cold", "room"), "conductance": 0.1}, {"between": ("hot", "room"), "conductance": 1.0}],
        inputs={"heater": {"lump": "cold", "limits": (0.0, 5.0)}},
        sensors={"T1": {"lump": "cold"}},
        modules={
            "m1": {
                "hot": "hot",
                "cold": "cold",
                "seebeck": {"value": 0.05},
                "resistance": {"value": 2.0},
                "conductance": {"value": 0.5},
                "reference_temperature": 298.15,
                "current_limits": (-6.0, 6.0),
            }
        },
    )


def rows(line: Any, n: int = N, skip: tuple[int, ...] = ()) -> str:
    return "".join(line(k) + "\n" for k in range(n) if k not in skip)


def plain(k: int) -> str:
    return f"{k},{20 + 0.01 * k:.2f},0.5,1"


HEADER = "time,T1,m1,heater\n"


def adds_up(record: rt.Record) -> bool:
    imported = record.imported
    assert imported is not None
    lost = sum(action["rows"] for action in imported.actions)
    return bool(imported.rows["used"] + lost == imported.rows["file"])


def test_a_german_windows_logger(tmp_path: Path, stage: Any) -> None:
    def line(k: int) -> str:
        return f"01.03.2024 10:{k // 60:02d}:{k % 60:02d};{20 + 0.01 * k:.2f};1500;250;23,1;".replace(
            ".", ",", 0
        ).replace("20.", "20,")

    text = "Messgerät XY\nSerie 12\n\nDatum/Zeit;NTC 1 [°C];I_TEC_mA;Heizer [mW];Raum (°C);\n" + rows(line)
    path = tmp_path / "log.txt"
    path.write_bytes(text.replace("\n", "\r\n").encode("cp1252"))
    record = rt.read_record(path, stage, columns={"T1": "NTC 1", "m1": "I_TEC", "heater": "Heizer", "room": "Raum"})
    assert (record.sample_time, record.start_time, record.n_samples) == (1.0, 0.0, N)
    np.testing.assert_allclose(record["T1"], 293.15 + 0.01 * np.arange(N), rtol=1e-12)
    assert record["m1"][0] == 1.5 and record["heater"][0] == 0.25 and record["room"][0] == pytest.approx(296.25)
    imported = record.imported
    assert imported is not None
    assert (imported.encoding, imported.delimiter, imported.decimal, imported.header_line) == ("cp1252", ";", ",", 4)
    assert imported.time["origin"] == "2024-03-01T10:00:00"
    assert {action["what"] for action in imported.actions} == {
        "decoded",
        "skipped",
        "mapped",
        "converted",
        "dropped_column",
    }
    assert adds_up(record) and json.loads(json.dumps(imported.to_dict()))["format"] == "robthermal-import/1"
    assert "NTC 1" in str(imported) and "cp1252" in str(imported)


@pytest.mark.parametrize(
    ("stamp", "options", "origin"),
    [
        (lambda k: f"2024-03-01T10:00:{k:02d}Z", {}, "2024-03-01T10:00:00+00:00"),
        (lambda k: f"2024-03-01 10:00:{k:02d}.250+02:00", {}, "2024-03-01T08:00:00.250000+00:00"),
        (lambda k: f"21/03/2024 10:00:{k:02d}", {}, "2024-03-21T10:00:00"),
        (lambda k: f"3/21/2024 10:00:{k:02d} PM", {}, "2024-03-21T22:00:00"),
        (lambda k: f"1/3/2024 10:00:{k:02d}", {"time_format": "%d/%m/%Y %H:%M:%S"}, "2024-03-01T10:00:00"),
        (lambda k: f"1/3/2024 10:00:{k:02d}.250", {"time_format": "%d/%m/%Y %H:%M:%S"}, "2024-03-01T10:00:00.250000"),
        (lambda k: f"{1709287200 + k}", {}, "2024-03-01T10:00:00+00:00"),
        (lambda k: f"{1709287200000 + 1000 * k}", {}, "2024-03-01T10:00:00+00:00"),
        (lambda k: f"{k} sec", {}, None),
        (lambda k: f"0:{k // 60:02d}:{k % 60:02d}", {}, None),
        (lambda k: f"{k / 60:.9f}", {"time_format": "min"}, None),
        (lambda k: f"{45352 + 0.25 + k / 86400:.9f}", {"time_format": "excel"}, "2024-03-01T06:00:00"),
    ],
)
def test_stamps(tmp_path: Path, stage: Any, stamp: Any, options: dict[str, Any], origin: str | None) -> None:
    path = tmp_path / "run.csv"
    path.write_text(HEADER + rows(lambda k: f"{stamp(k)},{20 + 0.01 * k:.2f},0.5,1"))
    record = rt.read_record(path, stage, **options)
    assert (record.sample_time, record.n_samples, record.start_time) == (1.0, N, 0.0)
    assert record.imported is not None and record.imported.time["origin"] == origin


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        (
            HEADER + rows(lambda k: f"1/3/2024 10:00:{k:02d},20,0,1"),
            {},
            r'time_format = "%d/%m/%Y %H:%M:%S"  or  "%m/%d/%Y',
        ),
        (HEADER + rows(lambda k: f"yesterday {k},20,0,1"), {}, "is no time that is known"),
        (
            HEADER + rows(plain).replace("\n30,20.30,", "\n30,-127,"),
            {},
            "line 32, column 'T1': -127 jumps.*missing = \\[-127\\]",
        ),
        (HEADER + rows(plain).replace("\n30,", "\n29,"), {}, 'stands twice, with other values.*duplicates = "first"'),
        (HEADER + rows(plain) + rows(plain), {}, 'runs backward.*restarts = "split"'),
        (HEADER + rows(plain, skip=(30, 31)), {"gaps": "refuse"}, "2 samples are missing.*gaps = "),
        (HEADER + rows(plain, skip=(30, 31)), {}, "falls into 2 parts.*read_records"),
        (
            HEADER + rows(lambda k: f"{k + 0.35 * (k == 20)},20,0,1"),
            {},
            "line 2[12]: .*deviate by up to 35 %.*jitter = 0.3",
        ),
        (HEADER.replace("heater", "heater [%]") + rows(plain), {}, r'unit = "%" in \[inputs.heater\]'),
        (HEADER.replace("T1", "T1 [K]") + rows(plain), {}, "looks like Celsius"),
        (HEADER.replace("T1", "t1").replace("m1", "T1x") + rows(plain), {}, "no column 'm1'"),
        (HEADER.replace("heater", "t1") + rows(plain), {}, "no column 'heater'"),
        (
            "a\n" + HEADER + rows(plain) + "x,y,z,w\n" + rows(plain),
            {"restarts": "split"},
            "could all be the header.*header_line = 2",
        ),
    ],
)
def test_what_would_be_a_guess_is_refused(
    tmp_path: Path, stage: Any, text: str, options: dict[str, Any], message: str
) -> None:
    path = tmp_path / "run.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        rt.read_record(path, stage, **options)
    assert len(str(caught.value)) <= 600


def test_gaps_split_or_are_filled(tmp_path: Path, stage: Any) -> None:
    path = tmp_path / "run.csv"
    path.write_text(
        HEADER + rows(plain, skip=(10, 11)).replace("\n30,20.30,", "\n30,OL,").replace("\n40,20.40,0.5", "\n40,20.40,")
    )
    parts = rt.read_records(path, stage)
    assert [(part.start_time, part.n_samples) for part in parts] == [(0.0, 10), (12.0, 18), (31.0, 9), (41.0, 19)]
    assert all(adds_up(part) for part in parts)
    filled = rt.read_records(path, stage, gaps="fill")
    assert [(part.start_time, part.n_samples) for part in filled] == [(0.0, 40), (41.0, 19)]  # no current is invented
    np.testing.assert_allclose(filled[0]["T1"], 293.15 + 0.01 * np.arange(40), rtol=1e-9)
    assert all(adds_up(part) for part in filled)
    assert [part.n_samples for part in rt.read_records(path, stage, shortest=15)] == [18, 19]


def test_rows_that_could_be_interpolated_are_said_to_be_once(tmp_path: Path, stage: Any) -> None:
    path = tmp_path / "run.csv"
    path.write_text(HEADER + rows(plain, skip=(10, 20, 21, 40, 41, 42, 43)))
    said = [one["text"] for one in rt.read_records(path, stage)[0].imported.actions if one["what"] == "split"]
    assert len(said) == 3 and ["gaps=fill" in text for text in said] == [True, False, False]
    path.write_text(HEADER + rows(plain, skip=(40, 41, 42, 43)))  # more than are interpolated
    (text,) = [one["text"] for one in rt.read_records(path, stage)[0].imported.actions if one["what"] == "split"]
    assert "gaps=fill" not in text


def test_inputs_that_change_across_a_gap_are_not_filled(tmp_path: Path, stage: Any) -> None:
    path = tmp_path / "run.csv"
    path.write_text(HEADER + rows(lambda k: f"{k},20.{k:02d},{0.5 if k < 10 else 0.7},1", skip=(10,)))
    assert [part.n_samples for part in rt.read_records(path, stage, gaps="fill")] == [10, 49]


def test_repeated_rows_restarts_and_declared_codes(tmp_path: Path, stage: Any) -> None:
    path = tmp_path / "run.csv"
    twice = rows(plain).replace(plain(30) + "\n", (plain(30) + "\n") * 2)
    path.write_text(HEADER + twice)
    record = rt.read_record(path, stage)
    assert record.n_samples == N and adds_up(record)
    path.write_text(HEADER + rows(plain).replace("\n30,20.30", "\n29,20.40"))
    assert rt.read_record(path, stage, duplicates="first", jitter=1.0).n_samples == N
    path.write_text(HEADER + rows(plain) + rows(plain))
    assert [part.n_samples for part in rt.read_records(path, stage, restarts="split")] == [N, N]
    path.write_text(HEADER + rows(plain).replace("\n30,20.30,", "\n30,-127,"))
    assert [part.n_samples for part in rt.read_records(path, stage, missing=[-127])] == [30, 29]


def test_rounded_stamps_are_counted_and_a_lost_row_is_not(tmp_path: Path, stage: Any) -> None:
    path = tmp_path / "run.csv"
    path.write_text(HEADER + rows(lambda k: f"{int(1.5 * k)},20.{k:02d},0.5,1"))
    record = rt.read_record(path, stage)
    assert (record.sample_time, record.n_samples) == (1.5, N) and adds_up(record)
    path.write_text(HEADER + rows(lambda k: f"{k},20.{k:02d},0.5,1", skip=(20,)))
    assert [part.n_samples for part in rt.read_records(path, stage)] == [20, 39]


@pytest.mark.parametrize("h", [0.7, 1.02, 1.4, 2.35, 7.3])
@pytest.mark.parametrize("phase", [0.0, 0.41])
def test_any_step_of_a_clock_of_whole_seconds(tmp_path: Path, stage: Any, h: float, phase: float) -> None:
    """A logger whose period is no multiple of the second of its stamps."""
    path = tmp_path / "run.csv"
    path.write_text(HEADER + "".join(rounded_rows(h, phase, ())))
    record = rt.read_record(path, stage)
    assert record.n_samples == 600 and record.sample_time == pytest.approx(h, abs=1.1 / 600) and adds_up(record)


@pytest.mark.parametrize("h", [1.02, 1.4, 2.35, 7.3])  # a gap of n periods shorter than the unit is n or n + 1 rows
def test_parts_of_a_rounded_clock_stay_on_one_grid(tmp_path: Path, stage: Any, h: float) -> None:
    path = tmp_path / "run.csv"
    path.write_text(HEADER + "".join(rounded_rows(h, 0.0, range(200, 205))))
    parts = rt.read_records(path, stage)
    assert [part.n_samples for part in parts] == [200, 395] and parts[0].sample_time == parts[1].sample_time
    assert parts[1].start_time == pytest.approx(205 * h, abs=1.01 + h / 2)
    filled = rt.read_record(path, stage, gaps="fill", fill_up_to=5)
    np.testing.assert_allclose(filled["T1"], 293.15 + 0.001 * np.arange(600), atol=1e-9)


def rounded_rows(h: float, phase: float, lost: Sequence[int]) -> list[str]:
    return [f"{round(h * k + phase)},{20 + 0.001 * k:.3f},0.5,1\n" for k in range(600) if k not in lost]


def test_lost_rows_are_not_taken_for_a_rounded_clock(tmp_path: Path, stage: Any) -> None:
    """One row in 30 lost at random, of a logger with a true step of 1 s: never a grid of another step."""
    for seed in range(20):
        kept = np.sort(np.random.default_rng(seed).permutation(np.arange(1, 600))[:579])
        path = tmp_path / "run.csv"
        path.write_text(HEADER + "".join(f"{k},20.0,0.5,1\n" for k in kept))
        assert {part.sample_time for part in rt.read_records(path, stage)} == {1.0}


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_jitter_within_the_stated_error_bound(tmp_path: Path, stage: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    t = np.arange(400) + 0.1 * rng.uniform(-1, 1, 400)
    t[0] = 0.0
    truth = lambda s: 20.0 + 2.0 * np.sin(s / 15.0)  # noqa: E731
    path = tmp_path / "run.csv"
    path.write_text(HEADER + "".join(f"{s:.6f},{truth(s):.9f},0.5,1\n" for s in t))
    record = rt.read_record(path, stage)
    bound = 1.25**2 / 8 * 2.0 / 15.0**2  # the longest step, h²/8·max|T″|
    assert np.abs(record["T1"] - 273.15 - truth(record.time))[:-1].max() <= bound
    assert record.imported is not None
    assert "error bound" in next(action["text"] for action in record.imported.actions if action["what"] == "resampled")


@pytest.mark.parametrize("zone", ["Europe/Berlin", "America/New_York"])
def test_summer_time_needs_a_zone(tmp_path: Path, stage: Any, zone: str) -> None:
    utc = pd.date_range("2024-10-26", "2024-11-04", freq="10min", tz="UTC")
    local = utc.tz_convert(zone).tz_localize(None)
    path = tmp_path / "run.csv"
    path.write_text(HEADER + "".join(f"{s},20,0.5,1\n" for s in local))
    with pytest.raises(InputError, match="goes back by one hour.*timezone = "):
        rt.read_record(path, stage)
    record = rt.read_record(path, stage, timezone=zone)
    assert (record.sample_time, record.n_samples) == (600.0, len(utc))
    assert record.imported is not None and pd.Timestamp(record.imported.time["origin"]) == utc[0]


def test_tables_in_memory(stage: Any) -> None:
    T = 20.0 + 0.01 * np.arange(N)
    index = pd.date_range("2024-01-01", periods=N, freq="2s")
    frame = pd.DataFrame({"T1 (°C)": T, "m1": 0.5, "heater": 1}, index=index)
    found = [
        rt.read_record(frame, stage),
        rt.read_record(frame.tz_localize("UTC"), stage),
        rt.read_record({"time": 2.0 * np.arange(N), "T1": T, "m1": np.full(N, 0.5), "heater": np.ones(N, int)}, stage),
        rt.read_record(frame.reset_index(names="time").astype({"heater": "Int64", "m1": object}), stage),
    ]
    table = np.zeros(N, dtype=[("time", float), ("T1", float), ("m1", float), ("heater", float)])
    table["time"], table["T1"], table["m1"], table["heater"] = 2.0 * np.arange(N), T, 0.5, 1.0
    found.append(rt.read_record(table, stage))
    for record in found:
        np.testing.assert_allclose(record["T1"], T + 273.15, rtol=1e-14)
        assert (record.sample_time, record.n_samples) == (2.0, N)
    with pytest.raises(InputError, match="differ in length"):
        rt.read_record({"time": [0, 1], "T1": [1.0]}, stage)


def test_options_of_the_system_file_are_overruled_by_arguments(tmp_path: Path, stage: Any) -> None:
    text = (
        rt.thermal.format_system(stage)
        + '\n[record]\ngaps = "fill"\n[columns]\nT1 = "NTC"\nm1 = { column = "I", unit = "mA" }\n'
    )
    system = rt.thermal.parse_system(text)
    assert rt.thermal.parse_system(rt.thermal.format_system(system)) == system
    path = tmp_path / "run.csv"
    path.write_text("time,NTC,I,heater\n" + rows(lambda k: f"{k},20,500,1", skip=(5,)))
    assert rt.read_record(path, system)["m1"][0] == 0.5
    assert len(rt.read_records(path, system, gaps="split")) == 2
    with pytest.raises(InputError, match="unknown key 'gap'.*Did you mean 'gaps'"):
        rt.thermal.parse_system(text.replace("gaps", "gap"))
    with pytest.raises(InputError, match="jitter = '2'"):
        rt.read_record(path, system, jitter=2)


def test_scale_offset_and_units(tmp_path: Path, stage: Any) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time,T1 [°F],m1,Duty (%)\n" + rows(lambda k: f"{k},68,0.5,50"))
    record = rt.read_record(path, stage, columns={"heater": {"column": "Duty (%)", "unit": "%", "scale": 0.05}})
    assert record["heater"][0] == 2.5 and record["T1"][0] == pytest.approx(293.15)
    with pytest.raises(InputError, match="the header says degF and the declaration K"):
        rt.read_record(
            path, stage, columns={"T1": {"column": "T1 [°F]", "unit": "K"}, "heater": {"column": "Duty", "scale": 0.05}}
        )
    percent = rt.System(**{**dict(stage), "inputs": {"heater": {"lump": "cold", "gain": 0.05, "unit": "%"}}})
    assert rt.read_record(path, percent, columns={"heater": "Duty"})["heater"][0] == 50.0


def test_inspection_without_a_system(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time [s];T1 [°C];state\n" + rows(lambda k: f"{k};20,{k:02d};RUN"))
    found = rt.signals.inspect_file(path)
    assert [(c.column, c.role, c.unit) for c in found.columns] == [
        ("time [s]", "time", "s"),
        ("T1 [°C]", "unused", "degC"),
        ("state", "unused", ""),
    ]
    assert found.columns[1].max == pytest.approx(20.59)
    assert found.parts[0]["samples"] == N


def test_command_line_texts() -> None:
    record, columns = rt.signals.options_from_text(
        ["gaps=fill", "missing=-127,OL", "time=Datum,Uhrzeit", "jitter=0.3"], ["T1=NTC 1"]
    )
    made = rt.signals.declared((record, columns, "command line"))
    assert (
        made.record.missing == (-127.0, "OL") and made.record.time == ("Datum", "Uhrzeit") and made.record.jitter == 0.3
    )
    assert made.columns["T1"].column == "NTC 1"
    with pytest.raises(InputError, match="KEY=VALUE"):
        rt.signals.options_from_text(["gaps"])


@pytest.mark.parametrize("run", ["random_both_heaters_run_01", "random_heater1_run_01"])
def test_measured_uniform_records(shared: Path, run: str) -> None:
    path = shared / "data" / "tclab_saopaulo" / f"{run}.csv"
    record = rt.read_record(path, inputs=["Q1", "Q2"], outputs=["T1", "T2"], temperature_unit="degC")
    raw = np.genfromtxt(path, delimiter=",", names=True)
    np.testing.assert_array_equal(record.inputs, np.column_stack([raw["Q1"], raw["Q2"]]))
    np.testing.assert_allclose(record.outputs, 273.15 + np.column_stack([raw["T1"], raw["T2"]]), rtol=1e-15)
    assert (record.sample_time, record.start_time, record.n_samples) == (1.0, 1.0, 7700)


def test_measured_records_with_rounded_stamps_and_lost_samples(shared: Path) -> None:
    names: dict[str, Any] = {"inputs": ["Q1", "Q2"], "outputs": ["T1", "T2"], "temperature_unit": "degC"}
    rounded = shared / "data" / "tclab_saopaulo" / "step_heater1_060.csv"
    assert (
        rt.read_record(rounded, jitter=1.0, **names).sample_time,
        rt.read_record(rounded, jitter=1.0, **names).n_samples,
    ) == (0.5, 2400)
    lost = shared / "data" / "tclab_dowling" / "sine_50min_run_2.csv"
    assert [part.n_samples for part in rt.read_records(lost, **names)] == [555, 343]
    assert rt.read_record(lost, jitter=1.0, **names).n_samples == 901


@pytest.mark.parametrize("suffix", [".xlsx", ".ods"])
def test_workbooks(tmp_path: Path, stage: Any, suffix: str) -> None:
    pytest.importorskip("openpyxl" if suffix == ".xlsx" else "odf", reason="optional extra robthermal[excel]")
    stamps = pd.date_range("2024-03-01 10:00", periods=N, freq="s")
    body = pd.DataFrame({"Zeit": stamps, "T1 [°C]": 20.0 + 0.01 * np.arange(N), "m1": 0.5, "heater": 1.0})
    body.loc[30, "T1 [°C]"] = np.nan
    path = tmp_path / f"log{suffix}"
    with pd.ExcelWriter(path, engine="openpyxl" if suffix == ".xlsx" else "odf") as writer:
        pd.DataFrame({"a": ["a note", "no table"]}).to_excel(writer, sheet_name="Notes", index=False, header=False)
        body.to_excel(writer, sheet_name="Log 1", index=False, startrow=3)
    parts = rt.read_records(path, stage)
    assert [part.n_samples for part in parts] == [30, 29] and all(adds_up(part) for part in parts)
    assert parts[0].imported is not None and parts[0].imported.time["origin"] == "2024-03-01T10:00:00"
    assert rt.read_records(path, stage, sheet="Log 1", gaps="fill")[0].n_samples == N
    with pytest.raises(InputError, match="no sheet 'Log 2'.*'Notes', 'Log 1'"):
        rt.read_records(path, stage, sheet="Log 2")


def test_the_report_tells_temperatures_as_the_file_has_them(tmp_path: Path) -> None:
    """A technician compares it with the file; what is kept is in kelvin, and said in the column of units."""
    rows = "\n".join(f"{k},{21.5 + 0.5 * k},{70.7 + 0.9 * k:.1f},500" for k in range(25))
    path = tmp_path / "run.csv"
    path.write_text(f"time,T1 [°C],T2 [degF],m1 [mA]\n{rows}\n", encoding="utf-8")
    record = rt.read_record(path, inputs=["m1"], outputs=["T1", "T2"])
    said = str(record.imported)
    assert "degC → K  21.5 … 33.5" in said and "degF → K  70.7 … 92.3" in said
    assert "converted:" not in said and record["T1"][0] == pytest.approx(294.65)
    assert [one["what"] for one in record.imported.actions].count("converted") >= 2
    (first,) = [column for column in record.imported.columns if column.name == "T1"]
    assert first.min == pytest.approx(294.65)


@pytest.mark.parametrize(("step", "said"), [
    (2.0, "25 samples of 2 s, from 0 s, 50 s long"),
    (2000.0, "25 samples of 2000 s (33.3 min), from 0 s, 13.9 h long"),
    (86400.0, "25 samples of 86400 s (24 h), from 0 s, 25 days long")])
def test_the_report_tells_how_long_a_log_is(tmp_path: Path, step: float, said: str) -> None:
    """Milliseconds read as seconds are weeks."""
    rows = "\n".join(f"{step * k:g},{21.5 + 0.5 * k},0" for k in range(25))
    path = tmp_path / "run.csv"
    path.write_text(f"time,T1 [degC],m1\n{rows}\n", encoding="utf-8")
    assert said in str(rt.read_record(path, inputs=["m1"], outputs=["T1"]).imported)
