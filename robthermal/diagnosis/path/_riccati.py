"""Covariances along a record: in C where that was built, else without a loop over its samples.

Blocks of samples are mapped together, then run together.

With S = C P Cᵀ + R the covariance of the prediction becomes A (P - P Cᵀ S⁻¹ C P) Aᵀ + Q = A P (1 + G P)⁻¹ Aᵀ + Q with
G = Cᵀ R⁻¹ C. Such maps, (A, G, H): P → H + A P (1 + G P)⁻¹ Aᵀ, follow each other as one of the same form (Anderson
1978, the doubling algorithm; Särkkä and García-Fernández 2021):

    A = A₂ W A₁,   G = G₁ + A₁ᵀ G₂ W A₁,   H = H₂ + A₂ W H₁ A₂ᵀ,   W = (1 + H₁ G₂)⁻¹.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ._filter import compiled_for

Array = NDArray[np.float64]
_SHORTEST = 32  # samples of a block: below, a loop over the samples is as fast
_DOUBLINGS = 60  # more samples than any record has
_SETTLED = 1e-13  # relative change
_UNBOUNDED = 1e60  # K², beyond any temperature


def filtered(A: Array, C: Array, R: Array, Q: Array, P: Array) -> tuple[Array, Array]:
    """Gains (n, n_z, n_s) and inverse Cholesky factors (n, n_s, n_s) of the innovations of a Kalman filter.

    Parameters
    ----------
    A, C, R, Q : ndarray, shapes (n, n_z, n_z), (n, n_s, n_z), (n, n_s, n_s), (n, n_z, n_z)
        Transitions, sensors, covariances of the readings' noise and of what every sample adds.
    P : ndarray, shape (n_z, n_z)
        Covariance before the first sample.
    """
    compiled = compiled_for(C)
    return _in_numpy(A, C, R, Q, P) if compiled is None else compiled.filtered(A, C, R, Q, P)


def _in_numpy(A: Array, C: Array, R: Array, Q: Array, P: Array) -> tuple[Array, Array]:
    n, (n_s, n_z) = len(A), C.shape[1:]
    each = [_in_blocks(one) for one in (A, C, R, Q)]
    blocks, length = each[0].shape[:2]
    P = _starts(each[0], _in_blocks(C.swapaxes(1, 2) @ np.linalg.solve(R, C)), each[3], P)
    gains, roots = np.empty((blocks, length, n_z, n_s)), np.empty((blocks, length, n_s, n_s))
    for k in range(length):
        a, c, r, q = (one[:, k] for one in each)
        seen = P @ c.swapaxes(1, 2)
        root = np.linalg.inv(np.linalg.cholesky(c @ seen + r))
        weighed = seen @ root.swapaxes(1, 2)
        gains[:, k], roots[:, k] = weighed @ root, root
        P = a @ (P - weighed @ weighed.swapaxes(1, 2)) @ a.swapaxes(1, 2) + q
        P = 0.5 * (P + P.swapaxes(1, 2))
    return gains.reshape(-1, n_z, n_s)[:n], roots.reshape(-1, n_s, n_s)[:n]


def settled(A: Array, C: Array, R: Array, Q: Array) -> Array:
    """Covariance (n_z, n_z) to which that of the prediction settles: the same step doubled until it no longer changes.

    Parameters
    ----------
    A, C, R, Q : ndarray, shapes (n_z, n_z), (n_s, n_z), (n_s, n_s), (n_z, n_z)
        Transition, sensors, covariances of the readings' noise and of what every sample adds.

    Raises
    ------
    numpy.linalg.LinAlgError
        Where it grows without limit.
    """
    one, a, g, h = np.eye(len(A)), A, C.T @ np.linalg.solve(R, C), Q
    for _ in range(_DOUBLINGS):
        W = np.linalg.inv(one + h @ g)
        passed, through = W @ a, a @ W
        added = through @ h @ a.T
        a, g, h = a @ passed, g + a.T @ g @ passed, h + 0.5 * (added + added.T)
        if not np.abs(h).max() < _UNBOUNDED:
            break
        if np.abs(added).max() <= _SETTLED * np.abs(h).max():
            return h
    raise np.linalg.LinAlgError("the covariance of the prediction does not settle")


def spread(A: Array, Q: Array, P: Array | None = None) -> Array:
    """Covariances (n, n_z, n_z) before every sample of δ(k+1) = A(k) δ(k) + w(k), cov w = Q(k).

    Parameters
    ----------
    A, Q : ndarray, shape (n, n_z, n_z)
        Transitions, and covariances of what every sample adds.
    P : ndarray, shape (n_z, n_z), optional
        Covariance before the first sample; default 0.
    """
    a, q = _in_blocks(A), _in_blocks(Q)
    P = _starts(a, np.zeros(a.shape), q, np.zeros(A.shape[1:]) if P is None else P)
    out = np.empty(a.shape)
    for k in range(a.shape[1]):
        out[:, k] = P
        P = a[:, k] @ P @ a[:, k].swapaxes(1, 2) + q[:, k]
    return out.reshape(-1, *A.shape[1:])[:len(A)]


def _in_blocks(each: Array) -> Array:
    """(blocks, length, ...) of (n, ...), the last filled up with its last sample; the samples if they are few."""
    n = len(each)
    length = n if n < 4 * _SHORTEST else max(_SHORTEST, round(np.sqrt(n)))
    short = -n % length
    return np.concatenate([each, np.repeat(each[-1:], short, axis=0)]).reshape(-1, length, *each.shape[1:])


def _starts(A: Array, G: Array, Q: Array, P: Array) -> Array:
    """Covariances at the start of every block, from those before the first."""
    starts = np.empty((len(A), *P.shape))
    starts[0] = P
    if len(A) == 1:
        return starts
    one = np.eye(P.shape[0])
    a, g, h = A[:, 0], G[:, 0], Q[:, 0]
    for k in range(1, A.shape[1]):
        A2, G2 = A[:, k], G[:, k]
        W = np.linalg.inv(one + h @ G2)
        passed, through = W @ a, A2 @ W
        g = g + a.swapaxes(1, 2) @ (G2 @ passed)
        a, h = A2 @ passed, Q[:, k] + through @ h @ A2.swapaxes(1, 2)
        h = 0.5 * (h + h.swapaxes(1, 2))
    for k in range(len(A) - 1):
        P = h[k] + a[k] @ P @ np.linalg.solve(one + g[k] @ P, a[k].T)
        starts[k + 1] = P = 0.5 * (P + P.T)
    return starts
