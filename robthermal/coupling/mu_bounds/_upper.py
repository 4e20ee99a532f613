"""Upper bound of the structured singular value: the best scaling that commutes with Delta, for all frequencies at once.

    min sigma_max(D_L M D_R⁻¹)   =   min gamma :  F = gamma² X_R − Mᴴ X_L M > 0,   X_L = D_Lᴴ D_L, X_R = D_Rᴴ D_R

is a generalized eigenvalue problem, quasi-convex in X, solved by the method of centers (Boyd and El Ghaoui, 1993):
Newton's method to the analytic center of F > 0, lower gamma towards sigma_max there, repeat. The dual matrix Z = F⁻¹ of
the last center shows in which directions no scaling helps: there the worst Delta is found.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._blocks import Complex, Real, Structure

_STALLED = 1e-6  # relative distance of gamma² to the center's sigma_max² at which it ends: it falls linearly
_SMALLEST = 1e-10  # smallest gamma² of interest, of the balanced matrix: mu = 0 is approached and never met
_BACK_OFF = 0.1  # where gamma² is put, between sigma_max² of the center (0) and the last gamma² (1)
_LOST = 1e-14  # condition beyond which an eigenvalue is rounding
_CENTERS = 60
_NEWTON_STEPS = 30
_NEAR_CENTER = 0.3  # Newton decrement at which a center is good enough
_MEMORY = 4_000_000  # complex numbers held at once


@dataclass(frozen=True)
class Scaling:
    """The best scalings found, frequency first.

    Parameters
    ----------
    upper : ndarray, shape (n_f,)
        sigma_max(left M right⁻¹).
    left, right : ndarray, shape (n_f, p, p) and (n_f, m, m)
        D_L and D_R.
    dual : ndarray, shape (n_f, m, m)
        Positive semidefinite matrix of inputs that no scaling can make small: where to look for the worst Delta.
    """

    upper: Real
    left: Complex
    right: Complex
    dual: Complex


def best_scaling(M: Complex, structure: Structure, enough: float = 0.0) -> Scaling:
    """Find the scalings of the smallest sigma_max(D_L M D_R⁻¹).

    Parameters
    ----------
    M : ndarray, shape (n_f, p, m)
        Matrices of all frequencies.
    structure : Structure
        Blocks of Delta.
    enough : float
        Value to be content with: the center there is far from every limit, and serves the longest interval.

    Returns
    -------
    Scaling
    """
    size = len(structure.basis[0]) * M.shape[1] * M.shape[2]
    step = max(1, _MEMORY // size)
    parts = [_best_scaling(M[k:k + step], structure, enough) for k in range(0, len(M), step)]
    return Scaling(*(np.concatenate([getattr(part, name) for part in parts])
                     for name in ("upper", "left", "right", "dual")))


def largest_gain(M: Complex) -> Real:
    """sigma_max of every matrix."""
    return np.linalg.norm(M, 2, axis=(-2, -1))


def scaled(left: Complex, M: Complex, right: Complex) -> Complex:
    """left M right⁻¹ of every matrix."""
    return left @ np.linalg.solve(right.mT, M.mT).mT


def _best_scaling(M: Complex, structure: Structure, enough: float) -> Scaling:
    left, right = _balance(M, structure)
    balanced = left[:, :, None] * M / right[:, None, :]
    gain = largest_gain(balanced)
    size = np.where(gain > 0, gain, 1.0)
    x, Z = _center(balanced / size[:, None, None], structure, (enough / size) ** 2)
    D_L, D_R = _factors(x, structure)
    D_L, D_R = D_L * left[:, None, :], D_R * right[:, None, :]
    return Scaling(largest_gain(scaled(D_L, M, D_R)), D_L, D_R, Z / (right[:, :, None] * right[:, None, :]))


def _balance(M: Complex, structure: Structure) -> tuple[Real, Real]:
    """Diagonal scalings (Osborne, 1960): a good start, and exact where blocks meet only in one off-diagonal pair."""
    groups_L, groups_R = _groups(structure)
    power = groups_L @ np.abs(M) ** 2 @ groups_R.T
    count = power.shape[1]
    power[:, np.arange(count), np.arange(count)] = 0.0
    d2 = np.ones((len(M), count))  # squares of the scalings
    for i in np.tile(np.arange(count), 6):
        row = (power[:, i, :] / d2).sum(1)
        column = (power[:, :, i] * d2).sum(1)
        both = (row > 0) & (column > 0)
        d2[both, i] = np.sqrt(column[both] / row[both])
    d = np.sqrt(d2 / np.exp(np.log(d2).mean(1, keepdims=True)))
    return d @ groups_L, d @ groups_R


def _groups(structure: Structure) -> tuple[Real, Real]:
    """Which outputs and inputs of M share one diagonal scaling: those of a full block."""
    m, p = structure.shape
    rows_L, rows_R = [], []
    for block in structure.blocks:
        for k in range(block.shape[0]) if block.repeated else (slice(None),):
            rows_L.append(np.zeros(p))
            rows_R.append(np.zeros(m))
            rows_L[-1][block.columns][k] = rows_R[-1][block.rows][k] = 1.0
    return np.array(rows_L), np.array(rows_R)


def _center(M: Complex, structure: Structure, enough2: Real) -> tuple[Real, Complex]:
    """Coordinates of the best X in the basis (n_f, k), and its dual matrix; sigma_max(M) is 1, or M is zero."""
    E_L, E_R = structure.basis
    Q = M.mT.conj()[:, None] @ E_L @ M[:, None]
    own = np.trace(E_R, axis1=1, axis2=2).real
    weight = own + np.trace(E_L, axis1=1, axis2=2).real
    x = np.tile((own > 0).astype(float), (len(M), 1))  # X = I
    best, Z = x.copy(), np.tile(np.eye(M.shape[2], dtype=complex), (len(M), 1, 1))
    gain2 = _gain2(x, Q, E_R)
    gamma2, todo = np.maximum(1.5 * gain2, enough2), np.flatnonzero(gain2 > _SMALLEST)
    for _ in range(_CENTERS):
        if not len(todo):
            break
        G = gamma2[todo, None, None, None] * E_R - Q[todo]
        x[todo] = _newton(x[todo], G, weight)
        dual = np.linalg.pinv(_sum(x[todo], G), hermitian=True)
        new = _gain2(x[todo], Q[todo], E_R)
        last = gamma2[todo] <= enough2[todo]
        better = todo[(new < gain2[todo]) | last]
        best[better], Z[todo] = x[better], dual
        gain2[todo] = np.minimum(gain2[todo], new)
        kept = np.minimum(new, gamma2[todo])
        gap = gamma2[todo] - kept
        gamma2[todo] = np.maximum(kept + _BACK_OFF * gap, enough2[todo])
        todo = todo[(gap > _STALLED * kept) & (kept > _SMALLEST) & ~last]
    return best, Z


def _newton(x: Real, G: Complex, weight: Real) -> Real:
    """Center of F = sum x G > 0: minimize −log det F + weight x (the weight fixes the free size of X)."""
    n_f, count = x.shape
    for _ in range(_NEWTON_STEPS):
        s, U = np.linalg.eigh(_sum(x, G))
        half = U / np.sqrt(np.maximum(s, _LOST * s[:, -1:]))[:, None, :]
        W = half.mT.conj()[:, None] @ G @ half[:, None]  # F^-1/2 G F^-1/2
        gradient = weight - np.trace(W, axis1=2, axis2=3).real
        flat = W.reshape(n_f, count, -1).view(float)
        hessian = flat @ flat.mT
        diagonal = np.arange(count)
        hessian[:, diagonal, diagonal] *= 1 + 1e-13  # keeps the solve defined where X is not unique
        step = -np.linalg.solve(hessian, gradient[:, :, None])[:, :, 0]
        decrement = np.sqrt(np.maximum(-(gradient * step).sum(1), 0.0))
        x = x + _length(np.linalg.eigvalsh(_sum(step, W)), step @ weight, decrement)[:, None] * step
        if decrement.max() < _NEAR_CENTER:
            break
    return x


def _length(rates: Real, slope: Real, decrement: Real) -> Real:
    """Step length: minimize −sum log(1 + t rates) + t slope over t, exactly enough, and stay inside."""
    furthest = np.where(rates[:, 0] < 0, -0.99 / np.minimum(rates[:, 0], -1e-9), 1e3)
    t = np.minimum(1 / (1 + decrement), furthest)
    for _ in range(4):
        part = rates / (1 + t[:, None] * rates)
        curvature = np.maximum((part**2).sum(1), np.finfo(float).tiny)
        t = np.clip(t - (slope - part.sum(1)) / curvature, 0.1 * t, np.minimum(10 * t, furthest))
    return t


def _sum(x: Real, G: Complex) -> Complex:
    return (x[:, None, :] @ G.reshape(*G.shape[:2], -1)).reshape(len(G), *G.shape[2:])


def _gain2(x: Real, Q: Complex, E_R: Complex) -> Real:
    """Largest generalized eigenvalue of (Mᴴ X_L M, X_R): sigma_max² of the scaled matrix; inf where X_R is lost."""
    s, U = np.linalg.eigh(np.tensordot(x, E_R, 1))
    half = U / np.sqrt(np.maximum(s, _LOST * s[:, -1:]))[:, None, :]
    gain2 = np.linalg.eigvalsh(half.mT.conj() @ _sum(x, Q) @ half)[:, -1]
    return np.where(s[:, 0] > _LOST * s[:, -1], gain2, np.inf)


def _factors(x: Real, structure: Structure) -> tuple[Complex, Complex]:
    """D_L and D_R with Dᴴ D = X, the same numbers in both: they commute with Delta exactly, as a proof needs."""
    m, p = structure.shape
    X_R = np.tensordot(x, structure.basis[1], 1)
    D_L, D_R = np.zeros((len(x), p, p), complex), np.zeros((len(x), m, m), complex)
    for block in structure.blocks:
        own = X_R[:, block.rows, block.rows]
        if block.repeated:
            D_L[:, block.columns, block.columns] = D_R[:, block.rows, block.rows] = _root(own)
        else:
            rows, columns = block.shape
            number = np.sqrt(own[:, :1, :1].real)
            D_L[:, block.columns, block.columns] = number * np.eye(columns)
            D_R[:, block.rows, block.rows] = number * np.eye(rows)
    return D_L, D_R


def _root(X: Complex) -> Complex:
    s, U = np.linalg.eigh(X)
    return (U * np.sqrt(np.maximum(s, _LOST * s[:, -1:]))[:, None, :]) @ U.mT.conj()
