"""The norm in which trajectories approach each other: method, rate, and weights or a matrix, one entry per lump."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flint import fmpq

from robthermal.errors import InputError

from ._fields import get, mapping, not_negative, numbers, sequence, text
from ._numbers import decimal, name_of

NORMS = {
    "sum": "the weighted sum of absolute differences",
    "max": "the weighted largest difference",
    "energy": "the capacity-weighted sum of squared differences",
    "lyapunov": "the quadratic form e'Pe of the differences",
}


@dataclass(frozen=True)
class Norm:
    """What the evidence of a contraction says; ``weights`` of sum and max, ``matrix`` of lyapunov."""

    method: str
    rate: fmpq
    weights: tuple[fmpq, ...]
    matrix: tuple[tuple[fmpq, ...], ...]


def read_norm(evidence: Any, count: int) -> Norm:
    """Return the evidence for a network of ``count`` lumps, or raise InputError."""
    table = mapping(evidence, "evidence")
    method = text(get(table, "method", "evidence"), "evidence.method")
    if method not in NORMS:
        raise InputError(f"method {name_of(method)}", where="evidence.method", expected=f"one of {sorted(NORMS)}")
    rate = not_negative(get(table, "rate", "evidence"), "evidence.rate")
    weights: list[fmpq] = []
    matrix: list[list[fmpq]] = []
    if method in ("sum", "max"):
        weights = numbers(get(table, "weights", "evidence"), count, "evidence.weights")
    if method == "lyapunov":
        rows = sequence(get(table, "matrix", "evidence"), "evidence.matrix")
        if len(rows) != count:
            raise InputError(f"{len(rows)} rows", where="evidence.matrix", expected=f"{count}, one per lump")
        matrix = [numbers(row, count, f"evidence.matrix[{k}]") for k, row in enumerate(rows)]
    return Norm(method, rate, tuple(weights), tuple(tuple(row) for row in matrix))


def say_rate(rate: fmpq) -> str:
    """Return how fast a norm decays, for a claim."""
    return f"decays at least as exp(-rate t), rate = {decimal(rate)} 1/s" if rate > 0 else "decays strictly"
