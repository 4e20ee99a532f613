"""Two systems as one: side by side, or apart."""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from ..._control import control


def beside(first: control.StateSpace, second: control.StateSpace) -> control.StateSpace:
    """[first, second]: one output, the inputs of both.

    Parameters
    ----------
    first, second : StateSpace
        One output each.
    """
    return control.StateSpace(block_diag(first.A, second.A), block_diag(first.B, second.B),
                              np.hstack([first.C, second.C]), np.hstack([first.D, second.D]), first.dt,
                              remove_useless_states=False)


def apart(first: control.StateSpace, second: control.StateSpace) -> control.StateSpace:
    """diag(first, second): inputs and outputs of both.

    Parameters
    ----------
    first, second : StateSpace
        The two systems, of any sizes.
    """
    return control.StateSpace(*(block_diag(getattr(first, key), getattr(second, key)) for key in "ABCD"), first.dt,
                              remove_useless_states=False)


def minus_identity(first: control.StateSpace, second: control.StateSpace) -> control.StateSpace:
    """first + second - I, nothing cancelled.

    Parameters
    ----------
    first, second : StateSpace
        Square, of one size.
    """
    D = first.D + second.D
    return control.StateSpace(block_diag(first.A, second.A), np.vstack([first.B, second.B]),
                              np.hstack([first.C, second.C]), D - np.eye(len(D)), first.dt,
                              remove_useless_states=False)
