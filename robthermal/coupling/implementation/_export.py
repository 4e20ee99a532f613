"""Filters for other programs: MATLAB and C99."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...export import by_suffix, matlab_bytes
from ._c_source import program
from ._files import document, of_matrices
from ._matrix_c_source import matrix_program

if TYPE_CHECKING:
    from ..evaluation import Filters
    from ..matrix import MatrixFilters


def export(filters: Filters | MatrixFilters, path: str | Path, name: str) -> None:
    """Write a .mat, .c or .h file.

    Parameters
    ----------
    filters : Filters or MatrixFilters
        What is written.
    path : str or path
        File to write.
    name : str
        Name of the design; in C the prefix of every identifier.
    """
    by_suffix(path, {".mat": lambda: _mat(filters, name), **dict.fromkeys((".c", ".h"), lambda: _c(filters, name))},
              remedy="JSON is written by save().")


def _mat(filters: Filters | MatrixFilters, name: str) -> bytes:
    """One struct per filter with A, B, C, D; sections as (n, 6) matrices; numbers that are not finite are NaN."""
    content: dict[str, Any] = {key: value for key, value in document(filters, name).items()
                               if key not in ("filters", "remarks")}
    for key in ("norms", "performance"):
        content[key] = {entry: np.nan if value is None else value for entry, value in content[key].items()}
    content["sections"] = {key: np.array(rows) for key, rows in content["sections"].items()}
    for key in ("X", "Y", "X_hat", "Y_hat", "Z1", "Z2", "X_input", "Y_input", "controller"):
        system = getattr(filters, key)
        content[key] = {part: np.asarray(getattr(system, part)) for part in "ABCD"}
    return matlab_bytes(content)


def _c(filters: Filters | MatrixFilters, name: str) -> bytes:
    written = matrix_program if of_matrices(filters) else program
    return written(filters, name).text().encode("ascii")  # type: ignore[arg-type]  # as was just asked
