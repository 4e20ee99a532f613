"""The largest ball of starts inside an ellipsoid that a state feedback keeps: matrix inequalities in W = 1/P, Y = F W.

Maximize t with W >= t, W_ii <= room of lump i squared, [room of current k squared, Y_k; ., W] >= 0 and
A W + B Y + (.)' + 2 rate W < 0 at the vertices of the slopes (Boyd, El Ghaoui, Feron and Balakrishnan 1994, 7.2 and
5.2.2). Solved for a few vertices; those that break the solution are added. No evidence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..conic import Inequality, inside
from ._modules import Array
from ._tem_hull import TemHull

_ROUNDS, _ADDED = 25, 6
_ALONE = 4  # vertices that are tried by themselves
_SPARE = (1e-3, 1e-2)  # of the rate in the program, in turn


@dataclass(frozen=True)
class Ellipsoid:
    """W [K²] at level one, gain F [A/K], rate at the vertices [1/s], programs solved."""

    W: Array
    F: Array
    rate: float
    solves: int

    @property
    def semi_axis(self) -> float:
        """Smallest semi-axis [K]."""
        return float(np.sqrt(np.linalg.eigvalsh(self.W)[0]))


def largest_ball(hull: TemHull, rate: float, room: Array, current_room: Array) -> Ellipsoid | None:
    """Ellipsoid and gain at a rate [1/s]; None where the program has no solution."""
    solves, used = 0, _start(hull)
    for spare in _SPARE:
        program = _Program(hull, rate * (1 + spare), room, current_room)
        for _ in range(_ROUNDS):
            found = program.solve(used)
            solves += 1
            if found is None:
                return None
            W, F = found
            worst = _rates(hull, W, F)
            broken = [number for own, number in worst if own < rate * (1 + 0.2 * spare) and number not in used][:_ADDED]
            if not broken:
                break
            used += broken
        reached = worst[0][0]
        if reached > rate:
            scale = min(float((room**2 / np.diag(W)).min()),
                        float((current_room**2 / np.maximum(np.einsum("ki,ij,kj->k", F, W, F), 1e-300)).min()))
            return Ellipsoid(W * scale * (1 - 1e-6), F, reached, solves)
    return None


def most_of_any_form(hull: TemHull, rate: float, room: Array, current_room: Array, found: Ellipsoid) -> float:
    """Smallest semi-axis [K] beyond which no form, constant or varying with the temperatures, keeps a ball.

    Where the temperatures may move either way, P frozen at one vertex solves the program of that vertex alone; its
    ball bounds all others. The vertices tried are those at which the ellipsoid that was found is slowest.
    """
    program = _Program(hull, rate, room, current_room)
    alone = [program.solve([number]) for _, number in _rates(hull, found.W, found.F)[:_ALONE]]
    return min(float(np.sqrt(np.linalg.eigvalsh(one[0])[0])) for one in alone if one is not None)


def _start(hull: TemHull) -> list[int]:
    """The slowest and the fastest vertices of a first look."""
    slow = []
    for numbers, A, _ in hull.chunks():
        growth = np.linalg.eigvals(A).real.max(axis=1)
        slow += [(float(growth[i]), int(numbers[i])) for i in (int(growth.argmax()), int(growth.argmin()))]
    return list(dict.fromkeys([max(slow)[1], min(slow)[1]]))


def _rates(hull: TemHull, W: Array, F: Array) -> list[tuple[float, int]]:
    """Least rates of V = x'W⁻¹x over the vertices, with their numbers."""
    L = np.linalg.cholesky(W)
    inverse = np.linalg.inv(L)
    found: list[tuple[float, int]] = []
    for numbers, A, B in hull.chunks():
        loop = inverse @ (A + B @ F) @ L
        own = -np.linalg.eigvalsh(loop + loop.transpose(0, 2, 1))[:, -1] / 2
        first = np.argsort(own)[:4 * _ADDED]
        found += [(float(own[i]), int(numbers[i])) for i in first]
    return sorted(found)


class _Program:
    """In units of the rooms: x = D x', I = C I'."""

    def __init__(self, hull: TemHull, rate: float, room: Array, current_room: Array):
        self.hull, self.rate, self.room, self.current = hull, rate, room, current_room
        n, m = len(room), len(current_room)
        i, j = np.triu_indices(n)
        units = np.zeros((len(i), n, n))
        units[np.arange(len(i)), i, j] = units[np.arange(len(i)), j, i] = 1.0
        gains = np.eye(m * n).reshape(m * n, m, n)
        self.W = np.concatenate([units, np.zeros((m * n, n, n))])
        self.Y = np.concatenate([np.zeros((len(i), m, n)), gains])
        least = room.min()
        self.fixed = [Inequality(np.zeros((n, n)), self.W * np.outer(room, room) / least**2, 1.0)]
        self.fixed += [Inequality(np.ones((1, 1)), -self.W[:, k, k].reshape(-1, 1, 1)) for k in range(n)]
        for k in range(m):
            slopes = np.zeros((len(self.W), n + 1, n + 1))
            slopes[:, 1:, 1:] = self.W
            slopes[:, 0, 1:] = slopes[:, 1:, 0] = self.Y[:, k]
            constant = np.zeros((n + 1, n + 1))
            constant[0, 0] = 1.0
            self.fixed.append(Inequality(constant, slopes))

    def vertex(self, A: Array, B: Array) -> Inequality:
        """Rows and columns divided by the roots of the speeds of the lumps."""
        A, B = A * self.room / self.room[:, None], B * self.current / self.room[:, None]
        moved = A @ self.W + B @ self.Y
        scale = 1 / np.sqrt(np.abs(np.diag(A)) + self.rate)
        form = -(moved + moved.transpose(0, 2, 1)) - 2 * self.rate * self.W
        return Inequality(np.zeros(A.shape), form * np.outer(scale, scale))

    def solve(self, used: list[int]) -> tuple[Array, Array] | None:
        matrices = zip(*self.hull.at(np.array(used)), strict=True)
        point = inside([*self.fixed, *(self.vertex(A, B) for A, B in matrices)])
        if not np.isfinite(point.value) or not point.value > 1e-9:
            return None
        W, Y = np.tensordot(point.x, self.W, 1), np.tensordot(point.x, self.Y, 1)
        if not np.linalg.eigvalsh(W)[0] > 0:
            return None
        F = np.linalg.solve(W, Y.T).T * self.current[:, None] / self.room
        W = W * np.outer(self.room, self.room)
        return (W + W.T) / 2, F
