"""Covariance of the estimates when residuals are correlated: the sandwich, initial temperatures marginalised."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from .._fitting import Loss, Problem, Ranges, score, score_slope
from ._autoregression import correlation_of

Array = NDArray[np.float64]
_ZERO = 1e-12  # relative eigenvalue that is rounding


@dataclass(frozen=True)
class Information:
    """What the data say about the coordinates of the parameters.

    Parameters
    ----------
    covariance : ndarray, shape (p, p)
        In coordinates, priors included.
    undetermined : tuple of ndarray
        Orthonormal directions, in units of `Ranges.unit`, that the data leave open by more than one unit.
    """

    covariance: Array
    undetermined: tuple[Array, ...]


def information(problem: Problem, v: Array, loss: Loss) -> Information:
    """Sandwich covariance at the estimate.

    H = Σ J̃ᵀ D J̃ + GᵀG + P and M = Σ J̃ᵀ Cov(ψ) J̃ + GᵀG + P with J̃ = J - X G the derivative after the initial
    temperatures (derivative X, unit prior) have answered: G = (XᵀDX + 1)⁻¹XᵀDJ. D holds ψ', and Cov(ψ) is that of an
    autoregression fitted to the residuals. The covariance is H⁻¹ M H⁻¹.
    """
    p = len(problem.ranges.names)
    weighted = [(weigh(run.residual), weigh(run.by_parameter), weigh(run.by_start))
                for run, weigh in zip(problem.runs(v), problem.weigh, strict=True)]
    H, G2, meat = np.zeros((p, p)), np.zeros((p, p)), np.zeros((p, p))
    answered, absorbed, power = [], 0.0, 0.0
    starts: list[tuple[Array, Array]] = []
    for e, J, X in weighted:
        root = np.sqrt(score_slope(e, loss))[..., None]
        J2, X2 = (root * J).reshape(e.size, p), (root * X).reshape(e.size, X.shape[2])
        own = X2.T @ X2 + np.eye(X.shape[2])
        G = np.linalg.solve(own, X2.T @ J2)
        rest = J2 - X2 @ G
        H += rest.T @ rest + G.T @ G
        G2 += G.T @ G
        answered.append(J - X @ G)
        starts.append((X, own))
    for alike in _same_sensors(problem):
        psi = [score(weighted[i][0], loss) for i in alike]
        correlation = correlation_of(psi)
        meat += sum(correlation.meat(answered[i]) for i in alike)
        absorbed += sum(float(np.trace(np.linalg.solve(own, correlation.meat(X))))
                        for X, own in (starts[i] for i in alike) if X.shape[2])
        power += sum(float(np.sum(e**2)) for e in psi)
    absorbed += float(np.trace(np.linalg.pinv(H, rcond=_ZERO, hermitian=True) @ meat))
    return with_priors(problem.ranges, problem.parameters(v), H, G2 + meat * _inflation(power, absorbed))


def _same_sensors(problem: Problem) -> list[list[int]]:
    groups: dict[tuple[str, ...], list[int]] = {}
    for i, one in enumerate(problem.data):
        groups.setdefault(one.sensors, []).append(i)
    return list(groups.values())


def _inflation(power: float, absorbed: float) -> float:
    """Factor on Cov(ψ) for the part of the noise the fit has absorbed: E[Σψ²] = tr Σ - tr(projection Σ).

    Slow noise is absorbed far more than white noise is, which counting parameters would miss. Limited to 4: beyond that
    the record is too short for any honest statement about its noise.
    """
    return power / max(power - absorbed, power / 4.0) if power else 1.0


def with_priors(ranges: Ranges, values: Array, H: Array, M: Array) -> Information:
    """H⁻¹ M H⁻¹ with the priors added to both; H and M are of the data alone, (p, p), in coordinates."""
    unit = ranges.unit
    scale = np.outer(unit, unit)
    H, M, P = H * scale, M * scale, np.diag(ranges.prior_slopes(values) ** 2) * scale
    values, vectors = eigh(H)
    spread = np.array([_variance(value, vector, M, values[-1])
                       for value, vector in zip(values, vectors.T, strict=True)])
    open_ = tuple(vectors[:, i] for i in np.flatnonzero(spread > 1.0))
    bounds = np.diag((unit / ranges.spread) ** 2)
    H, M = H + P, M + P
    for direction in open_:  # no prior either: as uncertain as its bounds
        if direction @ P @ direction < direction @ bounds @ direction:
            extra = (direction @ bounds @ direction) * np.outer(direction, direction)
            H, M = H + extra, M + extra
    inverse = np.linalg.inv(H)
    covariance = inverse @ M @ inverse * scale
    return Information((covariance + covariance.T) / 2, open_)


def _variance(value: float, vector: Array, M: Array, largest: float) -> float:
    return np.inf if value <= _ZERO * largest else float(vector @ M @ vector) / value**2
