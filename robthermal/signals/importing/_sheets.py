"""Workbooks: the first sheet with a header, formulas as the values that were saved with them."""

from __future__ import annotations

import hashlib
import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from ..._pandas import pd
from ...errors import InputError
from ._frames import plain_column
from ._options import ImportOptions
from ._table import Action, Lines, Table
from ._tokens import is_missing, is_value, short
from ._units import unit_of

_MOST_UNPACKED = 1_000_000_000  # bytes
_SEARCHED, _ROWS = 200, 5


def read_workbook(path: Path, options: ImportOptions) -> Table:
    """A sheet of an .xlsx or .ods file as a table.

    Parameters
    ----------
    path : Path
        Workbook to read.
    options : ImportOptions
        sheet, header_line, units_line.

    Raises
    ------
    InputError
        The extra is not installed, no such sheet, no header, a workbook that unpacks to too much.
    """
    content = path.read_bytes()
    _check_size(content, path)
    engine = "odf" if path.suffix.lower() == ".ods" or b"opendocument.spreadsheet" in content[:200] else "openpyxl"
    try:
        book = pd.ExcelFile(io.BytesIO(content), engine=engine)
    except ImportError:
        raise InputError(
            "workbooks need a package that is not installed",
            where=str(path),
            remedy="Install it with: pip install 'robthermal[excel]'",
        ) from None
    except Exception as error:  # openpyxl and odfpy raise many kinds for damaged archives
        raise InputError(f"this is no workbook, or a damaged one ({short(error, 80)})", where=str(path)) from None
    names = [options.sheet] if options.sheet is not None else list(map(str, book.sheet_names))
    if options.sheet is not None and options.sheet not in book.sheet_names:
        raise InputError(
            f"there is no sheet {options.sheet!r}",
            where=str(path),
            expected="one of " + ", ".join(map(repr, map(str, book.sheet_names[:10]))),
        )
    for name in names:
        cells = pd.read_excel(book, sheet_name=name, header=None, dtype=object, keep_default_na=False, na_values=[])
        header = _header(cells, options)
        if header is not None:
            return _table(cells, header, path, name, hashlib.sha256(content).hexdigest(), options)
    raise InputError(
        "no sheet has a header row with rows of numbers below it",
        where=str(path),
        expected="column names, then a row per sample",
        remedy='Write sheet = "NAME" and header_line = N.',
    )


def _check_size(content: bytes, path: Path) -> None:
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
    except zipfile.BadZipFile:
        raise InputError("this is no workbook, or a damaged one", where=str(path)) from None
    if unpacked > _MOST_UNPACKED:
        raise InputError(
            f"the workbook unpacks to {unpacked / 1e6:.0f} MB",
            where=str(path),
            expected=f"at most {_MOST_UNPACKED / 1e6:.0f} MB",
            remedy="Export the sheet as CSV.",
        )


def _header(cells: pd.DataFrame, options: ImportOptions) -> int | None:
    """Row of the header: names, followed by rows that are mostly numbers or dates."""
    if options.header_line is not None:
        return options.header_line - 1 if options.header_line <= len(cells) else None
    for k in range(min(len(cells) - 1, _SEARCHED)):
        names = [cell for cell in cells.iloc[k] if not _empty(cell)]
        if (
            len(names) < 2
            or not all(isinstance(cell, str) for cell in names)
            or sum(map(is_value, names)) * 2 >= len(names)
        ):
            continue
        start = k + 2 if _units_row(cells, k + 1) else k + 1
        rows = [
            [cell for cell in cells.iloc[j] if not _empty(cell)] for j in range(start, min(start + _ROWS, len(cells)))
        ]
        if rows and all(row and 2 * sum(_is_value(cell) for cell in row) >= len(row) for row in rows):
            return k
    return None


def _units_row(cells: pd.DataFrame, k: int) -> bool:
    if k >= len(cells):
        return False
    filled = [cell for cell in cells.iloc[k] if not _empty(cell)]
    return bool(filled) and all(isinstance(cell, str) and unit_of(cell) is not None for cell in filled)


def _table(cells: pd.DataFrame, header: int, path: Path, sheet: str, digest: str, options: ImportOptions) -> Table:
    names = tuple("" if _empty(cell) else str(cell).strip() for cell in cells.iloc[header])
    units: tuple[str, ...] = ()
    start = header + 1
    actions = []
    if _units_row(cells, start):
        units = tuple("" if _empty(cell) else str(cell).strip() for cell in cells.iloc[start])
        start += 1
        actions.append(Action("units_row", 1, f"row {start} holds the units", lines=[start]))
    body = cells.iloc[start:]
    kept = ~body.map(_empty).all(axis=1).to_numpy()
    body = body[kept]
    if header:
        actions.insert(
            0, Action("skipped", header, f"{header} rows before the header skipped", lines=list(range(1, header + 1)))
        )
    columns: list[Any] = [
        plain_column(body.iloc[:, k].map(lambda cell: None if _empty(cell) else cell)) for k in range(len(names))
    ]
    return Table(
        f"{path} [{sheet}]",
        names,
        columns,
        Lines(np.flatnonzero(kept) + start + 1),
        units,
        actions,
        {"sha256": digest, "header_line": header + 1, "skipped_lines": header, "rows": int(kept.sum())},
    )


def _empty(cell: Any) -> bool:
    return (
        cell is None
        or cell is pd.NaT
        or isinstance(cell, float)
        and cell != cell
        or isinstance(cell, str)
        and is_missing(cell)
    )


def _is_value(cell: Any) -> bool:
    return is_value(cell) if isinstance(cell, str) else True
