"""Kind "peak": |z(t)| <= bound sup |w| for ever, from zero state, in Euclidean norms at every time.

Method "ellipsoid": the star norm of Abedor, Nagpal and Poolla (1996), with Q in place of P⁻¹, so that nothing is
inverted. Method "positive": one input and output, a positive system: the gain at frequency zero, exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flint import arb, arb_mat, fmpq, fmpq_mat

from robthermal.errors import InputError

from ._fields import get, mapping, no_other, positive
from ._kind import Kind, Proof, working_precision
from ._lti import LinearSystem, Rows, balls, expect_shape, read_linear, read_matrix, say_linear
from ._lyapunov import asymmetry
from ._numbers import decimal, exact, name_of, show
from ._stability import positive as proven_positive
from ._transfer import characteristic, too_large, unstable

_METHODS = ("ellipsoid", "positive")


@dataclass(frozen=True)
class Peak:
    """The exact problem of one peak-to-peak certificate."""

    system: LinearSystem
    bound: fmpq
    method: str
    matrix: Rows
    decay: fmpq
    share: fmpq


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Peak:
    """Return the exact problem, or raise InputError."""
    linear, table, found = read_linear(system), mapping(region, "region"), mapping(evidence, "evidence")
    no_other(table, ["bound"], "region")
    no_other(mapping(margin, "margin"), [], "margin")
    bound = positive(get(table, "bound", "region"), "region.bound")
    method = get(found, "method", "evidence")
    if method not in _METHODS:
        raise InputError(f"method {name_of(method)}", where="evidence.method", expected=f"one of {list(_METHODS)}")
    if method == "positive":
        return Peak(linear, bound, method, (), fmpq(0), fmpq(0))
    matrix = read_matrix(get(found, "matrix", "evidence"), "evidence.matrix")
    expect_shape(matrix, linear.states, linear.states, "evidence.matrix")
    decay, share = (exact(get(found, key, "evidence"), f"evidence.{key}") for key in ("decay", "share"))
    return Peak(linear, bound, method, matrix, decay, share)


def claim(problem: Peak, machine: str) -> str:
    """Return the one sentence the data give."""
    return (f"The {say_linear(problem.system, machine)} is stable, and from zero state the Euclidean norm of its "
            f"output never exceeds {decimal(problem.bound)} times the largest Euclidean norm of its input.")


def prove(problem: Peak) -> Proof:
    """Prove it by the method of the evidence."""
    return _prove_positive(problem) if problem.method == "positive" else _prove_ellipsoid(problem)


def _prove_ellipsoid(problem: Peak) -> Proof:
    """x'Q⁻¹x <= 1/decay holds for ever under |w| <= 1, and bounds |z| (proof note, linear systems, 3).

    With s = share, g = bound: A Q + Q A' + decay Q + BB' < 0, or A Q A'/(1 - decay) + BB' < Q, and
    g² I > C Q C'/(decay s) + D D'/(1 - s).
    """
    s, decay, share = problem.system, problem.decay, problem.share
    limit = "0 < decay < 1" if s.discrete else "0 < decay"
    if decay <= 0 or (s.discrete and decay >= 1) or not 0 < share < 1:
        return Proof(False, f"{limit} and 0 < share < 1 fails: decay {show(decay)}, share {show(share)}")
    why = asymmetry(problem.matrix)
    if why:
        return Proof(False, why)
    with working_precision():
        n, m, p = s.states, s.inputs, s.outputs
        Q, A, B = balls(problem.matrix, n, n), balls(s.A, n, n), balls(s.B, n, m)
        C, D = balls(s.C, p, n), balls(s.D, p, m)
        driven = B * B.transpose()
        if s.discrete:
            held = Q - A * Q * A.transpose() * (1 / arb(1 - decay)) - driven
        else:
            held = -(A * Q + (A * Q).transpose() + Q * arb(decay) + driven)
        seen = (arb_mat(p, p, 1) * arb(problem.bound) ** 2 - C * Q * C.transpose() * (1 / arb(decay * share))
                - D * D.transpose() * (1 / arb(1 - share)))
        for matrix, name in ((Q, "Q > 0"), (held, "the ellipsoid is not invariant: its inequality"),
                             (seen, "the output's inequality")):
            if not proven_positive(matrix):
                return Proof(False, f"{name} fails or cannot be proven")
    return Proof(True, "an invariant ellipsoid, and the output's bound on it")


def _prove_positive(problem: Peak) -> Proof:
    """The impulse response is not negative, so that its integral, the gain at zero, is the peak gain."""
    s, n = problem.system, problem.system.states
    if (s.inputs, s.outputs) != (1, 1):
        return Proof(False, "method positive needs one input and one output")
    negative = (any(entry < 0 for i, row in enumerate(s.A) for j, entry in enumerate(row) if s.discrete or i != j)
                or any(entry < 0 for matrix in (s.B, s.C, s.D) for row in matrix for entry in row))
    if negative:
        return Proof(False, "an entry that must not be negative is: the system is not positive")
    why = too_large(s) or unstable(characteristic(s, fmpq(0)), n)
    if why:
        return Proof(False, f"the system is not proven stable: {why}")
    A = fmpq_mat(n, n, [entry for row in s.A for entry in row])
    steady = (fmpq_mat(n, n, [fmpq(int(i == j)) for i in range(n) for j in range(n)]) - A) if s.discrete else -A
    state = steady.solve(fmpq_mat(n, 1, [row[0] for row in s.B])) if n else fmpq_mat(0, 1)
    gain = s.D[0][0] + sum((c * state[k, 0] for k, c in enumerate(s.C[0])), fmpq(0))
    if gain > problem.bound:
        return Proof(False, f"the gain at frequency zero is {show(gain)}, above the bound")
    return Proof(True, "a positive system: its peak gain is its gain at frequency zero")


def find_margin(problem: Peak) -> dict[str, float]:
    """Return no margin: the bound is the claim."""
    return {}


PEAK = Kind("peak", read, claim, prove, find_margin)
