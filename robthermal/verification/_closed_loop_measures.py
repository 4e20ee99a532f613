"""Measures of a closed loop that have no kind of their own: the H2 norm, and where its eigenvalues lie."""

from __future__ import annotations

from dataclasses import dataclass

from flint import arb, arb_mat, fmpq

from ._kind import Proof, working_precision
from ._lti import LinearSystem, Rows, balls
from ._lyapunov import asymmetry
from ._stability import positive


@dataclass(frozen=True)
class Region:
    """Decay α [1/s], damping ratio ζ [-], radius r [1/s; sampled -]; None where nothing is claimed."""

    decay: fmpq | None
    damping: fmpq | None
    radius: fmpq | None


def prove_h2(loop: LinearSystem, bound: fmpq, matrix: Rows) -> Proof:
    """P > 0, A'P + PA + C'C < 0 and tr B'PB < bound², D = 0.

    Sampled: A'PA - P + C'C < 0 and tr (B'PB + D'D) < bound². P is above the observability gramian.
    """
    if not loop.discrete and any(entry != 0 for row in loop.D for entry in row):
        return Proof(False, "the direct path from disturbance to output is not zero: the H2 norm is infinite")
    why = asymmetry(matrix)
    if why:
        return Proof(False, why)
    with working_precision():
        n, m, p = loop.states, loop.inputs, loop.outputs
        P, A, B = balls(matrix, n, n), balls(loop.A, n, n), balls(loop.B, n, m)
        C, D = balls(loop.C, p, n), balls(loop.D, p, m)
        half, seen = P * A, C.transpose() * C
        decay = P - A.transpose() * half - seen if loop.discrete else -(half + half.transpose() + seen)
        for form, name in ((P, "P > 0"), (decay, "the Lyapunov inequality of the H2 norm")):
            if not positive(form):
                return Proof(False, f"{name} fails or cannot be proven")
        energy = B.transpose() * P * B + (D.transpose() * D)
        if not sum((energy[j, j] for j in range(m)), arb(0)) < arb(bound) ** 2:
            return Proof(False, "the trace of B'PB is not below the square of the bound")
    return Proof(True, "P > 0, the Lyapunov inequality of the H2 norm, and its trace")


def prove_region(loop: LinearSystem, poles: Region, matrix: Rows) -> Proof:
    """One P > 0 for all parts of the region: Chilali and Gahinet (1996), theorem 2.2.

    Decay: A'P + PA + 2 α P < 0. Radius: A'PA < r² P. Damping, with s = √(1 - ζ²):
    [s (A'P + PA), ζ (PA - A'P); ., s (A'P + PA)] < 0.
    """
    why = asymmetry(matrix)
    if why:
        return Proof(False, why)
    with working_precision():
        n = loop.states
        P, A = balls(matrix, n, n), balls(loop.A, n, n)
        half = P * A
        both, skew = half + half.transpose(), half - half.transpose()
        forms = [(P, "P > 0")]
        if poles.decay is not None:
            forms.append((-both - P * arb(2 * poles.decay), "the inequality of the decay"))
        if poles.radius is not None:
            forms.append((P * arb(poles.radius**2) - A.transpose() * half, "the inequality of the radius"))
        if poles.damping is not None:
            own, cross = both * arb(1 - poles.damping**2).sqrt(), skew * arb(poles.damping)
            forms.append((-_square(own, cross), "the inequality of the damping"))
        for form, name in forms:
            if not positive(form):
                return Proof(False, f"{name} fails or cannot be proven")
    return Proof(True, "P > 0 and the inequalities of the region")


def _square(own: arb_mat, cross: arb_mat) -> arb_mat:
    """Return [own, cross; cross', own]."""
    a, b, c = own.tolist(), cross.tolist(), cross.transpose().tolist()
    rows = [[*a[i], *b[i]] for i in range(len(a))] + [[*c[i], *a[i]] for i in range(len(a))]
    return arb_mat(len(rows), len(rows), [entry for row in rows for entry in row])
