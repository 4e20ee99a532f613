"""A symmetric matrix that is a sum of a base and one part of every group: positive definite at all combinations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import product
from operator import add as plus

from flint import arb_mat

from ._definite import approximate, is_positive_preconditioned


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


def make_part(matrix: arb_mat, where: str, real: bool) -> Part:
    """Return a share of the matrix."""
    return Part(matrix, where, real)


def is_positive(part: Part) -> bool:
    """Prove one matrix positive definite in ball arithmetic."""
    return _proven([part])


def first_failure(base: Part, groups: Sequence[Sequence[Part]]) -> Failure | None:
    """Return the first combination that is not proven, none when all are."""
    for chosen in product(*groups):
        parts = [base, *chosen]
        if not _proven(parts):
            where = ", ".join(part.where for part in parts if part.where)
            return Failure(where, all(part.real for part in parts))
    return None


def _proven(parts: Sequence[Part]) -> bool:
    matrix = reduce(plus, (part.matrix for part in parts))
    return is_positive_preconditioned(matrix, approximate(matrix))
