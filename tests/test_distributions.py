"""Tails of distributions, against scipy.stats."""

from __future__ import annotations

import numpy as np
from scipy import stats

from robthermal._distributions import chi2_isf, chi2_sf, f_isf, f_sf, t_isf

VALUES = np.array([0.0, 1e-12, 1e-3, 0.7, 5.0, 80.0, 1e5, np.inf, np.nan])
CHANCES = np.array([1e-12, 1e-4, 0.025, 0.5, 0.999])
FREEDOM = np.array([0.3, 1.0, 2.5, 7.0, 300.0, 1e6])


def test_tails_are_those_of_scipy_stats() -> None:
    x, chance, own = VALUES[:, None], CHANCES[:, None], FREEDOM
    np.testing.assert_array_equal(chi2_sf(x, own), stats.chi2.sf(x, own))
    np.testing.assert_array_equal(chi2_isf(chance, own), stats.chi2.isf(chance, own))
    np.testing.assert_array_equal(t_isf(chance, own), stats.t.isf(chance, own))
    for above in FREEDOM:
        np.testing.assert_array_equal(f_sf(x, above, own), stats.f.sf(x, above, own))
        np.testing.assert_array_equal(f_isf(chance, above, own), stats.f.isf(chance, above, own))


def test_without_degrees_of_freedom_nothing_is_known() -> None:
    """Not a chance of 0, which would call everything significant."""
    found = [chi2_sf(1.0, 0), chi2_sf(0.0, 0), chi2_isf(0.1, 0), f_sf(1.0, 0, 3), f_sf(1.0, 3, 0), t_isf(0.1, 0)]
    assert np.isnan(found).all()
