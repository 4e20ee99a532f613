"""Why a record of the closed loop does not replace the count: an unstable loop whose record passes every check."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import robthermal as rt
from robthermal._arrays import Array

GAIN, SAMPLES, DT = 20.0, 1000, 0.01
MODEL = np.array([0.01]), np.array([1.0, -0.99])  # P0, falling powers of z
SLOW = np.array([-5e-4]), np.array([1.0, -0.99999])  # what the machine has besides, slower than the record
STABLE = np.array([-5e-4]), np.array([1.0, -0.9985])  # another slow part, with which the loop is stable


def machine(slow: tuple[Array, Array] = SLOW) -> tuple[Array, Array]:
    """P = P0 + the slow part."""
    return (np.polyadd(np.polymul(MODEL[0], slow[1]), np.polymul(slow[0], MODEL[1])), np.polymul(MODEL[1], slow[1]))


def closed(plant: tuple[Array, Array]) -> tuple[Array, Array]:
    """S = 1/(1 + P K)."""
    return plant[1], np.polyadd(plant[1], GAIN * plant[0])


def error_of(plant: tuple[Array, Array], r: Array, v: Array) -> Array:
    """e = S (r - v), from rest, sample by sample."""
    return np.asarray(lfilter(*closed(plant), r - v))


def sensitivity(plant: tuple[Array, Array], hertz: Array) -> Array:
    z = np.exp(2j * np.pi * DT * hertz)
    return np.asarray(np.polyval(closed(plant)[0], z) / np.polyval(closed(plant)[1], z))


def signals(samples: int, seed: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    return rng.standard_normal(samples), 0.05 * rng.standard_normal(samples)


@pytest.mark.parametrize("seed", range(5))
def test_an_unstable_loop_has_a_finite_sensitivity_that_agrees_and_signals_that_do_not_grow(seed: int) -> None:
    """Every check that a record of 1000 samples allows is passed; after 40 000 samples the loop has diverged."""
    assert np.abs(np.roots(closed(MODEL)[1])).max() < 0.8
    assert np.abs(np.roots(closed(machine(STABLE))[1])).max() < 0.9991
    assert 1.0004 < np.abs(np.roots(closed(machine())[1])).max() < 1.0005
    r, v = signals(SAMPLES, seed)
    e = error_of(machine(), r, v)
    S = rt.identify.lpm(rt.Record(sample_time=DT, inputs=r, outputs=e, input_names=["r"], output_names=["e"]))
    radius = S.confidence_radius(1 - 0.05 / len(S))[0, 0]
    assert np.isfinite(radius).all()
    for plant in (machine(), machine(STABLE)):  # agrees at every bin, with a stable loop as well
        assert np.all(np.abs(S.response[0, 0] - sensitivity(plant, S.frequencies)) <= radius)
    assert np.std(e[SAMPLES // 2:]) < 1.2 * np.std(e[:SAMPLES // 2])
    long = error_of(machine(), *signals(40_000, seed))
    assert np.abs(long[-1000:]).max() > 1000 * np.abs(e).max()
