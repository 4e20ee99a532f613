"""Python-control systems as arrays and as the section of a certificate; refuses what no claim could be about."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np

from .._arrays import Array
from .._control import control
from ..errors import InputError


@dataclass(frozen=True)
class Plant:
    """A, B, C, D and sample time [s], 0 when continuous."""

    A: Array
    B: Array
    C: Array
    D: Array
    dt: float

    @property
    def section(self) -> dict[str, Any]:
        """The section "system" of a certificate."""
        return {"A": self.A, "B": self.B, "C": self.C, "D": self.D, "sample_time": self.dt}

    @property
    def poles(self) -> Array:
        return np.linalg.eigvals(self.A) if len(self.A) else np.zeros(0, complex)

    @property
    def stable(self) -> bool:
        """Whether the computed eigenvalues are: a float test, not a proof."""
        return bool(np.all(abs(self.poles) < 1) if self.dt else np.all(self.poles.real < 0))

    @property
    def end(self) -> float:
        """Last frequency [rad/s]: Nyquist, or infinity."""
        return float(np.pi / self.dt) if self.dt else np.inf


def read_plant(system: Any, where: str = "argument system") -> Plant:
    """Arrays of a python-control system."""
    if not isinstance(system, (control.StateSpace, control.TransferFunction)):
        raise InputError(f"system is a {type(system).__name__}", where=where,
                         expected="a python-control StateSpace or TransferFunction")
    if system.dt is True:
        raise InputError("the system is sampled, without a sample time (dt = True)", where=where,
                         expected="dt = 0 (continuous) or the sample time [s]")
    try:
        found = control.ss(system)
    except (control.ControlMIMONotImplemented, ValueError) as error:
        raise InputError(f"a transfer function that cannot be realized here: {error}", where=where,
                         expected="a StateSpace, or a proper transfer function with one input and output") from None
    n, m, p = found.nstates, found.ninputs, found.noutputs
    arrays = (np.asarray(found.A, float).reshape(n, n), np.asarray(found.B, float).reshape(n, m),
              np.asarray(found.C, float).reshape(p, n), np.asarray(found.D, float).reshape(p, m))
    if not all(np.isfinite(matrix).all() for matrix in arrays):
        raise InputError("a matrix of the system holds numbers that are not finite", where=where,
                         expected="finite A, B, C, D")
    return Plant(*arrays, float(system.dt or 0.0))


def made_by(solver: str, status: str) -> dict[str, str]:
    """Versions, and how the candidate was found: for the record, never as evidence."""
    return {"robthermal": version("robthermal"), "python": platform.python_version(), "numpy": np.__version__,
            "solver": solver, "status": status}


def scaling(value: Any, size: int, where: str) -> Array | None:
    """A square scaling of finite numbers, regular as far as floats tell."""
    if value is None:
        return None
    matrix = np.asarray(value)
    if matrix.shape[-2:] != (size, size) or matrix.dtype.kind not in "iufc" or not np.isfinite(matrix).all():
        raise InputError(f"shape {matrix.shape}", where=where, expected=f"finite numbers, shape (..., {size}, {size})")
    if np.any(np.linalg.matrix_rank(matrix) < size):
        raise InputError("a scaling has no inverse", where=where, expected="regular matrices")
    return matrix
