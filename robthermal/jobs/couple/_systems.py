"""Linear systems of a coupling file: matrices, polynomials, a number, or a file that holds one of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, ValidationError

from ..._control import control
from ...errors import InputError
from ..request import Number, Table, read_text, refusal

_MOST_STATES = 300  # a proof about more takes minutes
_REMEDY = "Give { A, B, C, D }, { num, den } in falling powers of z or s, or { file = \"p.json\" } that holds either."
_MATRICES, _POLYNOMIALS = ("A", "B", "C", "D"), ("num", "den")
Matrix = list[list[Number]]
LTI = Any  # control.StateSpace or control.TransferFunction
Polynomial = Annotated[list[Number], Field(min_length=1, max_length=_MOST_STATES + 1)]


class SystemTable(Table):
    """A system: one input and one output, or matrices of any size."""

    A: Matrix | None = None
    B: Matrix | None = None
    C: Matrix | None = None
    D: Matrix | None = None
    num: Polynomial | None = None
    den: Polynomial | None = None
    file: str | None = None
    sample_time: Number | None = None


def _from_number(value: Any) -> Any:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return {"num": [value], "den": [1.0]} if number else value


System = Annotated[SystemTable, BeforeValidator(_from_number)]


def linear_system(table: SystemTable, dt: float, where: str, source: Path) -> LTI:
    """python-control system of a table.

    Parameters
    ----------
    table : SystemTable
        What the file says.
    dt : float
        Sample time of the file [s]; 0: continuous.
    where : str
        Table and key, for messages.
    source : Path
        The coupling file; other files are relative to it.
    """
    place = f"{source} {where}"
    given = [name for name in (*_MATRICES, *_POLYNOMIALS, "file") if getattr(table, name) is not None]
    if table.sample_time is not None and table.sample_time != dt:
        raise InputError(f"sample_time = {table.sample_time:g} s, [coupling] has {dt:g} s", where=place,
                         expected="one sample time for all systems", remedy="Discretize all systems alike.")
    if given == ["file"]:
        inside = _load(source.parent / str(table.file), where)
        return linear_system(inside, dt, f"{where} file = {table.file!r}", source)
    if given == list(_MATRICES):
        return _state_space(table, dt, place)
    if given == list(_POLYNOMIALS):
        return _transfer_function(table, dt, place)
    raise InputError(f"has {', '.join(given) or 'nothing'}", where=place,
                     expected="A, B, C and D, or num and den, or file", remedy=_REMEDY)


def files_of(table: SystemTable | None, source: Path) -> list[Path]:
    """Files a table names.

    Parameters
    ----------
    table : SystemTable or None
        What the file says.
    source : Path
        The coupling file.
    """
    return [source.parent / table.file] if table is not None and table.file is not None else []


def _load(path: Path, where: str) -> SystemTable:
    try:
        table = SystemTable(**json.loads(read_text(path, "JSON")))
    except (json.JSONDecodeError, RecursionError) as error:
        raise InputError(f"is not valid JSON: {error}", where=f"{path}, {where}", remedy=_REMEDY) from None
    except TypeError:
        raise InputError("is not a JSON object", where=f"{path}, {where}", remedy=_REMEDY) from None
    except ValidationError as error:
        raise refusal(error, path, _REMEDY) from None
    if table.file is not None:
        raise InputError("names another file", where=f"{path}, {where}", remedy=_REMEDY)
    return table


def _state_space(table: SystemTable, dt: float, place: str) -> control.StateSpace:
    n = len(table.A or [])
    if n > _MOST_STATES:
        raise InputError(f"{n} states", where=place, expected=f"at most {_MOST_STATES}", remedy="Reduce the model.")
    outputs, inputs = len(table.D or []), len((table.D or [[]])[0])
    if not outputs or not inputs:
        raise InputError("D is empty", where=place, expected="as many rows as outputs, as many columns as inputs",
                         remedy="A row is a list: [[0.0]] for one input and one output.")
    shapes = {"A": (n, n), "B": (n, inputs), "C": (outputs, n), "D": (outputs, inputs)}
    parts = [_matrix(getattr(table, name), name, shape, place) for name, shape in shapes.items()]
    return control.StateSpace(*parts, dt, remove_useless_states=False)


def _matrix(rows: list[list[float]], name: str, shape: tuple[int, int], place: str) -> Any:
    widths = sorted({len(row) for row in rows})
    found = (len(rows), widths[0] if widths else 0)
    if found != shape and not (0 in shape and 0 in found) or len(widths) > 1:
        text = f"{len(rows)} rows of {' or '.join(map(str, widths))} numbers" if rows else "no rows"
        raise InputError(f"{name} has {text}", where=place, expected=f"{shape[0]}x{shape[1]}, for A and D as given",
                         remedy="A row is a list: [[1.0, 0.0], [0.0, 1.0]].")
    return np.array(rows, dtype=float).reshape(shape)


def _transfer_function(table: SystemTable, dt: float, place: str) -> control.TransferFunction:
    if not any(table.den or []):
        raise InputError("den is zero", where=place, expected="a polynomial in falling powers of z or s")
    return control.TransferFunction(table.num, table.den, dt)
