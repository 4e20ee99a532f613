"""Covariance of the estimates: what every data set says is added up; records by the sandwich, starts marginalized."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from .._arrays import Floats
from ..fitting import Loss, Problem, Ranges, score, score_slope
from ._autoregression import correlation_of
from ._score_blocks import block_scores, blocks_of, covariance_scale

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
    bounded : tuple of ndarray
        Directions among them, normalized, that the priors leave open too.
    degrees_of_freedom : float
        Of the noise: independent samples of the residuals less what the fit has used of them, at least 1.
    scale : float
        Factor by which residuals exceed what the covariance accounts for, at least 1.
    """

    covariance: Floats
    undetermined: tuple[Floats, ...]
    bounded: tuple[Floats, ...]
    degrees_of_freedom: float
    scale: float


@dataclass(frozen=True)
class Share:
    """What one kind of data says about the coordinates, priors left out.

    Parameters
    ----------
    H, M : ndarray, shape (p, p)
        Slope of the score and its covariance: alone the data give H⁻¹ M H⁻¹.
    degrees_of_freedom : float
        Of the noise in these data, at least 1.
    scale : float
        Factor by which their residuals exceed what M accounts for, at least 1.
    """

    H: Floats
    M: Floats
    degrees_of_freedom: float
    scale: float


def combined(ranges: Ranges, values: Floats, shares: Sequence[Share]) -> Information:
    """Independent data sets together: H and M are sums, the scale is the largest.

    Each share brings a variance of its own to the estimates; the degrees of freedom of their sum are Satterthwaite's,
    (Σ a)² / Σ a²/ν with a the mean variance that a share brings, never fewer than the fewest.
    """
    H, M = (np.sum([getattr(one, name) for one in shares], axis=0) for name in "HM")
    unit = ranges.unit
    inverse = np.linalg.pinv(H * np.outer(unit, unit), rcond=_ZERO, hermitian=True)
    part = np.array([max(float(np.trace(inverse @ (one.M * np.outer(unit, unit)))), 0.0) for one in shares])
    own = np.array([one.degrees_of_freedom for one in shares])
    freedom = float(part.sum() ** 2 / np.sum(part**2 / own)) if part.any() else float(own.min())
    return with_priors(ranges, values, H, M, freedom, max(one.scale for one in shares))


def record_share(problem: Problem, v: Floats, loss: Loss) -> Share:
    """What the records say.

    H = Σ J̃ᵀ D J̃ + GᵀG + P and M = Σ J̃ᵀ Cov(ψ) J̃ + GᵀG + P with J̃ = J - X G the derivative after the initial
    temperatures (derivative X, unit prior) have answered: G = (XᵀDX + 1)⁻¹XᵀDJ. D holds ψ', and Cov(ψ) is that of an
    autoregression fitted to the residuals. The covariance is H⁻¹ M H⁻¹.
    """
    p = len(problem.ranges.names)
    weighted = [(weigh(run.residual), weigh(run.by_parameter), weigh(run.by_start))
                for run, weigh in zip(problem.runs(v), problem.weigh, strict=True)]
    H, G2, meat = np.zeros((p, p)), np.zeros((p, p)), np.zeros((p, p))
    answered, absorbed, power, independent, bias = [], 0.0, 0.0, -float(p), 1.0
    found, expected = np.zeros((p, p)), np.zeros((p, p))
    blocks = blocks_of([len(e) for e, _, _ in weighted])
    starts: list[tuple[Floats, Floats]] = []
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
        independent -= X.shape[2] - float(np.trace(np.linalg.inv(own)))
    for alike in _same_sensors(problem):
        psi = [score(weighted[i][0], loss) for i in alike]
        correlation = correlation_of(psi)
        meat += sum(correlation.meat(answered[i]) for i in alike)
        absorbed += sum(float(np.trace(np.linalg.solve(own, correlation.meat(X))))
                        for X, own in (starts[i] for i in alike) if X.shape[2])
        power += sum(float(np.sum(e**2)) for e in psi)
        independent += correlation.independent(np.concatenate(psi))
        bias = max(bias, correlation.bias(np.concatenate(psi)))
        for i, e in zip(alike, psi, strict=True):
            of_blocks = block_scores(e, answered[i], correlation, blocks[i])
            found, expected = found + of_blocks[0], expected + of_blocks[1]
    absorbed += float(np.trace(np.linalg.pinv(H, rcond=_ZERO, hermitian=True) @ meat))
    larger, unit = _inflation(power, absorbed), problem.ranges.unit
    scale = covariance_scale(found * np.outer(unit, unit), larger * expected * np.outer(unit, unit),
                             sum(map(len, blocks)))
    return Share(H, G2 + meat * larger, max(independent, 1.0), bias * scale)


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


def with_priors(ranges: Ranges, values: Floats, H: Floats, M: Floats, degrees_of_freedom: float, scale: float
                ) -> Information:
    """H⁻¹ M H⁻¹ with the priors added to both; H and M are of the data alone, (p, p), in coordinates."""
    unit = ranges.unit
    units = np.outer(unit, unit)
    H, M, P = H * units, M * units, np.diag(ranges.prior_slopes(values) ** 2) * units
    size, vectors = scipy.linalg.eigh(H)
    spread = np.array([_variance(value, vector, M, size[-1])
                       for value, vector in zip(size, vectors.T, strict=True)])
    open_ = tuple(vectors[:, i] for i in np.flatnonzero(spread > 1.0))
    bounds = np.diag((unit / ranges.spread) ** 2)
    H, M = H + P, M + P
    bounded, extra = _without_prior(vectors[:, spread > 1.0], P, bounds)
    inverse = np.linalg.inv(H + extra)
    covariance = inverse @ (M + extra) @ inverse * units
    return Information((covariance + covariance.T) / 2, open_, bounded, degrees_of_freedom, scale)


def _without_prior(V: Floats, P: Floats, bounds: Floats) -> tuple[tuple[Floats, ...], Floats]:
    """Directions in the space of V (p, k) about which the priors P say less than the bounds, and what those say there.

    The generalized eigenvectors w of (VᵀPV, VᵀBV) tell what a prior closes from what none does; with wᵀVᵀBVw = 1 the
    information added is Σ (VᵀBVw)(VᵀBVw)ᵀ over the latter, which makes their variance that of the bounds.
    """
    if not V.shape[1]:
        return (), np.zeros_like(P)
    B = V.T @ bounds @ V
    told, w = scipy.linalg.eigh(V.T @ P @ V, B)
    w = w[:, told < 1.0]
    own = V @ B @ w
    return tuple(d / np.linalg.norm(d) for d in (V @ w).T), own @ own.T


def _variance(value: float, vector: Floats, M: Floats, largest: float) -> float:
    return np.inf if value <= _ZERO * largest else float(vector @ M @ vector) / value**2
