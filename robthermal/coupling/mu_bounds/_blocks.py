"""The block structure of a perturbation Delta, and the scalings that commute with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robthermal.errors import InputError

Complex = NDArray[np.complexfloating[Any, Any]]
Real = NDArray[np.floating[Any]]

_KINDS = {"full": 3, "repeated": 2}  # length of the tuple that describes a block of this kind
_EXPECTED = 'a list of ("full", rows, columns) and ("repeated", n), sizes of the blocks of Delta in order'


@dataclass(frozen=True)
class Block:
    """One block of Delta.

    Parameters
    ----------
    repeated : bool
        Whether it is a complex scalar times the identity; else it is a full complex matrix.
    rows, columns : slice
        Where it stands in Delta: rows are inputs of M, columns are outputs of M.
    """

    repeated: bool
    rows: slice
    columns: slice

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the block."""
        return self.rows.stop - self.rows.start, self.columns.stop - self.columns.start


@dataclass(frozen=True)
class Structure:
    """Blocks of Delta (m, p), in order along its diagonal.

    Parameters
    ----------
    blocks : tuple of Block
        They cover every row and every column.
    """

    blocks: tuple[Block, ...]

    @property
    def shape(self) -> tuple[int, int]:
        """Rows m and columns p of Delta."""
        return self.blocks[-1].rows.stop, self.blocks[-1].columns.stop

    @cached_property
    def basis(self) -> tuple[Complex, Complex]:
        """Basis of the Hermitian scalings: X_L (k, p, p) and X_R (k, m, m) with Delta X_L = X_R Delta.

        One real number per full block, n² per repeated block of size n.
        """
        m, p = self.shape
        left, right = [], []
        for block in self.blocks:
            for E_R, E_L in _commuting(block):
                X_L, X_R = np.zeros((p, p), complex), np.zeros((m, m), complex)
                X_L[block.columns, block.columns], X_R[block.rows, block.rows] = E_L, E_R
                left.append(X_L)
                right.append(X_R)
        return np.array(left), np.array(right)


def _commuting(block: Block) -> list[tuple[Complex, Complex]]:
    rows, columns = block.shape
    if not block.repeated:
        return [(np.eye(rows, dtype=complex), np.eye(columns, dtype=complex))]
    pairs = []
    for i in range(rows):
        for j in range(i, rows):
            for unit in (1.0,) if i == j else (np.sqrt(0.5), 1j * np.sqrt(0.5)):
                E = np.zeros((rows, rows), complex)
                E[i, j], E[j, i] = unit, np.conj(unit)
                pairs.append((E, E))
    return pairs


def read_blocks(blocks: Sequence[Sequence[Any]] | None, shape: tuple[int, int]) -> Structure:
    """Read the blocks of Delta; None is one full block.

    Parameters
    ----------
    blocks : sequence of tuple, or None
        ("full", rows, columns) or ("repeated", n), in order.
    shape : tuple of int
        Rows m and columns p of Delta: inputs and outputs of M.

    Returns
    -------
    Structure

    Raises
    ------
    InputError
        Unknown kinds, sizes that are not positive whole numbers, sizes that do not add up to the shape.
    """
    listed = [("full", *shape)] if blocks is None else blocks
    if isinstance(listed, str) or not isinstance(listed, Sequence) or not len(listed):
        raise InputError(f"blocks is {blocks!r}", where="blocks", expected=_EXPECTED)
    found, row, column = [], 0, 0
    for number, entry in enumerate(listed):
        repeated, rows, columns = _read_block(entry, f"blocks[{number}]")
        found.append(Block(repeated, slice(row, row + rows), slice(column, column + columns)))
        row, column = row + rows, column + columns
    if (row, column) != shape:
        raise InputError(f"the blocks make Delta {row} by {column}", where="blocks",
                         expected=f"{shape[0]} by {shape[1]}: as many rows as M has columns, and the other way round",
                         remedy='Rows and columns of ("full", rows, columns) are those of Delta, not of M.')
    return Structure(tuple(found))


def _read_block(entry: Any, where: str) -> tuple[bool, int, int]:
    if isinstance(entry, str) or not isinstance(entry, Sequence) or not len(entry):
        raise InputError(f"{entry!r} is not a block", where=where, expected=_EXPECTED)
    kind, *sizes = entry
    if not isinstance(kind, str) or kind not in _KINDS or len(entry) != _KINDS[kind]:
        raise InputError(f"{entry!r} is not a block", where=where, expected=_EXPECTED)
    if not all(isinstance(size, (int, np.integer)) and not isinstance(size, bool) and size > 0 for size in sizes):
        raise InputError(f"size of {entry!r}", where=where, expected="whole numbers of at least 1")
    return kind == "repeated", int(sizes[0]), int(sizes[-1])
