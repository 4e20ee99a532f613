"""Free run of a system on a record that its fit has not seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy

from .._arrays import Floats
from ..thermal import System
from ._data import Data
from ._problem import Problem, scaled
from ._ranges import NONE
from ._start import Start, initial_of

_UNKNOWN = {"K": 1.0, "V": 0.05}  # noise nobody declared, of a first guess
_HEAD = 0.1  # part of a validation record that is used for its initial temperatures, if it determines them
_OPEN = 0.3  # standard deviations of noise that the start may move the readings by


@dataclass(frozen=True, eq=False)
class FreeRun:
    """A model beside a record, driven by the recorded inputs alone.

    Parameters
    ----------
    one : Data
        Record with its readings.
    initial_temperatures : ndarray, shape (n_lumps,)
        Where the model started [K].
    residual : ndarray, shape (n, n_sensors)
        Measured − modelled of every sensor [K, or V].
    """

    one: Data
    initial_temperatures: Floats
    residual: Floats

    @property
    def modelled(self) -> Floats:
        """What the model reads, (n, n_sensors) [K, or V]."""
        return self.one.readings - self.residual

    @property
    def by_sensor(self) -> dict[str, Floats]:
        """Residual (n,) of every sensor [K, or V]."""
        return {name: self.residual[:, i] for i, name in enumerate(self.one.sensors)}


def free_run(system: System, one: Data, start: Start, noise: Mapping[str, float]) -> FreeRun:
    """Run a model freely on a record that its fit has not seen.

    A free start is estimated on the first tenth of the record (with its prior). Where that leaves it so open that the
    readings of the record could be off by more than 0.3 of their noise (rms), it is estimated on the whole record: the
    start of a body without a thermometer, which shows late.

    Parameters
    ----------
    system : System
        Model with its parameters.
    one : Data
        Record to run on.
    start : {"free", "measured", "system"}
        Initial lump temperatures, as in `calibrate`.
    noise : mapping
        Standard deviation of the sensors [K], weights of the readings; 1 K or 0.05 V where it is unknown or 0.
    """
    initial = initial_of(system, one, start)
    weights = scaled(np.array([noise.get(name) or _UNKNOWN[system.sensors[name].unit] for name in one.sensors]))
    whole = Problem(system, [one], NONE, [initial], [weights])
    v = whole.v0
    if initial.n_free:
        n_head = max(2, round(_HEAD * len(one.readings)))
        missing = None if one.missing is None else one.missing[:n_head]
        head = Data(one.record[:n_head], one.sensors, one.columns, one.readings[:n_head], missing)
        v = _start(replace(whole, data=[head]), v)
        if _spread(whole, v, n_head) > _OPEN:
            v = _start(whole, v)
    return FreeRun(one, whole.temperatures(v)[0], whole.residuals(v)[0])


def _start(problem: Problem, v: Floats) -> Floats:
    """Initial temperatures that fit the readings of a record best, with their prior."""
    return np.asarray(scipy.optimize.least_squares(problem.vector, v, problem.jacobian, bounds=problem.bounds,
                                                   x_scale="jac").x)


def _spread(whole: Problem, v: Floats, n_head: int) -> float:
    """Rms of the standard deviations of all readings that come of the start, known from the head [std of noise]."""
    readings = whole.data[0].readings
    J = whole.jacobian(v)[:readings.size]
    head = np.concatenate([J[:n_head * readings.shape[1]], np.eye(v.size)])
    root = np.linalg.qr(head, mode="r")
    return float(np.sqrt(np.sum(scipy.linalg.solve_triangular(root, J.T, trans="T") ** 2) / len(J)))
