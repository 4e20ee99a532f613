"""Time columns that are counters of microcontrollers and start again from zero, and rows of a logger that starts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import robthermal as rt
from robthermal import InputError

N = 60
T = np.round(20.0 + 0.01 * np.arange(N), 3)
NAMES: dict[str, Any] = {"inputs": ["I"], "outputs": ["T1"], "temperature_unit": "degC"}
SECOND = 1_000_000


def _log(path: Path, times: Any, header: str = "t,T1,I") -> Path:
    rows = [f"{time},{temperature},0.5" for time, temperature in zip(times, T, strict=True)]
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def _counter(period: int, step: int = SECOND, start: int = 4_503_930) -> list[int]:
    """A counter with a jitter of some ticks, as `micros()` prints it."""
    ticks = np.random.default_rng(1).integers(-12, 13, N)
    return [int(start + step * k + ticks[k]) % period for k in range(N)]


def _as_written(record: rt.Record) -> None:
    assert record.n_samples == N and record.sample_time == pytest.approx(1.0, abs=1e-4)
    np.testing.assert_allclose(record.outputs[:, 0], T + 273.15, atol=2e-6)


@pytest.mark.parametrize("period", [10_000_000, 2**16 * 1000])
def test_a_counter_that_starts_again_is_counted_on_where_declared(tmp_path: Path, period: int) -> None:
    path = _log(tmp_path / "log.csv", _counter(period, start=period - 4_503_930))
    record = rt.read_record(path, **NAMES, time_format="us", wraps_at=period)
    _as_written(record)
    assert f"starts again at {period}" in str(record.imported)


@pytest.mark.parametrize("period", [10_000_000, 2**32])
def test_the_refusal_names_the_value_to_declare(tmp_path: Path, period: int) -> None:
    path = _log(tmp_path / "log.csv", _counter(period, start=period - 4_503_930))
    with pytest.raises(InputError, match=f"one step across {period}.*wraps_at = {period}.*restarts") as caught:
        rt.read_record(path, **NAMES, time_format="us")
    assert "line 7, column 't'" in str(caught.value)


def test_the_header_of_a_microcontroller_says_the_unit(tmp_path: Path) -> None:
    times = _counter(2**32, start=2**32 - 4_503_930)
    for header in ("micros,T1,I", "Time [us],T1,I", "t_µs,T1,I"):
        _as_written(rt.read_record(_log(tmp_path / "log.csv", times, header), **NAMES, wraps_at=2**32))
    frame = pd.DataFrame({"micros": np.array(times, np.uint32), "T1": T, "I": 0.5})
    _as_written(rt.read_record(frame, **NAMES, wraps_at=2**32))


def test_seconds_of_the_day_pass_midnight(tmp_path: Path) -> None:
    times = [(86_390 + k) % 86_400 for k in range(N)]
    path = _log(tmp_path / "log.csv", times)
    with pytest.raises(InputError, match="wraps_at = 86400"):
        rt.read_record(path, **NAMES)
    _as_written(rt.read_record(path, **NAMES, wraps_at=86_400))


@pytest.mark.parametrize("wrong", [2**32, 20_000_000, 5_000_000])
def test_a_wrong_value_is_refused(tmp_path: Path, wrong: int) -> None:
    path = _log(tmp_path / "log.csv", _counter(10_000_000))
    with pytest.raises(InputError, match=r"Correct wraps_at|steps deviate"):
        rt.read_record(path, **NAMES, time_format="us", wraps_at=wrong)


def test_a_second_run_is_no_start_again(tmp_path: Path) -> None:
    times = [float(k % 30) for k in range(N)]  # 0 to 29 s, twice
    path = _log(tmp_path / "log.csv", times)
    with pytest.raises(InputError, match=r'^(?!.*wraps_at).*restarts = "split"'):
        rt.read_record(path, **NAMES)
    with pytest.raises(InputError, match='restarts = "split" as well'):
        rt.read_record(path, **NAMES, wraps_at=2**16)
    parts = rt.read_records(path, **NAMES, wraps_at=2**16, restarts="split")
    assert [part.n_samples for part in parts] == [30, 30]


def test_a_lost_row_at_the_start_again_is_a_gap(tmp_path: Path) -> None:
    times = _counter(10_000_000)
    lost = [k for k in range(N) if k != 6]  # 503930: the first after the start again
    rows = [f"{times[k]},{T[k]},0.5" for k in lost]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["t,T1,I", *rows]) + "\n")
    _as_written(rt.read_record(path, **NAMES, time_format="us", wraps_at=10_000_000, gaps="fill"))


def test_cells_before_the_names_of_a_header_are_named(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    rows = [f"{k}\t{temperature}\t0.5" for k, temperature in enumerate(T)]
    path.write_text("\n".join(["\t" * 4 + "Timestamp\tT1\tI", *rows]) + "\n")
    with pytest.raises(InputError, match=r'Write header = \["Timestamp", "T1", "I"\]'):
        rt.read_record(path, **NAMES)
    _as_written(rt.read_record(path, **NAMES, header=["Timestamp", "T1", "I"]))


def _times(first: list[float]) -> list[float]:
    """Stamps one second apart after some that are not [s]."""
    return [round(float(at), 3) for at in np.concatenate([first, first[-1] + np.arange(1, N - len(first) + 1)])]


@pytest.mark.parametrize(("first", "left_out"), [([0.0, 0.195], 1), ([0.0, 0.852, 1.122, 2.007], 2)])
def test_rows_of_a_logger_that_starts_are_left_out_and_said(tmp_path: Path, first: list[float], left_out: int) -> None:
    """First steps of two measured logs; the whole file had been refused for them."""
    record = rt.read_record(_log(tmp_path / "log.csv", _times(first)), **NAMES)
    np.testing.assert_allclose(record.outputs[-20:, 0], T[-20:] + 273.15, atol=2e-3)
    assert record.n_samples == N - left_out and "a logger that starts" in str(record.imported)


def test_an_irregular_step_later_on_is_refused_as_before(tmp_path: Path) -> None:
    times = [float(k) + (0.4 if k == 30 else 0.0) for k in range(N)]
    with pytest.raises(InputError, match="the time steps deviate by up to 40 %"):
        rt.read_record(_log(tmp_path / "log.csv", times), **NAMES)


@pytest.mark.parametrize(("unit", "per_second"), [("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_an_epoch_in_any_unit_is_told_by_its_size(tmp_path: Path, unit: str, per_second: float) -> None:
    """Nanoseconds since 1970, as Python's `time_ns` and many data bases give them, were read as seconds."""
    times = [int(1730907985.25 * per_second) + int(k * per_second) for k in range(N)]
    for header in ("time,T1,I", "timestamp,T1,I"):
        record = rt.read_record(_log(tmp_path / "log.csv", times, header), **NAMES)
        _as_written(record)
        format_, _, zero = str(record.imported).partition("time: ")[2].partition(", zero is ")
        assert format_.endswith(f"epoch_{unit}")
        assert abs(pd.Timestamp(zero) - pd.Timestamp("2024-11-06T15:46:25.25Z")) < pd.Timedelta("1us")
    _as_written(rt.read_record(_log(tmp_path / "log.csv", times, "at,T1,I"), **NAMES, time="at",
                               time_format=f"epoch_{unit}"))


