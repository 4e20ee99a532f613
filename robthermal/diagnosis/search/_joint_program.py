"""The convex program of the joint selection: columns, groups and bounds; its path, and how far from optimal a point is.

    minimize ½|z' - J'β|² + λ Σ_g w_g |β_g|   with   lower <= β <= upper

over all candidates together. The columns have length 1, so that β is counted in standard deviations of a reading.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...conic import group_sparse
from ..effects import Candidate
from ..evidence import Scores
from ..fit import Refit

Array = NDArray[np.float64]
_COLUMNS = 60  # more would only slow the program down: what is far below the noise alone seldom matters
_ALIKE = 1e-9  # relative eigenvalue below which two columns are one
_NEWTON = 4
_ROUNDS = 20
_EXACT = 1e-9


@dataclass(frozen=True, eq=False)
class Program:
    """One column per candidate; sine and cosine of a periodic one are a pair.

    Parameters
    ----------
    candidates : tuple of Candidate
        One per group.
    groups : tuple of ndarray
        Columns of every candidate.
    G, c : ndarray, shapes (n, n), (n,)
        J'ᵀJ' and J'ᵀz'.
    length : ndarray, shape (n,)
        |J'| per unit of size: β over it is the size in its unit.
    lower, upper : ndarray, shape (n,)
        Physical bounds of β.
    weights : ndarray, shape (n_groups,)
        w_g, the root of the number of columns.
    """

    candidates: tuple[Candidate, ...]
    groups: tuple[NDArray[np.intp], ...]
    G: Array
    c: Array
    length: Array
    lower: Array
    upper: Array
    weights: Array

    @property
    def largest_penalty(self) -> float:
        """The smallest λ at which nothing is selected: max_g |c_g| / w_g, where the sign is possible."""
        pull = np.where(self.c > 0, np.where(self.upper > 0, self.c, 0.0), np.where(self.lower < 0, -self.c, 0.0))
        return float(max((np.linalg.norm(pull[g]) / w for g, w in zip(self.groups, self.weights, strict=True)),
                         default=0.0))

    def proximal(self, point: Array, penalty: float, step: float) -> Array:
        """argmin ½|x - point|² + step λ Σ w_g |x_g| within the bounds: exact, group by group."""
        out = np.zeros_like(point)
        for g, weight in zip(self.groups, self.weights, strict=True):
            length = float(np.linalg.norm(point[g]))
            if length > step * penalty * weight:
                shrunk = point[g] * (1.0 - step * penalty * weight / length)
                out[g] = np.clip(shrunk, self.lower[g], self.upper[g])
        return out

    def solve(self, penalty: float) -> tuple[Array, float]:
        """β at λ, and its distance from optimality: what one proximal step from it still changes, over λ."""
        scale = self.largest_penalty
        found = group_sparse(self.G, self.c / scale, self.groups, self.weights * (penalty / scale),
                             self.lower / scale, self.upper / scale)
        # an interior-point solution is nowhere exactly 0, and rough: proximal steps find the support, Newton the rest
        step = 1.0 / max(float(np.linalg.norm(self.G, 2)), 1.0)
        beta = self._stepped(np.asarray(found.x * scale, np.float64), penalty, step)
        best, least = beta, np.inf
        for _ in range(_ROUNDS):
            polished = self._polished(beta, penalty)
            beta = self._stepped(polished, penalty, step)
            change = float(np.abs(beta - polished).max()) / (step * penalty)
            if change < least:
                best, least = polished, change
            if least < _EXACT:
                break
        return best, least

    def _polished(self, beta: Array, penalty: float) -> Array:
        """Newton's method for the stationary point on the support; what sits on a bound stays there."""
        out = beta.copy()
        inner = (beta != 0.0) & (beta > self.lower) & (beta < self.upper)
        for _ in range(_NEWTON):
            slope, curvature, last = self.G @ out - self.c, self.G.copy(), out.copy()
            for g, weight in zip(self.groups, self.weights, strict=True):
                length = float(np.linalg.norm(out[g]))
                if length > 0.0:
                    along = out[g] / length
                    slope[g] += penalty * weight * along
                    curvature[np.ix_(g, g)] += penalty * weight / length * (np.eye(g.size) - np.outer(along, along))
            out[inner] -= np.linalg.lstsq(curvature[np.ix_(inner, inner)], slope[inner], rcond=1e-12)[0]
            for g in self.groups:
                if out[g] @ last[g] <= 0.0:  # through zero: it leaves the support
                    out[g], inner[g] = 0.0, False
        return np.clip(out, self.lower, self.upper)

    def _stepped(self, beta: Array, penalty: float, step: float) -> Array:
        return self.proximal(beta + step * (self.c - self.G @ beta), penalty, step)

    def chosen(self, beta: Array) -> tuple[int, ...]:
        """Groups that differ from zero."""
        return tuple(i for i, g in enumerate(self.groups) if np.any(beta[g] != 0.0))

    def sizes(self, beta: Array) -> Array:
        """Size of every candidate in its unit; the length of a pair."""
        return np.array([float(np.linalg.norm(beta[g] / self.length[g])) if g.size > 1
                         else float(beta[g[0]] / self.length[g[0]]) for g in self.groups])

    def best_pairs(self, count: int) -> list[tuple[int, int]]:
        """Pairs that explain most with possible sizes: a path cannot enter what is impossible alone."""
        gain = {}
        for i, j in combinations(range(len(self.groups)), 2):
            at = np.concatenate([self.groups[i], self.groups[j]])
            beta = np.linalg.lstsq(self.G[np.ix_(at, at)], self.c[at], rcond=_ALIKE)[0]
            if np.all(beta >= self.lower[at]) and np.all(beta <= self.upper[at]):
                gain[i, j] = float(self.c[at] @ beta)
        return sorted(gain, key=lambda pair: -gain[pair])[:count]

    def irrepresentable(self, support: tuple[int, ...], beta: Array) -> float:
        """max over the others of |J_g'ᵀJ_S(J_SᵀJ_S)⁻¹ w_S β_S/|β_S|| / w_g: below 1 the path can find the support."""
        inside = np.concatenate([self.groups[i] for i in support])
        pull = np.concatenate([self.weights[i] * beta[self.groups[i]] / np.linalg.norm(beta[self.groups[i]])
                               for i in support])
        push = self.G[:, inside] @ np.linalg.lstsq(self.G[np.ix_(inside, inside)], pull, rcond=None)[0]
        push = np.where((push > 0) & (self.upper <= 0) | (push < 0) & (self.lower >= 0), 0.0, push)
        return max((float(np.linalg.norm(push[g])) / w for i, (g, w) in
                    enumerate(zip(self.groups, self.weights, strict=True)) if i not in support), default=0.0)


