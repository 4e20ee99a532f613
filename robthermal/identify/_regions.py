"""Confidence circles, and the covariance of several bins together."""

from __future__ import annotations

import numpy as np
from scipy import stats

from robthermal._arrays import Array
from robthermal.errors import InputError


def quantile(p: float, q: Array) -> Array:
    """F_p(2, 2q); infinite where no degrees of freedom are left."""
    real = isinstance(p, (int, float, np.floating)) and not isinstance(p, bool)
    if not real or not 0.0 < p < 1.0:
        raise InputError(f"the confidence level p is {p!r}", where="p", expected="a number between 0 and 1, as 0.95")
    q = np.asarray(q, dtype=float)
    values, place = np.unique(q, return_inverse=True)
    quantiles = np.array([stats.f.ppf(p, 2, 2 * v) if v > 0 else np.inf for v in values])
    return quantiles[place]


def shared_data(weights: Array, rows: Array) -> Array:
    """Inner products of the weights of bins a and b over the rows they share, (B, n_u, B, n_u)."""
    n_u, _, n_b = weights.shape
    flat = _on_common_rows(weights, rows)
    return (flat @ flat.conj().T).reshape(n_b, n_u, n_b, n_u)


def _on_common_rows(weights: Array, rows: Array) -> Array:
    """Weights (n_u, m, B) of rows numbered (B, m), spread over the union of all rows: (B n_u, n_rows)."""
    labels, place = np.unique(rows, return_inverse=True)
    place = place.reshape(rows.shape)
    n_u, _, n_b = weights.shape
    flat = np.zeros((n_b, n_u, labels.size), dtype=complex)
    for b in range(n_b):
        flat[b][:, place[b]] = weights[..., b]
    return flat.reshape(n_b * n_u, labels.size)
