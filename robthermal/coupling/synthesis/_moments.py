"""Exact variances of the synchronization error as quadratic forms in the coefficients.

The error that one filter shapes is (1 + Z Σ c_k f_k) applied to a colored noise: affine in the coefficients, so its
variance is [1, c] G [1, c]ᵀ. G comes from one Lyapunov equation, not from a frequency grid.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_continuous_lyapunov, solve_discrete_lyapunov

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ..systems import series
from ._basis import Basis


def moments(signal: control.StateSpace, factor: control.StateSpace, basis: Basis, samples: int) -> tuple[Array, Array]:
    """Gram matrices of (signal, factor signal, factor f_1 signal, ...), white noise into `signal`.

    Parameters
    ----------
    signal : StateSpace
        Colored noise of one subsystem in e12, SISO, stable.
    factor : StateSpace
        Z of that filter.
    basis : Basis
        Basis functions f_k of the filters.
    samples : int
        Length N of the moving average; 1 for none.

    Returns
    -------
    total, average : ndarray, shape (n + 1, n + 1)
        Covariance of the regressors, and of their moving averages over N samples.
    """
    chain = series(_stacked(series(basis.all(), factor)), signal)
    A, B, C, D = (np.asarray(part) for part in (chain.A, chain.B, chain.C, chain.D))
    if not basis.sample_time:
        if np.any(D):
            raise InputError("the variance of e12 is infinite: disturbance and weight do not roll off",
                             where="synthesize, argument disturbances", expected="strictly proper shaping filters",
                             remedy='Add a lowpass to the disturbance or to the weight, or use objective="hinf".')
        return _pair(C @ solve_continuous_lyapunov(A, -B @ B.T) @ C.T)
    P = solve_discrete_lyapunov(A, B @ B.T)
    total = C @ P @ C.T + D @ D.T
    # R(l) = C A^(l-1) G is the covariance at lag l >= 1; the mean of N samples has Σ_l (N - |l|) R(l) / N²  (Horner).
    G = A @ P @ C.T + B @ D.T
    lagged = np.zeros_like(G)
    for weight in range(1, samples):
        lagged = weight * G + A @ lagged
    later = C @ lagged
    return _half(total), _half(samples * total + later + later.T) / samples**2


def square_root(gram: Array) -> Array:
    """R with RᵀR = gram, negative eigenvalues (rounding) left out."""
    values, vectors = np.linalg.eigh(gram)
    kept = values > values[-1] * len(gram) * np.finfo(float).eps
    return (np.sqrt(values[kept]) * vectors[:, kept]).T


def _stacked(system: control.StateSpace) -> control.StateSpace:
    """Outputs (input, outputs of the system)."""
    D = np.vstack([[[1.0]], system.D])
    C = np.vstack([np.zeros((1, system.nstates)), system.C])
    return control.StateSpace(system.A, system.B, C, D, system.dt, remove_useless_states=False)


def _half(gram: Array) -> Array:
    return (gram + gram.T) / 2


def _pair(gram: Array) -> tuple[Array, Array]:
    return _half(gram), _half(gram)