@pytest.mark.parametrize(("unit", "per_second"), [("us", 10**6), ("ns", 10**9)])
def test_a_counter_without_a_unit_is_not_taken_for_seconds(tmp_path: Path, unit: str, per_second: int) -> None:
    """Of a counter of nanoseconds a record with steps of 32 years was made."""
    path = _log(tmp_path / "log.csv", [5 * per_second + k * per_second for k in range(N)])
    with pytest.raises(InputError, match="'t' has no unit, and its steps are 1e\\+0.*time_format"):
        rt.read_record(path, **NAMES)
    _as_written(rt.read_record(path, **NAMES, time_format=unit))


TURNS = [1.2 + 0.1 * (-1) ** k for k in range(N)]


def test_of_two_columns_called_time_the_one_that_rises_is_taken(tmp_path: Path) -> None:
    """A program that logs how long each turn of its loop took calls that `elapsed`."""
    both = [f"{k},{turn}" for k, turn in enumerate(TURNS)]
    record = rt.read_record(_log(tmp_path / "log.csv", both, "time,elapsed,T1,I"), **NAMES)
    _as_written(record)
    assert record.imported is not None
    said = [action["text"] for action in record.imported.actions]
    assert "time taken from 'time'; 'elapsed' does not increase" in said


def test_a_time_for_every_sensor_and_none_for_the_row_is_asked_for(tmp_path: Path) -> None:
    each = [f"{1730907985.0 + k},{1730907985.8 + k},{turn}" for k, turn in enumerate(TURNS)]
    path = _log(tmp_path / "log.csv", each, "time_t1,time_t2,elapsed,T1,I")
    with pytest.raises(InputError, match="'elapsed' is called a time and does not increase.*'time_t1', 'time_t2'"):
        rt.read_record(path, **NAMES)
    _as_written(rt.read_record(path, **NAMES, time="time_t1"))
