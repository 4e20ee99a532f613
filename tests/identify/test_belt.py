"""Figures 3.3 and 3.8 of Evers (2021): the belt of (3.4) in its loop, from rest; spectral analysis against polynomial.

The thesis prints the plant, 1000 Hz, periods of 5 s, two of them (10 000 samples) and six; not its controller.
"""

from __future__ import annotations

import numpy as np
import pytest
import scipy

import robthermal as rt

TS, PERIOD = 1e-3, 5000
A = np.array([[0, 1, 0, 0], [-173, -8, 166, 1.33], [0, 0, 0, 1], [166, 1.33, -173, -8]])
B = np.array([[0.0], [53.0], [0.0], [0.0]])  # motor 1 and encoder 1 in the loop
HELD = scipy.linalg.expm(np.block([[A, B], [np.zeros((1, 5))]]) * TS)  # exact: the input is held between samples
(K0, K1), (_, POLE) = scipy.signal.bilinear([10 / 15, 10], [1 / 60, 1], 1 / TS)  # lead 10 (s/15 + 1)/(s/60 + 1)
LOW, MIDDLE, HIGH = (0.1, 2.0), (2.0, 10.0), (10.0, 450.0)  # Hz


def sensitivity(f: np.ndarray) -> np.ndarray:
    """u/d = 1/(1 + G K) of the sampled loop, from the matrices."""
    z = np.exp(2j * np.pi * f * TS)
    G = np.array([np.linalg.solve(each * np.eye(4) - HELD[:4, :4], HELD[:4, 4])[0] for each in z])
    return 1 / (1 + G * (K0 + K1 / z) / (1 + POLE / z))


@pytest.fixture(scope="module")
def loop() -> rt.Record:
    """Twelve periods of d and of u = d - K y, sample by sample, from rest, without noise."""
    d = rt.signals.multisine(PERIOD, sample_time=TS, band=(0.1, 450.0), rms=1.0, periods=12, seed=1)
    x, u, before = np.zeros(4), np.zeros(d.size), (0.0, 0.0)
    for n, each in enumerate(d):
        k = K0 * x[0] + K1 * before[0] - POLE * before[1]
        before = (x[0], k)
        u[n] = each - k
        x = HELD[:4, :4] @ x + HELD[:4, 4] * u[n]
    return rt.Record(sample_time=TS, inputs=d, outputs=u, input_names=["d"], output_names=["u"])


def error(estimate: rt.FrequencyResponse, band: tuple[float, float]) -> float:
    """Relative rms error at the excited lines, every 0.2 Hz, of a band."""
    line = estimate.frequencies * PERIOD * TS
    seen = (abs(line - np.round(line)) < 1e-6) & (estimate.frequencies >= band[0]) & (estimate.frequencies <= band[1])
    off = estimate.response[0, 0, seen] / sensitivity(estimate.frequencies[seen]) - 1
    return float(np.sqrt(np.mean(abs(off) ** 2)))


def rectangular(record: rt.Record, periods: int) -> rt.FrequencyResponse:
    return rt.identify.spectral(record[:periods * PERIOD], segments=periods, window="rectangular", overlap=0.0)


def hann(record: rt.Record, periods: int) -> rt.FrequencyResponse:
    """As in the thesis: segments of one period."""
    return rt.identify.spectral(record[:periods * PERIOD], segments=periods, window="hann", overlap=0.0)


@pytest.mark.parametrize("band", [LOW, MIDDLE, HIGH])
def test_the_polynomial_removes_the_transient(loop: rt.Record, band: tuple[float, float]) -> None:
    """Figure 3.3: two periods, 10 000 samples."""
    polynomial = error(rt.identify.lpm(loop[:2 * PERIOD]), band)
    assert polynomial < 0.7 * error(hann(loop, 2), band)
    assert polynomial < 0.5 * error(rectangular(loop, 2), band)
    assert band is LOW or polynomial < 0.25 * error(rectangular(loop, 2), band)


def test_the_gain_of_the_hann_window_at_two_periods_is_misleading(loop: rt.Record) -> None:
    """As the text says: better at two periods, worse at more. Without window a transient that ends in the first
    period is divided by their number; the leakage of the window stays."""
    two, six, twelve = (error(rectangular(loop, n), LOW) for n in (2, 6, 12))
    assert error(hann(loop, 2), LOW) < two
    assert two / six == pytest.approx(3.0, rel=0.05) and six / twelve == pytest.approx(2.0, rel=0.05)
    assert error(hann(loop, 6), LOW) > 1.5 * six
    assert error(hann(loop, 12), LOW) == pytest.approx(error(hann(loop, 6), LOW), rel=0.1)


def test_a_window_over_two_periods_does_not_leak(loop: rt.Record) -> None:
    """Corrected: "no window should be used" holds for segments of one period. Hann's window reaches one bin to either
    side, and over two periods those bins are empty: it keeps the lines apart and removes most of the transient."""
    three = loop[:3 * PERIOD]
    over_two = rt.identify.spectral(three, segments=2, window="hann", overlap=0.5)
    assert error(over_two, LOW) < 0.1 * error(rectangular(loop, 3), LOW)
    assert error(over_two, MIDDLE) < 0.1 * error(rectangular(loop, 3), MIDDLE)


def test_the_poles_of_the_loop_leave_nothing_of_the_transient(loop: rt.Record) -> None:
    K_C, K_A = K1 - POLE * K0, -POLE
    closed = np.block([[HELD[:4, :4] - np.outer(HELD[:4, 4], [K0, 0, 0, 0]), -HELD[:4, 4:] * K_C],
                       [np.array([[1.0, 0, 0, 0, K_A]])]])
    known = rt.identify.lrmp(loop[:2 * PERIOD], poles=list(np.log(np.linalg.eigvals(closed).astype(complex)) / TS))
    assert error(known, LOW) < 1e-3 * error(rt.identify.lpm(loop[:2 * PERIOD]), LOW)


def test_two_noisy_periods_against_the_baseline_of_six(loop: rt.Record) -> None:
    """Figure 3.8: no truth there, six periods are the reference."""
    noise = 1e-3 * np.random.default_rng(1).standard_normal(loop.outputs.shape)
    seen = loop.with_outputs(loop.outputs + noise)
    reference = rt.identify.lpm(seen[:6 * PERIOD])
    band = {round(f, 6): g for f, g in zip(reference.frequencies, reference.response[0, 0], strict=True)}

    def off(estimate: rt.FrequencyResponse, low: float, high: float) -> float:
        f = np.round(np.arange(low, high, 0.2), 6)
        own = dict(zip(np.round(estimate.frequencies, 6), estimate.response[0, 0], strict=True))
        return float(np.sqrt(np.mean([abs(own[each] / band[each] - 1) ** 2 for each in f])))

    polynomial = rt.identify.lpm(seen[:2 * PERIOD])
    assert off(polynomial, 1.0, 20.0) < 0.4 * off(rectangular(seen, 2), 1.0, 20.0)
    assert off(polynomial, 1.0, 20.0) < 0.4 * off(hann(seen, 2), 1.0, 20.0)
    assert error(reference, LOW) < 0.05 * error(rectangular(loop, 2), LOW)  # it deserves to be the reference
