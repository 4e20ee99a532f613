"""Unknowns of a refit: nominal parameters, quantities of the added effects, and what is every record's own.

A record's own are its initial temperatures and its session gains; a frequency response has none.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...fitting import COLDEST, HOTTEST, Initial, Ranges, started
from ...thermal import System
from ..data import DataSet, records_of
from ..effects import Candidate
from ..path import Linearized, Unknowns, linearize
from ._derived import STEP, with_quantities
from ._ends import Ends
from ._recent import Recent
from ._sessions import Sessions

Array = NDArray[np.float64]
_FARTHEST = 20.0  # standard deviations of an initial temperature
_STILL = 1e-6  # standard deviations from a bound
_COARSEST = 2.5  # times what is usual: a place off by more than half a lump belongs to another lump


@dataclass(eq=False)
class _Computed:
    """What has been computed at some unknowns."""

    paths: tuple[Linearized, ...]
    slopes: list[Array] | None = None


@dataclass(frozen=True, eq=False)
class Structure:
    """The nominal system with some effects; what may change in it, and where the priors are.

    Parameters
    ----------
    base : System
        Nominal system with its starting values.
    ranges : Ranges
        Nominal parameters that may change.
    data : tuple of DataSet
        Records and frequency responses.
    starts : tuple of Initial
        Prior of every record's initial temperatures.
    effects : tuple of Candidate
        What has been added.
    tolerance : float
        Of the simulation [K].
    sessions : Sessions
        Gains of their own that the records may have.
    coarse : tuple of ndarray, shape (n, n_sensors, k)
        Changes of the readings of every data set by which a finer network may differ, from `coarse_columns`; their
        sizes are unknowns common to all data, with the prior 0 ± 1. Empty: the network is taken to be right.
    only_heated : bool
        Whether unknown ambients are no warmer than `warmest_room`.
    ended : Ends
        Where descents ended, for all structures that come from one.
    """

    base: System
    ranges: Ranges
    data: tuple[DataSet, ...]
    starts: tuple[Initial, ...]
    effects: tuple[Candidate, ...] = ()
    tolerance: float = 1e-4
    sessions: Sessions = Sessions()
    coarse: tuple[Array, ...] = ()
    only_heated: bool = False
    ended: Ends = field(default_factory=Ends, repr=False)
    _last: Recent[_Computed] = field(default_factory=Recent, init=False, repr=False)
    _nominals: Recent[System] = field(default_factory=Recent, init=False, repr=False)

    @property
    def n_parameters(self) -> int:
        """Number of nominal parameters."""
        return len(self.ranges.names)

    @property
    def n_effects(self) -> int:
        """Number of quantities of all effects."""
        return sum(len(c.effect.free) for c in self.effects)

    def column_of(self, place: int) -> int:
        """Place among the unknowns of the first quantity, its size, of an effect.

        Parameters
        ----------
        place : int
            Place of the effect in `effects`.
        """
        return self.n_parameters + sum(len(c.effect.free) for c in self.effects[:place])

    @property
    def n_coarse(self) -> int:
        """Number of ways in which a finer network may differ."""
        return self.coarse[0].shape[2] if self.coarse else 0

    @property
    def n_common(self) -> int:
        """Number of unknowns common to all data: parameters, quantities of effects, what a finer network changes."""
        return self.n_parameters + self.n_effects + self.n_coarse

    @property
    def known(self) -> range:
        """Places of unknowns that other records tell: none, unless healthy ones were compared."""
        return range(0)

    @property
    def n_priors(self) -> int:
        """Number of rows that priors of nominal parameters add to the residuals."""
        return int(np.isfinite(self.ranges.sigma).sum())

    @property
    def n_readings(self) -> int:
        """Readings in all records; a frequency response counts two per complex number."""
        return sum(one.readings.size for one in self.data)

    @property
    def certainty(self) -> float:
        """Degrees of freedom of the sum of squares, per reading: below 1 where the noise is itself an estimate."""
        return sum(one.readings.size * one.certainty for one in self.data) / self.n_readings

    @property
    def n_starts(self) -> int:
        """Number of unknown initial temperatures in all records."""
        return sum(start.n_free for start in self.starts)

    @property
    def n_own(self) -> int:
        """Number of unknowns that belong to one record each: initial temperatures, then session gains."""
        return self.n_starts + self.sessions.n_free * sum(one.n_sessions for one in self.data)

    def quantities(self, v: Array) -> list[dict[str, float]]:
        """Quantities of every effect by name."""
        out, at = [], self.n_parameters
        for candidate in self.effects:
            q = dict(candidate.shape)
            for quantity in candidate.effect.free:
                q[quantity.name] = float(np.exp(v[at]) if quantity.lower > 0 else v[at])
                at += 1
            out.append(q)
        return out

    def start(self, parameters: Array, quantities: Sequence[dict[str, float]]) -> Array:
        """Unknowns from values; initial temperatures at the center of their priors."""
        coordinates = [np.log(q[quantity.name]) if quantity.lower > 0 else q[quantity.name]
                       for candidate, q in zip(self.effects, quantities, strict=True)
                       for quantity in candidate.effect.free]
        return np.concatenate([self.ranges.coordinates(parameters), coordinates, np.zeros(self.n_coarse + self.n_own)])

    def carried(self, other: Structure, v: Array, quantities: Sequence[dict[str, float]]) -> Array:
        """Unknowns at the parameters and initial temperatures of another structure; what it lacks, at its prior."""
        out = self.start(other.ranges.values(v[:other.n_parameters]), quantities)
        if self.n_coarse and self.n_coarse == other.n_coarse:
            out[self.n_common - self.n_coarse:self.n_common] = v[other.n_common - other.n_coarse:other.n_common]
        at = self.n_common
        for start, before, T in zip(self.starts, other.starts, other.temperatures(v), strict=True):
            known = dict(zip(before.names, T.tolist(), strict=True))
            for i, name in enumerate(start.names if start.n_free else ()):
                if name in known:
                    out[at + i] = (known[name] - start.mean[i]) / start.sigma[i]
            at += start.n_free
        n_gains = self.n_own - self.n_starts
        out[out.size - n_gains:] = v[v.size - n_gains:]
        return out

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Bounds of the unknowns."""
        lower, upper = [], []
        for candidate in self.effects:
            for quantity in candidate.effect.free:
                log = quantity.lower > 0
                lower.append(np.log(quantity.lower) if log else quantity.lower)
                upper.append(np.log(quantity.upper) if log else quantity.upper)
        away = np.tile(self.sessions.reach, sum(one.n_sessions for one in self.data))
        coldest, hottest = self._starts_within
        warmest = np.minimum(away, self._warmest) if self.only_heated else away
        q = self.ranges.coordinates
        wide = np.full(self.n_coarse, _COARSEST)
        return (np.concatenate([q(self.ranges.lower), lower, -wide, coldest, -away]),
                np.concatenate([q(self.ranges.upper), upper, wide, hottest, warmest]))

    @property
    def _starts_within(self) -> tuple[Array, Array]:
        """Bounds of the initial states, in standard deviations: no farther than a system accepts."""
        bounds = [start.within(COLDEST, HOTTEST, _FARTHEST) for start in self.starts]
        return np.concatenate([low for low, _ in bounds]), np.concatenate([high for _, high in bounds])

    @cached_property
    def _warmest(self) -> Array:
        return self.sessions.warmest(self.base, self.data if self.only_heated else ())

    def at_warmest(self, v: Array) -> NDArray[np.bool_]:
        """Which unknowns are ambients as warm as they can be: these hold still under a test."""
        others = np.full(v.size - self._warmest.size, np.inf)
        return np.asarray(v >= np.concatenate([others, self._warmest]) - _STILL)

    def system(self, v: Array) -> System:
        """Nominal system at these parameters with the effects added."""
        p = v[:self.n_parameters]  # derivatives by effects ask for the same ones
        system = self._nominals.of(p, lambda: self.ranges.applied(self.base, p)) if p.size else self.base
        for candidate, q in zip(self.effects, self.quantities(v), strict=True):
            system = candidate.effect.add(system, candidate.where, q)
        return system

    def temperatures(self, v: Array) -> list[Array]:
        """Initial temperatures of every record [K], of lumps, then lagged thermometers; of a response none."""
        out, at = [], self.n_common
        for start in self.starts:
            free = start.sigma * v[at:at + start.n_free] if start.n_free else 0.0
            out.append(start.mean + free)
            at += start.n_free
        return out

    def systems(self, v: Array) -> list[System]:
        """System of every record, with its initial temperatures and session gains; of a response, the common one."""
        system = self.system(v)
        return [self.sessions.applied(one.started(system, start, T), g)
                for one, start, T, g in zip(self.data, self.starts, self.temperatures(v), self.gains(v), strict=True)]

    def gains(self, v: Array) -> list[Array]:
        """Session gains of every record, in units of their priors; empty for a frequency response."""
        out, at = [], v.size - (self.n_own - self.n_starts)
        for one in self.data:
            n = self.sessions.n_free * one.n_sessions
            out.append(v[at:at + n])
            at += n
        return out

    def paths(self, v: Array) -> tuple[Linearized, ...]:
        """The model beside all data; the last few are kept: filters and noise change more often than unknowns."""
        return self._computed(v).paths

    def slopes(self, v: Array) -> list[Array]:
        """Derivatives (n, n_sensors, n_unknowns) of the modelled readings of all data sets."""
        moving, first = self.moving_slopes(v), self.in_coarse.start
        return moving if first == self.in_coarse.stop else [
            np.concatenate([slopes[..., :first], columns, slopes[..., first:]], axis=2)
            for slopes, columns in zip(moving, self.coarse, strict=True)]

    def moving_slopes(self, v: Array) -> list[Array]:
        """`slopes` without those that are the same everywhere, by what a finer network would change; kept too."""
        computed = self._computed(v)
        if computed.slopes is None:
            computed.slopes = [path.slopes(own) for path, own in zip(computed.paths, self._unknowns(v), strict=True)]
        return computed.slopes

    @property
    def in_coarse(self) -> slice:
        """Places of the unknowns of a finer network whose derivatives are the same everywhere: those of records."""
        first, only_records = self.n_common - self.n_coarse, len(records_of(self.data)) == len(self.data)
        return slice(first, self.n_common if only_records else first)

    def _computed(self, v: Array) -> _Computed:
        def compute() -> _Computed:
            paths = [linearize(system, one, self.tolerance, self.sessions.late(g))
                     for system, one, g in zip(self.systems(v), self.data, self.gains(v), strict=True)]
            if self.coarse:
                b = v[self.n_common - self.n_coarse:self.n_common]
                paths = [path.refined(columns, b) for path, columns in zip(paths, self.coarse, strict=True)]
            return _Computed(tuple(paths))

        return self._last.of(v, compute)

    def keep_only(self, v: Array) -> None:
        """Forget what was computed at other unknowns than these: megabytes for every fit to a long record.

        Parameters
        ----------
        v : ndarray
            Values of the unknowns.
        """
        self._last.keep_only(v)

    def without_slopes(self) -> None:
        """Forget derivatives: they are computed again where they are asked for."""
        for computed in self._last:
            computed.slopes = None

    def _unknowns(self, v: Array) -> Iterator[Unknowns]:
        """The unknowns as every data set sees them, without those whose derivatives are the same everywhere."""
        names, chain = self._chain(v)
        n, left_out = self.n_parameters + self.n_effects, self.in_coarse.stop - self.in_coarse.start
        coarse = slice(self.in_coarse.start, self.n_common - left_out)
        steps = STEP * np.concatenate([self.ranges.spread, np.maximum(np.abs(v[self.n_parameters:n]), self._typical)])
        at, gain_at = self.n_common - left_out, v.size - (self.n_own - self.n_starts) - left_out
        asked = np.delete(v, self.in_coarse)
        for one, start in zip(self.data, self.starts, strict=True):
            n_gains = self.sessions.n_free * one.n_sessions
            yield Unknowns(asked, self.system, steps, self.bounds, names, chain, slice(at, at + start.n_free), start,
                           slice(gain_at, gain_at + n_gains), self.sessions.numbers, self.sessions.sigma, coarse)
            at, gain_at = at + start.n_free, gain_at + n_gains

    @property
    def _typical(self) -> Array:
        """A small value of every effect's coordinate."""
        return np.array([1.0 if quantity.lower > 0 else quantity.typical for candidate in self.effects
                         for quantity in candidate.effect.free])

    def prior(self, v: Array) -> tuple[Array, Array]:
        """Priors' centers less the unknowns, in standard deviations, and the derivatives of the unknowns."""
        known = np.flatnonzero(np.isfinite(self.ranges.sigma))
        n_free = self.n_coarse + self.n_own
        first = self.n_parameters + self.n_effects
        values = self.ranges.values(v[:self.n_parameters])
        J = np.zeros((known.size + n_free, v.size))
        J[np.arange(known.size), known] = self.ranges.prior_slopes(values)[known]
        J[known.size:, first:] = np.eye(n_free)
        return -np.concatenate([self.ranges.prior(values), v[first:]]), J

    def at_rest(self) -> Structure:
        """The same where every record begins with settled lags."""
        return replace(self, starts=tuple(start.at_rest for start in self.starts))

    def with_effect(self, candidate: Candidate) -> Structure:
        """The same with one more effect; a new lump gets an initial temperature of its own."""
        return self.with_effects((*self.effects, candidate))

    def with_effects(self, effects: tuple[Candidate, ...]) -> Structure:
        """The same base with these effects."""
        system = self._with_typical(effects)
        if started(system) == started(self._with_typical(self.effects)):
            return replace(self, effects=effects)
        starts = tuple(one.initial(system, "free" if start.n_free else "measured")
                       for one, start in zip(self.data, self.starts, strict=True))
        return replace(self, effects=effects, starts=starts)

    def _with_typical(self, effects: tuple[Candidate, ...]) -> System:
        system = self.base
        for candidate in effects:
            system = candidate.add(system, candidate.effect.size.typical)
        return system

    def first(self, n: int) -> Structure:
        """The same on the first samples of every record.

        Parameters
        ----------
        n : int
            Number of samples.
        """
        data = tuple(one.first(n) for one in self.data)
        coarse = tuple(columns[:len(one.readings)] for columns, one in zip(self.coarse, data, strict=False))
        return replace(self, data=data, coarse=coarse)

    def hides(self, candidate: Candidate) -> str:
        """Why an effect is not tried on these data, known before they are looked at; empty if it is.

        Parameters
        ----------
        candidate : Candidate
            Effect at a place.
        """
        if any(part in self._added for part in candidate.where):
            return "it would act on a part that another effect has added"
        if any(map(candidate.displaces, self.effects)):
            return "its column heats another lump already"
        reasons = [one.hides(self.base, candidate) for one in self.data]
        return reasons[0] if all(reasons) else self.sessions.hides(candidate)

    @cached_property
    def _added(self) -> frozenset[str]:
        """Lumps and links that the effects have added."""
        system = self._with_typical(self.effects)
        before, after = ({*one.lumps, *(link.name for link in one.links)} for one in (self.base, system))
        return frozenset(after - before)

    def _chain(self, v: Array) -> tuple[list[str], Array]:
        """The system's numbers that depend on parameters and quantities, and their derivatives by these coordinates."""
        p, n = self.n_parameters, self.n_parameters + self.n_effects
        names = dict.fromkeys(self.ranges.flat)
        columns: list[dict[str, float]] = []
        slopes = self.ranges.slopes(self.ranges.values(v[:p]))
        for group, slope in zip(self.ranges.members, slopes, strict=True):
            columns.append({name: float(slope) for name in group})
        if self.n_effects:
            columns = with_quantities(lambda at: self.system(at).parameters, v, columns, self.bounds[1][:n])
        for column in columns:
            names |= dict.fromkeys(column)
        return list(names), np.array([[column.get(name, 0.0) for column in columns] for name in names]
                                     ).reshape(len(names), n)


def structure_of(system: System, ranges: Ranges, data: Sequence[DataSet], starts: Sequence[Initial],
                 sessions: Sessions) -> Structure:
    """Nominal structure, checked: the system must be small enough for derivatives."""
    if len(system.lumps) > 100:
        raise InputError(f"a network of {len(system.lumps)} lumps", where="argument system", expected="at most 100",
                         remedy="Reduce the model first (rt.thermal.reduce).")
    return Structure(system, ranges, tuple(data), tuple(starts), sessions=sessions)
