"""Polynomials with rational coefficients in several variables, and their sign on a box.

On a box a polynomial is a convex combination of its Bernstein coefficients, and at the corners they are its values.
Where they do not decide, the box is halved along the variable along which they differ most.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from itertools import product
from math import comb

from ._exact import ZERO, Interval

_MOST_BOXES = 400
_MOST_WORK = 30_000  # coefficients of all boxes
Tensor = dict[tuple[int, ...], Fraction]


class Polynomial:
    """Sum of monomials; ``terms`` maps exponents to the coefficient."""

    def __init__(self, terms: Mapping[tuple[int, ...], Fraction]):
        self.terms = {powers: value for powers, value in terms.items() if value}

    def __add__(self, other: Polynomial) -> Polynomial:
        terms = dict(self.terms)
        for powers, value in other.terms.items():
            terms[powers] = terms.get(powers, ZERO) + value
        return Polynomial(terms)

    def __mul__(self, other: Polynomial | Fraction | int) -> Polynomial:
        if not isinstance(other, Polynomial):
            return Polynomial({powers: value * other for powers, value in self.terms.items()})
        terms: dict[tuple[int, ...], Fraction] = {}
        for (p, a), (q, b) in product(self.terms.items(), other.terms.items()):
            powers = tuple(x + y for x, y in zip(p, q, strict=True))
            terms[powers] = terms.get(powers, ZERO) + a * b
        return Polynomial(terms)

    __rmul__ = __mul__

    def __sub__(self, other: Polynomial) -> Polynomial:
        return self + other * -1


def variables(count: int) -> list[Polynomial]:
    """Return the polynomials that are the variables themselves."""
    return [Polynomial({tuple(int(i == k) for i in range(count)): Fraction(1)}) for k in range(count)]


def positive_on(polynomial: Polynomial, box: Sequence[Interval], strict: bool = True) -> bool | None:
    """Decide whether a polynomial is positive (not strict: nowhere negative) on a box; None where undecided.

    Examples
    --------
    >>> x, y = variables(2)
    >>> unit = [(Fraction(0), Fraction(1))] * 2
    >>> positive_on(x + y * y * y, unit, strict=False), positive_on(x - y, unit)
    (True, False)
    """
    waiting, used = [tuple(box)], 0.0
    bits = max((value.denominator.bit_length() + value.numerator.bit_length() for pair in box for value in pair),
               default=0)
    for _ in range(_MOST_BOXES):
        if not waiting:
            return True
        part = waiting.pop()
        found = _bernstein(polynomial, part)
        used += len(found) * (1 + bits / 500) ** 2
        if _holds(found.values(), strict):
            continue
        top = [max(index[axis] for index in found) for axis in range(len(box))]
        corners = [value for index, value in found.items()
                   if all(i in (0, last) for i, last in zip(index, top, strict=True))]
        if not _holds(corners, strict):
            return False
        if used > _MOST_WORK:
            return None
        waiting += _halves(part, found)
    return None


def _holds(values: Iterable[Fraction], strict: bool) -> bool:
    least = min(values)
    return least > 0 or (least == 0 and not strict)


def _bernstein(polynomial: Polynomial, box: Sequence[Interval]) -> Tensor:
    """Return the Bernstein coefficients on a box, one variable after the other; one coefficient along a point."""
    current: Tensor = dict(polynomial.terms) or {(0,) * len(box): ZERO}
    for axis, (low, high) in enumerate(box):
        degree = max(powers[axis] for powers in current)
        lines: dict[tuple[int, ...], list[Fraction]] = {}
        for powers, value in current.items():
            line = lines.setdefault((*powers[:axis], 0, *powers[axis + 1:]), [ZERO] * (degree + 1))
            line[powers[axis]] = value
        current = {(*key[:axis], k, *key[axis + 1:]): value for key, line in lines.items()
                   for k, value in enumerate(_line(line, low, high - low))}
    sizes = [range(1 + max(index[axis] for index in current)) for axis in range(len(box))]
    return {index: current.get(index, ZERO) for index in product(*sizes)}


def _line(falling: list[Fraction], low: Fraction, width: Fraction) -> list[Fraction]:
    """Return the Bernstein coefficients of a polynomial in one variable, lowest power first."""
    work, degree = list(falling), len(falling) - 1
    for k in range(degree):  # powers of (x - low)
        for i in range(degree - 1, k - 1, -1):
            work[i] += low * work[i + 1]
    if width == 0:
        return work[:1]
    scaled = [value * width**k / comb(degree, k) for k, value in enumerate(work)]
    return [sum((comb(j, k) * scaled[k] for k in range(j + 1)), ZERO) for j in range(degree + 1)]


def _halves(box: tuple[Interval, ...], found: Tensor) -> list[tuple[Interval, ...]]:
    spread = []
    for axis in range(len(box)):
        steps = [abs(found[(*index[:axis], index[axis] + 1, *index[axis + 1:])] - value)
                 for index, value in found.items() if (*index[:axis], index[axis] + 1, *index[axis + 1:]) in found]
        spread.append(max(steps, default=Fraction(-1)))
    axis = spread.index(max(spread))
    low, high = box[axis]
    middle = (low + high) / 2
    return [(*box[:axis], half, *box[axis + 1:]) for half in ((low, middle), (middle, high))]
