"""Kind "hinf": the H-infinity norm of L G R⁻¹ is below a bound, G = C (sI - A)⁻¹ B + D stable.

Method "bounded_real": P > 0 and the matrix inequality of the bounded real lemma, in balls. Method "polynomial": the
proof of kind "frequency" on one interval, which needs no evidence.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flint import arb, arb_mat, fmpq

from robthermal.errors import InputError

from ._fields import get, mapping, no_other, positive
from ._frequency import Frequency, read_scaling
from ._frequency import prove as prove_frequency
from ._frequency_norm import Bound, Scaling
from ._hash import short_hash
from ._kind import Kind, Proof, working_precision
from ._lti import LinearSystem, Rows, balls, expect_shape, read_linear, read_matrix, say_linear
from ._lyapunov import asymmetry
from ._numbers import decimal, name_of
from ._stability import positive as proven_positive

_METHODS = ("bounded_real", "polynomial")


@dataclass(frozen=True)
class Hinf:
    """The exact problem of one H-infinity certificate; ``region``: hash of bound and scalings."""

    system: LinearSystem
    bound: fmpq
    left: Scaling | None
    right: Scaling | None
    method: str
    matrix: Rows
    region: str


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Hinf:
    """Return the exact problem, or raise InputError."""
    linear, table, found = read_linear(system), mapping(region, "region"), mapping(evidence, "evidence")
    no_other(table, ["bound", "left", "right"], "region")
    no_other(mapping(margin, "margin"), [], "margin")
    method = get(found, "method", "evidence")
    if method not in _METHODS:
        raise InputError(f"method {name_of(method)}", where="evidence.method", expected=f"one of {list(_METHODS)}")
    matrix: Rows = ()
    if method == "bounded_real":
        matrix = read_matrix(get(found, "matrix", "evidence"), "evidence.matrix")
        expect_shape(matrix, linear.states, linear.states, "evidence.matrix")
    return Hinf(linear, positive(get(table, "bound", "region"), "region.bound"),
                _scaling(table, "left", linear.outputs), _scaling(table, "right", linear.inputs), method, matrix,
                short_hash(table))


def claim(problem: Hinf, machine: str) -> str:
    """Return the one sentence the data give."""
    scaled = (f"L G R^-1, with the scalings of region {problem.region}," if problem.left or problem.right
              else "its transfer matrix")
    return (f"The {say_linear(problem.system, machine)} is stable, and the H-infinity norm of {scaled} is below "
            f"{decimal(problem.bound)}.")


def prove(problem: Hinf) -> Proof:
    """Prove it by the method of the evidence."""
    if problem.method == "polynomial":
        bounds = (Bound(problem.bound, problem.left, problem.right),)
        return prove_frequency(Frequency(problem.system, (), bounds, (), (), fmpq(0), ""))
    why = asymmetry(problem.matrix)
    if why:
        return Proof(False, why)
    with working_precision():
        inequality = _inequality(problem)
        n = problem.system.states
        for matrix, name in ((balls(problem.matrix, n, n), "P > 0"), (inequality, "the bounded real lemma")):
            if not proven_positive(matrix):
                return Proof(False, f"{name} fails or cannot be proven")
    return Proof(True, "P > 0 and the matrix inequality of the bounded real lemma")


def _inequality(problem: Hinf) -> arb_mat:
    """Return what must be positive definite, with W = L'L and V = R'R.

    Continuous: -[A'P + PA + C'WC, PB + C'WD; ., D'WD - bound² V]; sampled: P - A'PA in place of -(A'P + PA), -A'PB in
    place of -PB and -B'PB added to the last block.
    """
    s = problem.system
    n, m, p = s.states, s.inputs, s.outputs
    P, A, B = balls(problem.matrix, n, n), balls(s.A, n, n), balls(s.B, n, m)
    C, D = balls(s.C, p, n), balls(s.D, p, m)
    W, V = _weight(problem.left, p), _weight(problem.right, m)
    own, cross, last = C.transpose() * W * C, C.transpose() * W * D, D.transpose() * W * D - V * arb(problem.bound) ** 2
    if s.discrete:
        own += A.transpose() * P * A - P
        cross += A.transpose() * P * B
        last += B.transpose() * P * B
    else:
        own += P * A + (P * A).transpose()
        cross += P * B
    return join(-own, -cross, -last)


def join(own: arb_mat, cross: arb_mat, last: arb_mat) -> arb_mat:
    """Return the symmetric matrix [own, cross; cross', last]."""
    a, b, c, d = own.tolist(), cross.tolist(), cross.transpose().tolist(), last.tolist()
    n, m = own.nrows(), last.nrows()
    rows = [[*a[i], *b[i]] for i in range(n)] + [[*c[i], *d[i]] for i in range(m)]
    return arb_mat(n + m, n + m, [entry for row in rows for entry in row])


def _weight(scaling: Scaling | None, size: int) -> arb_mat:
    if scaling is None:
        return arb_mat(size, size, 1)
    L = arb_mat([[arb(real) for real, _ in row] for row in scaling])
    return L.transpose() * L


def _scaling(table: Any, key: str, size: int) -> Scaling | None:
    if key not in table:
        return None
    found = read_scaling(table[key], size, f"region.{key}")
    if any(imaginary != 0 for row in found for _, imaginary in row):
        raise InputError("a scaling is complex", where=f"region.{key}", expected="real numbers")
    return found


def find_margin(problem: Hinf) -> dict[str, float]:
    """Return no margin: the bound is the claim."""
    return {}


HINF = Kind("hinf", read, claim, prove, find_margin)
