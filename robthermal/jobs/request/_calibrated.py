"""calibrated.json: estimates with their covariance, in a file that later commands take ranges from."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, Field, ValidationError

from ..._write import write
from ...calibration import Estimates, Fit
from ...errors import InputError, Outcome
from ...report import file_hash
from ...thermal import System
from ._toml import Number, read_text, refusal

FORMAT: Literal["robthermal-calibration/1"] = "robthermal-calibration/1"
_REMEDY = "Give the calibrated.json that `robthermal calibrate` or `robthermal run` wrote."
_MOST = 1_000  # parameters
Size = Annotated[float, Field(ge=0, allow_inf_nan=False, strict=True)]


class _Row(BaseModel):
    value: Number
    start: Number
    lower: Number | None
    upper: Number | None
    prior: Size | None
    at_bound: bool


class _Outcome(BaseModel):
    ok: bool
    code: str
    text: str


class _File(BaseModel):
    format: Literal["robthermal-calibration/1"]
    parameters: Annotated[dict[str, _Row], Field(max_length=_MOST)]
    logarithmic: dict[str, bool]
    bounded: dict[str, bool]
    covariance: Annotated[list[list[Number]], Field(max_length=_MOST)] | None
    covariance_scale: Size
    degrees_of_freedom: Size | None
    undetermined: list[str]
    undetermined_parameters: list[str]
    iterations: int
    outcome: _Outcome


def write_calibrated(fit: Fit, files: Sequence[Path], path: Path) -> None:
    """Write calibrated.json: estimates, covariance, ranges, and the hashes of the data.

    Parameters
    ----------
    fit : Fit
        From `rt.calibrate`.
    files : sequence of Path
        Input files: system and records.
    path : Path
        File to write, replaced in one step.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    content = {"format": FORMAT, **fit.to_dict(), "data": {file.name: file_hash(file) for file in files}}
    write(path, (json.dumps(content, indent=1, allow_nan=False) + "\n").encode())


def read_calibrated(path: Path, system: System) -> Estimates:
    """Estimates from calibrated.json.

    Parameters
    ----------
    path : Path
        File that `robthermal calibrate` or `robthermal run` wrote.
    system : System
        The calibrated system.

    Returns
    -------
    Estimates
        With `ranges` as of the calibration itself.

    Raises
    ------
    InputError
        Another file, one that was cut or edited, one of another system.
    """
    try:
        found = _File(**json.loads(read_text(path, "JSON")))
    except (json.JSONDecodeError, RecursionError, TypeError) as error:
        raise InputError(f"is not a calibration: {error}", where=str(path), remedy=_REMEDY) from None
    except ValidationError as error:
        raise refusal(error, path, _REMEDY) from None
    rows, names = list(found.parameters.values()), list(found.parameters)
    n = len(names)
    C = np.full((n, n), np.inf) if found.covariance is None else _square(found.covariance, n, path)
    unknown = [own for name in names for own in name.split(" = ") if own not in system.parameter_names]
    if unknown:
        raise InputError(f"{unknown[0]!r} is no parameter of {system.name!r}", where=str(path),
                         expected="the calibration of this system", remedy="Certify the calibrated system file.")
    if set(found.logarithmic) != set(names) or set(found.bounded) != set(names):
        raise InputError("logarithmic and bounded do not name the parameters", where=str(path), remedy=_REMEDY)
    ends = (([-np.inf if r.lower is None else r.lower for r in rows]), [np.inf if r.upper is None else r.upper
                                                                       for r in rows])
    return Estimates(
        system=system, parameters={name: row.value for name, row in found.parameters.items()},
        start={name: row.start for name, row in found.parameters.items()}, lower=np.array(ends[0]),
        upper=np.array(ends[1]), sigma=np.array([np.inf if r.prior is None else r.prior for r in rows]),
        at_bound=np.array([r.at_bound for r in rows], bool), covariance=C, undetermined=tuple(found.undetermined),
        undetermined_parameters=tuple(found.undetermined_parameters),
        bounded=np.array([found.bounded[name] for name in names], bool),
        logarithmic=np.array([found.logarithmic[name] for name in names], bool),
        degrees_of_freedom=np.inf if found.degrees_of_freedom is None else found.degrees_of_freedom,
        covariance_scale=found.covariance_scale, iterations=found.iterations,
        outcome=Outcome.restored(**dict(found.outcome)))


def _square(rows: list[list[float]], n: int, path: Path) -> np.ndarray[Any, np.dtype[np.float64]]:
    if len(rows) != n or any(len(row) != n for row in rows):
        raise InputError("the covariance has another size than the parameters", where=str(path), remedy=_REMEDY)
    C = np.array(rows, float).reshape(n, n)
    if not np.allclose(C, C.T, rtol=1e-6, atol=0.0) or (np.diag(C) < 0).any():
        raise InputError("the covariance is not symmetric, or has a negative variance", where=str(path), remedy=_REMEDY)
    return C
