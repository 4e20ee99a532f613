"""Linear systems of any size that users give, checked."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._control import control
from ...errors import InputError


def matrix_of(system: Any, where: str, dt: float) -> control.StateSpace:
    """A proper system of any size as a finite state space.

    Parameters
    ----------
    system : LTI
        What the user gave.
    where : str
        Name of the argument.
    dt : float
        Sample time of the loop [s].
    """
    if isinstance(system, control.TransferFunction) and (system.ninputs, system.noutputs) == (1, 1):
        system = control.ss(system)
    if not isinstance(system, control.StateSpace):
        raise InputError(f"{type(system).__name__} is not a state space", where=where,
                         expected="a python-control StateSpace", remedy="control.ss makes one of matrices A, B, C, D.")
    parts = [np.asarray(part, dtype=float) for part in (system.A, system.B, system.C, system.D)]
    if not all(np.all(np.isfinite(part)) for part in parts):
        raise InputError("NaN or infinite entries", where=where, expected="finite matrices A, B, C, D")
    if system.dt is not None and float(system.dt) != dt:
        raise InputError(f"sample time {system.dt} s, the others have {dt:g} s", where=where, expected=f"dt = {dt:g}",
                         remedy="Discretize all systems alike.")
    return control.StateSpace(*parts, dt, remove_useless_states=False)
