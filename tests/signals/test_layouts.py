"""Layouts of loggers found on benches: read, or refused with a declaration that, pasted, reads them."""

from __future__ import annotations

import datetime as dt
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robthermal as rt
from robthermal import InputError

N = 30
T = np.round(20.0 + 0.01 * np.arange(N), 3)
NAMES: dict[str, Any] = {"inputs": ["I"], "outputs": ["T1"], "temperature_unit": "degC"}
START = dt.datetime(2026, 10, 24, 23, 59, 50)


def _stamps(pattern: str, tail: str = "") -> list[str]:
    return [(START + dt.timedelta(seconds=k)).strftime(pattern) + tail for k in range(N)]


def _write(path: Path, head: list[str], rows: list[str]) -> Path:
    path.write_text("\n".join(head + rows) + "\n")
    return path


def _as_written(record: rt.Record) -> None:
    assert record.n_samples == N and record.sample_time == pytest.approx(1.0)
    np.testing.assert_allclose(record.outputs[:, 0], T + 273.15, atol=1e-9)
    assert (record.inputs == 0.5).all()


def _pasted(error: InputError) -> dict[str, Any]:
    """What the remedy says to write, read as it would be from a project file."""
    assert error.remedy is not None
    text = re.split(r", whose first cell| and header = |, or ", error.remedy.removeprefix("Write "))[0]
    text = text.removeprefix("Declare both: ").replace(" and ", "\n").rstrip(".")
    return tomllib.loads(text)


@pytest.mark.parametrize(
    ("pattern", "tail", "declared"),
    [
        ("%m/%d/%Y %H:%M:%S", ":000", "%m/%d/%Y %H:%M:%S:%f"),
        ("%d-%b-%Y %H:%M:%S", "", "%d-%b-%Y %H:%M:%S"),
        ("%b.%d.%Y %H:%M:%S", "", "%b.%d.%Y %H:%M:%S"),
        ("%a %b %d %H:%M:%S %Y", "", "%a %b %d %H:%M:%S %Y"),
        ("%Y%m%dT%H%M%S", "", "%Y%m%dT%H%M%S"),
        ("%d %B %Y %I:%M:%S %p", "", "%d %B %Y %I:%M:%S %p"),
    ],
)
def test_the_time_format_that_is_proposed_reads_the_file(
    tmp_path: Path, pattern: str, tail: str, declared: str
) -> None:
    rows = [f"{stamp},0.5,{t}" for stamp, t in zip(_stamps(pattern, tail), T, strict=True)]
    path = _write(tmp_path / "run.csv", ["Time,I,T1"], rows)
    with pytest.raises(InputError, match="is no time that is known") as caught:
        rt.read_record(path, **NAMES)
    assert _pasted(caught.value) == {"time_format": declared}
    _as_written(rt.read_record(path, **NAMES, **_pasted(caught.value)))


def test_no_time_format_is_proposed_where_day_and_month_could_be_exchanged(tmp_path: Path) -> None:
    path = _write(tmp_path / "run.csv", ["Time,I,T1"], [f"03/04/2026 at 10:00:{k:02d},0.5,{T[k]}" for k in range(N)])
    with pytest.raises(InputError, match="Declare it, for example"):
        rt.read_record(path, **NAMES)


@pytest.mark.parametrize(
    ("head", "rows", "declared"),
    [
        (
            '"#","Date Time, GMT+01:00","I","T1"',
            _stamps("%m/%d/%y %I:%M:%S %p"),
            {"time": "Date Time, GMT+01:00"},
        ),
        ("n,(MM/DD/YYYY),(HH:MM:SS),I,T1", _stamps("%m/%d/%Y,%H:%M:%S"), {"time": ["(MM/DD/YYYY)", "(HH:MM:SS)"]}),
        ("n,last_changed,I,T1", _stamps("%Y-%m-%dT%H:%M:%SZ"), {"time": "last_changed"}),
    ],
)
def test_the_time_column_that_is_proposed_reads_the_file(
    tmp_path: Path, head: str, rows: list[str], declared: dict[str, Any]
) -> None:
    path = _write(tmp_path / "run.csv", [head], [f"{k},{row},0.5,{T[k]}" for k, row in enumerate(rows)])
    with pytest.raises(InputError, match="there is no column 'time'") as caught:
        rt.read_record(path, **NAMES)
    assert _pasted(caught.value) == declared
    _as_written(rt.read_record(path, **NAMES, **declared))


