"""Excitation signals against their spectra."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robthermal import InputError
from robthermal.signals import multisine, staircase


def test_staircase_holds_every_level() -> None:
    u = staircase([1, -2.5, 4], 0.3, sample_time=0.1)
    np.testing.assert_array_equal(u, [1, 1, 1, -2.5, -2.5, -2.5, 4, 4, 4])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([], 1.0), "levels is"),
        ((3.0, 1.0), "levels is 3.0"),
        (("abc", 1.0), "levels is 'abc'"),
        (([1.0, np.nan], 1.0), r"levels\[1\] is nan"),
        (([1.0, "x"], 1.0), r"levels\[0\]"),
        (([1.0], 0.0), "dwell is 0.0"),
        (([1.0], 0.25), "whole number of samples.*Use dwell=0.2"),
        (([1.0], 0.01), "Use dwell=0.1"),
    ],
)
def test_staircase_refuses(arguments: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        staircase(*arguments, sample_time=0.1)


@settings(max_examples=50, deadline=None)
@given(st.integers(4, 400), st.integers(0, 2**31), st.data())
def test_multisine_spectrum(n: int, seed: int, data: st.DataObject) -> None:
    lines = data.draw(st.sets(st.integers(1, (n - 1) // 2), min_size=1))
    u = multisine(n, sample_time=0.2, lines=sorted(lines), rms=3.0, offset=20.0, periods=2, seed=seed)
    np.testing.assert_array_equal(u[:n], u[n:])
    size = 2.0 * np.abs(np.fft.rfft(u[:n])) / n
    expected = np.zeros_like(size)
    expected[list(lines)] = 3.0 * np.sqrt(2.0 / len(lines))  # equal amplitudes: rms^2 = sum of A^2 / 2
    expected[0] = 40.0
    np.testing.assert_allclose(size, expected, atol=1e-12 * 40)


def test_multisine_band_holds_its_limits_and_amplitude_is_the_peak() -> None:
    u = multisine(1000, sample_time=0.1, band=(0.03, 0.07), amplitude=5.0, offset=-1.0, seed=3)
    excited = np.flatnonzero(np.abs(np.fft.rfft(u)) > 1e-6)
    np.testing.assert_array_equal(excited, [0, 3, 4, 5, 6, 7])
    assert np.abs(u + 1.0).max() == pytest.approx(5.0, rel=1e-14)


def test_multisine_seed_decides() -> None:
    def one(seed: int) -> np.ndarray:
        return multisine(64, sample_time=1.0, lines=[1, 2, 5], rms=1.0, seed=seed)

    np.testing.assert_array_equal(one(1), one(1))
    assert not np.allclose(one(1), one(2))


GOOD: dict[str, Any] = {"period": 100, "sample_time": 1.0, "lines": [1, 2], "rms": 1.0, "seed": 0}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lines": [50]}, "line 50 is not below the Nyquist.*1 to 49"),
        ({"lines": [0]}, r"lines\[0\] is 0"),
        ({"lines": [1.5]}, r"lines\[0\] is 1.5"),
        ({"lines": []}, "lines is"),
        ({"lines": [3, 3]}, "line 3 is given twice"),
        ({"lines": "12"}, "lines is '12'"),
        ({"lines": None}, "neither of band and lines"),
        ({"band": (0.1, 0.2)}, "both of band and lines"),
        ({"lines": None, "band": (0.1, 0.5)}, "Nyquist"),
        ({"lines": None, "band": (0.2, 0.1)}, "band is"),
        ({"lines": None, "band": (0.011, 0.019)}, "no line lies between"),
        ({"lines": None, "band": 0.1}, "band is 0.1"),
        ({"lines": None, "band": (0.1, np.nan)}, r"band\[1\] is nan"),
        ({"rms": None}, "neither of rms and amplitude"),
        ({"amplitude": 1.0}, "both of rms and amplitude"),
        ({"rms": 0.0}, "rms is 0.0"),
        ({"rms": -1.0}, "rms is -1.0"),
        ({"period": 2}, "period is 2"),
        ({"period": 10.5}, "period is 10.5"),
        ({"periods": 0}, "periods is 0"),
        ({"seed": None}, "seed is None"),
        ({"seed": -1}, "seed is -1"),
        ({"offset": np.inf}, "offset is inf"),
        ({"sample_time": 0.0}, "sample_time is 0.0"),
    ],
)
def test_multisine_refuses(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        multisine(**{**GOOD, **changes})