def program_of(fit: Refit, scores: Scores) -> Program:
    """The best candidates, each at its best trial values; of exact aliases, the first.

    A size that is impossible for an effect alone may be possible beside another one: none is left out for its sign.
    """
    picked: list[int] = []
    for i in np.argsort(-scores.statistic).tolist():
        if len(picked) < _COLUMNS and scores.size[i] != 0.0 and not set(scores.aliases(i)) & set(picked):
            picked.append(i)
    blocks = [_block(fit, scores, i) for i in picked]
    lengths = [np.full(block.shape[1], float(np.sqrt(np.mean(np.sum(block**2, axis=0))))) for block in blocks]
    length = np.concatenate([*lengths, np.zeros(0)])
    J = np.column_stack([fit.rest[:, None][:, :0], *blocks]) / length
    ends = np.cumsum([block.shape[1] for block in blocks])
    groups = tuple(np.arange(end - block.shape[1], end) for block, end in zip(blocks, ends, strict=True))
    lower, upper = np.full(length.size, -np.inf), np.full(length.size, np.inf)
    for i, group in zip(picked, groups, strict=True):
        if group.size == 1:  # the sign of a pair is its phase
            size = scores.candidates[i].effect.size
            lower[group], upper[group] = size.lower * length[group], size.upper * length[group]
    return Program(tuple(scores.candidates[i] for i in picked), groups, J.T @ J, J.T @ fit.rest, length, lower, upper,
                   np.sqrt([float(group.size) for group in groups]))


def _block(fit: Refit, scores: Scores, i: int) -> Array:
    """Projected signatures of a candidate per unit of size, (m, 1), or (m, 2) for sine and cosine."""
    candidate = scores.candidates[i]
    if not candidate.effect.paired:
        along = float(scores.signatures[:, i] @ fit.rest)
        return scores.signatures[:, i:i + 1] * (along / scores.size[i])
    pair = [replace(candidate, shape={**candidate.shape, candidate.effect.paired: angle}) for angle in (0.0, np.pi / 2)]
    return fit.project(fit.whiten([path.columns(pair) for path in fit.paths]))
