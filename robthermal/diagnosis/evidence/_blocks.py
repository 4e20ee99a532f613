"""Evidence that knows model error: what holds in block after block of the records, not only in their sum.

A remainder is no white noise: neighboring residuals share it. Blocks that are long against it are repetitions of the
experiment; what differs between them is the scatter that a statement has to exceed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..._digits import downwards
from ..fit import Refit

Array = NDArray[np.float64]
BLOCKS = 24  # of all records together, at least
SURE = 0.95  # share of the draws
SEGMENTS = 6  # of all records together, at least
WIDEST = 0.5  # spread of a size over segments, relative: beyond, it is no constant
NEEDED = 0.3  # of what is left without it, that an effect must explain
PREDICTED = 0.9  # of what is left without it of records that no fit has seen: a size that does so is the right one
_DRAWS = 2000
_SEED = 20  # of the bootstrap: an answer does not change when it is asked again


@dataclass(frozen=True)
class Stability:
    """How an estimate agrees with itself over the records.

    Parameters
    ----------
    segments : int
        Number of segments that tell anything about it.
    spread : float
        Standard deviation of the segments' estimates, weighted by what they tell, over the size of the estimate.
    """

    segments: int
    spread: float

    @property
    def constant(self) -> bool:
        """Whether the size shows in several parts of the records, and is the same in them."""
        return self.segments >= 2 and self.spread <= WIDEST


@dataclass(frozen=True)
class Wandering:
    """How far an unknown moves over the segments of the records.

    Parameters
    ----------
    moves : float
        Mean square of its deviations, each in units of what the declared noise makes of it: 1 for white noise.
    segments : int
        Number of segments that tell anything about it.
    per_variance : float
        By how much `moves` grows per variance of the unknown itself from segment to segment.
    """

    moves: float
    segments: int
    per_variance: float


@dataclass(frozen=True)
class Evidence:
    """How far one effect of a set can be relied on where the model is not exact.

    Parameters
    ----------
    share : float
        Part of the excess mean square of the training records that it removed, in order of acceptance [-].
    reproducible : float
        Share of bootstrap draws of blocks in which the set with it is better than without it [-].
    stability : Stability
        Spread of its size over segments.
    needed : float
        Part of the excess mean square left without it that it removes [-].
    predicted : float
        The same of the validation records alone, asked where it does not hold over parts of the training records [-].
    """

    share: float
    reproducible: float
    stability: Stability
    needed: float
    predicted: float = 0.0

    @property
    def lasting(self) -> bool:
        """Whether it is needed, and holds over blocks and segments or predicts data that no fit has seen."""
        return not self.short_of

    @property
    def short_of(self) -> str:
        """The first of these tests that fails, with the number and the limit; empty if none does."""
        if not self.needed >= NEEDED:
            return (f"takes {_below(self.needed, NEEDED)} off what is left without it, less than the "
                    f"{100.0 * NEEDED:.0f} % of an effect that is needed")
        if self.predicted >= PREDICTED:
            return ""
        if not self.reproducible >= SURE:
            return (f"lessens the error in {_below(self.reproducible, SURE)} of draws of parts of the records, less "
                    f"than {100.0 * SURE:.0f} %")
        if self.stability.segments < 2:
            return "shows its size in a single part of the records"
        if not self.stability.spread <= WIDEST:
            return (f"has a size that differs by {100.0 * self.stability.spread:.0f} % between parts of the records, "
                    f"more than {100.0 * WIDEST:.0f} %")
        return ""


def reproducible(with_it: Refit, without: Refit) -> float:
    """Share of bootstrap draws of blocks in which one fit has the smaller sum of squares.

    Parameters
    ----------
    with_it, without : Refit
        Fits to the same data with the same filters.
    """
    gain = block_sums(without, without.z**2) - block_sums(with_it, with_it.z**2)
    draws = np.random.default_rng(_SEED).integers(gain.size, size=(_DRAWS, gain.size))
    return float(np.mean(gain[draws].sum(axis=1) > 0.0))


def block_sums(fit: Refit, rows: Array, count: int = BLOCKS) -> Array:
    """Sums (n_blocks, ...) of rows (m, ...) over consecutive stretches of every data set; priors are left out.

    Parameters
    ----------
    fit : Refit
        Fit whose rows they are.
    rows : ndarray, shape (m, ...)
        One per whitened reading, then those of the priors.
    count : int
        Blocks of all data together, at least.
    """
    each = max(2, -(-count // len(fit.structure.data)))
    out, row = [], 0
    for one in fit.structure.data:
        n, n_sensors = one.readings.shape
        own = rows[row:row + n * n_sensors].reshape(n, n_sensors, -1).sum(axis=1)
        out += [part.sum(axis=0) for part in np.array_split(own, each)]
        row += n * n_sensors
    return np.array(out).reshape(len(out), *rows.shape[1:])


def stability(fit: Refit, column: int) -> Stability:
    """Spread of one unknown over segments: one linear solve on the whitened derivatives, all others moving freely.

    Parameters
    ----------
    fit : Refit
        Fit with the unknown.
    column : int
        Place of the unknown.
    """
    moved, weight = _segments(fit, column)
    if not weight.size:
        return Stability(0, float("inf"))
    return Stability(weight.size, float(np.sqrt(_deviations(moved, weight) / weight.sum())))


def wandering(fit: Refit, column: int) -> Wandering:
    """How far one unknown moves over segments.

    Parameters
    ----------
    fit : Refit
        Fit with the unknown.
    column : int
        Place of the unknown.
    """
    moved, weight = _segments(fit, column)
    if weight.size < 2:
        return Wandering(0.0, weight.size, 0.0)
    freedom = weight.size - 1
    total = float(weight.sum())
    return Wandering(_deviations(moved, weight) / freedom, weight.size,
                     (total - float(weight @ weight) / total) / freedom)


def _below(share: float, limit: float) -> str:
    """A share that is below its limit, in per cent: never rounded up to it."""
    text = f"{100.0 * max(share, 0.0):.0f}"
    return f"{text if float(text) < 100.0 * limit else downwards(100.0 * share, 3)} %"


def _segments(fit: Refit, column: int) -> tuple[Array, Array]:
    """By how much each segment would move an unknown, and what it tells of it; of those that tell anything."""
    own = alone(fit, column)
    weight = block_sums(fit, own**2, SEGMENTS)
    told = weight > 0.02 * weight.sum() / max(weight.size, 1)
    return block_sums(fit, own * fit.z, SEGMENTS)[told] / weight[told], weight[told]


def _deviations(moved: Array, weight: Array) -> float:
    """Weighted sum of squares about the mean."""
    return float(np.sum(weight * (moved - (weight @ moved) / weight.sum()) ** 2))


def alone(fit: Refit, column: int) -> Array:
    """Whitened derivative by one unknown, without what all others can explain (m,).

    Parameters that are known but for the scatter of healthy days are no others: they would explain a change of
    themselves, at the price of their prior, which is in no segment.

    Parameters
    ----------
    fit : Refit
        Fit with the unknown.
    column : int
        Place of the unknown.
    """
    others = np.delete(fit.J, [*fit.structure.known, column], axis=1)
    scale = np.linalg.norm(others, axis=0)
    others = others[:, scale > 0] / scale[scale > 0]
    J = fit.J[:, column]
    return np.asarray(J - others @ np.linalg.lstsq(others, J, rcond=1e-10)[0], np.float64)
