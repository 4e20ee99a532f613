"""Loops of the kind "ellipsoid": plants at the vertices of a hull, one controller, limits of its controls; exact.

x' = A x + B1 w + B2 u (or x+), y = C x + D w, v = C_K x_K + D_K y, x_K' = A_K x_K + B_K y + E (v - u), u = v. With
limited controls u = sat(v) lies between v and H x, where H x keeps the limits (Hu and Lin 2001): every set of controls
with v replaced by H x gives a loop, and the hull of these loops holds the limited one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

from flint import fmpq, fmpq_mat

from robthermal.errors import InputError

from ._fields import get, mapping, no_other, not_negative, sequence
from ._lti import Rows, expect_shape, read_matrix

_MOST_WORK = 10**8  # vertices times sets of controls times the third power of states, inputs and measurements


@dataclass(frozen=True)
class Controller:
    """A_K, B_K, C_K, D_K and E of x_K' = A_K x_K + B_K y + E (v - u), v = C_K x_K + D_K y."""

    A: fmpq_mat
    B: fmpq_mat
    C: fmpq_mat
    D: fmpq_mat
    windup: fmpq_mat

    @property
    def states(self) -> int:
        return self.A.nrows()


@dataclass(frozen=True)
class Loop:
    """xi' = A xi + B w and z = C xi + D w, xi = (x, x_K)."""

    A: fmpq_mat
    B: fmpq_mat
    C: fmpq_mat
    D: fmpq_mat


@dataclass(frozen=True)
class Plants:
    """What section "system" says, exact.

    ``vertices``: A, B1, B2; ``feedback``, ``direct``: v = feedback xi + direct w; ``seen``: C, D of y;
    ``performance``: C, D1, D2 of z.
    """

    vertices: tuple[tuple[fmpq_mat, fmpq_mat, fmpq_mat], ...]
    seen: tuple[fmpq_mat, fmpq_mat]
    controller: Controller
    performance: tuple[fmpq_mat, fmpq_mat, fmpq_mat]
    feedback: fmpq_mat
    direct: fmpq_mat
    sample_time: fmpq

    @property
    def states(self) -> int:
        """States of the plant."""
        return self.vertices[0][0].nrows()

    @property
    def size(self) -> int:
        """States of plant and controller."""
        return self.states + self.controller.states

    @property
    def disturbances(self) -> int:
        return self.vertices[0][1].ncols()

    @property
    def controls(self) -> int:
        return self.feedback.nrows()

    @property
    def outputs(self) -> int:
        """Performance outputs."""
        return self.performance[0].nrows()

    @property
    def discrete(self) -> bool:
        return bool(self.sample_time > 0)

    def loops(self, held: fmpq_mat | None) -> Iterator[tuple[str, Loop]]:
        """Every loop with its name; ``held``: H, where controls are limited."""
        sets = list(product((0, 1), repeat=self.controls)) if held is not None else [(0,) * self.controls]
        for i, vertex in enumerate(self.vertices):
            for limited in sets:
                words = f"vertex {i}" + (f", limited controls {[k for k, one in enumerate(limited) if one]}"
                                         if held is not None else "")
                yield words, self._loop(vertex, limited, held)

    def _loop(self, vertex: tuple[fmpq_mat, fmpq_mat, fmpq_mat], limited: tuple[int, ...], held: fmpq_mat | None
              ) -> Loop:
        A, B1, B2 = vertex
        own = self.controller
        used, through = _entries(self.feedback), _entries(self.direct)
        for k, one in enumerate(limited):
            if one and held is not None:
                used[k], through[k] = _entries(held)[k], [fmpq(0)] * self.disturbances
        n, N, w = self.states, self.size, self.disturbances
        U, V = dense(used, self.controls, N), dense(through, self.controls, w)
        q, q_w = self.feedback - U, self.direct - V  # v - u
        moved = _stack(_beside(A, zeros(n, N - n)), _beside(own.B * self.seen[0], own.A))
        moved = moved + _stack(B2 * U, own.windup * q)
        driven = _stack(B1 + B2 * V, own.B * self.seen[1] + own.windup * q_w)
        C1, D11, D12 = self.performance
        return Loop(moved, driven, _beside(C1, zeros(C1.nrows(), N - n)) + D12 * U, D11 + D12 * V)


def read_plants(system: Any, limited: bool) -> Plants:
    """Return the plants and the controller of section "system", or raise InputError; ``limited``: sets of controls."""
    table = mapping(system, "system")
    no_other(table, ["vertices", "measured", "controller", "performance", "sample_time"], "system")
    time = not_negative(get(table, "sample_time", "system"), "system.sample_time")
    k = _controls(table)
    vertices = _read_vertices(table, k)
    n, w = vertices[0][0].nrows(), vertices[0][1].ncols()
    seen = _read_seen(table, n, w)
    controller = _read_controller(table, k, seen[0].nrows())
    size = n + controller.states + w + k + seen[0].nrows()
    if len(vertices) * (2**k if limited else 1) * size**3 > _MOST_WORK:
        raise InputError(f"{len(vertices)} vertices, {k} controls, {size} states, inputs and measurements",
                         where="system.vertices", expected="fewer: too many")
    performance = zeros(0, n), zeros(0, w), zeros(0, k)
    if "performance" in table:
        part = mapping(table["performance"], "system.performance")
        no_other(part, ["C", "D"], "system.performance")
        C, D = (read_matrix(get(part, key, "system.performance"), f"system.performance.{key}") for key in "CD")
        if not C:
            raise InputError("no output", where="system.performance", expected="at least one row")
        expect_shape(C, len(C), n, "system.performance.C")
        expect_shape(D, len(C), w + k, "system.performance.D")
        performance = (dense(C, len(C), n), dense([row[:w] for row in D], len(C), w),
                       dense([row[w:] for row in D], len(C), k))
    return Plants(vertices, seen, controller, performance, _beside(controller.D * seen[0], controller.C),
                  controller.D * seen[1], time)


