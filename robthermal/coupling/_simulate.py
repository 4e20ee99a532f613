"""e12 over time: both loops with the coupling controller as it would be programmed, and without it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import control
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ._cascade import realise
from ._joined import apart
from ._problem import Problem

if TYPE_CHECKING:
    from ._filters import Filters

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Simulation:
    """e12 under one realisation of the disturbances, without and with coupling.

    Parameters
    ----------
    time : ndarray, shape (n,)
        [s].
    before, after : ndarray, shape (n,)
        e12 [m].
    samples : int
        In the exposure window; 0 without one.
    ma_before, ma_after, msd_before, msd_after : ndarray, shape (n - samples + 1,)
        Mean and standard deviation of e12 over each window [m]; empty without a window. Value k belongs to the window
        that begins at time k.

    Examples
    --------
    >>> import robthermal as rt
    >>> machine = rt.systems.scanner()
    >>> filters = rt.coupling.evaluate(machine.P1, machine.P2, machine.C1, machine.C2, X_hat=-0.1, window=0.01,
    ...                                disturbances=machine.disturbances)
    >>> run = rt.coupling.simulate(filters, samples=500)
    >>> run.after.shape, run.ma_after.shape
    ((500,), (451,))
    """

    time: Array
    before: Array
    after: Array
    samples: int
    ma_before: Array
    ma_after: Array
    msd_before: Array
    msd_after: Array

    def plot(self) -> Any:
        """e12 and, with a window, its moving average and moving standard deviation [nm] over time [s].

        Returns
        -------
        ndarray of matplotlib axes, shape (1,) or (3,)
        """
        import matplotlib.pyplot as plt

        rows: list[tuple[str, Array, Array]] = [("e12 [nm]", self.before, self.after)]
        if self.samples:
            rows += [("moving\naverage [nm]", self.ma_before, self.ma_after),
                     ("moving standard\ndeviation [nm]", self.msd_before, self.msd_after)]
        axes: Any = plt.subplots(len(rows), 1, sharex=True, squeeze=False, figsize=(7, 2 * len(rows)))[1][:, 0]
        for ax, (name, before, after) in zip(axes, rows, strict=True):
            ax.plot(self.time[:len(before)], 1e9 * before, color="0.5", linewidth=0.8, label="without coupling")
            ax.plot(self.time[:len(after)], 1e9 * after, linewidth=0.8, label="with coupling")
            ax.set_ylabel(name)
        axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
        axes[-1].set_xlabel("time [s]")
        return axes


def simulate(filters: Filters, samples: int = 2500, seed: int = 0) -> Simulation:
    """Simulate the model's loops with the coupling controller and without it, under the same noise.

    Nothing of the formulas for e12 is used: plants, controllers and disturbances run sample by sample. They start at
    rest; the first half is dropped.

    Parameters
    ----------
    filters : Filters
        In discrete time.
    samples : int
        Samples that are returned.
    seed : int
        Of the white noise behind the disturbances.

    Returns
    -------
    Simulation

    Raises
    ------
    InputError
        In continuous time, or for fewer samples than the window has.

    Examples
    --------
    See :class:`Simulation`.

    >>> import robthermal as rt
    >>> rt.coupling.simulate.__name__
    'simulate'
    """
    problem = filters.problem
    if not problem.dt:
        raise InputError("continuous-time filters", where="simulate", expected="discrete time (dt > 0)",
                         remedy="Discretise plants and controllers first.")
    if samples < max(problem.samples, 1):
        raise InputError(f"samples = {samples}", where="simulate", expected=f"at least {max(problem.samples, 1)}")
    white = np.random.default_rng(seed).standard_normal((2, 2 * samples))
    disturbance = _run(apart(realise(problem.one.W), realise(problem.two.W)), white)
    alone = apart(realise(problem.one.C), realise(problem.two.C))
    before, after = (_synchronisation(problem, K, disturbance)[samples:] for K in (alone, filters.controller))
    moving = [part for trace in (before, after) for part in _moving(trace, problem.samples)]
    return Simulation(problem.dt * np.arange(samples), before, after, problem.samples, ma_before=moving[0],
                      ma_after=moving[2], msd_before=moving[1], msd_after=moving[3])


def _synchronisation(problem: Problem, K: control.StateSpace, v: Array) -> Array:
    """e12 = y2 - y1 of the loop u = K e, e = -y, y = v + P u."""
    P = apart(realise(problem.one.P), realise(problem.two.P))
    x, k = np.zeros(P.nstates), np.zeros(K.nstates)
    direct = np.linalg.inv(np.eye(2) + P.D @ K.D)
    e12 = np.empty(v.shape[1])
    for t in range(v.shape[1]):
        y = direct @ (v[:, t] + P.C @ x + P.D @ (K.C @ k))
        u = K.C @ k - K.D @ y
        x, k = P.A @ x + P.B @ u, K.A @ k - K.B @ y
        e12[t] = y[1] - y[0]
    return e12


def _run(system: control.StateSpace, inputs: Array) -> Array:
    x = np.zeros(system.nstates)
    outputs = np.empty((system.noutputs, inputs.shape[1]))
    for t in range(inputs.shape[1]):
        outputs[:, t] = system.C @ x + system.D @ inputs[:, t]
        x = system.A @ x + system.B @ inputs[:, t]
    return outputs


def _moving(trace: Array, samples: int) -> tuple[Array, Array]:
    """Mean and standard deviation over every window; empty without one."""
    if not samples:
        return np.empty(0), np.empty(0)
    windows = np.lib.stride_tricks.sliding_window_view(trace, samples)
    return windows.mean(axis=1), windows.std(axis=1)
