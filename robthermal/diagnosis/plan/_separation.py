"""Expected ΔBIC between candidates on one more record, with everything refitted and the present records kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from ...signals import Record
from ..data import RecordData
from ..fit import Structure, Whitened, filters
from ..search import Entry
from ._measurement import Measurement
from ._trial_conditions import TrialConditions

Array = NDArray[np.float64]
Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A candidate as the present records left it.

    Parameters
    ----------
    label : str
        Of the candidate.
    structure : Structure
        With all accepted effects.
    v : ndarray
        Values of the unknowns.
    present : ndarray, shape (p, p)
        Triangular factor of the present records' whitened derivatives, priors included: what they know.
    """

    label: str
    structure: Structure
    v: Array
    present: Array

    def on(self, trial: RecordData, conditions: TrialConditions) -> tuple[Structure, Array]:
        """The structure and its unknowns on one new record."""
        start = conditions.start(self.structure, self.structure.system(self.v))
        own = replace(self.structure, data=(trial,), starts=(start,), coarse=())
        values = own.ranges.values(self.v[:own.n_parameters])
        return own, own.start(values, self.structure.quantities(self.v))


def hypotheses_of(entries: Sequence[Entry]) -> tuple[Hypothesis, ...]:
    """Every entry with what the present records say about its unknowns, by the filters of the first."""
    out = []
    for entry in entries:
        J = Whitened(entry.fit.structure, entries[0].fit.whiteners).slopes(entry.fit.v)
        out.append(Hypothesis(entry.candidate.label, entry.fit.structure, entry.fit.v, qr(J, mode="r")[0][:J.shape[1]]))
    return tuple(out)


@dataclass(frozen=True, eq=False)
class Separation:
    """What one more record would show of the differences between candidates.

    Parameters
    ----------
    hypotheses : tuple of Hypothesis
        Candidates to be separated.
    z : tuple of ndarray, shape (m,)
        Whitened residuals of the new record, up to what is common to all.
    rows : tuple of ndarray, shape (m + p + ..., p)
        Derivatives of the new readings, of what the present records know, and of the new start's prior.
    """

    hypotheses: tuple[Hypothesis, ...]
    z: tuple[Array, ...]
    rows: tuple[Array, ...]

    def pairs(self, measured: Measurement | None = None) -> dict[Pair, float]:
        """Expected gain of ΔBIC between every two candidates, if a parameter is also measured by itself or not.

        If j is true, k has to explain y_j - y_k on the new record with its own unknowns, which the present records and
        the priors hold: λ_jk = min over δ of |R δ|² + |L⁻¹(y_j - y_k) - J_k δ|². The smaller of λ_jk and λ_kj is
        returned. A measured parameter is one more row.

        Parameters
        ----------
        measured : Measurement, optional
            Parameter measured by itself.
        """
        out: dict[Pair, float] = {}
        for j, k in permutations(range(len(self.hypotheses)), 2):
            pair = (self.hypotheses[min(j, k)].label, self.hypotheses[max(j, k)].label)
            J, difference = self.rows[k], self.z[k] - self.z[j]
            if measured is not None:
                row, target = self._measured(measured, j, k)
                J, difference = np.vstack([row, J]), np.concatenate([[target], difference])
            out[pair] = min(out.get(pair, np.inf), _unexplained(J, difference))
        return out

    def _measured(self, measured: Measurement, j: int, k: int) -> tuple[Array, float]:
        """Row and target of the parameter that k has to move to the value of j."""
        ranges = self.hypotheses[k].structure.ranges
        at = ranges.names.index(measured.parameter)
        true, own = (ranges.values(self.hypotheses[i].v[:len(ranges.names)]) for i in (j, k))
        std = measured.accuracy * abs(float(true[at]))
        row = np.zeros(self.rows[k].shape[1])
        row[at] = ranges.slopes(own)[at] / std
        return row, float(true[at] - own[at]) / std


def separation(hypotheses: Sequence[Hypothesis], conditions: TrialConditions, record: Record) -> Separation:
    """Simulate all candidates on one more record.

    Parameters
    ----------
    hypotheses : sequence of Hypothesis
        Two or more.
    conditions : TrialConditions
        Its sensors, start and noise.
    record : Record
        Inputs to apply.
    """
    one = conditions.one
    readings = np.zeros((len(record), len(one.sensors)))  # only differences count
    trial = RecordData(record, one.sensors, one.columns, readings)
    on = [hypothesis.on(trial, conditions) for hypothesis in hypotheses]
    _, whiteners = filters(*on[0], conditions.floor, conditions.levels)
    n, z, rows = trial.readings.size, [], []
    for hypothesis, (own, v) in zip(hypotheses, on, strict=True):
        problem = Whitened(own, whiteners)
        z.append(problem.residual(v)[:n])
        rows.append(_stacked(hypothesis, own, problem.slopes(v), n))
    return Separation(tuple(hypotheses), tuple(z), tuple(rows))


def _stacked(hypothesis: Hypothesis, own: Structure, J: Array, n: int) -> Array:
    """Derivatives of the new readings, of what the present records know, and of the new start's prior."""
    common = own.n_parameters + own.n_effects
    fresh, old = J.shape[1] - common, hypothesis.present.shape[1] - common
    readings = np.hstack([J[:n, :common], np.zeros((n, old)), J[:n, common:]])
    known = np.hstack([hypothesis.present, np.zeros((len(hypothesis.present), fresh))])
    start = np.hstack([np.zeros((fresh, common + old)), np.eye(fresh)])
    return np.vstack([readings, known, start])


def _unexplained(J: Array, difference: Array) -> float:
    """Squared length of what is left of a difference of the new readings."""
    target = np.concatenate([difference, np.zeros(len(J) - difference.size)])
    scale = np.linalg.norm(J, axis=0)
    J = J[:, scale > 0] / scale[scale > 0]
    left = target - J @ np.linalg.lstsq(J, target, rcond=1e-10)[0]
    return float(left @ left)
