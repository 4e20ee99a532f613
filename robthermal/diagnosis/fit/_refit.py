"""Result of stage 2: a structure fitted to the records, and what is left after the nominal parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import Outcome
from ...fitting import counted, rmse
from ...thermal import System
from ..data import NoiseEstimate
from ..effects import Candidate
from ..path import Linearized, LinearizedRecord, White, linearized_records
from ._noise_scaling import NoiseScaling
from ._sessions import session_table
from ._structure import Structure
from ._turned import orthonormal, right_singular
from ._whitened import Whitened

Array = NDArray[np.float64]
_FLAT = 1e-9  # relative size of a direction of J that counts as none
_CONTRADICTED = 6.0  # standard deviations of a prior


@dataclass(frozen=True, eq=False)
class Refit:
    """A structure fitted to the records, with everything the tests need.

    Parameters
    ----------
    structure : Structure
        Unknowns and their priors.
    v : ndarray
        Values of the unknowns.
    floor : NoiseEstimate
        Where the noise levels came from.
    levels : NoiseScaling
        Factors on them, re-estimated within limits.
    paths : tuple of Linearized
        Linearization along every record; the modelled frequency response beside every measured one.
    whiteners : tuple of Whitener or ResponseWhitener
        One per record or frequency response.
    z : ndarray, shape (m,)
        Whitened residuals of all readings, then of the priors.
    outcome : Outcome
        Codes "converged", "not_converged" (not ok).
    """

    structure: Structure
    v: Array
    floor: NoiseEstimate
    levels: NoiseScaling
    paths: tuple[Linearized, ...]
    whiteners: tuple[White, ...]
    z: Array
    outcome: Outcome
    _others: dict[str, Refit] = field(default_factory=dict, init=False, repr=False)

    def kept(self, name: str, made: Callable[[], Refit]) -> Refit:
        """Another fit that follows from this one, made when it is first asked for.

        Parameters
        ----------
        name : str
            Name of the other fit.
        made : callable
            Makes the other fit.

        Returns
        -------
        Refit
        """
        if name not in self._others:
            self._others[name] = made()
        return self._others[name]

    @cached_property
    def J(self) -> Array:
        """Whitened derivatives, (m, p)."""
        return Whitened(self.structure, self.whiteners).slopes(self.v)

    def without_derivatives(self) -> None:
        """Forget what has a row for every reading and a column for every unknown; it is computed again when asked for.

        For fits that are kept to be compared, and may never be asked again: tens of megabytes each on long records.
        """
        self.structure.without_slopes()
        for name in ("J", "basis"):
            self.__dict__.pop(name, None)

    @cached_property
    def system(self) -> System:
        """Refitted system."""
        return self.structure.system(self.v)

    @property
    def n_readings(self) -> int:
        """Readings in all records."""
        return self.structure.n_readings

    @cached_property
    def basis(self) -> Array:
        """Orthonormal basis (m, r) of what the unknowns can explain."""
        return orthonormal(self.J[:, ~self.structure.at_warmest(self.v)], _FLAT)

    @cached_property
    def rest(self) -> Array:
        """Whitened residual that the unknowns cannot explain, (m,)."""
        return self.project(self.z)

    def project(self, columns: Array) -> Array:
        """Remove from columns what the unknowns can explain.

        Parameters
        ----------
        columns : ndarray, shape (m, ...)
            Whitened columns to project.

        Returns
        -------
        ndarray, shape (m, ...)
        """
        return columns - self.basis @ (self.basis.T @ columns)

    @property
    def rss(self) -> float:
        """Sum of squares of the whitened residuals, priors included."""
        return float(self.z @ self.z)

    @property
    def degrees_of_freedom(self) -> int:
        """Rows less missing readings and directions fitted."""
        return self.z.size - self.basis.shape[1] - sum(
            int(path.one.missing.sum()) for path in self.records if path.one.missing is not None)

    @property
    def variance(self) -> float:
        """Whitened variance [-]: 1 if the model and its noise are right."""
        return self.rss / self.degrees_of_freedom

    def whiten(self, per_record: Sequence[Array]) -> Array:
        """Whiten changes of the readings; the rows of the priors are 0.

        Parameters
        ----------
        per_record : sequence of ndarray, shape (n, n_sensors, k)
            One per record [K]; (2 n_b, m, k) for a frequency response.

        Returns
        -------
        ndarray, shape (m, k)
        """
        k = per_record[0].shape[2]
        rows = [w(r).reshape(-1, k) for w, r in zip(self.whiteners, per_record, strict=True)]
        return np.concatenate([*rows, np.zeros((self.z.size - self.n_readings, k))])

    def innovations(self) -> list[Array]:
        """Whitened residuals of every record, (n, n_sensors)."""
        out, row = [], 0
        for one in self.structure.data:
            out.append(self.z[row:row + one.readings.size].reshape(one.readings.shape))
            row += one.readings.size
        return out

    @cached_property
    def residuals(self) -> tuple[Array, ...]:
        """Free-run residual, measured - modelled, of every record (n, n_sensors) [K]; of a response (2 n_b, m)."""
        return tuple(path.residual for path in self.paths)

    @property
    def rms(self) -> float:
        """Root mean square of the free-run residual over all sensors of the records [K].

        Voltages count where no record holds a temperature; then it is in volts.

        Without any record: of the whitened residual of the responses, in standard deviations of their noise.
        """
        if not self.records:
            return rmse([self.z[:self.n_readings]])
        return rmse(path.residual[:, counted(self.system, path.one.sensors, self._read)] for path in self.records)

    @property
    def _read(self) -> list[str]:
        """Sensors of all records."""
        return [name for path in self.records for name in path.one.sensors]

    @property
    def records(self) -> tuple[LinearizedRecord, ...]:
        """Linearizations along the records, without the frequency responses."""
        return linearized_records(self.paths)

    @property
    def record_innovations(self) -> list[tuple[Array, LinearizedRecord]]:
        """Whitened residuals of every record with its linearization; without the frequency responses."""
        of = dict(zip(map(id, self.paths), self.innovations(), strict=True))
        return [(of[id(path)], path) for path in self.records]

    @property
    def drifting(self) -> tuple[str, ...]:
        """Ambients of which it is tried whether they swing or drift: none where they are held below the readings."""
        return () if self.structure.only_heated else self.unrecorded

    @property
    def unrecorded(self) -> tuple[str, ...]:
        """Ambients that some record does not hold."""
        return tuple(name for name in self.system.ambients
                     if any(name not in path.one.record.input_names for path in self.records))

    @property
    def takes_all_as_right(self) -> bool:
        """Whether no number of the system is fitted because it has no fit table."""
        return not self.structure.n_parameters and not self.structure.base.fit

    @property
    def unit(self) -> str:
        """Unit of `rms`."""
        if not self.records:
            return "standard deviations"
        return "K" if any(name in self.system.thermometers for name in self._read) else "V"

    @cached_property
    def span(self) -> float:
        """Range of the temperatures that the records hold [K]; 0 without any."""
        read = [path.one.readings[:, [name in self.system.thermometers for name in path.one.sensors]]
                for path in self.records]
        ends = [(float(np.nanmin(one)), float(np.nanmax(one))) for one in read if one.size]
        return max((high for _, high in ends), default=0.0) - min((low for low, _ in ends), default=0.0)

    def testable(self, tested: Iterable[Candidate]) -> list[Candidate]:
        """Candidates that these data may show, and that the fit does not have already.

        Parameters
        ----------
        tested : iterable of Candidate
            Candidates to choose from.

        Returns
        -------
        list of Candidate
        """
        taken = {candidate.key for candidate in self.structure.effects}
        return [candidate for candidate in tested if candidate.key not in taken
                and candidate.effect.span(self.system, candidate.where) <= self.span
                and not self.structure.hides(candidate)]

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the unknowns, (p, p), in the optimizer's coordinates, scaled by the whitened variance."""
        # of J, not of JᵀJ: its rounding would make variances negative where the data tell next to nothing
        scale, s, Vt = right_singular(self.J)
        root = (Vt[s > _FLAT * s[0]] / s[s > _FLAT * s[0], None]).T / scale[:, None]
        return np.asarray(root @ root.T * max(self.variance, 1.0), np.float64)

    @property
    def contradictions(self) -> tuple[str, ...]:
        """Priors that the records contradict, a sentence each: by more than six standard deviations.

        With the leverage h of a prior's row its residual r has the variance 1 - h, so that r / sqrt(1 - h) is the
        distance between the prior and what everything else says, in standard deviations of that distance.
        """
        ranges = self.structure.ranges
        known = np.flatnonzero(np.isfinite(ranges.sigma))
        rows = slice(self.n_readings, self.n_readings + known.size)
        free = 1.0 - np.sum(self.basis[rows] ** 2, axis=1)
        distance = np.abs(self.z[rows]) / np.sqrt(np.maximum(free, 1e-9) * max(self.variance, 1.0))
        values = ranges.values(self.v[:len(ranges.names)])
        return tuple(f"The prior of {ranges.names[i]} is contradicted by the records: {ranges.start[i]:.6g} ± "
                     f"{ranges.sigma[i]:.2g} declared, {values[i]:.6g} fitted, {far:.0f} standard deviations from what "
                     "the records say without it." for i, far in zip(known, distance, strict=True)
                     if far > _CONTRADICTED)

    def __str__(self) -> str:
        ranges = self.structure.ranges
        values = ranges.values(self.v[:len(ranges.names)])
        lines = [f"{name} = {value:.6g}" for name, value in zip(ranges.names, values, strict=True)]
        labels = [path.one.label for path in self.records]
        own = zip(self.structure.data, self.structure.gains(self.v), strict=True)
        gains = [g for one, g in own if one.n_sessions]
        lines += session_table(self.structure.sessions, labels, gains)
        lines.append(f"whitened variance {self.variance:.4g} (1: nothing is missing), rms {self.rms:.4g} {self.unit}")
        return "\n".join([*lines, str(self.levels), *self.contradictions, str(self.outcome)])

    def plot(self) -> NDArray[Any]:
        """Residuals of every record against time [K, V], of every response against frequency; returns the axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        _, axes = plt.subplots(len(self.paths), 1, squeeze=False, layout="constrained")
        for ax, path, r in zip(axes[:, 0], self.paths, self.residuals, strict=True):
            path.draw(ax, r)
            ax.set(title=path.one.label)
            ax.legend(fontsize="small")
        return axes[:, 0]
