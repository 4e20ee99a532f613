"""The least-squares problem: weighted residuals of all records, priors, and their exact derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .._arrays import Floats
from .._residual import residual
from ..errors import Diverged
from ..thermal import System, trajectory
from ._data import Data
from ._ranges import Ranges
from ._start import COLDEST, HOTTEST, REACH, Initial, start_values

Weigh = Callable[[Floats], Floats]  # (n, n_sensors, ...) in kelvin to weighted, linear


@dataclass(frozen=True)
class Run:
    """One record at one point: residual, measured − modelled (n, n_sensors), and the residual's derivatives.

    By the parameters (n, n_sensors, p), by the initial temperatures (n, n_sensors, n_free).
    """

    residual: Floats
    by_parameter: Floats
    by_start: Floats


@dataclass
class Problem:
    """Unknowns v: coordinates of the parameters, then every record's initial temperatures in units of their prior.

    Parameters
    ----------
    system : System
        System whose parameters are estimated.
    data : list of Data
        Records to be explained.
    ranges : Ranges
        Parameters to estimate.
    starts : list of Initial
        One per record.
    weigh : list of callable
        Maps one record's residuals [K] to weighted ones.
    """

    system: System
    data: list[Data]
    ranges: Ranges
    starts: list[Initial]
    weigh: list[Weigh] = field(default_factory=list)

    @property
    def n_readings(self) -> int:
        """Number of readings."""
        return sum(one.readings.size for one in self.data)

    @property
    def v0(self) -> Floats:
        """Starting point."""
        n_free = sum(s.n_free for s in self.starts)
        return np.concatenate([self.ranges.coordinates(self.ranges.start), np.zeros(n_free)])

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Bounds of the unknowns."""
        within = [start.within(COLDEST, HOTTEST, REACH) for start in self.starts]
        q = self.ranges.coordinates
        return (np.concatenate([q(self.ranges.lower), *(low for low, _ in within)]),
                np.concatenate([q(self.ranges.upper), *(high for _, high in within)]))

    def parameters(self, v: Floats) -> Floats:
        """Parameter values."""
        return self.ranges.values(v[:len(self.ranges.names)])

    def temperatures(self, v: Floats) -> list[Floats]:
        """Initial temperatures of lumps and lagged thermometers of every record [K]."""
        out, at = [], len(self.ranges.names)
        for start in self.starts:
            out.append(start.mean + start.sigma * v[at:at + start.n_free] if start.n_free else start.mean)
            at += start.n_free
        return out

    def systems(self, v: Floats) -> list[System]:
        """System of every record: the parameters, and its own initial temperatures."""
        values = self.ranges.assigned(self.parameters(v))
        return [self.system.with_parameters({**start_values(start, T), **values})
                for start, T in zip(self.starts, self.temperatures(v), strict=True)]

    def residuals(self, v: Floats) -> list[Floats]:
        """Measured − modelled of every record, (n, n_sensors) [K]."""
        return [one.where_read(residual(one.readings, trajectory(system, one.record).readings[:, one.columns]))
                for system, one in zip(self.systems(v), self.data, strict=True)]

    def runs(self, v: Floats) -> list[Run]:
        """Residuals of all records with their derivatives in the coordinates [K]."""
        slopes = self.ranges.slopes(self.parameters(v))
        out = []
        for system, one, start in zip(self.systems(v), self.data, self.starts, strict=True):
            free = list(start.names) if start.n_free else []
            flat = self.ranges.flat
            run = trajectory(system, one.record, sensitivities=[*flat, *free])
            J: Floats = one.where_read(np.asarray(run.sensitivity[:, one.columns], np.float64))
            by_start: Floats = np.multiply(J[..., len(flat):], -start.sigma[:start.n_free])
            by_parameter: Floats = np.multiply(self.ranges.joined(J[..., :len(flat)]), -slopes)
            own = one.where_read(residual(one.readings, run.readings[:, one.columns]))
            out.append(Run(own, by_parameter, by_start))
        return out

    def vector(self, v: Floats) -> Floats:
        """Weighted residuals of all readings, then the priors; infinite where the model runs away (a rejected step)."""
        try:
            parts = [weigh(r).ravel() for weigh, r in zip(self.weigh, self.residuals(v), strict=True)]
        except Diverged:
            return np.full(self.n_readings + self._prior(v).size, np.inf)
        return np.concatenate([*parts, self._prior(v)])

    def jacobian(self, v: Floats) -> Floats:
        """Derivative of `vector`."""
        p, known = len(self.ranges.names), np.isfinite(self.ranges.sigma)
        J = np.zeros((self.n_readings + int(known.sum()) + v.size - p, v.size))
        row, column = 0, p
        for run, weigh, start in zip(self.runs(v), self.weigh, self.starts, strict=True):
            rows = slice(row, row + run.residual.size)
            J[rows, :p] = weigh(run.by_parameter).reshape(run.residual.size, p)
            J[rows, column:column + start.n_free] = weigh(run.by_start).reshape(run.residual.size, start.n_free)
            row, column = rows.stop, column + start.n_free
        J[row + np.arange(known.sum()), np.flatnonzero(known)] = self.ranges.prior_slopes(self.parameters(v))[known]
        J[row + int(known.sum()):, p:] = np.eye(v.size - p)
        return J

    def _prior(self, v: Floats) -> Floats:
        return np.concatenate([self.ranges.prior(self.parameters(v)), v[len(self.ranges.names):]])


def scaled(noise: Floats) -> Weigh:
    """Weight that divides every sensor's column by its noise [K]."""
    return lambda r: r / noise.reshape(1, -1, *[1] * (r.ndim - 2))
