"""A symmetric matrix that is a sum of a base and one part of every group: positive definite at all combinations.

Parts are made when they are needed: what is held in memory does not grow with the number of combinations.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from flint import arb_mat

from ._definite import approximate, is_positive_preconditioned

Item = TypeVar("Item")
_KEPT = 300_000  # entries of parts that are kept, about 100 MB


@dataclass(frozen=True)
class Part:
    """One share of the matrix, where it comes from, and whether that is a point of the box (not only of a hull)."""

    matrix: arb_mat
    where: str
    real: bool


@dataclass(frozen=True)
class Failure:
    """A combination that is not proven positive definite."""

    where: str
    real: bool


def is_positive(matrix: arb_mat) -> bool:
    """Prove one matrix positive definite in ball arithmetic."""
    return is_positive_preconditioned(matrix, approximate(matrix))


def first_failure(base: arb_mat, groups: Sequence[Collection[Item]], make: Callable[[Item], Part]) -> Failure | None:
    """Return the first combination of one item per group that is not proven, none when all are.

    The largest group is run through once, outermost; the parts of the others are kept as far as memory allows.
    """
    total = Part(base, "", True)
    for group in groups:
        for item in group if len(group) == 1 else ():
            total = _plus(total, make(item))
    ordered = sorted((group for group in groups if len(group) != 1), key=len, reverse=True)
    inner = sum(len(group) for group in ordered[1:]) * base.nrows() ** 2
    outer: list[Callable[[], Iterable[Part]]] = [_made(group, make) for group in ordered[:1]]
    rest = [_kept(group, make) if inner <= _KEPT else _made(group, make) for group in ordered[1:]]
    return _search(total, [*outer, *rest])


def _made(group: Collection[Item], make: Callable[[Item], Part]) -> Callable[[], Iterable[Part]]:
    return lambda: map(make, group)


def _kept(group: Collection[Item], make: Callable[[Item], Part]) -> Callable[[], Iterable[Part]]:
    parts = [make(item) for item in group]
    return lambda: parts


def _search(total: Part, groups: Sequence[Callable[[], Iterable[Part]]]) -> Failure | None:
    if not groups:
        return None if is_positive(total.matrix) else Failure(total.where, total.real)
    for part in groups[0]():
        failed = _search(_plus(total, part), groups[1:])
        if failed is not None:
            return failed
    return None


def _plus(total: Part, part: Part) -> Part:
    where = ", ".join(words for words in (total.where, part.where) if words)
    return Part(total.matrix + part.matrix, where, total.real and part.real)
