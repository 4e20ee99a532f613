"""Excitation signals against their spectra."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robthermal import InputError
from robthermal.signals import crest_factor, multisine, staircase


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


def test_multisine_has_the_amplitude_spectrum_asked_for() -> None:
    lines = [2, 3, 7, 20]

    def sizes(spectrum: Any) -> np.ndarray:
        u = multisine(64, sample_time=1.0, lines=lines, rms=1.0, spectrum=spectrum, seed=5)
        return np.abs(np.fft.rfft(u))[lines]

    np.testing.assert_allclose(sizes("logarithmic") ** 2 * lines, sizes("logarithmic")[0] ** 2 * 2)
    np.testing.assert_allclose(sizes([4.0, 1.0, 2.0, 0.5]) / sizes([4.0, 1.0, 2.0, 0.5])[1], [4.0, 1.0, 2.0, 0.5])
    np.testing.assert_array_equal(sizes("linear"), sizes(np.ones(4)))


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from(["random", "schroeder", "low_crest"]), st.floats(1e-3, 1e3))
def test_a_nonnegative_multisine_touches_zero_and_is_nowhere_below(seed: int, phases: Any, rms: float) -> None:
    common: dict[str, Any] = dict(sample_time=1.0, lines=range(1, 12), rms=rms, phases=phases, seed=seed)
    u = multisine(60, offset="nonnegative", **common)
    assert u.min() == 0.0
    np.testing.assert_allclose(u - u.mean(), multisine(60, **common), atol=1e-12 * rms)


def test_crest_factor_of_known_signals() -> None:
    t = np.arange(400)
    assert crest_factor(7.0 + 3.0 * np.sin(2 * np.pi * t / 400)) == pytest.approx(np.sqrt(2.0))
    assert crest_factor(np.where(t < 200, -1, 4)) == pytest.approx(1.0)
    # F cosines in phase: peak F, rms sqrt(F/2)
    assert crest_factor(sum(np.cos(2 * np.pi * k * t / 400) for k in range(1, 33))) == pytest.approx(8.0)


def test_schroeder_phases_of_equal_amplitudes_are_the_published_ones() -> None:
    # Schroeder: phi_m = -pi m (m - 1) / F for equal amplitudes, up to a phase for all.
    F, n = 16, 128
    u = multisine(n, sample_time=1.0, lines=range(1, F + 1), rms=1.0, phases="schroeder", seed=0)
    m = np.arange(1, F + 1)
    expected = sum(np.cos(2 * np.pi * k * np.arange(n) / n - np.pi * k * (k - 1) / F) for k in m) * np.sqrt(2.0 / F)
    np.testing.assert_allclose(u, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("lines", "spectrum", "at_most"),
    [
        (range(1, 101), "linear", 1.45),
        (range(1, 101), "logarithmic", 1.35),
        ([1, 2, 4, 8, 16, 32], "linear", 2.02),  # thirty starts end between 2.0112 and 2.0113
    ],
)
def test_low_crest_phases_beat_schroeder_and_keep_the_spectrum(lines: Any, spectrum: Any, at_most: float) -> None:
    common: dict[str, Any] = dict(sample_time=1.0, lines=lines, rms=1.0, spectrum=spectrum)
    schroeder = multisine(1000, phases="schroeder", seed=0, **common)
    for seed in range(2):
        low, random = (multisine(1000, phases=word, seed=seed, **common) for word in ("low_crest", "random"))
        assert crest_factor(low) < min(at_most, crest_factor(schroeder), crest_factor(random))
        np.testing.assert_allclose(np.abs(np.fft.rfft(low)), np.abs(np.fft.rfft(schroeder)), atol=1e-9)


def test_two_sines_reach_the_lowest_crest_factor_there_is() -> None:
    # By brute force over the relative phase: a shift in time leaves one phase to choose.
    n, lines = 240, np.array([1, 2])
    t = np.arange(n)
    waves = np.cos(2 * np.pi * t / n) + np.cos(4 * np.pi * t / n + np.linspace(0, 2 * np.pi, 721)[:, None])
    best = np.min(np.abs(waves).max(axis=1) / waves.std(axis=1))
    u = multisine(n, sample_time=1.0, lines=lines, rms=1.0, phases="low_crest", seed=4)
    assert crest_factor(u) == pytest.approx(best, rel=2e-3)


@pytest.mark.parametrize(
    ("u", "message"),
    [
        ([1.0, 1.0], "constant"),
        ([], "shape"),
        ([[1.0, 2.0]], "shape"),
        ([1.0, np.nan], r"u\[1\] is nan"),
        (["a"], "type"),
    ],
)
def test_crest_factor_refuses(u: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        crest_factor(u)


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
        ({"offset": "positive"}, "offset is 'positive'.*'nonnegative'"),
        ({"phases": "schröder"}, "phases is .*'schroeder'"),
        ({"spectrum": "log"}, "spectrum is 'log'.*'logarithmic'"),
        ({"spectrum": [1.0]}, "1 numbers for 2 lines"),
        ({"spectrum": [1.0, 0.0]}, r"spectrum\[1\] is 0.0"),
        ({"spectrum": [1.0, -1.0]}, r"spectrum\[1\] is -1.0"),
        ({"spectrum": 1.0}, "spectrum is 1.0"),
        ({"lines": None, "band": (0.2, 0.6)}, "Nyquist frequency, 0.5 Hz. Lower it, or sample faster"),
    ],
)
def test_multisine_refuses(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        multisine(**{**GOOD, **changes})
