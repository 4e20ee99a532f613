"""A controller read back from its export: the same numbers as the C source, operation by operation."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._checks import positive_number
from ..errors import InputError
from ._controller import Controller, ControllerInput, expect_modules
from ._export_controller import FORMAT, vector_of
from ._matrices import Matrices, dot, matrices
from ._modules import Array
from ._numbers import non_negative, numbers
from ._pid import PID

DESIGN_FORMAT = "robthermal-design/1"
_LARGEST = 50_000_000  # bytes: the matrices of a hundred states are a hundredth of it


@dataclass(frozen=True)
class MatrixController(Controller):
    """Any linear controller as three matrices; it computes to the last bit what its C source computes.

    Parameters
    ----------
    matrices : Matrices
        What it multiplies with.
    name : str
        Of the design.
    """

    matrices: Matrices
    name: str

    @property
    def sample_time(self) -> float:  # type: ignore[override]  # of its matrices: nobody sets it
        """[s]."""
        return self.matrices.sample_time

    @property
    def count(self) -> int:
        """Number of modules."""
        return self.matrices.modules

    def start(self, given: ControllerInput, heat: Array) -> Array:
        expect_modules(self.count, heat)
        if self.matrices.n_lumps and len(given.temperatures) != self.matrices.n_lumps:
            raise InputError(f"a controller made for {self.matrices.n_lumps} lumps, in a system of "
                             f"{len(given.temperatures)}", where="argument controller", expected="the same system")
        return self._times(self.matrices.start, self.matrices.vector(given), heat)

    def heat(self, state: Array, given: ControllerInput) -> Array:
        return self._times(self.matrices.heat, state, self.matrices.vector(given))

    def advance(self, state: Array, given: ControllerInput, wanted: Array, achieved: Array) -> Array:
        return self._times(self.matrices.advance, state, self.matrices.vector(given), wanted, achieved)

    @staticmethod
    def _times(matrix: Array, *parts: Any) -> Array:
        values = [float(value) for part in parts for value in part]
        return np.array([dot(row, values) for row in matrix])


def load_controller(path: str | Path) -> MatrixController:
    """Read a controller that was exported to JSON, or that of a design.

    Parameters
    ----------
    path : str or path
        File that `Controller.export` wrote, or the design.json of a design.

    Returns
    -------
    MatrixController

    Raises
    ------
    InputError
        The file cannot be read, is not such a file, or its numbers are not those that were written.

    Examples
    --------
    >>> import robthermal as rt
    >>> plant = rt.design.cold_side(rt.design.feedback_linearization(rt.systems.two_module()))
    >>> rt.design.pid(plant, bandwidth=0.05, sample_time=1.0).export("pi.json")
    >>> controller = rt.design.load_controller("pi.json")
    >>> bool(abs(rt.design.loop_poles(plant, controller)).max() < 1)
    True
    """
    where = ascii(str(path))
    try:
        if Path(path).stat().st_size > _LARGEST:
            raise InputError(f"is larger than {_LARGEST / 1e6:.0f} MB", where=where, remedy="Is this the right file?")
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=where, remedy="Check the path.") from None
    except InputError:
        raise
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not JSON: {error}", where=where) from None
    kinds = {FORMAT: _controller, DESIGN_FORMAT: _designed}
    if not isinstance(content, dict) or content.get("format") not in kinds:
        raise InputError("is not a controller", where=where, expected=f'"format": "{FORMAT}" or "{DESIGN_FORMAT}"',
                         remedy="Write one with controller.export(path), or `robthermal design`.")
    try:
        found, intact = kinds[content["format"]](content)
    except InputError as error:
        raise InputError(error.what, where=f"{where} {error.where}", expected=error.expected) from None
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InputError(f"is not a complete controller: {type(error).__name__}: {error}", where=where) from None
    if not intact:
        raise InputError("its numbers are not those that were written", where=where,
                         expected="an unchanged file", remedy="Write it again, or design with other gains.")
    return found


def gains_digest(controller: Mapping[str, Any], sample_time: float) -> str:
    """SHA-256 of the gains of a design, as its file holds them.

    Parameters
    ----------
    controller : mapping
        Modules with their gains.
    sample_time : float
        Time between two samples [s].

    Examples
    --------
    >>> gains_digest({"m1": {"proportional": {"value": 0.4, "unit": "W/K"}}}, 1.0)[:8]
    'c237e26c'
    """
    text = json.dumps([controller, sample_time], sort_keys=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _designed(content: dict[str, Any]) -> tuple[MatrixController, bool]:
    """PI of every module from design.json, and whether its gains are what was written."""
    modules, h = content["controller"]["modules"], content["sample_time"]["value"]
    gains = [[module[key]["value"] for module in modules.values()] for key in ("proportional", "integral",
                                                                              "tracking_time")]
    table = numbers(gains, "controller")
    if table.shape != (3, len(modules)) or not len(modules):
        raise ValueError("no modules")
    non_negative(table, "controller")
    h = positive_number(h, "sample_time", "s")
    found: Any = PID(table[0], table[1], np.zeros(len(modules)), 2 * h, table[2], h)
    return (MatrixController(matrices(found), str(content["system"])),
            content["controller"]["sha256"] == gains_digest(modules, content["sample_time"]["value"]))


def _controller(content: dict[str, Any]) -> tuple[MatrixController, bool]:
    """From an export, and whether it meets its own test vector."""
    m, lumps, around = int(content["modules"]), tuple(map(str, content["lumps"])), tuple(map(str, content["around"]))
    indices = tuple(int(i) for i in content["indices"])
    k, n = 2 * m + len(lumps) + len(around), len(content["start"])
    shapes = {"start": (n, k + m), "heat": (m, n + k), "advance": (n, n + k + 2 * m)}
    found = {key: numbers(content[key], key).reshape(shape) for key, shape in shapes.items()}
    if m < 1 or len(indices) != len(lumps) or not all(0 <= i < content["n_lumps"] for i in indices):
        raise ValueError("lumps, indices and n_lumps contradict each other")
    M = Matrices(positive_number(content["sample_time"], "sample_time", "s"), m, lumps, indices,
                 int(content["n_lumps"]), around, **found)
    rows = content["test_vector"]["rows"] if "test_vector" in content else None  # files of former versions have none
    intact = rows is None or np.allclose(np.array(list(vector_of(M))), np.array(rows, float), rtol=1e-9, atol=1e-12)
    return MatrixController(M, str(content["name"])), intact
