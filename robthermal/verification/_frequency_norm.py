"""Form "norm": σ_max(L M(jω) R⁻¹) < β at every frequency of an interval, from one polynomial and one point.

With G = L M R⁻¹, g = |d|² det(β² - G Gᴴ) is a polynomial of degree n in x = t² (2n in t where a scaling is complex): it
is the determinant of a pencil with 2n rows. Where g has no root in the interval and all eigenvalues of G Gᴴ lie below
β² at its lower end, they lie below β² in all of it, because they are continuous.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flint import acb, acb_mat, arb, arb_poly, fmpq

from ._bernstein import sign_on
from ._kind import working_precision
from ._transfer import Transfer, as_balls, parts, squared

Scaling = tuple[tuple[tuple[fmpq, fmpq], ...], ...]  # rows of (real, imaginary)
Places = Callable[[], list[arb]]
_SPREAD = 40.0  # nodes lie between scale / 40 and 40 scale


@dataclass(frozen=True)
class Bound:
    """The claim on one interval: σ_max(left M right⁻¹) < bound; identity where a scaling is None."""

    bound: fmpq
    left: Scaling | None
    right: Scaling | None


@dataclass(frozen=True)
class Failed:
    """An interval that is not proven, and t on the axis where that shows; ``certain``: the bound is wrong there."""

    interval: int
    certain: bool
    at: arb | None
    why: str


def ladder(degree: int) -> tuple[int, ...]:
    """Return the precisions to try [bit]: interpolation and shifts lose up to a few tens of bits per degree."""
    return (256 + 12 * degree, 512 + 40 * degree, 1024 + 160 * degree)


def first_failure(system: Transfer, bounds: Sequence[Bound], edges: Places) -> Failed | None:
    """Prove every interval; return the first that is not. ``edges`` gives t at the ends between them."""
    waiting, failed = list(range(len(bounds))), None
    for bits in ladder(system.degree):
        with working_precision(bits):
            found = _failures(system, bounds, waiting, edges())
        if not found:
            return None
        failed = next((item for item in found if item.certain), found[0])
        if failed.certain:
            return failed
        waiting = [item.interval for item in found]
    return failed


def _failures(system: Transfer, bounds: Sequence[Bound], which: Sequence[int], edges: list[arb]) -> list[Failed]:
    """Return the intervals that are not proven at this precision, at the first certain one."""
    found: list[Failed] = []
    samples = {even: _Samples(system, even) for even in {_is_real(bounds[k]) for k in which}}
    known: dict[tuple[Scaling | None, Scaling | None], list[arb_poly] | None] = {}
    for k in which:
        item = bounds[k]
        pair, sampled = (item.left, item.right), samples[_is_real(item)]
        if pair not in known:
            known[pair] = sampled.characteristic(*pair)
        failed = _check(known[pair], sampled, item.bound, k, edges)
        if failed:
            found.append(failed)
            if failed.certain:
                break
    return found


def _check(pencil: list[arb_poly] | None, sampled: _Samples, bound: fmpq, k: int, edges: list[arb]) -> Failed | None:
    """Decide one interval."""
    if pencil is None:
        return Failed(k, False, None, "the right scaling has no inverse, or none can be proven")
    start, end = arb(0) if k == 0 else edges[k - 1], edges[k] if k < len(edges) else None
    cell = (sampled.variable(start), None if end is None else sampled.variable(end))
    level = arb(bound) ** 2
    # all derivatives at β² positive: no eigenvalue at or above β²
    at_start = arb_poly([entry(cell[0]) for entry in pencil])(arb_poly([level, 1]))
    if not all(entry > 0 for entry in at_start.coeffs()):
        return Failed(k, any(entry < 0 for entry in at_start.coeffs()), start, "at the lower end")
    g = arb_poly([0])
    for entry in reversed(pencil):
        g = g * level + entry
    sign = sign_on(g, sampled.degree, cell)
    if sign.positive:
        return None
    return Failed(k, sign.certain, None if sign.at is None else sampled.axis(sign.at), "between its ends")


class _Samples:
    """N and |d|² at as many points of the axis as determine g."""

    def __init__(self, system: Transfer, even: bool):
        n = system.degree
        self.even, self.degree = even, n if even else 2 * n
        self.points = _nodes(_scale(system), n) if even else _mirrored(_nodes(_scale(system), n))
        self.nodes = [self.variable(t) for t in self.points]
        size = as_balls(squared(system.denominator))
        self.sizes = [size(t * t) for t in self.points]
        entries = [[tuple(as_balls(part) for part in parts(entry)) for entry in row] for row in system.numerators]
        self.matrices = [acb_mat([[acb(even_part(t * t), t * odd_part(t * t)) for even_part, odd_part in row]
                                  for row in entries]) for t in self.points]

    def variable(self, t: arb) -> arb:
        return t * t if self.even else t

    def axis(self, value: arb) -> arb:
        return value.sqrt() if self.even else value

    def characteristic(self, left: Scaling | None, right: Scaling | None) -> list[arb_poly] | None:
        """Return c_k with |d|² det(λ - G Gᴴ) = Σ c_k λ^k, None where R has no inverse."""
        try:
            inverse = None if right is None else _matrix(right).inv()
        except ZeroDivisionError:
            return None
        before = None if left is None else _matrix(left)
        values = []
        for N, size in zip(self.matrices, self.sizes, strict=True):
            G = N if before is None else before * N
            G = G if inverse is None else G * inverse
            adjoint = G.transpose().conjugate()
            small = (G * adjoint if G.nrows() <= G.ncols() else adjoint * G).charpoly().coeffs()
            r = len(small) - 1
            values.append([entry.real * size ** (k - r + 1) for k, entry in enumerate(small)])
        return [arb_poly.interpolate(self.nodes, list(column)) for column in zip(*values, strict=True)]


def _nodes(scale: float, degree: int) -> list[arb]:
    """Return degree + 1 different points t > 0."""
    if degree == 0:
        return [arb(scale)]
    return [arb(scale * _SPREAD ** (2 * k / degree - 1)) for k in range(degree + 1)]


def _mirrored(points: list[arb]) -> list[arb]:
    """Return 2n + 1 points of both signs."""
    return [*(-t for t in points[:-1]), *points]


def _scale(system: Transfer) -> float:
    """Return a typical t: the geometric mean of the modes. Any number would do."""
    first, last = system.denominator.coeffs()[0], system.denominator.coeffs()[-1]
    if system.degree == 0:
        return 1.0
    mean = abs(arb(first / last)) ** (arb(1) / system.degree)
    return float(mean.mid())


def _is_real(bound: Bound) -> bool:
    matrices = [matrix for matrix in (bound.left, bound.right) if matrix is not None]
    return all(imaginary == 0 for matrix in matrices for row in matrix for _, imaginary in row)


def _matrix(scaling: Scaling) -> acb_mat:
    return acb_mat([[acb(arb(real), arb(imaginary)) for real, imaginary in row] for row in scaling])
