"""Poles and zeros of one channel, with rigid bodies and integrators put back where they belong."""

from __future__ import annotations

import numpy as np
from scipy.linalg import matrix_balance

from ..._arrays import Array

_ROUNDING = 1e-13  # relative size below which a Markov parameter is none
# A k-fold root scatters by about rounding**(1/k), evenly round its place: nearest roots at most this far from 1 (or,
# relative to the largest, from 0) whose mean is much nearer are one multiple root. Slow poles lie on one side of it.
_SCATTER = {True: (1e-10, 1e-6, 3e-5), False: (1e-12, 1e-6, 3e-5)}  # discrete, continuous
_CENTERED = 1e-2


def snapped(roots: Array, dt: float) -> Array:
    """Roots of which the cluster at 1 (discrete) or 0 (continuous) is replaced by that number, k times.

    Parameters
    ----------
    roots : ndarray of complex
        Poles or zeros.
    dt : float
        Sample time [s]; 0 in continuous time.
    """
    origin = 1.0 if dt else 0.0
    size = 1.0 if dt else float(np.max(np.abs(roots), initial=0.0))
    order = np.argsort(np.abs(roots - origin))
    distance = np.abs(roots[order] - origin)
    result = np.array(roots, dtype=complex)
    for k in range(min(3, len(roots)), 0, -1):
        mean = abs(np.mean(roots[order[:k]] - origin))
        if distance[k - 1] <= _SCATTER[dt > 0][k - 1] * size and (k == 1 or mean <= _CENTERED * distance[k - 1]):
            result[order[:k]] = origin
            break
    return result


def paired(roots: Array) -> Array:
    """Roots as exact conjugate pairs and exact reals.

    Parameters
    ----------
    roots : ndarray of complex
        Roots of a real polynomial or matrix.
    """
    roots = np.asarray(roots, dtype=complex)
    above, below = roots[roots.imag > 0], roots[roots.imag < 0]
    if len(above) != len(below):  # rounding left a lone tiny imaginary part
        return roots.real.astype(complex)
    return np.concatenate([above, above.conj(), roots[roots.imag == 0]])


def number_of_zeros(A: Array, B: Array, C: Array, D: Array) -> int | None:
    """How many finite zeros one channel has, by orthogonal reduction; None: it passes nothing.

    Where the feedthrough vanishes, the output holds one state at zero; that state's equation is the next output
    (Emami-Naeini and Van Dooren 1982, for one input and one output). Every step takes one pole more than zeros.
    The numerator itself does not tell: a feedthrough of rounding would make one more zero, far away.

    Parameters
    ----------
    A, B, C, D : ndarray
        (n, n), (n, 1), (1, n), (1, 1).
    """
    A, B, C = _balanced(A, B, C)
    rounding = _ROUNDING * float(np.linalg.norm(B) * np.linalg.norm(C)) / max(1.0, float(np.linalg.norm(A)))
    while True:
        if abs(float(D[0, 0])) > rounding:
            return len(A)
        length = float(np.linalg.norm(C))
        if length == 0.0:
            return None
        basis = _last_axis(C[0] / length)
        A, B = basis.T @ A @ basis, basis.T @ B
        rounding = _ROUNDING * float(np.linalg.norm(B))
        A, B, C, D = A[:-1, :-1], B[:-1], A[-1:, :-1], B[-1:]


def _balanced(A: Array, B: Array, C: Array) -> tuple[Array, Array, Array]:
    """The same channel in state units that make its matrices of even size."""
    n = len(A)
    whole = np.block([[A, B], [C, np.zeros((1, 1))]])
    even = matrix_balance(whole, permute=False)[0]
    return even[:n, :n], even[:n, n:], even[n:, :n]


def _last_axis(direction: Array) -> Array:
    """Orthogonal matrix whose last column is the direction: a Householder reflection."""
    n = len(direction)
    axis = np.zeros(n)
    axis[-1] = 1.0
    sign = -1.0 if direction[-1] > 0 else 1.0
    v = direction - sign * axis
    v = v / np.linalg.norm(v)
    return sign * (np.eye(n) - 2 * np.outer(v, v))
