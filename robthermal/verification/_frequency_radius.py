"""Form "radius": ρ(|M(jω)| R) < β at every frequency of an interval, |.| entry by entry, R an envelope.

On a piece of the interval every |M_ij|² is at most the largest ratio of the Bernstein coefficients of |n_ij|² and |d|²;
the spectral radius of a non-negative matrix grows with its entries. Pieces are halved until that decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import arb, arb_poly, fmpq, fmpq_poly

from ._bernstein import Cell, coefficients, halves, largest_ratio
from ._frequency_norm import Failed, Places, ladder
from ._kind import working_precision
from ._lti import Rows
from ._transfer import Transfer, as_balls, squared

_DEEPEST = 40
_MOST_PIECES = 200_000
_MOST_WORK = 2e8  # pieces times entries times states


@dataclass(frozen=True)
class _Ratio:
    """|n/d|² of one entry, common factors removed exactly; polynomials in x = t²."""

    above: fmpq_poly
    below: fmpq_poly
    degree: int


def first_failure(system: Transfer, envelopes: Sequence[Rows], bound: fmpq, edges: Places) -> Failed | None:
    """Prove every interval; return the first that is not. ``edges`` gives t at the ends between them."""
    entries = [[_reduced(entry, system.denominator) for entry in row] for row in system.numerators]
    failed = None
    start = 0
    for bits in ladder(system.degree):
        with working_precision(bits):
            failed = _from(start, entries, envelopes, bound, edges())
        if failed is None or failed.certain:
            return failed
        start = failed.interval
    return failed


def _from(start: int, entries: list[list[_Ratio]], envelopes: Sequence[Rows], bound: fmpq,
          edges: list[arb]) -> Failed | None:
    moduli = _Moduli(entries)
    channels = sum(entry.degree + 10 for row in entries for entry in row)
    most = min(_MOST_PIECES, _MOST_WORK / channels)
    pieces = 0
    for k in range(start, len(envelopes)):
        R = [[arb(value) for value in row] for row in envelopes[k]]
        low, high = arb(0) if k == 0 else edges[k - 1] ** 2, edges[k] ** 2 if k < len(edges) else None
        waiting: list[tuple[Cell, int]] = [((low, high), 0)]
        while waiting:
            cell, depth = waiting.pop()
            pieces += 1
            if _below(moduli.over(cell), R, bound) is True:
                continue
            lower, upper = halves(cell)
            for x in (cell[0], upper[0]):
                if _below(moduli.at(x), R, bound) is False:
                    return Failed(k, True, x.sqrt(), "ρ(|M| R) reaches the bound")
            if depth == _DEEPEST or pieces > most:
                return Failed(k, False, cell[0].sqrt(), "too many pieces")
            waiting += [(upper, depth + 1), (lower, depth + 1)]
    return None


class _Moduli:
    """|M| entry by entry, at a point or over a piece."""

    def __init__(self, entries: list[list[_Ratio]]):
        self.entries = [[(as_balls(entry.above), as_balls(entry.below), entry.degree) for entry in row]
                        for row in entries]

    def at(self, x: arb) -> list[list[arb]]:
        return [[(above(x) / below(x)).sqrt() for above, below, _ in row] for row in self.entries]

    def over(self, cell: Cell) -> list[list[arb]] | None:
        """Return upper bounds, None where a denominator is not proven positive."""
        found = []
        for row in self.entries:
            bounds = []
            for above, below, degree in row:
                ratio = _ratio(above, below, degree, cell)
                if ratio is None:
                    return None
                bounds.append(ratio.sqrt().upper())
            found.append(bounds)
        return found


def _ratio(above: arb_poly, below: arb_poly, degree: int, cell: Cell) -> arb | None:
    if above.degree() < 0:
        return arb(0)
    return largest_ratio(coefficients(above, degree, cell), coefficients(below, degree, cell))


def _below(moduli: list[list[arb]] | None, R: list[list[arb]], bound: fmpq) -> bool | None:
    """Decide ρ(moduli R) < bound: bound I - T is an M-matrix if and only if its pivots are positive."""
    if moduli is None:
        return None
    n = len(moduli)
    work = [[(arb(bound) if i == j else arb(0)) - sum((size * R[k][j] for k, size in enumerate(row)), arb(0))
             for j in range(n)] for i, row in enumerate(moduli)]
    for k in range(n):
        pivot = work[k][k]
        if pivot <= 0:
            return False
        if not pivot > 0:
            return None
        for i in range(k + 1, n):
            factor = work[i][k] / pivot
            work[i] = [entry - factor * other for entry, other in zip(work[i], work[k], strict=True)]
    return True


def _reduced(numerator: fmpq_poly, denominator: fmpq_poly) -> _Ratio:
    """Return |n/d|² without the factors that n and d share."""
    if numerator.degree() < 0:
        return _Ratio(fmpq_poly([0]), fmpq_poly([1]), 0)
    common = numerator.gcd(denominator)
    d = denominator / common
    return _Ratio(squared(numerator / common), squared(d), d.degree())