def _controls(table: Mapping[str, Any]) -> int:
    if "controller" not in table:
        if "measured" in table:
            raise InputError("measurements without a controller", where="system.measured", expected="a controller")
        return 0
    part = mapping(table["controller"], "system.controller")
    count = len(sequence(get(part, "D", "system.controller"), "system.controller.D"))
    if not count:
        raise InputError("no control", where="system.controller.D", expected="at least one row")
    return count


def _read_vertices(table: Mapping[str, Any], k: int) -> tuple[tuple[fmpq_mat, fmpq_mat, fmpq_mat], ...]:
    found, sizes = [], set()
    for i, item in enumerate(sequence(get(table, "vertices", "system"), "system.vertices")):
        where = f"system.vertices[{i}]"
        part = mapping(item, where)
        no_other(part, ["A", "B"], where)
        A, B = (read_matrix(get(part, key, where), f"{where}.{key}") for key in "AB")
        n, m = len(A), len(B[0]) if B else 0
        sizes.add((n, m))
        if not n or m < k or len(sizes) > 1:
            raise InputError(f"{n} states and {m} inputs", where=where,
                             expected=f"the same at every vertex, at least one state, {k} inputs for control")
        expect_shape(A, n, n, f"{where}.A")
        expect_shape(B, n, m, f"{where}.B")
        w = m - k
        found.append((dense(A, n, n), dense([row[:w] for row in B], n, w), dense([row[w:] for row in B], n, k)))
    if not found:
        raise InputError("no vertex", where="system.vertices", expected="at least one")
    return tuple(found)


def _read_seen(table: Mapping[str, Any], n: int, w: int) -> tuple[fmpq_mat, fmpq_mat]:
    """Return C and D of y = C x + D w; y = x where nothing is said."""
    if "measured" not in table:
        return fmpq_mat(n, n, [fmpq(int(i == j)) for i in range(n) for j in range(n)]), zeros(n, w)
    part = mapping(table["measured"], "system.measured")
    no_other(part, ["C", "D"], "system.measured")
    C, D = (read_matrix(get(part, key, "system.measured"), f"system.measured.{key}") for key in "CD")
    expect_shape(C, len(C), n, "system.measured.C")
    expect_shape(D, len(C), w, "system.measured.D")
    return dense(C, len(C), n), dense(D, len(C), w)


def _read_controller(table: Mapping[str, Any], k: int, p: int) -> Controller:
    where = "system.controller"
    if not k:
        return Controller(zeros(0, 0), zeros(0, p), zeros(0, 0), zeros(0, p), zeros(0, 0))
    part = mapping(table["controller"], where)
    no_other(part, ["A", "B", "C", "D", "windup"], where)
    found = {key: read_matrix(get(part, key, where), f"{where}.{key}") for key in "ABCD"}
    q = len(found["A"])
    shapes = {"A": (q, q), "B": (q, p), "C": (k, q), "D": (k, p), "windup": (q, k)}
    windup = read_matrix(part["windup"], f"{where}.windup") if "windup" in part else ((fmpq(0),) * k,) * q
    for key, matrix in (*found.items(), ("windup", windup)):
        expect_shape(matrix, *shapes[key], f"{where}.{key}")
    A, B, C, D = (dense(found[key], *shapes[key]) for key in "ABCD")
    return Controller(A, B, C, D, dense(windup, q, k))


def dense(matrix: Rows | list[list[fmpq]] | list[tuple[fmpq, ...]], rows: int, columns: int) -> fmpq_mat:
    """Return rows of exact numbers as a matrix, also where it is empty."""
    return fmpq_mat(rows, columns, [entry for row in matrix for entry in row])


def zeros(rows: int, columns: int) -> fmpq_mat:
    """Return a matrix of zeros, also where it is empty."""
    return fmpq_mat(rows, columns)


def _entries(matrix: fmpq_mat) -> list[list[fmpq]]:
    return [[matrix[i, j] for j in range(matrix.ncols())] for i in range(matrix.nrows())]


def _beside(left: fmpq_mat, right: fmpq_mat) -> fmpq_mat:
    rows = [[*a, *b] for a, b in zip(_entries(left), _entries(right), strict=True)]
    return dense(rows, left.nrows(), left.ncols() + right.ncols())


def _stack(upper: fmpq_mat, lower: fmpq_mat) -> fmpq_mat:
    return dense([*_entries(upper), *_entries(lower)], upper.nrows() + lower.nrows(), upper.ncols())
