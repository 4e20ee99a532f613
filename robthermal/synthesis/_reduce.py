"""Controllers with fewer states: balanced truncation of the stable part."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cholesky, schur, solve_continuous_lyapunov, solve_discrete_lyapunov, solve_sylvester, svd

from .._arrays import Array
from .._checks import whole_number
from ..errors import InputError
from ..linear import Plant


def shortened(K: Plant, order: int) -> Plant:
    """K with at most `order` states; unstable modes stay. Nothing is claimed: whoever asks certifies the result."""
    wanted = whole_number(order, "order", 0)
    n = len(K.A)
    if wanted >= n:
        return K
    T, stable = _parted(K.A, bool(K.dt))
    if n - stable > wanted:
        raise InputError(f"order = {wanted}: the controller has {n - stable} unstable modes", where="argument order",
                         expected=f"at least {n - stable}")
    A, B, C = np.linalg.solve(T, K.A @ T), np.linalg.solve(T, K.B), K.C @ T
    s, keep = slice(0, stable), wanted - (n - stable)
    L, R = _balancing(A[s, s], B[s], C[:, s], bool(K.dt), keep)
    rest = slice(stable, n)
    zero = np.zeros((keep, n - stable))
    return Plant(np.block([[L @ A[s, s] @ R, zero], [zero.T, A[rest, rest]]]), np.vstack([L @ B[s], B[rest]]),
                 np.hstack([C[:, s] @ R, C[:, rest]]), K.D, K.dt)


def _parted(A: Array, sampled: bool) -> tuple[Array, int]:
    """T with T⁻¹ A T block diagonal, stable modes first, and their number."""
    S, U, count = schur(A, sort="iuc" if sampled else "lhp")
    n = len(A)
    X = solve_sylvester(S[:count, :count], -S[count:, count:], -S[:count, count:]) if 0 < count < n else None
    shear = np.eye(n)
    if X is not None:
        shear[:count, count:] = X
    return U @ shear, int(count)


def _balancing(A: Array, B: Array, C: Array, sampled: bool, keep: int) -> tuple[Array, Array]:
    """Left and right projections on the `keep` states of the largest Hankel singular values."""
    if sampled:
        Wc, Wo = solve_discrete_lyapunov(A, B @ B.T), solve_discrete_lyapunov(A.T, C.T @ C)
    else:
        Wc, Wo = solve_continuous_lyapunov(A, -B @ B.T), solve_continuous_lyapunov(A.T, -C.T @ C)
    roots = [_root(W) for W in (Wc, Wo)]
    U, sigma, Vt = svd(roots[1].T @ roots[0])
    keep_sigma = np.sqrt(np.maximum(sigma[:keep], 1e-300))
    return (U[:, :keep] / keep_sigma).T @ roots[1].T, roots[0] @ Vt[:keep].T / keep_sigma


def _root(W: Array) -> Array:
    """Lower triangular L with L L' close to W, which rounding may leave a little indefinite."""
    size = float(np.trace(W)) or 1.0
    lower: Array = cholesky((W + W.T) / 2 + 1e-14 * size * np.eye(len(W)), lower=True)
    return lower