def test_a_column_of_stamps_without_a_name_is_the_time(tmp_path: Path) -> None:
    """As a table's index is written; a bare row number without a name is not."""
    rows = [f"{stamp},0.5,{t}" for stamp, t in zip(_stamps("%Y-%m-%d %H:%M:%S"), T, strict=True)]
    record = rt.read_record(_write(tmp_path / "run.csv", [",I,T1"], rows), **NAMES)
    _as_written(record)
    assert record.imported is not None
    assert any("without a name, which holds stamps" in action["text"] for action in record.imported.actions)
    numbered = _write(tmp_path / "numbered.csv", [",I,T1"], [f"{k},0.5,{T[k]}" for k in range(N)])
    with pytest.raises(InputError, match="there is no column 'time'"):
        rt.read_record(numbered, **NAMES)


@pytest.mark.parametrize(("cell", "decimal"), [("1,234.5", "."), ("1.234,5", ",")])
def test_the_separators_that_are_proposed_read_the_file(tmp_path: Path, cell: str, decimal: str) -> None:
    t = [f"{value:.3f}".replace(".", decimal) for value in T]
    path = _write(tmp_path / "run.csv", ["time;I;T1;P"], [f"{k};0{decimal}5;{t[k]};{cell}" for k in range(N)])
    with pytest.raises(InputError, match="thousands separator") as caught:
        rt.read_record(path, **NAMES)
    _as_written(rt.read_record(path, **NAMES, **_pasted(caught.value)))
    power = rt.read_record(path, inputs=["I", "P"], outputs=["T1"], temperature_unit="degC", **_pasted(caught.value))
    assert (power.inputs[:, 1] == 1234.5).all()


def test_blanks_between_the_cells_where_declared(tmp_path: Path) -> None:
    path = _write(
        tmp_path / "run.txt", ["   time/s     I/A   T1/degC"], [f"{k:9d} 0.5 \t {T[k]:12.4f}" for k in range(N)]
    )
    with pytest.raises(InputError, match="blanks are between the cells") as caught:
        rt.read_record(path, **NAMES)
    assert _pasted(caught.value) == {"delimiter": " "}
    _as_written(rt.read_record(path, **NAMES, delimiter=" "))


def test_blanks_between_the_cells_without_a_header(tmp_path: Path) -> None:
    path = tmp_path / "run.dat"
    np.savetxt(path, np.column_stack([np.arange(N), np.full(N, 0.5), T]))
    with pytest.raises(InputError, match=r'delimiter = " " and header = \["time", …\], 3 names'):
        rt.read_record(path, **NAMES)
    _as_written(rt.read_record(path, **NAMES, delimiter=" ", header=("time", "I", "T1")))


def test_a_ragged_row_between_blanks_is_refused(tmp_path: Path) -> None:
    rows = [f"{k}  0.5  {T[k]}" for k in range(N)]
    rows[12] = "12  20.1"
    path = _write(tmp_path / "run.txt", ["time I T1"], rows)
    with pytest.raises(InputError, match="line 14: the row has 2 cells and the header has 3"):
        rt.read_record(path, **NAMES, delimiter=" ")


def test_declared_headers_stand_for_every_line_before_the_values(tmp_path: Path) -> None:
    head = ["Device,GX", "Interval,1s,x", "CH,,0001", "Date,Time,current", "(dmy),(hms),A"]
    path = _write(tmp_path / "run.csv", head, [f"{k},0.5,{T[k]}" for k in range(N)])
    record = rt.read_record(path, header=("time", "I", "T1"), **NAMES)
    _as_written(record)
    assert (
        record.imported is not None
        and record.imported.skipped_lines == 5
        and "headers declared" in str(record.imported)
    )


def test_a_row_of_units_with_a_few_other_words(tmp_path: Path) -> None:
    head = ["Model,GL", "Interval,1s", "Number,Date&Time,ms,T1,I,AlarmOut", "NO.,Time,ms,degC,A,A1234"]
    rows = [f"{k},{stamp},0,+{T[k]},+0.5,LLLL" for k, stamp in enumerate(_stamps("%Y/%m/%d %H:%M:%S"))]
    record = rt.read_record(_write(tmp_path / "run.csv", head, rows), inputs=["I"], outputs=["T1"])
    _as_written(record)
    assert record.imported is not None and record.imported.header_line == 3


def test_a_date_with_the_time_of_day_beside_another_time_column_is_asked_about(tmp_path: Path) -> None:
    """Wall clock, its milliseconds and seconds since 1970, as a camera logs them; was a traceback of `re`."""
    stamps = _stamps("%Y-%m-%d %H:%M:%S")
    epoch = [1_366_405_131.115 + k for k in range(N)]
    rows = [f"{stamp},115,{at:.6f},{T[k]:.3f}, 0.5" for k, (stamp, at) in enumerate(zip(stamps, epoch, strict=True))]
    path = _write(tmp_path / "log.csv", ["date,ms,time,T1,I"], rows)
    with pytest.raises(InputError, match='Write time = "date", or time = "time"'):
        rt.read_record(path, **NAMES)
    _as_written(rt.read_record(path, **NAMES, time="date"))
    _as_written(rt.read_record(path, **NAMES, time="time"))
