"""Sources as loggers and their users make them, that were misread or refused without a reason once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import robthermal as rt
from robthermal import InputError

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")
N = 40
T = 20.0 + 0.01 * np.arange(N)
NAMES: dict[str, Any] = {"inputs": ["I"], "outputs": ["T1"], "temperature_unit": "degC"}


def test_masked_readings_are_missing() -> None:
    masked = np.ma.masked_array(T, np.arange(N) == 5)
    parts = rt.read_records({"time": np.arange(N), "I": np.ones(N), "T1": masked}, **NAMES)
    assert [part.n_samples for part in parts] == [5, N - 6]


def test_a_missing_cell_of_pandas_among_objects() -> None:
    cells = [pd.NA if k == 5 else T[k] for k in range(N)]
    frame = pd.DataFrame({"time": range(N), "I": 0.5, "T1": pd.Series(cells, dtype=object)})
    assert [part.n_samples for part in rt.read_records(frame, **NAMES)] == [5, N - 6]


def test_complex_columns_are_refused() -> None:
    with pytest.raises(InputError, match="column 'I' has complex numbers"):
        rt.read_record(pd.DataFrame({"time": range(N), "I": 0.5 + 0.1j, "T1": T}), **NAMES)


def test_elapsed_times_of_a_workbook() -> None:
    elapsed = pd.Series([pd.Timedelta(2 * k, "h").to_pytimedelta() for k in range(N)], dtype=object)
    record = rt.read_record(pd.DataFrame({"elapsed": elapsed, "I": 0.5, "T1": T}), **NAMES)
    assert (record.sample_time, record.n_samples) == (7200.0, N)


@pytest.mark.parametrize("rows", [[0], [N - 1], list(range(30, N))])
def test_a_broken_sensor_at_either_end_is_no_reading(tmp_path: Path, rows: list[int]) -> None:
    path = tmp_path / "run.csv"
    cells = [f"{k},0.5,{-127 if k in rows else T[k]}\n" for k in range(N)]
    path.write_text("time,I,T1\n" + "".join(cells))
    with pytest.raises(InputError, match=rf"line {rows[0] + 2}, column 'T1': -127 jumps.*missing = \[-127\]"):
        rt.read_records(path, **NAMES)
    assert rt.read_records(path, missing=[-127], **NAMES)[0].n_samples == N - len(rows)


def test_digits_as_dates_where_declared(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time,I,T1\n" + "".join(f"202403011000{k:02d},0.5,{T[k]}\n" for k in range(N)))
    record = rt.read_record(path, time_format="%Y%m%d%H%M%S", **NAMES)
    assert record.imported is not None and record.imported.time["origin"] == "2024-03-01T10:00:00"


def test_dates_in_a_channel_of_tdms(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms", reason="optional extra robthermal[tdms]")
    stamps = pd.date_range("2024-03-01", periods=N, freq="s").to_numpy()
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as writer:
        channels = {"time": stamps, "I": np.full(N, 0.5), "T1": T}
        writer.write_segment([nptdms.ChannelObject("Log", name, values) for name, values in channels.items()])
    record = rt.read_record(tmp_path / "run.tdms", **NAMES)
    assert (record.sample_time, record.n_samples) == (1.0, N)


def test_a_date_cell_beside_a_time_of_day(tmp_path: Path) -> None:
    pytest.importorskip("openpyxl", reason="optional extra robthermal[excel]")
    stamps = pd.date_range("2024-03-01 23:59:40", periods=N, freq="s")
    frame = pd.DataFrame({"Datum": stamps.date, "Uhrzeit": stamps.time, "I [A]": 0.5, "T1 [°C]": T})
    frame.to_excel(tmp_path / "run.xlsx", index=False)
    record = rt.read_record(tmp_path / "run.xlsx", **NAMES)
    assert (record.sample_time, record.n_samples) == (1.0, N)
    assert record.imported is not None and record.imported.time["origin"] == "2024-03-01T23:59:40"
