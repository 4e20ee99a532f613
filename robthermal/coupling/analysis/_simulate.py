"""e12 over time: both loops with the coupling controller as it would be programmed, and without it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._arrays import Array
from ..._control import control
from ..._drawing import size_of
from ...errors import InputError
from ...signals import Record
from ..evaluation import CouplingResult
from ..problem import Performance, RunningLoops

_SAMPLES = 2500


@dataclass(frozen=True, eq=False)
class Simulation:
    """e12 under one realization of the disturbances, without and with coupling.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Time of every sample [s].
    before, after : ndarray, shape (n,) or (n, p)
        Synchronization error e12 without and with coupling [m]; of p channels where the subsystems have several.
    samples : int
        In the exposure window; 0 without one.
    ma_before, ma_after, msd_before, msd_after : ndarray, shape (n - samples + 1,)
        Mean and standard deviation of e12 over each window [m]; empty without a window. Value k belongs to the window
        that begins at time k.
    e1, e2 : ndarray, shape (n,) or (n, p)
        Tracking errors with coupling [m].
    e1_seen, e2_seen : ndarray, shape (n,) or (n, p)
        e1+, e2+: what C1 and C2 act on [m]. They are the errors without coupling.
    on : ndarray of bool, shape (n,)
        Where the coupling is switched on.

    Examples
    --------
    Off for the first half: until then nothing differs.

    >>> import robthermal as rt
    >>> machine = rt.systems.scanner()
    >>> filters = rt.coupling.evaluate(machine.P1, machine.P2, machine.C1, machine.C2, X_hat=-0.1, window=0.01,
    ...                                disturbances=machine.disturbances)
    >>> run = rt.coupling.simulate(filters, samples=500, on=250)
    >>> run.after.shape, run.ma_after.shape
    ((500,), (451,))
    >>> bool(abs(run.after - run.before)[:250].max() < 1e-6 * abs(run.after - run.before).max())
    True
    """

    time: Array
    before: Array
    after: Array
    samples: int
    ma_before: Array
    ma_after: Array
    msd_before: Array
    msd_after: Array
    e1: Array
    e2: Array
    e1_seen: Array
    e2_seen: Array
    on: Array

    @property
    def performance(self) -> Performance:
        """Three times the root mean square of MA and MSD over all windows [m]: estimates; nan without a window."""
        if not self.samples:
            return Performance(*[float("nan")] * 4)
        traces = (self.ma_before, self.ma_after, self.msd_before, self.msd_after)
        return Performance(*[3 * float(np.sqrt(np.mean(trace**2))) for trace in traces])

    def plot(self) -> NDArray[Any]:
        """e12 and, with a window, its moving average and moving standard deviation [nm] over time [s].

        Returns
        -------
        ndarray of matplotlib axes, shape (1,), (3,) or (p,)
        """
        import matplotlib.pyplot as plt

        rows: list[tuple[str, Array, Array]] = [("e12 [nm]", self.before, self.after)]
        if self.before.ndim == 2:
            rows = [(f"e12,\nchannel {k + 1} [nm]", *pair)
                    for k, pair in enumerate(zip(self.before.T, self.after.T, strict=True))]
        if self.samples:
            rows += [("moving\naverage [nm]", self.ma_before, self.ma_after),
                     ("moving standard\ndeviation [nm]", self.msd_before, self.msd_after)]
        axes: Any = plt.subplots(len(rows), 1, sharex=True, squeeze=False, figsize=size_of(2.0 * len(rows)),
                                 layout="constrained")[1][:, 0]
        switched = self.time[1:][self.on[1:] != self.on[:-1]]
        for ax, (name, before, after) in zip(axes, rows, strict=True):
            ax.plot(self.time[:len(before)], 1e9 * before, color="0.5", linewidth=0.8, label="without coupling")
            ax.plot(self.time[:len(after)], 1e9 * after, linewidth=0.8, label="with coupling")
            for moment in switched:
                ax.axvline(moment, color="0.5", linestyle=":", linewidth=0.8)
            ax.set_ylabel(name)
        axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
        axes[-1].set_xlabel("time [s]")
        return axes

    def __str__(self) -> str:
        rms = [float(np.sqrt(np.mean(trace**2))) for trace in (self.before, self.after)]
        text = f"e12 over {len(self.time)} samples, rms: {rms[0]:.4g} -> {rms[1]:.4g} m"
        return f"{text}\n{self.performance}" if self.samples else text


def simulate(filters: CouplingResult, samples: int | None = None, seed: int = 0, *, disturbances: Any = None,
             on: int | tuple[int, int] | None = None) -> Simulation:
    """Simulate the model's loops with the coupling controller and without it, under the same disturbances.

    Nothing of the formulas for e12 is used: plants, controllers and disturbances run sample by sample. They start at
    rest. Of noise twice as much is made as is returned; the first half is dropped. Switching acts on the inputs of the
    coupling filters, so that the loops of C1 and C2 see nothing of it.

    Parameters
    ----------
    filters : Filters or MatrixFilters
        In discrete time.
    samples : int, optional
        Samples that are returned, of noise; 2500 when nothing is said. Not together with `disturbances`.
    seed : int
        Of the white noise behind the disturbances of the design.
    disturbances : Record or pair of array_like, shape (n,) or (n, p), optional
        v1, v2 at the outputs of the plants [m], one value per sample of the loop and channel; of a record, for one
        channel each, its columns "v1" and "v2". None: noise of the design. A reference r acts as the disturbance -r.
    on : int or pair of int, optional
        First sample with coupling, or first with and first again without, counted in what is returned. None: always.

    Returns
    -------
    Simulation

    Raises
    ------
    InputError
        In continuous time, for fewer samples than the window has, disturbances of another sample time, or an `on`
        that is not within the samples.

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> machine = rt.systems.scanner()
    >>> filters = rt.coupling.evaluate(machine.P1, machine.P2, machine.C1, machine.C2, X_hat=-0.5)
    >>> step = np.where(np.arange(2000) < 100, 0.0, 1e-9)
    >>> run = rt.coupling.simulate(filters, disturbances=(np.zeros(2000), step))
    >>> bool(abs(run.after[-1]) < 1e-12)
    True
    """
    loops = filters.running_loops()
    dt = float(loops.plants.dt)
    if not dt:
        raise InputError("continuous-time filters", where="simulate", expected="discrete time (dt > 0)",
                         remedy="Discretize plants and controllers first.")
    v, dropped = _disturbances(loops, samples, seed, disturbances)
    n, p = v.shape[1] - dropped, len(v) // 2
    if n < max(loops.samples, 1):
        raise InputError(f"{n} samples", where="simulate", expected=f"at least {max(loops.samples, 1)}")
    gate = _gate(on, n)
    alone = _loops(loops.plants, (loops.alone,), np.zeros(v.shape[1], dtype=bool), v)[0][:, dropped:]
    # Before what is returned the coupling is as in the first sample of it, so that nothing is switched at time zero.
    whole = np.concatenate([np.full(dropped, gate[0]), gate])
    e, seen = (part[:, dropped:] for part in _loops(loops.plants, (loops.cut, loops.coupled), whole, v))
    before, after = _trace(alone[:p] - alone[p:]), _trace(e[:p] - e[p:])
    moving = [part for trace in (before, after) for part in _moving(trace, loops.samples)]
    return Simulation(dt * np.arange(n), before, after, loops.samples, ma_before=moving[0], ma_after=moving[2],
                      msd_before=moving[1], msd_after=moving[3], e1=_trace(e[:p]), e2=_trace(e[p:]),
                      e1_seen=_trace(seen[:p]), e2_seen=_trace(seen[p:]), on=gate)


def _trace(channels: Array) -> Array:
    """(n,) of one channel, (n, p) of several."""
    return channels[0] if len(channels) == 1 else channels.T


def _disturbances(loops: RunningLoops, samples: int | None, seed: int, given: Any) -> tuple[Array, int]:
    """v (2p, n) and how many samples at its beginning are there to settle only."""
    if given is not None:
        if samples is not None:
            raise InputError(f"samples = {samples} and disturbances", where="simulate", expected="one of the two",
                             remedy="Cut the record to length instead.")
        return _given(given, float(loops.plants.dt), loops.plants.noutputs // 2), 0
    n = _SAMPLES if samples is None else samples
    if isinstance(n, bool) or not isinstance(n, (int, np.integer)) or n < 1:
        raise InputError(f"samples = {n!r}", where="simulate", expected="a positive number of samples")
    white = np.random.default_rng(seed).standard_normal((loops.shaping.ninputs, 2 * n))
    return _run(loops.shaping, white), n


def _given(disturbances: Any, dt: float, channels: int) -> Array:
    shape = "(n,)" if channels == 1 else f"(n, {channels})"
    if isinstance(disturbances, Record) and channels == 1:
        if not np.isclose(disturbances.sample_time, dt, rtol=1e-6, atol=0.0):
            raise InputError(f"sample time {disturbances.sample_time:g} s, the loop has {dt:g} s",
                             where="simulate, argument disturbances", expected=f"{dt:g} s",
                             remedy="Resample the record.")
        for name in ("v1", "v2"):
            if disturbances.units.get(name, "m") != "m":
                raise InputError(f"{name} in {disturbances.units[name]}", where="simulate, argument disturbances",
                                 expected="metres", remedy="Convert the columns.")
        disturbances = disturbances["v1"], disturbances["v2"]
    try:
        v = np.array([np.asarray(part, dtype=float) for part in disturbances])
    except (TypeError, ValueError):
        v = np.empty(0)
    if v.shape[:1] + v.shape[2:] != (2,) + (channels,) * (channels > 1) or v.ndim < 2 or not np.all(np.isfinite(v)):
        record = ', or a record with columns "v1" and "v2"' if channels == 1 else ""
        raise InputError("not two traces of finite numbers and of one length", where="simulate, argument disturbances",
                         expected=f"a pair (v1, v2), shape {shape} each [m]{record}")
    return v if channels == 1 else np.concatenate([v[0].T, v[1].T])


def _gate(on: Any, n: int) -> Array:
    """Where the coupling is on, shape (n,)."""
    if on is None:
        return np.ones(n, dtype=bool)
    pair = (on, n) if isinstance(on, (int, np.integer)) else on
    whole = isinstance(pair, (tuple, list)) and len(pair) == 2 and all(
        isinstance(k, (int, np.integer)) and not isinstance(k, bool) for k in pair)
    if not whole or not 0 <= pair[0] < pair[1] <= n:
        raise InputError(f"on = {on!r}", where="simulate",
                         expected=f"a sample, or a pair of samples first < last, from 0 to {n}")
    t = np.arange(n)
    return (pair[0] <= t) & (t < pair[1])


def _loops(P: control.StateSpace, controllers: tuple[control.StateSpace, ...], gate: Array, v: Array
           ) -> tuple[Array, Array]:
    """e and e+ (2p, n) of u = K e, e = -y, y = v + P u, with the second controller where the gate is on."""
    m, x, k = P.ninputs, np.zeros(P.nstates), np.zeros(controllers[0].nstates)
    direct = [np.linalg.inv(np.eye(len(v)) + P.D @ K.D[:m]) for K in controllers]
    e, seen = np.empty(v.shape), np.empty(v.shape)
    for t, state in enumerate(gate.astype(int)):
        K = controllers[state]
        rest = K.C @ k
        e[:, t] = -direct[state] @ (v[:, t] + P.C @ x + P.D @ rest[:m])
        out = rest + K.D @ e[:, t]
        x, k = P.A @ x + P.B @ out[:m], K.A @ k + K.B @ e[:, t]
        seen[:, t] = out[m:]
    return e, seen


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
