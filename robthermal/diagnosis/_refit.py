"""Stage 2: refit a structure with its priors; the whitened residual and what is left after the nominal parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._fitting._ranges import NONE, Choice, chosen_ranges
from ..errors import Diverged, InputError, Outcome
from ..thermal import System
from ._along import Along, along
from ._descent import Descent, descend
from ._effect import Candidate
from ._frequency_data import Measured, ResponseData, as_measured
from ._frequency_model import AlongResponse, along_response
from ._frequency_whitening import ResponseWhitener
from ._glitches import without_glitches
from ._levels import Levels, refined
from ._noise_floor import NoiseFloor, noise_floor
from ._sessions import SessionGain, session_table, sessions_of
from ._structure import Structure, start_of, structure_of
from ._whitening import Whitener, whitener

Array = NDArray[np.float64]
Path = Along | AlongResponse
White = Whitener | ResponseWhitener
LIMIT = 40  # evaluations of a refit
_ENOUGH = 3e-5  # relative: a tenth of a unit of BIC on a thousand samples of three sensors
_FLAT = 1e-9  # relative size of a direction of J that counts as none
_CONTRADICTED = 6.0  # standard deviations of a prior
_ROUNDS = 3  # of filter and noise levels


@dataclass(frozen=True, eq=False)
class Refit:
    """A structure fitted to the records, with everything the tests need.

    Parameters
    ----------
    structure : Structure
        Unknowns.
    v : ndarray
        Their values.
    floor : NoiseFloor
        Where the noise levels came from.
    levels : Levels
        Factors on them, re-estimated within limits.
    paths : tuple of Along or AlongResponse
        Linearisation along every record; the modelled frequency response beside every measured one.
    whiteners : tuple of Whitener or ResponseWhitener
        One per record or frequency response.
    z : ndarray, shape (m,)
        Whitened residuals of all readings, then of the priors.
    J : ndarray, shape (m, p)
        Whitened derivatives.
    outcome : Outcome
        Codes "converged", "not_converged" (not ok).
    """

    structure: Structure
    v: Array
    floor: NoiseFloor
    levels: Levels
    paths: tuple[Path, ...]
    whiteners: tuple[White, ...]
    z: Array
    J: Array
    outcome: Outcome

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
        scale = np.linalg.norm(self.J, axis=0)
        U, s, _ = np.linalg.svd(self.J / np.where(scale > 0, scale, 1.0), full_matrices=False)
        return U[:, s > _FLAT * s[0]]

    @cached_property
    def rest(self) -> Array:
        """Whitened residual that the unknowns cannot explain, (m,)."""
        return self.project(self.z)

    def project(self, columns: Array) -> Array:
        """Remove from columns what the unknowns can explain.

        Parameters
        ----------
        columns : ndarray, shape (m, ...)
            Whitened.

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
            int(path.one.missing.sum()) for path in self.along if path.one.missing is not None)

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
        return tuple(path.one.readings - path.readings[:, path.one.columns] for path in self.paths)

    @property
    def rms(self) -> float:
        """Root mean square of the free-run residual over all sensors of the records [K].

        Without any record: of the whitened residual of the responses, in standard deviations of their noise.
        """
        if not self.along:
            return float(np.sqrt(np.mean(self.z[:self.n_readings] ** 2)))
        own = [r.ravel() for path, r in zip(self.paths, self.residuals, strict=True) if isinstance(path, Along)]
        return float(np.sqrt(np.mean(np.concatenate(own) ** 2)))

    @property
    def along(self) -> tuple[Along, ...]:
        """Linearisations along the records, without the frequency responses."""
        return tuple(path for path in self.paths if isinstance(path, Along))

    @property
    def unit(self) -> str:
        """Unit of `rms`."""
        return "K" if self.along else "standard deviations"

    def testable(self, tested: Iterable[Candidate]) -> list[Candidate]:
        """Candidates that these data may show.

        Parameters
        ----------
        tested : iterable of Candidate
            All.

        Returns
        -------
        list of Candidate
        """
        return [candidate for candidate in tested if not self.structure.hides(candidate)]

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the unknowns, (p, p), in the optimiser's coordinates, scaled by the whitened variance."""
        scale = np.linalg.norm(self.J, axis=0)
        scale[scale == 0] = 1.0
        J = self.J / scale
        inverse = np.linalg.pinv(J.T @ J, rcond=_FLAT**2, hermitian=True)
        return np.asarray(inverse / np.outer(scale, scale) * max(self.variance, 1.0), np.float64)

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
        labels = [path.one.label for path in self.along]
        gains = [g for path, g in zip(self.paths, self.structure.gains(self.v), strict=True) if isinstance(path, Along)]
        lines += session_table(self.structure.sessions, labels, gains)
        lines.append(f"whitened variance {self.variance:.4g} (1: nothing is missing), rms {self.rms:.4g} {self.unit}")
        return "\n".join([*lines, str(self.levels), *self.contradictions, str(self.outcome)])

    def plot(self) -> Any:
        """Residuals of every record against time [K], of every response against frequency; returns the axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        _, axes = plt.subplots(len(self.paths), 1, squeeze=False, layout="constrained")
        for ax, path, r in zip(axes[:, 0], self.paths, self.residuals, strict=True):
            path.draw(ax, r)
            ax.set(title=path.one.label)
            ax.legend(fontsize="small")
        return axes[:, 0]


def refit(system: System, records: Measured | Sequence[Measured], floor: NoiseFloor | None = None, *,
          parameters: Choice = None, operating_point: Mapping[str, float] | None = None,
          session_gain: SessionGain = False) -> Refit:
    """Refit the nominal parameters and the initial temperatures to the records, with their priors.

    Parameters
    ----------
    system : System
        Nominal. `sigma` in its fit table are the priors.
    records : Record, FrequencyResponse, or list of them
        Measured.
    floor : NoiseFloor, optional
        From `noise_floor`.
    parameters : iterable or mapping, optional
        As in `rt.calibrate`. Default: the fit table; without one, all parameters are taken as known.
    operating_point : mapping, optional
        For frequency responses: mean heaters [unit], module currents [A] and ambients [K] of the experiment; default
        off and nominal.
    session_gain : bool or mapping
        Whether every record has a gain of its own of every heater and module: True, with a prior of 5 %, or a mapping
        from input to the standard deviation of its gain [-].

    Returns
    -------
    Refit

    Raises
    ------
    InputError
        As `noise_floor`; a nominal model that runs away; priors that contradict the bounds.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> heater = np.repeat([4.0, 0.0, 6.0, 2.0], 50)
    >>> drive = rt.Record(sample_time=10.0, inputs=heater, outputs=np.zeros((200, 0)), input_names=["heater"],
    ...                   output_names=[])
    >>> run = rt.thermal.simulate(bar, drive)
    >>> noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> fit = rt.diagnosis.refit(bar, noisy, parameters={"lumps.bar.capacity": (10.0, 500.0)})
    >>> 0.8 < fit.variance < 1.2
    True
    """
    floor = noise_floor(system, records) if floor is None else floor
    data = without_glitches(system, as_measured(system, records, "records", operating_point), floor.noise)
    ranges = chosen_ranges(system, parameters) if parameters is not None or system.fit else NONE
    starts = [start_of(system, one) for one in data]
    structure = structure_of(system, ranges, data, starts, sessions_of(system, session_gain))
    n_unknown = structure.n_parameters + structure.n_own
    if structure.n_readings <= 2 * n_unknown:
        raise InputError(f"{structure.n_readings} readings for {n_unknown} unknowns", where="argument records",
                         expected="more than two readings per unknown", remedy="Measure longer, or fix parameters.")
    try:
        return fitted(structure, structure.start(ranges.start, []), floor, Levels(1.0, {}))
    except Diverged as error:
        raise InputError(f"the nominal model runs away: {error}", where="argument system",
                         remedy="Correct it first; nothing can be diagnosed on a model that leaves all data.") from None


def fitted(structure: Structure, v: Array, floor: NoiseFloor, levels: Levels) -> Refit:
    """Fit from v; filter and noise levels are renewed at the estimate, and the fit repeated."""
    for _ in range(_ROUNDS):
        paths, whiteners = filters(structure, v, floor, levels)
        found = minimised(structure, v, whiteners)
        v = found.v
        paths = paths_of(structure, v)
        new = _refined(paths, floor, levels)
        if new.close_to(levels):
            break
        levels = new
    paths, whiteners = filters(structure, v, floor, levels)
    z, J = whitened(structure, v, whiteners)
    return Refit(structure, v, floor, levels, paths, whiteners, z, J, _outcome(found))


def extended(fit: Refit, structure: Structure, v: Array, limit: int = LIMIT) -> Refit:
    """Fit another structure with the same filters, so that sums of squares can be compared."""
    found = minimised(structure, v, fit.whiteners, limit)
    return replace(fit, structure=structure, v=found.v, z=found.z, J=found.J, outcome=_outcome(found))


def relinearised(fit: Refit) -> Refit:
    """The same with linearisations of its own structure; `extended` keeps those of the structure it came from."""
    return replace(fit, paths=paths_of(fit.structure, fit.v))


def filters(structure: Structure, v: Array, floor: NoiseFloor, levels: Levels
            ) -> tuple[tuple[Path, ...], tuple[White, ...]]:
    """Linearisation and filter of every record; whitener of every response."""
    paths = paths_of(structure, v)
    return paths, tuple(path.one.white if isinstance(path, AlongResponse) else
                        whitener(path, *levels.of(path, floor), levels.slow(path, floor)) for path in paths)


def paths_of(structure: Structure, v: Array) -> tuple[Path, ...]:
    """Linearisation along every record; the modelled response beside every measured one."""
    return tuple(along_response(system, one) if isinstance(one, ResponseData) else run.path or along(system, one)
                 for system, one, run in zip(structure.systems(v), structure.data, structure.runs(v), strict=True))


def _refined(paths: Sequence[Path], floor: NoiseFloor, levels: Levels) -> Levels:
    """Noise levels of the records; those of responses come with them."""
    records = [path for path in paths if isinstance(path, Along)]
    if not records:
        return levels
    sensors = {name for path in records for name in path.one.sensors}
    return refined(records, replace(floor, noise={name: floor.noise[name] for name in floor.noise if name in sensors}),
                   levels)


def minimised(structure: Structure, v: Array, whiteners: Sequence[White], limit: int = LIMIT) -> Descent:
    """Gauss-Newton with fixed filters."""
    return descend(lambda v: whitened(structure, v, whiteners), v, structure.bounds, limit, _ENOUGH)


def whitened(structure: Structure, v: Array, whiteners: Sequence[White]) -> tuple[Array, Array]:
    """Whitened residuals of all readings, then of the priors, and the derivative of the model."""
    z, J = [], []
    for run, w in zip(structure.runs(v), whiteners, strict=True):
        both = w(np.concatenate([run.residual[..., None], run.slopes], axis=2)).reshape(-1, 1 + v.size)
        z.append(both[:, 0])
        J.append(both[:, 1:])
    prior, prior_J = structure.prior(v)
    return np.concatenate([*z, prior]), np.concatenate([*J, prior_J])


def _outcome(found: Descent) -> Outcome:
    if found.converged:
        return Outcome(True, "converged", f"Converged in {found.iterations} evaluations.")
    return Outcome(False, "not_converged", f"Stopped after {found.iterations} evaluations without converging. Narrow "
                   "the bounds, or give priors (sigma) to parameters the data do not determine.")
