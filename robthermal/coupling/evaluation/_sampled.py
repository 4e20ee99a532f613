"""Filters designed in continuous time, sampled, and judged again with the sampled models."""

from __future__ import annotations

from typing import Any

from ..._control import control
from ...errors import InputError
from ._evaluate import evaluate
from ._filters import Filters


def discretize(filters: Filters, P1: Any, P2: Any, C1: Any, C2: Any, *, prewarp: float | None = None,
               **again: Any) -> Filters:
    """Sample filters that were designed in continuous time, and judge them with sampled plants and controllers.

    The free filters X_hat and Y_hat are sampled by the bilinear map, which keeps them stable; Z1, Z2 and everything
    made of them follow from the sampled plants, and every certificate is made anew.

    Parameters
    ----------
    filters : Filters
        Of a continuous-time problem.
    P1, P2, C1, C2 : StateSpace or TransferFunction
        Sampled plants (with their hold and delay) and controllers, one sample time.
    prewarp : float, optional
        Frequency that the bilinear map keeps [rad/s].
    **again
        What `evaluate` takes beside the filters: uncertainty, disturbances, weight, window.

    Returns
    -------
    Filters
        Of the sampled problem.

    Raises
    ------
    InputError
        Filters that are sampled already; as `evaluate`.

    Examples
    --------
    >>> import control
    >>> import robthermal as rt
    >>> P, C = control.tf([1], [1, 1]), control.tf([5], [1])
    >>> slow = rt.coupling.evaluate(P, P, C, C, X_hat=control.tf([-1], [0.1, 1]), Y_hat=0, cutoff=100.0)
    >>> Pd, Cd = control.c2d(P, 0.001), control.tf([5], [1], 0.001)
    >>> sampled = rt.coupling.discretize(slow, Pd, Pd, Cd, Cd)
    >>> sampled.holds, sampled.X_hat.dt
    (True, 0.001)
    """
    if control.isdtime(filters.X_hat, strict=True):
        raise InputError(f"the filters are sampled already, every {filters.X_hat.dt} s", where="argument filters",
                         expected="filters of a continuous-time problem")
    time = P1.dt if isinstance(P1, (control.StateSpace, control.TransferFunction)) else None
    if isinstance(time, bool) or not time:
        raise InputError(f"P1 has the sample time {time!r}", where="argument P1",
                         expected="a sampled plant, sample time in seconds",
                         remedy="Sample it with its hold: control.c2d(P1, sample_time).")
    X_hat, Y_hat = (control.c2d(part, time, method="bilinear", prewarp_frequency=prewarp)
                    for part in (filters.X_hat, filters.Y_hat))
    return evaluate(P1, P2, C1, C2, X_hat=X_hat, Y_hat=Y_hat, **again)
