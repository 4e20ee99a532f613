"""Suspect bins against their definition, bin by bin, however the bins are cut into pieces."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from robthermal.identify import _suspect


def by_definition(variance: np.ndarray, q: np.ndarray, half_width: int, rounding: np.ndarray) -> np.ndarray:
    """Each bin beside the medians of the windows next to its own, one at a time."""
    n_y, n = variance.shape
    gap, reach = 2 * half_width + 1, 6 * max(half_width, 1)
    if n < gap + reach:
        gap, reach = min(gap, n // 2), max(1, n // 4)
    stride, independent = max(1, reach // 2), max(2.0, 1.5 * reach / gap)
    found, free = np.zeros(n, dtype=bool), np.maximum(q, 1)
    limit = stats.f.isf(2e-3 / n_y, 2.0 * free, 2.0 * free * independent)
    for o in range(n_y):
        row = variance[o] / (1.0 - 1.0 / (9.0 * free)) ** 3
        starts = range(0, n - reach + 1, stride)
        median_of = {i: np.median(row[i : i + reach]) for i in starts}
        for k in range(n):
            right = [i for i in starts if i >= k + gap][:1]
            left = [i for i in starts if i + reach - 1 <= k - gap][-1:]
            medians = [median_of[i] for i in (*left, *right)] or [np.median(row)]
            found[k] |= variance[o, k] > limit[k] * max(min(medians), rounding[o] ** 2)
    return found


@pytest.mark.parametrize("piece", [7, 64, 2**14])
@pytest.mark.parametrize(("n", "half_width"), [(2, 1), (17, 3), (40, 8), (66, 8), (300, 0), (300, 4), (700, 8)])
def test_bins_are_those_of_the_definition(n: int, half_width: int, piece: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_suspect, "_PIECE", piece)
    rng = np.random.default_rng(n + half_width)
    variance = rng.chisquare(18, size=(2, n)) * np.array([[1e-4], [3.0]])
    variance[:, rng.integers(0, n, 1 + n // 40)] *= 40.0
    same, other = np.full(n, 9), rng.integers(0, 10, n)
    quiet, loud = np.zeros(2), np.array([0.0, 20.0])
    for q, rounding in ((same, quiet), (other, quiet), (same, loud)):
        found = _suspect.suspect_bins(variance, q, half_width, rounding)
        np.testing.assert_array_equal(found, by_definition(variance, q, half_width, rounding))
