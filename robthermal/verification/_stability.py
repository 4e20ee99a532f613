"""Kind "stability": every mode of x' = A x (or x+ = A x) decays, with a rate to spare.

Method "polynomial": the characteristic polynomial is computed exactly and its Routh array decided in balls. Method
"lyapunov": A'P + PA + 2 rate P < 0 (or A'PA < (1 - rate)² P) and P > 0, in balls.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from flint import arb, arb_mat, fmpq

from robthermal.errors import InputError

from ._definite import approximate, is_positive_preconditioned
from ._fields import get, mapping, no_other, not_negative
from ._kind import Kind, Proof, working_precision
from ._lti import LinearSystem, Rows, balls, expect_shape, read_linear, read_matrix, say_linear
from ._lyapunov import asymmetry
from ._numbers import decimal, name_of, show
from ._transfer import characteristic, too_large, unstable

_METHODS = ("lyapunov", "polynomial")


@dataclass(frozen=True)
class Stability:
    """The exact problem of one stability certificate."""

    system: LinearSystem
    rate: fmpq
    method: str
    matrix: Rows


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Stability:
    """Return the exact problem, or raise InputError."""
    linear, table, found = read_linear(system), mapping(region, "region"), mapping(evidence, "evidence")
    no_other(table, ["rate"], "region")
    no_other(mapping(margin, "margin"), [], "margin")
    rate = not_negative(table.get("rate", 0), "region.rate")
    if linear.discrete and rate >= 1:
        raise InputError(f"rate {show(rate)}", where="region.rate", expected="below 1 for a sampled system")
    method = get(found, "method", "evidence")
    if method not in _METHODS:
        raise InputError(f"method {name_of(method)}", where="evidence.method", expected=f"one of {list(_METHODS)}")
    matrix: Rows = ()
    if method == "lyapunov":
        matrix = read_matrix(get(found, "matrix", "evidence"), "evidence.matrix")
        expect_shape(matrix, linear.states, linear.states, "evidence.matrix")
    return Stability(linear, rate, method, matrix)


def claim(problem: Stability, machine: str) -> str:
    """Return the one sentence the data give."""
    if problem.system.discrete:
        modes = f"have absolute values below {decimal(1 - problem.rate)}"
    else:
        modes = f"have real parts below {decimal(-problem.rate)}{' 1/s' if problem.rate else ''}"
    return f"The {say_linear(problem.system, machine)} is asymptotically stable: all eigenvalues of A {modes}."


def prove(problem: Stability) -> Proof:
    """Prove it by the method of the evidence."""
    if problem.method == "polynomial":
        why = too_large(problem.system) or unstable(characteristic(problem.system, problem.rate), problem.system.states)
        return Proof(not why, why or "all entries of the first column of the Routh array are positive")
    why = asymmetry(problem.matrix)
    if why:
        return Proof(False, why)
    with working_precision():
        n = problem.system.states
        A, P = balls(problem.system.A, n, n), balls(problem.matrix, n, n)
        if problem.system.discrete:
            words = "A'PA < (1 - rate)² P"
            decay = P * arb((1 - problem.rate) ** 2) - A.transpose() * P * A
        else:
            words = "A'P + PA < -2 rate P"
            half = P * A
            decay = -(half + half.transpose()) - P * arb(2 * problem.rate)
        for matrix, name in ((P, "P > 0"), (decay, words)):
            if not positive(matrix):
                return Proof(False, f"{name} fails or cannot be proven")
    return Proof(True, f"P > 0 and {words}")


def positive(matrix: arb_mat) -> bool:
    """Prove a symmetric matrix of balls positive definite."""
    return matrix.nrows() == 0 or is_positive_preconditioned(*_scaled(matrix))


def _scaled(matrix: arb_mat) -> tuple[arb_mat, Any]:
    """Return the matrix with a diagonal near one, by powers of two on both sides, and its floats as the hint."""
    n = matrix.nrows()
    diagonal = [float(matrix[i, i].mid()) for i in range(n)]
    powers = [arb(2.0 ** round(-math.log2(value) / 2)) if 1e-300 < value < 1e300 else arb(1) for value in diagonal]
    scaling = arb_mat(n, n, [powers[i] if i == j else arb(0) for i in range(n) for j in range(n)])
    scaled = scaling * matrix * scaling
    return scaled, approximate(scaled)


def find_margin(problem: Stability) -> dict[str, float]:
    """Return no margin: the rate is the claim."""
    return {}


STABILITY = Kind("stability", read, claim, prove, find_margin)
