"""A controller read back from its export: the same numbers as the C source, operation by operation."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._checks import positive_number
from ..errors import InputError
from ._controller import Controller, ControllerInput, expect_modules
from ._export_controller import FORMAT
from ._matrices import Matrices, dot
from ._modules import Array
from ._numbers import numbers

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
    """Read a controller that was exported to JSON.

    Parameters
    ----------
    path : str or path
        File that `Controller.export` wrote.

    Returns
    -------
    MatrixController

    Raises
    ------
    InputError
        The file cannot be read, or is not such a file.

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
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise InputError("is not a controller", where=where, expected=f'"format": "{FORMAT}"',
                         remedy="Write one with controller.export(path).")
    try:
        return _controller(content)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(f"is not a complete controller: {type(error).__name__}: {error}", where=where) from None


def _controller(content: dict[str, Any]) -> MatrixController:
    m, lumps, around = int(content["modules"]), tuple(map(str, content["lumps"])), tuple(map(str, content["around"]))
    indices = tuple(int(i) for i in content["indices"])
    k, n = 2 * m + len(lumps) + len(around), len(content["start"])
    shapes = {"start": (n, k + m), "heat": (m, n + k), "advance": (n, n + k + 2 * m)}
    found = {key: numbers(content[key], key).reshape(shape) for key, shape in shapes.items()}
    if m < 1 or len(indices) != len(lumps) or not all(0 <= i < content["n_lumps"] for i in indices):
        raise ValueError("lumps, indices and n_lumps contradict each other")
    return MatrixController(Matrices(positive_number(content["sample_time"], "sample_time", "s"), m, lumps, indices,
                                     int(content["n_lumps"]), around, **found), str(content["name"]))
