"""Parquet: columns of numbers without missing values."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError
from ._checks import Array
from ._export import require_pyarrow
from ._source import numeric, refuse_large


class ParquetSource:
    """A Parquet file, its schema read."""

    def __init__(self, path: Path, max_bytes: float | None):
        pyarrow, parquet = require_pyarrow()
        self.path = path
        try:
            self._file = parquet.ParquetFile(path)
        except (pyarrow.ArrowException, OSError, UnicodeDecodeError) as error:
            raise InputError(f"this is no Parquet file ({error})", where=f"{path}") from None
        self._broken = (pyarrow.ArrowException, OSError, UnicodeDecodeError)
        self.headers = tuple(self._file.schema_arrow.names)
        # Compressed: a small file may hold a large table.
        refuse_large(path, 8.0 * self._file.metadata.num_rows * len(self.headers), "bytes unpacked", max_bytes)

    def read(self, wanted: Sequence[str]) -> dict[str, Array]:
        """The wanted columns."""
        try:
            table = self._file.read(columns=list(wanted))
        except self._broken as error:
            raise InputError(f"the file is damaged ({error})", where=f"{self.path}") from None
        columns = {}
        for header in wanted:
            column = table.column(header)
            if column.null_count:
                row = column.is_null().to_pylist().index(True)
                raise InputError(
                    f"column {header!r} is empty in {self.row(row)}",
                    where=f"{self.path}",
                    expected="a number in every cell",
                    remedy="Missing values are not filled: cut the file there, or repair it.",
                )
            columns[header] = numeric(column.to_numpy(), header, self.path)
        return columns

    def row(self, index: int) -> str:
        """Words for a data row, counted from 0."""
        return f"row {index}"
