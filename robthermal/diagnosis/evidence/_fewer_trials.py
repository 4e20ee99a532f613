"""Trial values of a slow effect on a long record: compared on averaged innovations first, the best few in full.

Periods and times of a step are tried by the dozen. Which few of them explain most shows on innovations averaged over
blocks as well; their scores, and that of the effect, come from all samples. What is left out still counts as tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..effects import Candidate
from ..fit import Refit
from ..path import AveragedRecord, Whitener, averaged_record
from ._twin import possible_size

Array = NDArray[np.float64]
_BLOCKS = 1000  # of a record
_LONG = 3  # samples of a block: a record of fewer than 3000 samples is not averaged
_MANY = 20  # trial values
_KEPT = 3  # of the best, possible or not, and as many of the best possible ones


@dataclass(frozen=True, eq=False)
class FewerTrials:
    """Chooses among the trials of a candidate.

    Parameters
    ----------
    fit : Refit
        Fit without the candidate.
    """

    fit: Refit

    @cached_property
    def length(self) -> int:
        """Samples of a block: as many as give the shortest record 1000 blocks."""
        return min((len(path.x) for path in self.fit.records), default=0) // _BLOCKS

    def of(self, candidate: Candidate) -> tuple[list[Candidate], int]:
        """Trials to be scored in full, and how many of them all there are; a pair of columns is one.

        Parameters
        ----------
        candidate : Candidate
            Effect at a place.
        """
        trials = candidate.trials(self.fit.paths[0])
        each = 2 if candidate.effect.paired else 1
        count = len(trials) // each
        if count < _MANY or self.length < _LONG or len(self.fit.records) < len(self.fit.paths):
            return trials, count
        kept = self._kept(trials, each)
        return [trials[each * i + j] for i in kept for j in range(each)], count

    def _kept(self, trials: Sequence[Candidate], each: int) -> list[int]:
        """Places of the best few, a pair being one, in their order."""
        per_record = [one.columns(trials) for one in self._averaged]
        if any(columns is None for columns in per_record):
            return list(range(len(trials) // each))
        priors = np.zeros((len(self._rest) - sum(len(c) for c in per_record if c is not None), len(trials)))
        J = np.concatenate([*(columns for columns in per_record if columns is not None), priors])
        J -= self._basis @ (self._basis.T @ J)
        along, power = (J.T @ self._rest).reshape(-1, each), np.sum(J * J, axis=0).reshape(-1, each)
        if each == 2:
            across = np.sum(J[:, ::2] * J[:, 1::2], axis=0)
            gram = np.stack([power[:, 0], across, across, power[:, 1]], axis=-1).reshape(-1, 2, 2)
            weights = np.linalg.pinv(gram, rcond=1e-12, hermitian=True) @ along[..., None]
            explained, possible = np.sum(along * weights[..., 0], axis=1), np.ones(len(along), bool)
        else:
            size = along[:, 0] / np.maximum(power[:, 0], 1e-300)
            explained = along[:, 0] * size
            possible = np.array([possible_size(trial, beta, 0.0) for trial, beta in zip(trials, size, strict=True)])
        order = np.argsort(-explained, kind="stable")
        return sorted({*order[:_KEPT].tolist(), *order[possible[order]][:_KEPT].tolist()})

    @cached_property
    def _averaged(self) -> list[AveragedRecord]:
        of_records = zip(self.fit.records, self.fit.whiteners, strict=True)  # there is nothing but records
        return [averaged_record(path, white, self.length) for path, white in of_records if isinstance(white, Whitener)]

    def _rows(self, columns: Array) -> Array:
        """Whitened columns (m, k), averaged; priors as they are."""
        out, row = [], 0
        for one, path in zip(self._averaged, self.fit.records, strict=True):
            n, m = path.one.readings.shape
            out.append(one.of(columns[row:row + n * m].reshape(n, m, -1)))
            row += n * m
        return np.concatenate([*out, columns[row:]])

    @cached_property
    def _basis(self) -> Array:
        """Orthonormal basis of what the unknowns can explain of the averages."""
        J = self._rows(self.fit.basis)
        U, s, _ = np.linalg.svd(J, full_matrices=False)
        return U[:, s > 1e-9 * s[0]]

    @cached_property
    def _rest(self) -> Array:
        z = self._rows(self.fit.z[:, None])[:, 0]
        return z - self._basis @ (self._basis.T @ z)
