"""coupling.json: the filters as numbers another program can read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._control import control
from ..._write import write
from ...errors import InputError, Outcome
from ...export import json_bytes, plain
from ._sections import sections

if TYPE_CHECKING:
    from ..evaluation import Filters
    from ..matrix import MatrixFilters

FORMAT = "robthermal-coupling/1"
_SYSTEMS = ("X", "Y", "X_hat", "Y_hat", "Z1", "Z2", "X_input", "Y_input", "controller")
_PERFORMANCE = ("ma_before", "ma_after", "msd_before", "msd_after")


def document(filters: Filters | MatrixFilters, name: str, remarks: Sequence[Outcome] = ()) -> dict[str, Any]:
    """Content of coupling.json; numbers that are not finite become null.

    Parameters
    ----------
    filters : Filters or MatrixFilters
        What is written.
    name : str
        Name of the design.
    remarks : sequence of Outcome
        What the verdict leaves out.
    """
    return {"format": FORMAT, "name": name, "sample_time": filters.problem.dt, "verdict": filters.verdict,
            "filters": {key: _matrices(getattr(filters, key)) for key in _SYSTEMS},
            "sections": _sections(filters),
            "norms": {key: plain(value) for key, value in filters.norms.items()},
            "robust": plain(filters.norms["robust"]),
            "robust_without_circles": plain(filters.norms["robust_without_circles"]),
            "left_out": _left_out(filters),
            "performance": {key: plain(getattr(filters.performance, key)) for key in _PERFORMANCE},
            "remarks": [{"code": remark.code, "text": remark.text} for remark in remarks]}


def save_filters(filters: Filters | MatrixFilters, path: str | Path, name: str, remarks: Sequence[Outcome] = ()
                 ) -> None:
    """Write the file whole, or not at all.

    Parameters
    ----------
    filters : Filters or MatrixFilters
        What is written.
    path : str or path
        File to write.
    name : str
        Name of the design.
    remarks : sequence of Outcome
        What the verdict leaves out.
    """
    write(path, json_bytes(document(filters, name, remarks)))


def of_matrices(filters: Filters | MatrixFilters) -> bool:
    """Whether the subsystems were given as matrices: state spaces, without zeros and poles one by one.

    Parameters
    ----------
    filters : Filters or MatrixFilters
        What is written.
    """
    return isinstance(filters.problem.one.Q, control.StateSpace)


def _left_out(filters: Filters | MatrixFilters) -> list[float]:
    """Measured frequencies that are not in the envelope [Hz]."""
    uncertainty = filters.problem.uncertainty
    return [] if uncertainty is None else (uncertainty.left_out / (2 * np.pi)).tolist()


def _sections(filters: Filters | MatrixFilters) -> dict[str, Any]:
    """Empty in continuous time, for subsystems given as matrices, and for filters that have to be reduced first."""
    if of_matrices(filters):
        return {}
    try:
        return {key: rows.tolist() for key, rows in sections(filters).items()}  # type: ignore[arg-type]  # one channel
    except InputError:
        return {}


def _matrices(system: control.StateSpace) -> dict[str, Any]:
    return {key: np.asarray(getattr(system, key)).tolist() for key in "ABCD"}
