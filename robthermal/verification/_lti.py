"""Linear time-invariant systems in a certificate: exact matrices A, B, C, D and a sample time, zero when continuous."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flint import arb, arb_mat, fmpq

from robthermal.errors import InputError

from ._fields import get, mapping, no_other, not_negative, sequence
from ._numbers import decimal, exact

Rows = tuple[tuple[fmpq, ...], ...]
MOST_STATES = 400  # every method needs at least n³ exact operations


@dataclass(frozen=True)
class LinearSystem:
    """x' = A x + B w (or x+), z = C x + D w, every entry an exact number."""

    A: Rows
    B: Rows
    C: Rows
    D: Rows
    sample_time: fmpq

    @property
    def states(self) -> int:
        return len(self.A)

    @property
    def inputs(self) -> int:
        return len(self.D[0])

    @property
    def outputs(self) -> int:
        return len(self.D)

    @property
    def discrete(self) -> bool:
        return bool(self.sample_time > 0)


def read_linear(value: Any) -> LinearSystem:
    """Return the system of a section {"A", "B", "C", "D", "sample_time"}, or raise InputError."""
    table = mapping(value, "system")
    no_other(table, ["A", "B", "C", "D", "sample_time"], "system")
    return read_realization(table, not_negative(get(table, "sample_time", "system"), "system.sample_time"), "system")


def read_realization(table: Mapping[str, Any], sample_time: fmpq, where: str) -> LinearSystem:
    """Return the system of the matrices A, B, C, D of an object; its other keys are not looked at."""
    A = read_matrix(get(table, "A", where), f"{where}.A")
    D = read_matrix(get(table, "D", where), f"{where}.D")
    n = len(A)
    if n > MOST_STATES:
        raise InputError(f"{n} states", where=f"{where}.A", expected=f"at most {MOST_STATES}")
    if not D or not D[0]:
        raise InputError("no output or no input", where=f"{where}.D", expected="at least one row and one column")
    B = read_matrix(get(table, "B", where), f"{where}.B")
    C = read_matrix(get(table, "C", where), f"{where}.C")
    for name, matrix, rows, columns in (("A", A, n, n), ("B", B, n, len(D[0])), ("C", C, len(D), n),
                                        ("D", D, len(D), len(D[0]))):
        expect_shape(matrix, rows, columns, f"{where}.{name}")
    return LinearSystem(A, B, C, D, sample_time)


def read_matrix(value: Any, where: str) -> Rows:
    """Return a matrix as rows of exact numbers; rows may differ in length until their shape is checked."""
    return tuple(tuple(exact(item, f"{where}[{i}][{j}]") for j, item in enumerate(sequence(row, f"{where}[{i}]")))
                 for i, row in enumerate(sequence(value, where)))


def expect_shape(matrix: Sequence[Sequence[Any]], rows: int, columns: int, where: str) -> None:
    """Refuse a matrix of another shape."""
    if len(matrix) != rows:
        raise InputError(f"{len(matrix)} rows", where=where, expected=f"{rows}")
    for i, row in enumerate(matrix):
        if len(row) != columns:
            raise InputError(f"{len(row)} numbers", where=f"{where}[{i}]", expected=f"{columns}")


def say_linear(system: LinearSystem, machine: str) -> str:
    """Return the subject of a claim: the system as given, its size and hash."""
    time = f"sampled at {decimal(system.sample_time)} s" if system.discrete else "continuous"
    sizes = ((system.states, "state"), (system.inputs, "input"), (system.outputs, "output"))
    words = ", ".join(f"{count} {name}{'' if count == 1 else 's'}" for count, name in sizes)
    return f"linear system as given, {time} ({words}, machine {machine}), nominal parameters,"


def balls(matrix: Rows, rows: int, columns: int) -> arb_mat:
    """Return an exact matrix as balls of the current precision."""
    return arb_mat(rows, columns, [arb(entry) for row in matrix for entry in row])
