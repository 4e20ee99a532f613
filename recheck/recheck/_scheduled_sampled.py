"""Scheduled currents with sampled temperatures: what a held current adds to |x - x0|, bounded in rational numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from operator import mul

from ._exact import ZERO, NotCovered, power
from ._vertices import Entries

Matrix = list[list[Fraction]]
Inputs = tuple[int, int, list[tuple[Fraction, Fraction]]]  # hot lump, cold lump, ∂f/∂I there
_MOST_LUMPS = 30  # of an exact inverse


def held_gains(P: Matrix, capacity: Sequence[Fraction], gain: Matrix, groups: Sequence[Sequence[Entries]],
               inputs: Sequence[Inputs]) -> tuple[Fraction, Fraction]:
    """Return upper bounds of C = Σ c_k h_k and C' = Σ c_k κ_k.

    ``groups``: of each, values of a part of J; ``inputs``: per module the values of ∂f/∂I.
    """
    n = len(P)
    if n > _MOST_LUMPS:
        raise NotCovered(f"{n} lumps with samples are too many")
    W = inverse(P)
    kappa = [_length(row, W) for row in gain]
    growth = pushed = ZERO
    for k, (hot, cold, points) in enumerate(inputs):
        strength = max(_length([b_h / capacity[i] if i == hot else b_c / capacity[i] if i == cold else ZERO
                                for i in range(n)], P) for b_h, b_c in points)
        row = [entry / own for entry, own in zip(gain[k], capacity, strict=True)]
        speed = _speed(row, groups, W)
        for m, (h, c, others) in enumerate(inputs):
            speed += kappa[m] * max(abs(row[h] * b_h + row[c] * b_c) for b_h, b_c in others)
        growth += strength * speed
        pushed += strength * kappa[k]
    return growth, pushed


def held_holds(time: Fraction, claimed: Fraction, rate: Fraction, level: Fraction, left: Fraction,
               gains: tuple[Fraction, Fraction]) -> bool:
    """T/2 (rate² + C) <= rate - claimed, and r + T/2 ((rate² + C) √level + C' r) < rate √level."""
    growth, pushed = gains
    more = time / 2 * (rate**2 + growth)
    low, high = power(level, Fraction(1, 2))
    return more <= rate - claimed and left + more * high + time / 2 * pushed * left < rate * low


def inverse(P: Matrix) -> Matrix:
    """Return the inverse, exactly."""
    n = len(P)
    rows = [[*row, *(Fraction(int(i == j)) for j in range(n))] for i, row in enumerate(P)]
    for k in range(n):  # P is positive definite: no pivot is zero
        pivot = rows[k][k]
        rows[k] = [entry / pivot for entry in rows[k]]
        for i in range(n):
            factor = rows[i][k]
            if i != k and factor:
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
    return [row[n:] for row in rows]


def _speed(row: Sequence[Fraction], groups: Sequence[Sequence[Entries]], W: Matrix) -> Fraction:
    total = [ZERO] * len(row)
    spread = ZERO
    for group in groups:
        moved = [_moved(row, entries) for entries in group]
        middle = [sum(column, ZERO) / len(moved) for column in zip(*moved, strict=True)]
        total = [a + b for a, b in zip(total, middle, strict=True)]
        spread += max(_length([a - b for a, b in zip(one, middle, strict=True)], W) for one in moved)
    return _length(total, W) + spread


def _moved(row: Sequence[Fraction], entries: Mapping[tuple[int, int], Fraction]) -> list[Fraction]:
    found = [ZERO] * len(row)
    for (i, j), value in entries.items():
        found[j] += row[i] * value
    return found


def _length(vector: Iterable[Fraction], form: Matrix) -> Fraction:
    """Return an upper bound of √(v M v')."""
    v = list(vector)
    squared = sum(map(mul, v, (sum(map(mul, line, v), ZERO) for line in form)), ZERO)
    return power(max(squared, ZERO), Fraction(1, 2))[1]
