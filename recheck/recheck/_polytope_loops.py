"""Loops at the vertices of a hull of plants: with a gain, or with one controller per vertex, averaged as the plants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from operator import mul
from typing import Any

from ._document import get, mapping, matrix, only, sequence
from ._exact import ZERO, Malformed

Matrix = list[list[Fraction]]
Loop = tuple[Matrix, Matrix, Matrix, Matrix]
_KEYS = ("A", "B", "C", "D")
_MOST_WORK = 300_000_000  # vertices times the cube of the states of a loop


@dataclass(frozen=True)
class Loops:
    """A, B1, C, D1 of the loop at every vertex, and the sizes of the plants; ``measured``: 0 for a gain."""

    at: list[Loop]
    states: int
    inputs: int
    controls: int
    outputs: int
    measured: int


def read_loops(system: Mapping[str, Any], bounded: bool) -> Loops:
    """Return the loops; ``bounded``: a norm from w to z is claimed, so that there must be some of both."""
    found = _scheduled(system) if "controller" in system else _fed_back(system, bounded)
    if bounded and (found.inputs == found.controls or found.outputs == found.measured):
        raise Malformed("system.vertices: no disturbance or no performance output")
    return found


def _check_work(count: int, states: int) -> None:
    if count * states**3 > _MOST_WORK:
        raise Malformed("system.vertices: too many")


def _fed_back(system: Mapping[str, Any], bounded: bool) -> Loops:
    only(system, ["vertices", "gain", "sample_time"], "system")
    rows = sequence(get(system, "gain", "system"), "system.gain")
    k, n = len(rows), len(sequence(rows[0], "system.gain")) if rows else 0
    items = sequence(get(system, "vertices", "system"), "system.vertices")
    if not n or not items:
        raise Malformed("system: no vertex, or an empty gain")
    F = matrix(rows, k, n, "system.gain")
    _check_work(len(items), n)
    loops, sizes = [], set()
    for i, item in enumerate(items):
        loop, m, p = _with_gain(item, F, f"system.vertices[{i}]", bounded)
        loops.append(loop)
        sizes.add((m, p))
    if len(sizes) > 1:
        raise Malformed("system.vertices: they differ in size")
    (m, p), = sizes
    return Loops(loops, n, m, k, p, 0)


def _with_gain(item: Any, F: Matrix, where: str, bounded: bool) -> tuple[Loop, int, int]:
    part, k, n = mapping(item, where), len(F), len(F[0])
    only(part, _KEYS, where)
    A, lines = matrix(get(part, "A", where), n, n, f"{where}.A"), sequence(get(part, "B", where), f"{where}.B")
    m = len(sequence(lines[0], f"{where}.B")) if lines else 0
    B = matrix(lines, n, m, f"{where}.B")
    if m < k:
        raise Malformed(f"{where}.B: fewer inputs than controls")
    C: Matrix = []
    D: Matrix = []
    if bounded or "C" in part or "D" in part:
        p = len(sequence(get(part, "C", where), f"{where}.C"))
        C, D = matrix(part["C"], p, n, f"{where}.C"), matrix(get(part, "D", where), p, m, f"{where}.D")
    w = m - k
    closed = plus(A, times([row[w:] for row in B], F))
    seen = plus(C, times([row[w:] for row in D], F))
    return (closed, [row[:w] for row in B], seen, [row[:w] for row in D]), m, len(C)


def _scheduled(system: Mapping[str, Any]) -> Loops:
    only(system, ["vertices", "controller", "n_meas", "n_ctrl", "sample_time"], "system")
    plants, controllers = _systems(system, "vertices"), _systems(system, "controller")
    if len(plants) != len(controllers):
        raise Malformed("system.controller: not one per vertex")
    n, s = len(plants[0][0]), len(controllers[0][0])
    _check_work(len(plants), n + s)
    p, m = len(plants[0][3]), len(plants[0][3][0])
    q, k = _count(system, "n_meas", p), _count(system, "n_ctrl", m)
    if (len(controllers[0][3][0]), len(controllers[0][3])) != (q, k):
        raise Malformed("system.controller: other measurements or controls than the plants")
    _check_average(plants, controllers, m - k, p - q)
    loops = [_closed(plant, controller, m - k, p - q) for plant, controller in zip(plants, controllers, strict=True)]
    return Loops(loops, n, m, k, p, q)


def _systems(system: Mapping[str, Any], name: str) -> list[Loop]:
    found = []
    for i, item in enumerate(sequence(get(system, name, "system"), f"system.{name}")):
        where = f"system.{name}[{i}]"
        part = mapping(item, where)
        only(part, _KEYS, where)
        n, outputs = len(sequence(get(part, "A", where), where)), sequence(get(part, "D", where), where)
        inputs = len(sequence(outputs[0], where)) if outputs else 0
        if not inputs or n > 400:
            raise Malformed(f"{where}: no input or output, or too many states")
        sizes = {"A": (n, n), "B": (n, inputs), "C": (len(outputs), n), "D": (len(outputs), inputs)}
        A, B, C, D = (matrix(get(part, key, where), *sizes[key], f"{where}.{key}") for key in _KEYS)
        found.append((A, B, C, D))
    if len({(len(A), len(D), len(D[0])) for A, _, _, D in found}) != 1:
        raise Malformed(f"system.{name}: none, or of different sizes")
    return found


def _count(system: Mapping[str, Any], key: str, most: int) -> int:
    (value,), = matrix([[get(system, key, "system")]], 1, 1, f"system.{key}")
    if value.denominator != 1 or not 1 <= value <= most:
        raise Malformed(f"system.{key}: not a whole number from 1 to {most}")
    return int(value)


def _check_average(plants: Sequence[Loop], controllers: Sequence[Loop], w: int, z: int) -> None:
    """The loop of the averages must be the average of the loops: no product of two factors that vary."""
    acts = _moves([[row[w:] for row in B] + [row[w:] for row in D[:z]] for _, B, _, D in plants])
    sees = _moves([C[z:] + [row[:w] for row in D[z:]] for _, _, C, D in plants])
    through = [[row[w:] for row in D[z:]] for _, _, _, D in plants]
    moves_B, moves_C, moves_D = (_moves([one[i] for one in controllers]) for i in (1, 2, 3))
    straight = any(any(map(any, one[3])) for one in controllers)
    passes = any(any(map(any, one)) for one in through)
    if straight and passes:
        raise Malformed("system: neither D22 nor D_K is zero")
    wrong = (acts and moves_C) or (sees and moves_B)
    if straight:
        wrong = wrong or acts + sees + moves_D > 1
    if passes:
        wrong = wrong or _moves(through) + moves_B + moves_C > 1
    if wrong:
        raise Malformed("system: the loop is not the average of those at the vertices")


def _moves(parts: Sequence[Matrix]) -> bool:
    return any(part != parts[0] for part in parts)


def _closed(plant: Loop, controller: Loop, w: int, z: int) -> Loop:
    """Everything as a function of (x, x_K, w): u = D_K y0 + C_K x_K, y = y0 + D22 u, y0 = C2 x + D21 w."""
    A, B, C, D = plant
    AK, BK, CK, DK = controller
    n, s = len(A), len(AK)
    y0 = [[*c, *([ZERO] * s), *d[:w]] for c, d in zip(C[z:], D[z:], strict=True)]
    u = plus(times(DK, y0), [[*([ZERO] * n), *row, *([ZERO] * w)] for row in CK])
    y = plus(y0, times([row[w:] for row in D[z:]], u))
    x = plus([[*a, *([ZERO] * s), *b[:w]] for a, b in zip(A, B, strict=True)], times([row[w:] for row in B], u))
    own = plus([[*([ZERO] * n), *row, *([ZERO] * w)] for row in AK], times(BK, y))
    seen = plus([[*c, *([ZERO] * s), *d[:w]] for c, d in zip(C[:z], D[:z], strict=True)],
                times([row[w:] for row in D[:z]], u))
    moved, size = [*x, *own], n + s
    return ([row[:size] for row in moved], [row[size:] for row in moved], [row[:size] for row in seen],
            [row[size:] for row in seen])


def times(a: Matrix, b: Matrix) -> Matrix:
    """Return a product."""
    columns = list(zip(*b, strict=True))
    return [[sum(map(mul, row, column), ZERO) for column in columns] for row in a]


def plus(a: Matrix, b: Matrix) -> Matrix:
    """Return a sum."""
    return [[x + y for x, y in zip(row, other, strict=True)] for row, other in zip(a, b, strict=True)]
