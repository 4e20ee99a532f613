"""How far the parameters of healthy records scatter: a random-effects model on the linearized reference records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fit import Refit

Array = NDArray[np.float64]
ASSUMED = 0.03  # relative scatter of a parameter before any record is seen
COUNTS = 4.0  # records that this assumption counts for
_ROUNDS = 200
_STILL = 1e-4  # relative change of the scatter
_BLOCKS = 12  # of every record


@dataclass(frozen=True, eq=False)
class Scatter:
    """What healthy records say of the parameters of the next one, in the optimizer's coordinates.

    Parameters
    ----------
    center : ndarray, shape (p,)
        Mean of the parameters on a healthy day.
    std : ndarray, shape (p,)
        Standard deviation of each from record to record.
    covariance : ndarray, shape (p, p)
        Of the center.
    inflation : float
        Factor of the variance of scores over that of white residuals: 1 without a remainder.
    """

    center: Array
    std: Array
    covariance: Array
    inflation: float

    @property
    def next_one(self) -> Array:
        """Covariance of the parameters of a record to come, (p, p)."""
        return np.asarray(np.diag(self.std**2) + self.covariance, np.float64)


@dataclass(frozen=True, eq=False)
class _Record:
    """One record as the parameters see it: whitened derivatives and residual, its own unknowns projected out."""

    A: Array
    z: Array
    blocks: list[Array]

    @property
    def information(self) -> Array:
        return np.asarray(self.A.T @ self.A, np.float64)

    @property
    def score(self) -> Array:
        return np.asarray(self.A.T @ self.z, np.float64)

    def inflation(self) -> float:
        """Variance of the scores of blocks over that of white residuals, parameters of its own subtracted."""
        scale = np.linalg.norm(self.A, axis=0)
        A = self.A[:, scale > 0] / scale[scale > 0]
        if not A.shape[1]:
            return float(self.z @ self.z) / max(self.z.size, 1)
        left = self.z - A @ np.linalg.lstsq(A, self.z, rcond=1e-8)[0]
        scores = np.array([A[rows].T @ left[rows] for rows in self.blocks])
        free = len(self.blocks) / max(len(self.blocks) - min(A.shape[1], len(self.blocks) - 2), 1)
        return free * float(np.mean(np.sum(scores**2, axis=0)))


def scatter_of(fit: Refit) -> Scatter:
    """Scatter of the parameters over the records of a fit.

    Parameters
    ----------
    fit : Refit
        Common fit to the reference records.
    """
    structure = fit.structure
    records = _records(fit)
    inflation = max(1.0, float(np.mean([one.inflation() for one in records])))
    center = fit.v[:structure.n_parameters]
    unit = structure.ranges.unit
    M = [one.information / inflation for one in records]
    s = [one.score / inflation for one in records]
    known = np.where(np.isfinite(structure.ranges.sigma), structure.ranges.sigma / structure.ranges.slopes(
        structure.ranges.values(center)), structure.ranges.spread)
    std, shift, covariance = random_effects(M, s, ASSUMED * unit, known)
    return Scatter(center + shift, std, covariance, inflation)


def random_effects(M: Sequence[Array], s: Sequence[Array], assumed: Array, widest: Array
                   ) -> tuple[Array, Array, Array]:
    """Scatter (p,), mean (p,) and its covariance (p, p) of record-wise shifts (Laird and Ware 1982).

    Parameters
    ----------
    M, s : sequence of ndarray
        Information (p, p) and score (p,) of every record.
    assumed : ndarray, shape (p,)
        Scatter before any record is seen; it counts as `COUNTS` records.
    widest : ndarray, shape (p,)
        Standard deviation of the mean if no record tells anything about it.
    """
    variance, n = np.asarray(assumed**2, np.float64), len(M)
    eye = np.eye(assumed.size)
    for _ in range(_ROUNDS):
        S_inverse = np.diag(1.0 / variance)
        Q = [np.linalg.solve(one + S_inverse, eye) for one in M]
        W = sum((S_inverse - S_inverse @ q @ S_inverse for q in Q), np.diag(widest**-2.0))
        P = np.linalg.pinv(W, hermitian=True)
        mean = P @ sum((S_inverse @ q @ score for q, score in zip(Q, s, strict=True)), np.zeros(assumed.size))
        own = [q @ (score + S_inverse @ mean) - mean for q, score in zip(Q, s, strict=True)]
        turns = [q @ S_inverse - eye for q in Q]  # of the mean, whose own uncertainty counts too
        seen = sum((m**2 + np.diag(q + turn @ P @ turn.T) for m, q, turn in zip(own, Q, turns, strict=True)),
                   np.zeros(assumed.size))
        new = (COUNTS * assumed**2 + seen) / (COUNTS + n)
        still = bool(np.all(np.abs(new - variance) < _STILL * variance))
        variance = new
        if still:
            break
    return np.sqrt(variance), np.asarray(mean, np.float64), np.asarray(P, np.float64)


def _records(fit: Refit) -> list[_Record]:
    structure = fit.structure
    p, first = structure.n_parameters, structure.n_common
    own_rows = slice(fit.n_readings + structure.n_priors, fit.z.size)
    out, row = [], 0
    for one in structure.data:
        n, n_sensors = one.readings.shape
        rows = np.r_[row:row + n * n_sensors]
        B = fit.J[rows, first:]
        mine = np.flatnonzero(np.any(B != 0.0, axis=0))
        priors = own_rows.start + mine  # one row per unknown of the records
        both = np.concatenate([rows, priors])
        Q = np.linalg.qr(np.concatenate([B[:, mine], np.eye(mine.size)])).Q
        A, z = (block - Q @ (Q.T @ block) for block in (fit.J[both, :p], fit.z[both]))
        out.append(_Record(A, z, [n_sensors * part[0] + np.arange(n_sensors * part.size)
                                  for part in np.array_split(np.arange(n), _BLOCKS)]))
        row += n * n_sensors
    return out
