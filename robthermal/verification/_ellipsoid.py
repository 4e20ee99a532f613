"""Kind "ellipsoid": a set x'Px <= level that is never left, for every plant of a hull, with limits that it keeps.

Without disturbance, with limited disturbances, or with disturbances of limited energy. The loops are formed in rational
numbers (`_ellipsoid_loop`); with one P every inequality is convex in the loop, so that the vertices decide.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb, arb_mat, fmpq, fmpq_mat

from robthermal.errors import InputError

from ._ellipsoid_loop import Loop, Plants, dense, read_plants, zeros
from ._fields import get, mapping, no_other, not_negative, positive, sequence
from ._hash import short_hash
from ._hinf import join
from ._kind import Kind, Proof, working_precision
from ._lti import Rows, expect_shape, read_matrix
from ._lyapunov import asymmetry
from ._numbers import decimal
from ._stability import positive as definite


@dataclass(frozen=True)
class Limits:
    """Rows r with r xi <= bound, and the short hash of their table."""

    rows: tuple[fmpq_mat, ...]
    bounds: tuple[fmpq, ...]
    table: str


@dataclass(frozen=True)
class Ellipsoid:
    """The exact problem of one certificate.

    ``disturbance``: one number (Euclidean norm) or one per input, ``multipliers`` with it; ``bound``: of the gain under
    disturbances of energy up to the level; neither: no disturbance.
    """

    plants: Plants
    level: fmpq
    rate: fmpq
    disturbance: fmpq | tuple[fmpq, ...] | None
    bound: fmpq | None
    saturation: tuple[fmpq, ...]
    limits: Limits | None
    cost: tuple[fmpq_mat, fmpq_mat, str] | None
    matrix: Rows
    decay: fmpq
    multipliers: tuple[fmpq, ...]
    held: fmpq_mat | None
    table: str


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Ellipsoid:
    """Return the exact problem, or raise InputError."""
    asked, found = mapping(region, "region"), mapping(evidence, "evidence")
    no_other(mapping(margin, "margin"), [], "margin")
    plants = read_plants(system, "saturation" in asked)
    way = "disturbance" if "disturbance" in asked else "bound" if "bound" in asked else ""
    no_other(asked, ["level", "saturation", "limits", *([way] if way else ["rate"]),
                     *([] if way or "saturation" in asked else ["cost"])], "region")
    if bool(plants.disturbances) != bool(way) or bool(plants.outputs) != (way == "bound"):
        raise InputError(f"{plants.disturbances} disturbances, {plants.outputs} performance outputs", where="region",
                         expected="disturbances with region.disturbance, both with region.bound, else none")
    n, N, w = plants.states, plants.size, plants.disturbances
    rate = not_negative(asked.get("rate", 0), "region.rate")
    if plants.discrete and rate >= 1:
        raise InputError("rate of 1 or more", where="region.rate", expected="below 1 for sampled plants")
    disturbance = _read_disturbance(asked["disturbance"], w) if way == "disturbance" else None
    saturation = _numbers(asked["saturation"], plants.controls, "region.saturation") if "saturation" in asked else ()
    if "saturation" in asked and not saturation:
        raise InputError("limits of controls without a controller", where="region.saturation", expected="a controller")
    no_other(found, ["matrix", *(["feedback"] if saturation else []), *(["decay"] if disturbance is not None else []),
                     *(["multipliers"] if isinstance(disturbance, tuple) else [])], "evidence")
    matrix = _read(get(found, "matrix", "evidence"), N, N, "evidence.matrix")
    held = dense(_read(get(found, "feedback", "evidence"), plants.controls, N, "evidence.feedback"), plants.controls,
                 N) if saturation else None
    decay = positive(get(found, "decay", "evidence"), "evidence.decay") if disturbance is not None else fmpq(0)
    if plants.discrete and decay >= 1:
        raise InputError("decay of 1 or more", where="evidence.decay", expected="below 1 for sampled plants")
    multipliers = (_numbers(get(found, "multipliers", "evidence"), w, "evidence.multipliers")
                   if isinstance(disturbance, tuple) else ())
    return Ellipsoid(plants, positive(get(asked, "level", "region"), "region.level"), rate, disturbance,
                     positive(asked["bound"], "region.bound") if way == "bound" else None, saturation,
                     _read_limits(asked["limits"], plants, bool(saturation)) if "limits" in asked else None,
                     _read_cost(asked["cost"], plants, n) if "cost" in asked else None, matrix, decay, multipliers,
                     held, short_hash(found["matrix"]))


def _read_disturbance(value: Any, count: int) -> fmpq | tuple[fmpq, ...]:
    if isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim):
        return _numbers(value, count, "region.disturbance")
    return positive(value, "region.disturbance")


def _numbers(value: Any, count: int, where: str) -> tuple[fmpq, ...]:
    items = sequence(value, where)
    if len(items) != count:
        raise InputError(f"{len(items)} numbers", where=where, expected=f"{count}")
    return tuple(positive(item, f"{where}[{k}]") for k, item in enumerate(items))


def _read(value: Any, rows: int, columns: int, where: str) -> Rows:
    matrix = read_matrix(value, where)
    expect_shape(matrix, rows, columns, where)
    return matrix


def _read_limits(value: Any, plants: Plants, limited: bool) -> Limits:
    """Return rows over the states of plant and controller: u = F xi is put in."""
    where = "region.limits"
    table = mapping(value, where)
    no_other(table, ["state", "bound", *(["control"] if plants.controls and not limited else [])], where)
    bounds = _numbers(table.get("bound", ()), len(sequence(get(table, "bound", where), where)), f"{where}.bound")
    count, n, N, k = len(bounds), plants.states, plants.size, plants.controls
    if not count:
        raise InputError("no limit", where=where, expected="at least one row")
    G = _read(get(table, "state", where), count, n, f"{where}.state")
    H = zeros(count, k)
    if "control" in table:
        H = dense(_read(table["control"], count, k, f"{where}.control"), count, k)
    if any(entry != 0 for entry in (H * plants.direct).entries()):
        raise InputError("a limit of controls that the disturbance reaches directly", where=where,
                         expected="controls that do not depend on the disturbance of the moment")
    own = dense([[*row, *[fmpq(0)] * (N - n)] for row in G], count, N) + H * plants.feedback
    rows = tuple(dense([[own[i, j] for j in range(N)]], 1, N) for i in range(count))
    return Limits(rows, bounds, short_hash(table))


def _read_cost(value: Any, plants: Plants, n: int) -> tuple[fmpq_mat, fmpq_mat, str]:
    where, k = "region.cost", plants.controls
    table = mapping(value, where)
    no_other(table, ["state", *(["control"] if k else [])], where)
    found = []
    for key, size in (("state", n), ("control", k)):
        matrix = _read(table[key], size, size, f"{where}.{key}") if key in table else ((fmpq(0),) * size,) * size
        if any(matrix[i][j] != matrix[j][i] for i in range(size) for j in range(i)):
            raise InputError("a matrix that is not symmetric", where=f"{where}.{key}", expected="a symmetric matrix")
        found.append(dense(matrix, size, size))
    return found[0], found[1], short_hash(table)


def claim(problem: Ellipsoid, machine: str) -> str:
    """Return the one sentence the data give."""
    plants = problem.plants
    time = f"sampled at {decimal(plants.sample_time)} s" if plants.discrete else "continuous"
    k, q = plants.controls, plants.controller.states
    inputs = plants.disturbances + k
    sizes = ", ".join([_plural(plants.states, "state"), _plural(inputs, "input"),
                       *([f"the last {k} for control"] if k else [])])
    words = f", with the controller as given ({_plural(q, 'state')})" if k else ""
    if problem.saturation:
        words += f", its controls limited to {', '.join(map(decimal, problem.saturation))} on both sides"
    both = ", x the states of plant and controller" if q else ""
    return (f"Of every plant, constant or varying with time in any way, in the convex hull of "
            f"{_plural(len(plants.vertices), 'vertex', 'vertices')} as given, {time} ({sizes}) (machine {machine}), "
            f"nominal parameters{words}, the ellipsoid x'Px <= {decimal(problem.level)}, P of table {problem.table}"
            f"{both}, is never left{_say_disturbance(problem)}{_say_kept(problem)}.")


def _say_disturbance(problem: Ellipsoid) -> str:
    discrete, rate = problem.plants.discrete, problem.rate
    if isinstance(problem.disturbance, tuple):
        return (" once x is in it, under disturbances of absolute values at most "
                f"{', '.join(map(decimal, problem.disturbance))} at every moment")
    if problem.disturbance is not None:
        return (f" once x is in it, under disturbances of Euclidean norm at most {decimal(problem.disturbance)} at "
                "every moment")
    if problem.bound is not None:
        return (f" from x = 0 under disturbances w of energy ({'sum' if discrete else 'integral'} of |w|²) at most "
                f"{decimal(problem.level)}, and the energy of the {_plural(problem.plants.outputs, 'output')} z is "
                f"at most {decimal(problem.bound)}² times that of w")
    if discrete:
        return " once x is in it, without disturbance, and there x'Px shrinks " + (
            f"at least by the factor {decimal(1 - rate)}² per sample" if rate > 0 else "strictly with every sample")
    return " once x is in it, without disturbance, and there x'Px falls " + (
        f"at least as exp(-2 rate t), rate = {decimal(rate)} 1/s" if rate > 0 else "strictly")


def _say_kept(problem: Ellipsoid) -> str:
    words = ""
    if problem.limits is not None:
        words += (f"; in it {_plural(len(problem.limits.rows), 'limit')} of region table {problem.limits.table} "
                  f"{'is' if len(problem.limits.rows) == 1 else 'are'} kept")
    if problem.cost is not None:
        words += (f"; the {'sum' if problem.plants.discrete else 'integral'} of the cost of region table "
                  f"{problem.cost[2]} from then on is at most x'Px")
    return words


def _plural(count: int, word: str, many: str = "") -> str:
    return f"{count} {word if count == 1 else many or word + 's'}"


def prove(problem: Ellipsoid) -> Proof:
    """Prove that V = x'Px does not grow on the boundary at every loop, and that limits and saturation hold inside."""
    if why := asymmetry(problem.matrix) or _too_strong(problem):
        return Proof(False, why)
    with working_precision():
        N = problem.plants.size
        exact_P = dense(problem.matrix, N, N)
        P = _ball(exact_P)
        if not definite(P):
            return Proof(False, "P > 0 fails or cannot be proven")
        scaled = _ball(exact_P / problem.level)
        for rows, bounds, name in _inside(problem):
            for k, (row, bound) in enumerate(zip(rows, bounds, strict=True)):
                if not definite(join(scaled, _ball(row).transpose(), arb_mat([[arb(bound**2)]]))):
                    return Proof(False, f"{name} {k} fails in the ellipsoid or cannot be proven")
        for words, loop in problem.plants.loops(problem.held):
            for name, form in _forms(problem, loop, P):
                if not definite(form):
                    return Proof(False, f"{words}: {name} fails or cannot be proven")
    count = len(problem.plants.vertices)
    return Proof(True, f"P > 0, the inequality of x'Px at {_plural(count, 'vertex', 'vertices')}, limits inside")


