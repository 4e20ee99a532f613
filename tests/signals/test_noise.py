"""Noise and binary sequences against their spectra and correlations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, sosfreqz, welch

from robthermal import InputError
from robthermal.signals import crest_factor, noise, prbs


def test_white_noise_has_its_level_and_no_memory() -> None:
    u = noise(50_000, sample_time=2.0, rms=3.0, offset=-4.0, seed=1)
    deviation = u + 4.0
    assert deviation.mean() == pytest.approx(0.0, abs=4 * 3.0 / np.sqrt(50_000))
    assert deviation.std() == pytest.approx(3.0, rel=4 / np.sqrt(2 * 50_000))
    assert abs(np.mean(deviation[1:] * deviation[:-1])) < 4 * 9.0 / np.sqrt(50_000)
    np.testing.assert_array_equal(u, noise(50_000, sample_time=2.0, rms=3.0, offset=-4.0, seed=1))
    assert not np.array_equal(u, noise(50_000, sample_time=2.0, rms=3.0, offset=-4.0, seed=2))


@pytest.mark.parametrize("band", [(0.0, 0.02), (0.01, 0.1)])
def test_filtered_noise_has_the_spectrum_of_the_filter(band: tuple[float, float]) -> None:
    u = noise(200_000, sample_time=1.0, rms=2.0, band=band, seed=4)
    assert u.std() == pytest.approx(2.0, rel=0.05)
    f, density = welch(u, nperseg=1024)
    limits, kind = (band, "bandpass") if band[0] else (band[1], "lowpass")
    _, H = sosfreqz(butter(4, limits, kind, fs=1.0, output="sos"), f, fs=1.0)
    inside = (f > band[0] + 0.003) & (f < band[1] - 0.003)
    expected = np.abs(H) ** 2 * np.sum(density) / np.sum(np.abs(H) ** 2)
    np.testing.assert_allclose(density[inside], expected[inside], rtol=0.4)
    assert density[f > 2.5 * band[1]].max() < 1e-2 * density.max()


@pytest.mark.exhaustive
def test_filtered_noise_is_stationary_at_once() -> None:
    first = np.array([noise(2, sample_time=1.0, rms=2.0, band=(0.05, 0.2), seed=s)[0] for s in range(2000)])
    assert first.std() == pytest.approx(2.0, rel=4 / np.sqrt(4000))  # no switch-on


def test_nonnegative_noise() -> None:
    assert noise(500, sample_time=1.0, rms=1.0, offset="nonnegative", seed=0).min() == 0.0


@pytest.mark.parametrize("order", [2, 5, 9])
def test_binary_sequence_is_of_maximum_length(order: int) -> None:
    n = 2**order - 1
    u = prbs(order, sample_time=1.0, hold=1.0, low=-1.0, high=1.0, seed=order)
    assert u.shape == (n,) and set(u) == {-1.0, 1.0}
    correlation = np.fft.ifft(np.abs(np.fft.fft(u)) ** 2).real
    np.testing.assert_allclose(correlation, [n] + [-1.0] * (n - 1), atol=1e-9)  # the mark of an m-sequence


def test_binary_sequence_is_held_repeated_and_shifted_by_the_seed() -> None:
    def one(seed: int, periods: int = 1) -> np.ndarray:
        return prbs(6, sample_time=0.5, hold=1.5, low=0.0, high=4.0, seed=seed, periods=periods)

    u = one(1, 2)
    assert u.shape == (63 * 3 * 2,)
    np.testing.assert_array_equal(u[::3], u[2::3])
    np.testing.assert_array_equal(u[:189], u[189:])
    assert crest_factor(u) < 1.05
    shifts = [np.array_equal(np.roll(one(1), 3 * k), one(2)) for k in range(63)]
    assert sum(shifts) == 1 and not shifts[0]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n_samples": 1}, "n_samples is 1"),
        ({"n_samples": 10.5}, "n_samples is 10.5"),
        ({"rms": 0.0}, "rms is 0.0"),
        ({"seed": -1}, "seed is -1"),
        ({"band": (0.1, 0.1)}, "lowest < highest"),
        ({"band": (0.1, 0.7)}, "Nyquist"),
        ({"band": (0.0, 1e-8)}, "samples of 1 s to settle.*Widen the band"),
        ({"band": 3}, "band is 3"),
        ({"sample_time": np.nan}, "sample_time is nan"),
        ({"offset": "zero"}, "offset is 'zero'"),
    ],
)
def test_noise_refuses(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        noise(**{"n_samples": 100, "sample_time": 1.0, "rms": 1.0, "seed": 0, **changes})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"order": 1}, "order is 1"),
        ({"order": 25}, "at most 24"),
        ({"order": 24, "periods": 2}, "too long"),
        ({"low": 1.0, "high": 1.0}, "low < high"),
        ({"hold": 0.25}, "hold is 0.25 s.*Use hold=1"),
        ({"hold": -1.0}, "hold is -1.0"),
        ({"periods": 0}, "periods is 0"),
        ({"high": np.inf}, "high is inf"),
    ],
)
def test_prbs_refuses(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        prbs(**{"order": 5, "sample_time": 1.0, "hold": 2.0, "low": 0.0, "high": 1.0, "seed": 0, **changes})
