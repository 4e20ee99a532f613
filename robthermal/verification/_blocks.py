"""Scalings that commute with a block structure: they turn a bound of σ_max(L M R⁻¹) into one of μ(M).

Delta has the blocks on its diagonal. With L and R regular and R Δ = Δ L for all of them, det(I - M Δ) is
det(I - L M R⁻¹ Δ), so that no Δ with σ_max(Δ) <= 1/β makes it zero where σ_max(L M R⁻¹) < β: μ(M) < β.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flint import acb, acb_mat, arb, fmpq

from robthermal.errors import InputError

from ._fields import sequence
from ._numbers import exact, name_of

Scaling = tuple[tuple[tuple[fmpq, fmpq], ...], ...]  # rows of (real, imaginary)
_ZERO = (fmpq(0), fmpq(0))


@dataclass(frozen=True)
class Block:
    """One block of Delta: full with rows and columns, or a repeated scalar."""

    rows: int
    columns: int
    repeated: bool


def read_blocks(value: Any, inputs: int, outputs: int) -> tuple[Block, ...]:
    """Return the blocks of Delta (inputs, outputs), or raise InputError."""
    where = "region.blocks"
    found = tuple(_block(item, f"{where}[{k}]") for k, item in enumerate(sequence(value, where)))
    size = sum(block.rows for block in found), sum(block.columns for block in found)
    if size != (inputs, outputs):
        raise InputError(f"the blocks make a Delta of {size[0]} rows and {size[1]} columns", where=where,
                         expected=f"{inputs} rows and {outputs} columns, one per input and output of the system")
    return found


def say_blocks(blocks: Sequence[Block]) -> str:
    """Return the words for a structure in a claim."""
    return ", ".join(f"{block.rows} times a complex scalar" if block.repeated else
                     f"full {block.rows} by {block.columns}" for block in blocks)


def broken_structure(blocks: Sequence[Block], left: Scaling | None, right: Scaling | None) -> str:
    """Return why R Delta = Delta L fails for some Delta, or L is not proven regular; empty where it holds."""
    inputs, outputs = sum(block.rows for block in blocks), sum(block.columns for block in blocks)
    L, R = left or _identity(outputs), right or _identity(inputs)
    row = column = 0
    wanted_left, wanted_right = _zeros(outputs), _zeros(inputs)
    for block in blocks:
        if block.repeated:
            for i in range(block.rows):
                for j in range(block.rows):
                    if L[column + i][column + j] != R[row + i][row + j]:
                        return f"the scalings of the repeated block at row {row} differ"
                    wanted_left[column + i][column + j] = wanted_right[row + i][row + j] = R[row + i][row + j]
        else:
            for i in range(block.rows):
                wanted_right[row + i][row + i] = R[row][row]
            for j in range(block.columns):
                wanted_left[column + j][column + j] = R[row][row]
        row, column = row + block.rows, column + block.columns
    if [list(line) for line in L] != wanted_left or [list(line) for line in R] != wanted_right:
        return "a scaling does not commute with the blocks"
    ball = acb_mat([[acb(arb(real), arb(imaginary)) for real, imaginary in line] for line in L])
    return "the left scaling is not proven regular" if ball.det().contains(0) else ""


def _block(value: Any, where: str) -> Block:
    items = sequence(value, where)
    kind = items[0] if len(items) else None
    if kind == "full" and len(items) == 3:
        return Block(_size(items[1], where), _size(items[2], where), False)
    if kind == "repeated" and len(items) == 2:
        n = _size(items[1], where)
        return Block(n, n, True)
    raise InputError(f"{name_of(value)} is not a block", where=where,
                     expected='["full", rows, columns] or ["repeated", n]')


def _size(value: Any, where: str) -> int:
    number = exact(value, where)
    if number.q != 1 or not 1 <= number <= 1000:
        raise InputError(f"{name_of(value)} is not a size", where=where, expected="a whole number from 1 to 1000")
    return int(number.p)


def _identity(size: int) -> Scaling:
    return tuple(tuple((fmpq(int(i == j)), fmpq(0)) for j in range(size)) for i in range(size))


def _zeros(size: int) -> list[list[tuple[fmpq, fmpq]]]:
    return [[_ZERO] * size for _ in range(size)]
