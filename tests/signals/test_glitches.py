"""Glitches: planted ones are found, sound readings are not accused, nothing is altered unasked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import robthermal as rt
from robthermal import InputError, Record
from robthermal.signals import find_glitches, median_filter


def record_of(*channels: np.ndarray) -> Record:
    n = len(channels[0])
    names = [f"T{k}" for k in range(1, len(channels) + 1)]
    outputs = np.column_stack(channels)
    return Record(sample_time=1.0, inputs=np.ones(n), outputs=outputs, input_names=["u"], output_names=names)


def heating(n: int = 2000) -> np.ndarray:
    return 300.0 + 40.0 * (1.0 - np.exp(-np.arange(n) / 400.0))


def test_planted_glitches_are_found_in_quantized_readings() -> None:
    sound = np.round(heating() / 0.489) * 0.489
    spoilt = sound.copy()
    rows = [0, 57, 400, 401, 1999]
    spoilt[rows] += [20.0, 10.0, -15.0, -15.0, 8.0]
    found = find_glitches(record_of(sound, spoilt))
    assert set(found) == {"T2"}
    np.testing.assert_array_equal(found["T2"], rows)


def test_gaussian_noise_and_steps_are_no_glitches() -> None:
    rng = np.random.default_rng(5)
    noisy = heating() + rng.normal(0.0, 0.1, 2000)
    stepping = np.repeat([300.0, 320.0, 305.0, 340.0], 500) + rng.normal(0.0, 0.1, 2000)
    pulse = heating() + rng.normal(0.0, 0.1, 2000)
    pulse[700:703] += 20.0  # three samples: it stayed
    assert find_glitches(record_of(noisy, stepping, pulse)) == {}


def test_a_lone_spike_in_noise_is_found() -> None:
    rng = np.random.default_rng(6)
    noisy = heating() + rng.normal(0.0, 0.1, 2000)
    noisy[321] += 5.0
    np.testing.assert_array_equal(find_glitches(record_of(noisy))["T1"], [321])


def test_median_filter_against_sorting() -> None:
    rng = np.random.default_rng(7)
    T = rng.normal(300.0, 1.0, 60)
    smooth = median_filter(record_of(T), 9.0)
    padded = np.concatenate([np.repeat(T[0], 4), T, np.repeat(T[-1], 4)])
    expected = [np.sort(padded[k : k + 9])[4] for k in range(60)]
    np.testing.assert_array_equal(smooth["T1"], expected)
    assert "9 s (9 samples)" in smooth.notes[-1]
    np.testing.assert_array_equal(smooth["u"], np.ones(60))


@pytest.mark.parametrize(
    ("window", "message"), [(1.0, "1 samples"), (61.0, "61 samples"), (0.0, "window is 0"), ("9", "window is '9'")]
)
def test_median_filter_refuses(window: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        median_filter(record_of(heating(60)), window)  # type: ignore[arg-type]


def test_only_records() -> None:
    with pytest.raises(InputError, match="got ndarray"):
        find_glitches(heating())  # type: ignore[arg-type]


def test_reader_says_and_keeps_them_unless_a_filter_is_asked_for(tmp_path: Path) -> None:
    T = np.round(heating(200), 1)
    T[[50, 120]] += 30.0
    path = tmp_path / "run.csv"
    record_of(T).save(path)
    with pytest.warns(UserWarning, match="'T1' has 2 glitches at 50 s, 120 s"):
        kept = rt.read_record(path, inputs=["u"], outputs=["T1"])
    np.testing.assert_array_equal(kept["T1"], T)
    assert any("2 glitches" in note for note in kept.notes)
    with pytest.warns(UserWarning, match="glitches"):
        cleaned = rt.read_record(path, inputs=["u"], outputs=["T1"], median_filter=5.0)
    assert np.abs(cleaned["T1"] - np.round(heating(200), 1)).max() < 0.3
    assert any("running median" in note for note in cleaned.notes)


def log_of_a_fan(folder: Path, rpm: np.ndarray) -> Path:
    rows = [f"{2 * k},{value:g},{30 + 0.01 * k:.2f}" for k, value in enumerate(rpm)]
    path = folder / "fan.csv"
    path.write_text("\n".join(["time [s],fan [rpm],T [°C]", *rows]) + "\n", encoding="utf-8")
    return path


def test_a_fan_that_turns_999_times_a_minute_is_no_fault_code(tmp_path: Path) -> None:
    """Its readings scatter by 20 around 1000: the log was refused for the first one of 999."""
    rpm = 1000.0 + np.round(np.random.default_rng(3).normal(0.0, 20.0, 400))
    rpm[::40] = 999.0
    record = rt.read_record(log_of_a_fan(tmp_path, rpm), inputs=["fan"], outputs=["T"])
    np.testing.assert_array_equal(record["fan"], rpm)


@pytest.mark.parametrize("code", [999.0, -127.0, 9999.0])
def test_a_code_beyond_all_other_values_is(tmp_path: Path, code: float) -> None:
    rpm = 700.0 + np.round(np.random.default_rng(3).normal(0.0, 20.0, 400))
    rpm[[100, 200]] = code
    with pytest.raises(InputError, match=rf"{code:g} jumps there and back, like a fault code \(2 such cells\)"):
        rt.read_record(log_of_a_fan(tmp_path, rpm), inputs=["fan"], outputs=["T"])
