"""PLANT.toml: a generalized plant or a measured response, and what to design for it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from ..._control import control
from ...errors import InputError
from ...identify import FrequencyResponse, read_response
from ..request import Number, Table, read_text, read_toml

_REMEDY = "docs/command_line.md lists the keys of PLANT.toml."
_Matrix = list[list[Number]]


class _Plant(Table):
    A: _Matrix | None = None
    B: _Matrix | None = None
    C: _Matrix | None = None
    D: _Matrix | None = None
    file: str | None = None
    n_meas: int
    n_ctrl: int
    dt: Number = 0.0


class _Response(Table):
    file: str
    sample_time: Number | None = None


class _File(Table):
    plant: _Plant | None = None
    frf: _Response | None = None
    design: dict[str, Any] = Field(default_factory=dict)


@dataclass(frozen=True)
class SynthesisJob:
    """What a plant file asks for.

    Parameters
    ----------
    plant : control.StateSpace or None
        Generalized plant; None where there is a response.
    n_meas, n_ctrl : int
        Numbers of measurements and of controls; 1 each for a response.
    response : FrequencyResponse or None
        Measured response; None where there is a plant.
    arguments : dict
        Keyword arguments of the synthesis, table [design].
    files : tuple of Path
        Files that were read.
    """

    plant: control.StateSpace | None
    n_meas: int
    n_ctrl: int
    response: FrequencyResponse | None
    arguments: dict[str, Any]
    files: tuple[Path, ...]


def read_plant_file(path: str | Path) -> SynthesisJob:
    """Read a plant file.

    Parameters
    ----------
    path : str or Path
        TOML file with [plant] (A, B, C, D, or file: JSON with these keys; n_meas, n_ctrl, dt) or [frf] (file), and
        [design] with the keyword arguments of the synthesis.

    Returns
    -------
    SynthesisJob

    Raises
    ------
    InputError
        A file that cannot be read, unknown or missing keys, both or neither of [plant] and [frf].

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> _ = Path("plant.toml").write_text("[plant]\\nA = [[1.0]]\\nB = [[1.0, 0.0, 1.0]]\\nC = [[1.0], [0.0], [1.0]]\\n"
    ...     "D = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]\\nn_meas = 1\\nn_ctrl = 1\\n")
    >>> rt.jobs.read_plant_file("plant.toml").plant.nstates
    1
    """
    place = Path(path)
    found = read_toml(place, _File, _REMEDY)
    if found.frf is not None and found.plant is None:
        response = place.parent / found.frf.file
        measured = read_response(response, sample_time=found.frf.sample_time)
        return SynthesisJob(None, 1, 1, measured, found.design, (place, response))
    if found.plant is None or found.frf is not None:
        raise InputError("has both [plant] and [frf], or neither", where=str(place), expected="one of them",
                         remedy=_REMEDY)
    plant, files = _plant(place, found.plant)
    return SynthesisJob(plant, found.plant.n_meas, found.plant.n_ctrl, None, found.design, files)


def _plant(place: Path, table: _Plant) -> tuple[control.StateSpace, tuple[Path, ...]]:
    parts: dict[str, Any] = {key: getattr(table, key) for key in "ABCD"}
    files: tuple[Path, ...] = (place,)
    if table.file is not None:
        other = place.parent / table.file
        files = (place, other)
        try:
            content = json.loads(read_text(other, "JSON"))
        except (json.JSONDecodeError, RecursionError) as error:
            raise InputError(f"is not valid JSON: {error}", where=str(other)) from None
        if not isinstance(content, dict):
            raise InputError("is no JSON object", where=str(other), expected="an object with A, B, C, D")
        parts = {key: content.get(key) for key in "ABCD"}
    missing = [key for key, value in parts.items() if value is None]
    if missing:
        raise InputError(f"key plant.{missing[0]} is missing", where=str(place), remedy=_REMEDY)
    try:
        arrays = [np.asarray(parts[key], float) for key in "ABCD"]
        return control.ss(*arrays, float(table.dt)), files
    except (ValueError, TypeError) as error:
        raise InputError(f"[plant]: the matrices do not fit together: {error}", where=str(files[-1]),
                         expected="A (n x n), B (n x m), C (p x n), D (p x m) of numbers") from None
