"""One door for all kinds of sources: the content decides between text, archive and binary, the suffix is a hint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...errors import InputError
from .._source import check_file
from ._frames import is_in_memory, read_frame
from ._options import ImportOptions
from ._sheets import read_workbook
from ._table import Source, Whole
from ._text import TextSource
from ._typed import read_mat, read_parquet, read_tdms

_HEAD = 1024


def open_source(source: Any, options: ImportOptions, max_bytes: float | None = None) -> Source:
    """A source of rows, whatever it is.

    Parameters
    ----------
    source : str, Path, DataFrame, Series, mapping or structured ndarray
        What was measured.
    options : ImportOptions
        What is declared.
    max_bytes : float, optional
        Largest accepted size of the file [bytes].

    Raises
    ------
    InputError
        Files that are none of the known kinds.
    """
    if is_in_memory(source):
        return Whole(read_frame(source))
    if not isinstance(source, str | Path):
        raise InputError(
            f"the source is a {type(source).__name__}",
            where="argument source",
            expected="the name of a file, a DataFrame, or a dictionary of arrays",
        )
    path = Path(source)
    check_file(path, max_bytes)
    with path.open("rb") as file:
        head = file.read(_HEAD)
    kind = _kind(head, path)
    if kind == "workbook":
        return Whole(read_workbook(path, options))
    if kind == "parquet":
        return Whole(read_parquet(path, max_bytes))
    if kind == "mat":
        return Whole(read_mat(path, options, max_bytes))
    if kind == "tdms":
        return Whole(read_tdms(path, max_bytes))
    if kind:
        raise InputError(
            f"the file is {kind}",
            where=f"{path}",
            expected="a table of measured columns",
            remedy="Export it as CSV, XLSX, Parquet, MATLAB or TDMS.",
        )
    return TextSource(path, options)


def _kind(head: bytes, path: Path) -> str:
    """Kind of a file by its first bytes; empty for text."""
    suffix = path.suffix.lower()
    if head.startswith(b"PK\x03\x04"):
        return "workbook"
    if head.startswith(b"PAR1"):
        return "parquet"
    if head.startswith(b"TDSm"):
        return "tdms"
    if head.startswith(b"MATLAB ") or b"\x89HDF\r\n\x1a\n" in head[:520]:
        return "mat"
    for mark, name in (
        (b"\xd0\xcf\x11\xe0", "an old Excel workbook (.xls)"),
        (b"%PDF", "a PDF"),
        (b"\x89PNG", "a picture"),
        (b"\x1f\x8b", "compressed (gzip)"),
        (b"SQLite format 3", "a database"),
    ):
        if head.startswith(mark):
            return name
    binary = b"\0" in head and not head.startswith((b"\xff\xfe", b"\xfe\xff"))
    if binary and suffix in (".mat", ".parquet", ".tdms", ".xlsx", ".ods"):
        return {".xlsx": "workbook", ".ods": "workbook"}.get(suffix, suffix[1:])
    if suffix in (".parquet", ".tdms", ".mat", ".xlsx", ".ods"):
        return {".xlsx": "workbook", ".ods": "workbook"}.get(suffix, suffix[1:])
    return ""
