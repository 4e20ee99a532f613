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
from ...thermal import System, read_system
from ..request import Number, Table, read_text, read_toml

_REMEDY = "docs/command_line.md lists the keys of PLANT.toml."
_Matrix = list[list[Number]]


class _Vertex(Table):
    A: _Matrix
    B: _Matrix
    C: _Matrix | None = None
    D: _Matrix | None = None


class _Plant(Table):
    vertices: list[_Vertex] | None = None
    A: _Matrix | None = None
    B: _Matrix | None = None
    C: _Matrix | None = None
    D: _Matrix | None = None
    file: str | None = None
    n_meas: int | None = None
    n_ctrl: int
    dt: Number = 0.0


class _Response(Table):
    file: str
    sample_time: Number | None = None


class _Box(Table):
    temperature: list[Number] | dict[str, list[Number]]
    current: list[Number] | dict[str, list[Number]]
    ambient: dict[str, list[Number]] | None = None
    heat: dict[str, list[Number]] | None = None


class _System(Table):
    file: str
    box: _Box


class _Controller(Table):
    A: _Matrix
    B: _Matrix
    C: _Matrix
    D: _Matrix


class _File(Table):
    plant: _Plant | None = None
    controller: _Controller | None = None
    frf: _Response | None = None
    system: _System | None = None
    design: dict[str, Any] = Field(default_factory=dict)


@dataclass(frozen=True)
class SynthesisJob:
    """What a plant file asks for.

    Parameters
    ----------
    plant : control.StateSpace or None
        Generalized plant; None where there are vertices, a response or a system.
    n_meas, n_ctrl : int
        Numbers of measurements and of controls; 1 each for a response, 0 measurements where the file says nothing.
    response : FrequencyResponse or None
        Measured response; None where there is a plant.
    arguments : dict
        Keyword arguments of the synthesis, table [design].
    files : tuple of Path
        Files that were read.
    plants : tuple of control.StateSpace
        Plants at the vertices of a hull; empty where there is one plant.
    system : System or None
        Thermal system whose currents are fed back.
    controller : control.StateSpace or None
        Controller that is given, for anti-windup.
    """

    plant: control.StateSpace | None
    n_meas: int
    n_ctrl: int
    response: FrequencyResponse | None
    arguments: dict[str, Any]
    files: tuple[Path, ...]
    plants: tuple[control.StateSpace, ...] = ()
    system: System | None = None
    controller: control.StateSpace | None = None


def read_plant_file(path: str | Path) -> SynthesisJob:
    """Read a plant file.

    Parameters
    ----------
    path : str or Path
        TOML file with [plant] (A, B, C, D, or file: JSON with these keys; n_meas, n_ctrl, dt; or vertices), [frf]
        (file) or [system] (file, box), [controller] (A, B, C, D) for anti-windup, and [design] with the keyword
        arguments of the synthesis.

    Returns
    -------
    SynthesisJob

    Raises
    ------
    InputError
        A file that cannot be read, unknown or missing keys, none or several of [plant], [frf] and [system].

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
    if sum(table is not None for table in (found.plant, found.frf, found.system)) != 1:
        raise InputError("has several of [plant], [frf] and [system], or neither", where=str(place),
                         expected="one of them", remedy=_REMEDY)
    if found.system is not None:
        return _system(place, found.system, found.design)
    if found.frf is not None:
        response = place.parent / found.frf.file
        measured = read_response(response, sample_time=found.frf.sample_time)
        return SynthesisJob(None, 1, 1, measured, found.design, (place, response))
    if found.plant is None:
        raise ValueError("one of the tables is there")
    if found.plant.vertices:
        plants = tuple(_vertex(place, k, one, float(found.plant.dt)) for k, one in enumerate(found.plant.vertices))
        return SynthesisJob(None, found.plant.n_meas or 1, found.plant.n_ctrl, None, found.design, (place,), plants)
    plant, files = _plant(place, found.plant)
    controller = None if found.controller is None else _controller(place, found.controller, float(found.plant.dt))
    return SynthesisJob(plant, found.plant.n_meas or 0, found.plant.n_ctrl, None, found.design, files,
                        controller=controller)


def _controller(place: Path, table: _Controller, dt: float) -> control.StateSpace:
    try:
        return control.ss(*(np.asarray(getattr(table, key), float) for key in "ABCD"), dt)
    except (ValueError, TypeError, IndexError) as error:
        raise InputError(f"[controller]: the matrices do not fit together: {error}", where=str(place),
                         expected="A (n x n), B (n x m), C (p x n), D (p x m) of numbers") from None


def _system(place: Path, table: _System, design: dict[str, Any]) -> SynthesisJob:
    other = place.parent / table.file
    box = {key: _ranges(value) for key, value in table.box.model_dump().items() if value is not None}
    return SynthesisJob(None, 1, 1, None, {**box, **design}, (place, other), (), read_system(other))


def _ranges(value: Any) -> Any:
    return {name: tuple(pair) for name, pair in value.items()} if isinstance(value, dict) else tuple(value)


def _vertex(place: Path, k: int, one: _Vertex, dt: float) -> control.StateSpace:
    try:
        A, B = np.asarray(one.A, float), np.asarray(one.B, float)
        C = np.eye(len(A)) if one.C is None else np.asarray(one.C, float)
        D = np.zeros((len(C), B.shape[1])) if one.D is None else np.asarray(one.D, float)
        return control.ss(A, B, C, D, dt)
    except (ValueError, TypeError, IndexError) as error:
        raise InputError(f"plant.vertices[{k}]: the matrices do not fit together: {error}", where=str(place),
                         expected="A (n x n), B (n x m), C (p x n), D (p x m) of numbers") from None


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
    if table.n_meas is None and parts["C"] is None and parts["D"] is None and parts["A"] and parts["B"]:
        n, m = len(parts["A"]), len(parts["B"][0])  # only states are measured
        parts |= {"C": np.eye(n).tolist(), "D": np.zeros((n, m)).tolist()}
    missing = [key for key, value in parts.items() if value is None]
    if missing:
        raise InputError(f"key plant.{missing[0]} is missing", where=str(place), remedy=_REMEDY)
    try:
        arrays = [np.asarray(parts[key], float) for key in "ABCD"]
        return control.ss(*arrays, float(table.dt)), files
    except (ValueError, TypeError) as error:
        raise InputError(f"[plant]: the matrices do not fit together: {error}", where=str(files[-1]),
                         expected="A (n x n), B (n x m), C (p x n), D (p x m) of numbers") from None
