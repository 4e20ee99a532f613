"""Quadratic forms for a loop whose plant moves between the samples, by one linear matrix inequality.

Unknown are Q at the end of a sample and S at its start, one S for every case or one for all, and a multiplier for every
channel, which takes the corners of one module apart from those of the others (docs/explanations/observers.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..conic import Inequality, inside
from ._flow import Case, Channel

Array = NDArray[np.floating[Any]]
_LEAST = 1e-6  # eigenvalue of the forms, in the units of the search


@dataclass(frozen=True)
class Forms:
    """Candidates in physical units.

    Parameters
    ----------
    end : ndarray, shape (N, N)
        Q of (x, w).
    starts : list of ndarray
        S of (x, I, w), one for every case or one for all.
    """

    end: Array
    starts: list[Array]


def search(cases: Sequence[Case], time: float, scale: Array) -> Forms:
    """Forms for all cases, whether or not they prove anything: that is for `contraction` to say.

    Parameters
    ----------
    cases : sequence of Case
        Of the loop, or one that contains all of them.
    time : float
        Time between samples [s].
    scale : ndarray
        Units of (x, all currents, w) in which well-conditioned forms are expected.
    """
    return _Problem(cases, time, scale).solve()


def contraction(cases: Sequence[Case], time: float, forms: Forms) -> float:
    """Least factor c with e'Qe < c² of its value a sample before, at all corners; inf where the forms prove nothing."""
    try:
        factor = np.linalg.inv(np.linalg.cholesky(forms.end))
        worst = 0.0
        for k, case in enumerate(cases):
            S = forms.starts[min(k, len(forms.starts) - 1)][np.ix_(case.own, case.own)]
            end = np.zeros_like(S)
            end[np.ix_(case.end, case.end)] = forms.end
            A, K = case.corners()
            np.linalg.cholesky(S)
            for P in (S, end):
                moved = P @ A
                np.linalg.cholesky(S - end - time * (moved + moved.transpose(0, 2, 1)))
            after = factor @ (K.transpose(0, 2, 1) @ S @ K) @ factor.T
            worst = max(worst, float(np.linalg.eigvalsh(0.5 * (after + after.transpose(0, 2, 1)))[:, -1].max()))
    except np.linalg.LinAlgError:
        return np.inf
    return float(np.sqrt(worst))


class _Problem:
    """The inequality, in units near one; coefficients are the entries of Q, of the S and of the multipliers."""

    def __init__(self, cases: Sequence[Case], time: float, scale: Array):
        self.cases, self.time, self.scale = cases, time, scale
        self.count = 0
        self.inequalities: list[tuple[dict[int, Array], int, float, Array | None]] = []
        first = cases[0]
        self.width = len(first.end)
        self.end_scale = scale[first.own][first.end]
        self.Q = self._unknown(self.width)
        self.S = [self._unknown(len(case.own)) for case in cases]
        for case, start in zip(cases, self.S, strict=True):
            self._case(case, start)
        for own, units in (self.Q, *self.S):
            side = units.shape[1]
            self.inequalities += [({own: units}, side, 0.0, -_LEAST * np.eye(side)),
                                  ({own: -units}, side, 0.0, np.eye(side))]

    def solve(self) -> Forms:
        found = inside([Inequality(np.zeros((side, side)) if constant is None else constant,
                                   self._dense(slopes, side), margin)
                        for slopes, side, margin, constant in self.inequalities]).x
        end = self._value(found, self.Q) * np.outer(self.end_scale, self.end_scale)
        starts = []
        for case, start in zip(self.cases, self.S, strict=True):
            S = np.diag(np.full(len(self.scale), 1.0) * np.abs(end).max())  # currents that are not free play no part
            units = self.scale[case.own]
            S[np.ix_(case.own, case.own)] = self._value(found, start) * np.outer(units, units)
            starts.append(S)
        return Forms(end, starts)

    def _case(self, case: Case, start: tuple[int, Array]) -> None:
        units, ends = self.scale[case.own], self.end_scale
        A, flow = _centered(case.A * units[:, None] / units, case.flow, units, units)
        K, sample = _centered(case.K * units[:, None] / ends, case.sample, units, ends)
        d, q = len(units), self.Q[1]
        wide = np.zeros((len(q), d, d))
        wide[np.ix_(np.arange(len(q)), case.end, case.end)] = q
        end = (self.Q[0], wide)
        for own, form in (start, end):  # S - Q - T (P A + A'P)
            terms = [(*start, 1.0), (*end, -1.0)]
            moved = self.time * form @ np.hstack([A, *(B for B, _, _ in flow)])
            self._inequality(terms, d, flow, (own, moved, -1.0))
        M = np.hstack([K, *(B for B, _, _ in sample)])  # Q - K'SK
        self._inequality([(*self.Q, 1.0)], self.width, sample, None, (start[0], -(M.T @ start[1] @ M)))

    def _inequality(self, terms: list[tuple[int, Array, float]], side: int, channels: Sequence[Channel],
                    moved: tuple[int, Array, float] | None, whole: tuple[int, Array] | None = None) -> None:
        size = side + sum(B.shape[1] for B, _, _ in channels)
        slopes: dict[int, Array] = {}

        def put(own: int, units: Array) -> None:
            block = slopes.setdefault(own, np.zeros((len(units), size, size)))
            block[:, :units.shape[1], :units.shape[2]] += units

        for own, units, sign in terms:
            put(own, sign * units)
        if moved is not None:
            own, rows, sign = moved
            put(own, sign * rows)
            slopes[own][:, :, :rows.shape[1]] += sign * rows.transpose(0, 2, 1)
        if whole is not None:
            put(*whole)
        first = side
        for B, S, corners in channels:
            r, k = B.shape[1], len(S)
            own, units = self._unknown(r + k)
            place = np.zeros((k + r, size))
            place[:k, :side], place[k:, first:first + r] = S, np.eye(r)
            first += r
            slopes[own] = -(place.T @ units @ place)
            for D in corners:
                both = np.vstack([np.eye(k), D])
                self.inequalities.append(({own: both.T @ units @ both}, k, 0.0, None))
        self.inequalities.append((slopes, size, 1.0, None))

    def _unknown(self, side: int) -> tuple[int, Array]:
        i, j = np.triu_indices(side)
        units = np.zeros((len(i), side, side))
        units[np.arange(len(i)), i, j] = units[np.arange(len(i)), j, i] = 1.0
        own, self.count = self.count, self.count + len(i)
        return own, units

    def _dense(self, slopes: dict[int, Array], side: int) -> Array:
        out = np.zeros((self.count, side, side))
        for own, units in slopes.items():
            out[own:own + len(units)] += units
        return out

    @staticmethod
    def _value(found: Array, unknown: tuple[int, Array]) -> Array:
        own, units = unknown
        return np.tensordot(found[own:own + len(units)], units, 1)


def _centered(base: Array, channels: Sequence[Channel], rows: Array, columns: Array) -> tuple[Array, list[Channel]]:
    """Channels in the units of the search around the middle of their corners, which go to the base."""
    found: list[Channel] = []
    for into, seen, D in channels:
        B, S = into * rows[:, None], seen / columns
        middle = 0.5 * (D.max(axis=0) + D.min(axis=0))
        size: Array = np.abs(D - middle).max(axis=(0, 1))
        size = np.where(size > 0, size, 1e-9 * (np.abs(middle).max() or 1.0))
        base = base + B @ middle @ S
        found.append((B, S * size[:, None], np.unique((D - middle) / size, axis=0)))
    return base, found
