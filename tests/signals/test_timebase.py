"""Time stamps: what is uniform, what is resampled and said, what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robthermal as rt
from robthermal import InputError, Record
from robthermal.signals._timebase import TimeBase, uniform


def base_of(stamps: object, jitter: float = 0.05) -> TimeBase:
    return uniform(np.array(stamps, dtype=float), jitter=jitter, row=lambda k: f"row {k}", where="file")


@pytest.mark.parametrize("h", [1.0, 0.1, 1 / 3, 2.5e-3, 60.0, 0.9995])
@pytest.mark.parametrize("start", [0.0, -7.0, 1.7e9])
def test_uniform_stamps_are_left_alone(h: float, start: float) -> None:
    digits = 9 if start < 1e9 else 6
    base = base_of(np.round(start + h * np.arange(2000), digits))
    assert not base.resampled and base.note == ""
    assert base.sample_time == pytest.approx(h, rel=1e-6)
    assert base.n_samples == 2000


def test_nearly_nice_sample_times_are_nice() -> None:
    assert base_of(1.0000003 * np.arange(100)).sample_time == 1.0
    assert base_of(0.9995 * np.arange(100)).sample_time == 0.9995


def test_short_jittery_stamps_keep_their_mean_step() -> None:
    base = base_of([0.0, 1.01, 2.01, 3.0])
    assert base.resampled
    assert base.sample_time == pytest.approx(1.0, abs=1e-12)
    assert base_of([1.01, 2.01, 3.0]).sample_time == pytest.approx(1.99 / 2, rel=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.2, 1.0, 30.0]), st.booleans())
def test_jitter_is_resampled_without_error_for_straight_lines(seed: int, h: float, drifting: bool) -> None:
    rng = np.random.default_rng(seed)
    n = 300
    noise = rng.uniform(-0.02, 0.02, n)
    stamps = 5.0 + h * (np.arange(n) + (np.cumsum(noise) if drifting else noise))
    base = base_of(stamps)
    assert base.resampled and "uniform grid" in base.note
    assert base.n_samples == n
    assert base.sample_time == pytest.approx((stamps[-1] - stamps[0]) / (n - 1), rel=1e-3)
    inner = base.grid <= stamps[-1]
    np.testing.assert_allclose(
        base.interpolated(300.0 + 0.3 * stamps)[inner], 300.0 + 0.3 * base.grid[inner], rtol=1e-12
    )
    # Held: the rows in force; with stamps that do not drift, row k of the file stays row k.
    rows = base.held(np.arange(n, dtype=float)).astype(int)
    assert np.abs(stamps[rows] - base.grid).max() <= 0.53 * h
    if not drifting:
        np.testing.assert_array_equal(rows, np.arange(n))


@pytest.mark.parametrize(
    ("stamps", "message"),
    [
        ([0, 1, 2, 2, 3, 4], r"time 2 s stands twice \(duplicate\), again in row 3"),
        ([0, 1, 2, 1.5, 3, 4], "time runs backward, from 2 s to 1.5 s, in row 3"),
        ([5, 4, 3, 2], "backward.*3 such places"),
        ([0, 0, 0], "stands twice"),
        ([0, 1, 2, 5, 6, 7], r"1 gap in time, after row 2, 2 s to 5 s \(2 samples missing\).*Split the file"),
        ([0, 1, 2, 3, 4.2, 5, 6], "jitter by up to 20 % of 1 s, worst after row .*above 5 %.*jitter=0.21"),
    ],
)
def test_refuses(stamps: list[float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        base_of(stamps)


def test_the_first_five_gaps_are_listed() -> None:
    stamps = np.delete(np.arange(100.0), [10, 20, 30, 40, 50, 60, 70])
    with pytest.raises(InputError, match="7 gaps.*9 s to 11 s.*49 s to 51 s.*and 2 more") as caught:
        base_of(stamps)
    assert "59 s" not in str(caught.value)


def test_jitter_argument_permits_more_and_says_so() -> None:
    base = base_of([0, 1, 2, 3, 4.2, 5, 6], jitter=0.25)
    assert base.resampled and "20 %" in base.note
    filled = base_of(np.delete(np.arange(20.0), [7, 12]), jitter=1.0)
    assert (filled.n_samples, filled.sample_time) == (20, 1.0)
    assert "2 missing samples filled" in filled.note
    np.testing.assert_allclose(filled.interpolated(3.0 * filled.stamps), 3.0 * np.arange(20.0))
    np.testing.assert_array_equal(filled.held(filled.stamps)[[6, 7, 8]], [6, 6, 8])
    with pytest.raises(InputError, match="gap"):
        base_of(np.delete(np.arange(20.0), [7, 8]), jitter=1.0)


def test_rounded_stamps_are_counted_only_on_request() -> None:
    stamps = 0.5 * np.arange(101)
    stamps[80:] = np.floor(stamps[80:])  # two digits are printed
    with pytest.raises(InputError, match="uniform grid of 0.5 s with rounded time stamps.*jitter=1.0"):
        base_of(stamps)
    base = base_of(stamps, jitter=1.0)
    assert (base.sample_time, base.n_samples, base.resampled) == (0.5, 101, False)
    assert "counted" in base.note
    with pytest.raises(InputError, match="do not fit a uniform grid"):
        base_of([0, 1, 2, 3, 4, 4, 4, 4, 5, 6, 7, 8, 9], jitter=1.0)


@pytest.mark.parametrize("jitter", [-0.1, 1.5, np.nan, "5 %", True])
def test_jitter_must_be_a_fraction(jitter: object) -> None:
    with pytest.raises(InputError, match="jitter"):
        base_of([0, 1, 2], jitter=jitter)  # type: ignore[arg-type]


def test_reader_warns_and_notes(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time,u,T\n0,1,300\n1.01,2,301.01\n2.01,3,302.01\n3,4,303\n")
    with pytest.warns(UserWarning, match="deviate by up to 1 %; resampled to a uniform grid of 1 s"):
        record = rt.read_record(path, inputs=["u"], outputs=["T"])
    assert record.sample_time == 1.0
    np.testing.assert_array_equal(record["u"], [1, 2, 3, 4])
    np.testing.assert_allclose(record["T"], [300, 301, 302, 303], rtol=1e-12)
    assert "resampled" in record.notes[0]


def test_gap_names_the_line_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("# c\ntime,u,T\n0,1,300\n1,2,301\n# pause\n5,3,302\n6,4,303\n7,5,304\n8,5,305\n")
    with pytest.raises(InputError, match=r"after row 1 \(line 4\), 1 s to 5 s \(3 samples missing\)"):
        rt.read_record(path, inputs=["u"], outputs=["T"])


Shared = Callable[..., Path]
TCLAB = {"inputs": ["Q1", "Q2"], "outputs": ["T1", "T2"], "temperature_unit": "degC"}


def quietly(path: Path, **options: object) -> Record:
    with pytest.warns(UserWarning):
        return rt.read_record(path, **TCLAB, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["sine_5min_run_2", "step_50_run_2"])
def test_measured_records_with_jitter(shared: Path, name: str) -> None:
    path = shared / "data" / "tclab_dowling" / f"{name}.csv"
    record = quietly(path)
    assert (record.sample_time, record.n_samples) == (1.0, 901)
    assert "2 %" in record.notes[0]
    raw = np.genfromtxt(path, delimiter=",", names=True)
    np.testing.assert_array_equal(record["Q1"], raw["Q1"])
    assert np.abs(record["T1"] - 273.15 - raw["T1"]).max() < 0.05 * 1.0 + np.abs(np.diff(raw["T1"])).max() * 0.02


def test_measured_record_with_missing_samples(shared: Path) -> None:
    path = shared / "data" / "tclab_dowling" / "sine_50min_run_2.csv"
    with pytest.raises(InputError, match=r"2 gaps.*row 554 .*554.01 s to 556.01 s.*jitter=1.0"):
        rt.read_record(path, **TCLAB)  # type: ignore[arg-type]
    record = quietly(path, jitter=1.0)
    assert (record.sample_time, record.n_samples) == (1.0, 901)


@pytest.mark.parametrize("run", ["random_both_heaters_run_01", "random_both_heaters_run_02", "random_heater1_run_01"])
def test_measured_uniform_records(shared: Path, run: str) -> None:
    path = shared / "data" / "tclab_saopaulo" / f"{run}.csv"
    record = quietly(path)
    raw = np.genfromtxt(path, delimiter=",", names=True)
    np.testing.assert_array_equal(record.inputs, np.column_stack([raw["Q1"], raw["Q2"]]))
    np.testing.assert_allclose(record.outputs, 273.15 + np.column_stack([raw["T1"], raw["T2"]]), rtol=1e-15)
    assert (record.sample_time, record.start_time, record.n_samples) == (1.0, 1.0, 7700)
    assert any("glitch" in note for note in record.notes)


@pytest.mark.parametrize("percent", ["020", "060", "100"])
def test_measured_records_with_rounded_stamps(shared: Path, percent: str) -> None:
    path = shared / "data" / "tclab_saopaulo" / f"step_heater1_{percent}.csv"
    with pytest.raises(InputError, match=r"time 1000 s stands twice.*row 2000.*rounded time stamps.*jitter=1.0"):
        rt.read_record(path, **TCLAB)  # type: ignore[arg-type]
    record = quietly(path, jitter=1.0)
    assert (record.sample_time, record.n_samples) == (0.5, 2400)
    raw = np.genfromtxt(path, delimiter=",", names=True)
    np.testing.assert_allclose(record["T1"], raw["T1"] + 273.15, rtol=1e-15)
