"""Polynomials on intervals of [0, ∞], decided by the signs of their Bernstein coefficients in ball arithmetic.

With x = (a + b u)/(1 + u) (or a + u where b = ∞), (1+u)^n p(x(u)) has coefficients that are positive multiples of the
Bernstein coefficients of p on [a, b]. All positive: p > 0 on the whole interval, ends included. Conversely they are
positive as soon as no root lies near the interval, so that cutting it in two ends quickly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import arb, arb_poly

Cell = tuple[arb, arb | None]  # [a, b], None for infinity
DEEPEST = 60  # how often one interval may be halved


@dataclass(frozen=True)
class Sign:
    """What was found on an interval: positive, or where it is not, or where it could not be decided."""

    positive: bool
    certain: bool  # of a "no": the polynomial is certainly not positive at ``at``
    at: arb | None


def coefficients(polynomial: arb_poly, degree: int, cell: Cell) -> list[arb]:
    """Return positive multiples of the Bernstein coefficients, the value at b first, that at a last."""
    a, b = cell
    if b is None:
        found = _padded(polynomial(arb_poly([a, 1])), degree)
        return found[::-1]
    local = _padded(polynomial(arb_poly([a, b - a])), degree)
    return _padded(arb_poly(local[::-1])(arb_poly([1, 1])), degree)


def sign_on(polynomial: arb_poly, degree: int, cell: Cell) -> Sign:
    """Decide whether a polynomial is positive on a closed interval."""
    waiting = [(cell, 0)]
    while waiting:
        part, depth = waiting.pop()
        signs = coefficients(polynomial, degree, part)
        if all(entry > 0 for entry in signs):
            continue
        for entry, at in ((signs[-1], part[0]), (signs[0], part[1])):
            if not entry > 0:  # the value at an end, for infinity the leading coefficient
                return Sign(False, bool(entry < 0), at)
        if depth == DEEPEST:
            return Sign(False, False, part[0])
        waiting += [(half, depth + 1) for half in halves(part)]
    return Sign(True, True, None)


def halves(cell: Cell) -> tuple[Cell, Cell]:
    """Cut an interval in two: geometrically where it is long."""
    a, b = cell
    if b is None:
        middle = 4 * a if a > 0 else arb(1)
    elif a > 0 and b > 4 * a:
        middle = (a * b).sqrt()
    elif a > 0:
        middle = (a + b) / 2
    else:
        middle = b / 4
    middle = middle.mid()
    return (a, middle), (middle, b)


def largest_ratio(above: Sequence[arb], below: Sequence[arb]) -> arb | None:
    """Return a bound of p/q on an interval from the Bernstein coefficients of both, None where q is not positive.

    p - r q has the coefficients p_k - r q_k <= 0 for r the largest p_k/q_k.
    """
    largest = arb(0)
    for p, q in zip(above, below, strict=True):
        if not q > 0:
            return None
        ratio = (p / q).upper()
        if not ratio.is_finite():
            return None
        if not ratio <= largest:
            largest = ratio
    return largest


def _padded(polynomial: arb_poly, degree: int) -> list[arb]:
    found = polynomial.coeffs()
    return [*found, *([arb(0)] * (degree + 1 - len(found)))]
