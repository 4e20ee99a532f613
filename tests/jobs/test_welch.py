"""Welch's spectra, against scipy.signal."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from robthermal.jobs.diagnose._welch import welch


@pytest.mark.parametrize(("n", "length"), [(2, 2), (3, 3), (9, 8), (31, 8), (100, 25), (1501, 375), (1500, 376)])
def test_welch_is_that_of_scipy(n: int, length: int) -> None:
    values = np.random.default_rng(n).normal(size=n).cumsum() + 300.0
    found, expected = welch(values, 0.3, length), signal.welch(values, fs=1.0 / 0.3, nperseg=length)
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-15)
    np.testing.assert_allclose(found[1], expected[1], rtol=1e-9, atol=1e-13 * expected[1].max())


def test_what_is_not_known_is_not_known_at_any_frequency() -> None:
    """A model that runs away."""
    assert np.isnan(welch(np.full(100, np.nan), 1.0, 25)[1]).all()