def _too_strong(problem: Ellipsoid) -> str:
    """Say where the multipliers of single disturbances are larger than the decay pays for."""
    if not isinstance(problem.disturbance, tuple):
        return ""
    pairs = zip(problem.multipliers, problem.disturbance, strict=True)
    total = sum((one * size**2 for one, size in pairs), fmpq(0))
    return "" if total <= problem.decay * problem.level else "the multipliers of the disturbances are too large"


def _inside(problem: Ellipsoid) -> list[tuple[tuple[fmpq_mat, ...], tuple[fmpq, ...], str]]:
    """Return the rows r and bounds b with |r xi| < b in the ellipsoid."""
    found = [] if problem.limits is None else [(problem.limits.rows, problem.limits.bounds, "limit")]
    if problem.held is not None:
        H, N = problem.held, problem.plants.size
        rows = tuple(dense([[H[i, j] for j in range(N)]], 1, N) for i in range(H.nrows()))
        found.append((rows, problem.saturation, "H x of control"))
    return found


def _forms(problem: Ellipsoid, loop: Loop, P: arb_mat) -> list[tuple[str, arb_mat]]:
    """Return what has to be positive definite of one loop."""
    A, B, w = _ball(loop.A), _ball(loop.B), loop.B.ncols()
    discrete = problem.plants.discrete
    half = P * A
    moved = A.transpose() * half if discrete else half + half.transpose()
    if not w:
        keep = P * arb((1 - problem.rate) ** 2) if discrete else P * arb(-2 * problem.rate)
        found = [("x'Px", keep - moved)]
        if problem.cost is not None:
            found.append(("x'Px with the cost", (P if discrete else arb_mat(P.nrows(), P.nrows())) - moved
                          - _ball(_cost(problem))))
        return found
    cross = half.transpose() * B if discrete else P * B
    inner = B.transpose() * P * B if discrete else arb_mat(w, w)
    if problem.bound is not None:
        C, D = _ball(loop.C), _ball(loop.D)
        share = arb(1 / problem.bound**2)
        own = (P if discrete else arb_mat(P.nrows(), P.nrows())) - moved - C.transpose() * C * share
        last = arb_mat(w, w, 1) - inner - D.transpose() * D * share
        return [("x'Px with the energies of w and z", join(own, -cross - C.transpose() * D * share, last))]
    own = P * arb(1 - problem.decay if discrete else -problem.decay) - moved
    weights = problem.multipliers
    if isinstance(problem.disturbance, fmpq):
        weights = (problem.decay * problem.level / problem.disturbance**2,) * w
    last = arb_mat(w, w, [arb(weights[i]) if i == j else arb(0) for i in range(w) for j in range(w)]) - inner
    return [("x'Px under disturbances", join(own, -cross, last))]


def _cost(problem: Ellipsoid) -> fmpq_mat:
    """Return x'Qx + u'Ru, u = F xi, as a matrix over the states of plant and controller."""
    if problem.cost is None:
        raise ValueError("no cost is claimed")
    Q, R, _ = problem.cost
    plants = problem.plants
    n, N, F = plants.states, plants.size, plants.feedback
    found = dense([[Q[i, j] if i < n and j < n else fmpq(0) for j in range(N)] for i in range(N)], N, N)
    return found + F.transpose() * R * F if plants.controls else found


def _ball(matrix: fmpq_mat) -> arb_mat:
    return arb_mat(matrix.nrows(), matrix.ncols(), [arb(entry) for entry in matrix.entries()])


def find_margin(problem: Ellipsoid) -> dict[str, float]:
    """Return no margin: level and bounds are the claim."""
    return {}


ELLIPSOID = Kind("ellipsoid", read, claim, prove, find_margin)
