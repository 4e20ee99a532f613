"""Variances of e12 without integration: Gramians and the autocovariance of the moving average."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_continuous_lyapunov, solve_discrete_lyapunov

from ..._arrays import Array
from ..._control import control
from ..systems import plus_one, realize, series
from ._problem import Problem, Subsystem


@dataclass(frozen=True)
class Performance:
    """Three-sigma moving average (MA) and moving standard deviation (MSD) of e12 over the exposure window.

    Parameters
    ----------
    ma_before, ma_after : float
        3 sqrt(∫ S \\|F\\|²) without and with coupling [m]; nan without a window.
    msd_before, msd_after : float
        3 sqrt(∫ S (1 - \\|F\\|²)) without and with coupling [m]; nan without a window.
    """

    ma_before: float
    ma_after: float
    msd_before: float
    msd_after: float

    @property
    def msd_growth(self) -> float:
        """MSD after over before coupling [-]; nan without a window."""
        return float(np.divide(self.msd_after, self.msd_before)) if self.msd_before else 1.0

    def __str__(self) -> str:
        return (f"MA  3 sigma: {self.ma_before:.4g} -> {self.ma_after:.4g} m\n"
                f"MSD 3 sigma: {self.msd_before:.4g} -> {self.msd_after:.4g} m")


def variances(problem: Problem, X: control.StateSpace, Y: control.StateSpace) -> Performance:
    """MA and MSD before and after coupling; nan without a window.

    Parameters
    ----------
    problem : Problem
        What disturbs the loops.
    X, Y : StateSpace
        Coupling filters, in closed form.
    """
    if not problem.samples:
        return Performance(*[float("nan")] * 4)
    before = [_moving(realize(half.SW), problem.samples) for half in (problem.one, problem.two)]
    after = [_moving(channel, problem.samples) for channel in coupled(problem, X, Y, "SW")]
    values = [3 * float(np.sqrt(sum(part[kind] for part in parts))) for kind in (0, 1) for parts in (before, after)]
    return Performance(*values)


def coupled(problem: Problem, X: control.StateSpace, Y: control.StateSpace, field: str = "signal"
            ) -> tuple[control.StateSpace, control.StateSpace]:
    """(1+Y) times the first and (1+X) times the second subsystem's signal.

    Parameters
    ----------
    problem : Problem
        The two subsystems with their disturbances.
    X, Y : StateSpace
        Coupling filters, in closed form.
    field : str
        Which signal: "S", "SW" or "signal" (weight S W).
    """
    return _improved(problem.one, Y, field), _improved(problem.two, X, field)


def h2(systems: tuple[control.StateSpace, ...]) -> float:
    """Root of the summed squared H2 norms; infinite in continuous time with a feedthrough.

    Parameters
    ----------
    systems : tuple of StateSpace
        Stable channels of one row.
    """
    return float(np.sqrt(sum(_variance(system) for system in systems)))


def _improved(half: Subsystem, coupling: control.StateSpace, field: str) -> control.StateSpace:
    return series(plus_one(coupling), realize(getattr(half, field)))


def _variance(system: control.StateSpace) -> float:
    D = float(system.D[0, 0])
    if not system.dt and D:
        return float("inf")
    if not system.nstates:
        return D * D
    return (system.C @ _gramian(system) @ system.C.T).item() + D * D


def _gramian(system: control.StateSpace) -> Array:
    W = system.B @ system.B.T
    return solve_discrete_lyapunov(system.A, W) if system.dt else solve_continuous_lyapunov(system.A, -W)


def _moving(system: control.StateSpace, samples: int) -> tuple[float, float]:
    """Variances of the moving average and of what is left, for white noise of variance 1 per sample.

    The average of N samples has the variance (1/N²) sum over |k| < N of (N - |k|) R(k), R(k) the autocovariance.
    """
    if not system.nstates:
        total = float(system.D[0, 0]) ** 2
        return total / samples, total - total / samples
    W = _gramian(system)
    lag = (system.A @ W @ system.C.T + system.B * system.D[0, 0])[:, 0]  # R(k) = C A^(k-1) lag
    total = (system.C @ W @ system.C.T).item() + float(system.D[0, 0]) ** 2
    mean = samples * total
    for k in range(1, samples):
        mean += 2 * (samples - k) * float(system.C[0] @ lag)
        lag = system.A @ lag
    mean /= samples**2
    return max(mean, 0.0), max(total - mean, 0.0)
