"""Whitened readings averaged over some samples: enough to compare slow heats with each other, at a part of the cost.

Each block of samples is one linear map from the state of model and filter and from the mean heats of the block to its
state at the end and to its averaged innovations (docs/explanations/diagnosis.md, "Long records").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..._recursion import recursion
from ..effects import Candidate
from ._linearized_record import LinearizedRecord
from ._whitening import Whitener

Array = NDArray[np.float64]
_TOGETHER = 32  # signatures at once: they stay in the cache


@dataclass(frozen=True, eq=False)
class AveragedRecord:
    """Innovations of a record, summed over blocks of samples and divided by √length: white if they were.

    Parameters
    ----------
    path : LinearizedRecord
        System linearized along the record.
    length : int
        Samples of a block; the last block may be shorter.
    passed : ndarray, shape (n_blocks, n, n)
        State (δ, δ̂) after a block, by that before it.
    pushed : ndarray, shape (n_blocks, n, n_lumps)
        The same by heats that are constant over the block [W].
    seen, felt : ndarray, shapes (n_blocks, n_sensors, n) and (n_blocks, n_sensors, n_lumps)
        Averaged innovations by the same two.
    """

    path: LinearizedRecord
    length: int
    passed: Array
    pushed: Array
    seen: Array
    felt: Array

    def of(self, z: Array) -> Array:
        """Averaged innovations (n_blocks n_sensors, k) of innovations (n, n_sensors, k).

        Parameters
        ----------
        z : ndarray
            Whitened columns of the record.
        """
        whole = _in_blocks(z, self.length)
        return whole.sum(axis=1).reshape(-1, z.shape[-1]) / np.sqrt(self.length)

    def columns(self, trials: Sequence[Candidate]) -> Array | None:
        """Averaged innovations (n_blocks n_sensors, k) per unit of size of trials, each heat taken as its block means.

        None where a trial is no heat: then a block's mean says too little.

        Parameters
        ----------
        trials : sequence of Candidate
            Effects with trial values.
        """
        parts = [self._some(trials[first:first + _TOGETHER]) for first in range(0, len(trials), _TOGETHER)]
        whole = [part for part in parts if part is not None]
        return np.concatenate(whole, axis=1) if whole and len(whole) == len(parts) else None

    def _some(self, trials: Sequence[Candidate]) -> Array | None:
        q, mean = np.zeros((*self.pushed.shape[::2], len(trials))), np.full(self.length, 0.5 / self.length)
        for j, trial in enumerate(trials):
            response = None if trial.effect.signature is None else trial.effect.signature(self.path, trial.where,
                                                                                          trial.shape)
            if response is None or response.heat is None or response.reading is not None:
                return None
            for lump, (first, last) in response.heat.items():
                q[:, lump, j] = _in_blocks(first + last, self.length) @ mean
        states = recursion(self.passed, self.pushed @ q)[:-1]
        return np.asarray(self.seen @ states + self.felt @ q).reshape(-1, len(trials))


def averaged_record(path: LinearizedRecord, white: Whitener, length: int) -> AveragedRecord:
    """Maps of all blocks of a record.

    Parameters
    ----------
    path : LinearizedRecord
        System linearized along the record.
    white : Whitener
        Filter along it.
    length : int
        Samples of a block.
    """
    n_z, n_lumps = path.steps[0].shape[1], path.x.shape[1]
    blocks = [_in_blocks(one, length) for one in (*path.steps, path.C, white.A, white.C, white.gains, white.roots)]
    inside = (np.arange(len(path.x) + -len(path.x) % length) < len(path.x)).reshape(-1, length)
    n = n_z + white.A.shape[1]
    passed = np.broadcast_to(np.eye(n), (len(inside), n, n))
    pushed = np.zeros((len(inside), n, n_lumps))
    seen, felt = np.zeros((len(inside), path.C.shape[1], n)), np.zeros((len(inside), path.C.shape[1], n_lumps))
    for k in range(length):
        A, by_start, by_end, C, own, read, gain, root = (one[:, k] for one in blocks)
        innovation = root @ np.concatenate([C, -read], axis=2)  # zero beyond the end, where the roots are
        seen, felt = seen + innovation @ passed, felt + innovation @ pushed
        inject = own @ gain
        step = np.block([[A, np.zeros((*A.shape[:2], own.shape[1]))], [inject @ C, own - inject @ read]])
        last = inside[:, k, None, None]
        passed, pushed = np.where(last, step @ passed, passed), np.where(last, step @ pushed, pushed)
        pushed[:, :n_z] += last * (by_start + by_end)
    root_length = np.sqrt(length)
    return AveragedRecord(path, length, passed, pushed, seen / root_length, felt / root_length)


def _in_blocks(each: Array, length: int) -> Array:
    """(n_blocks, length, ...) of (n, ...), the last block filled up with zeros."""
    short = -len(each) % length
    if short:
        each = np.concatenate([each, np.zeros((short, *each.shape[1:]))])
    return each.reshape(-1, length, *each.shape[1:])
