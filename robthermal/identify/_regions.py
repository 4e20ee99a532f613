"""Confidence circles, and the covariance of several bins together."""

from __future__ import annotations

import numpy as np

from robthermal._arrays import Array
from robthermal.errors import InputError

from ._threads import run_all

_PIECE = 2**13  # bins that one thread multiplies at a time


def kronecker(gram: Array, noise: Array) -> Array:
    """Covariances (n_u n_y, n_u n_y, F) of a gram block (n_u, n_u, F) and noise covariances (n_y, n_y, F).

    Evers (4.16): the Kronecker product puts the input index outside, the output index inside.
    """
    n_u, n_y, n_f = len(gram), len(noise), gram.shape[-1]
    product = np.empty((n_u, n_y, n_u, n_y, n_f), dtype=complex)

    def multiply(start: int) -> None:
        part = slice(start, start + _PIECE)
        # np.einsum takes 1.4 to 2.4 times as long: its products of complex numbers are one by one.
        np.multiply(gram[:, None, :, None, part], noise[None, :, None, :, part], out=product[..., part])

    run_all(multiply, range(0, n_f, _PIECE), worth=n_f > 4 * _PIECE)
    return product.reshape(n_u * n_y, n_u * n_y, n_f)


def quantile(p: float, q: Array) -> Array:
    """F_p(2, 2q), from P(F > x) = (1 + x/q)^(-q); infinite where no degrees of freedom are left."""
    real = isinstance(p, (int, float, np.floating)) and not isinstance(p, bool)
    if not real or not 0.0 < p < 1.0:
        raise InputError(f"the confidence level p is {p!r}", where="p", expected="a number between 0 and 1, as 0.95")
    q = np.asarray(q, dtype=float)
    some = q > 0
    kept = np.where(some, q, 1.0)
    return np.where(some, kept * np.expm1(-np.log1p(-p) / kept), np.inf)


def radius_of(variance: Array, degrees_of_freedom: Array, ratio_uncertainty: Array | None, p: float) -> Array:
    """Radii of the circles that hold each entry of G with probability `p`, as `FrequencyResponse.confidence_radius`."""
    factor = quantile(p, degrees_of_freedom)
    with np.errstate(invalid="ignore", divide="ignore"):
        radius = factor * variance
        np.sqrt(radius, out=radius)
        if ratio_uncertainty is not None:
            left = 1.0 - np.sqrt(factor) * ratio_uncertainty
            radius = np.where(left > 0.0, radius / left, np.inf)
    radius[np.isnan(radius)] = np.inf
    return radius


def independent_blocks(covariance: Array, index: Array) -> Array:
    """Joint covariance of bins that share no data: blocks on the diagonal."""
    block, n_b = len(covariance), index.size
    joint = np.zeros((n_b, block, n_b, block), dtype=complex)
    for place, b in enumerate(index):
        joint[place, :, place] = covariance[..., b]
    return joint.reshape(n_b * block, n_b * block)


def correlated_blocks(weights: Array, rows: Array, noise: Array) -> Array:
    """Joint covariance of bins whose weights (n_u, m, B) act on common rows, with the noise (n_y, n_y, B) of each."""
    shared = shared_data(weights, rows)
    mean = 0.5 * (noise[..., :, None] + noise[..., None, :])  # the noise level may differ a little between the two
    joint = np.einsum("aibj,opab->aiobjp", shared, mean)
    size = len(noise) * shared.shape[0] * shared.shape[1]
    return joint.reshape(size, size)


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
