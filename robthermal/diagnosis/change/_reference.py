"""The reference: the model fitted to the records of a healthy machine, and what the next healthy record would show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import Diverged, InputError
from ...fitting import NONE, Choice, Ranges, chosen_ranges
from ...thermal import System
from ..data import (
    DataSet,
    Measured,
    NoiseEstimate,
    as_measured,
    noise_floor,
    records_of,
    responses_of,
    without_outliers,
)
from ..fit import (
    NoiseScaling,
    Refit,
    SessionGain,
    Sessions,
    Structure,
    extended,
    filters,
    fitted,
    relinearized,
    sessions_of,
    structure_of,
    with_late_means,
    with_unknown_ambients,
)
from ._held import Held, root_of
from ._scatter import ASSUMED, Scatter, scatter_of

Array = NDArray[np.float64]
_FILTERS = 2  # rounds: a filter is that of the estimate
_PINNED = 1e3  # times as certain as the scatter says: fixed, with the same unknowns
_WIDEST = 0.1  # relative scatter of a parameter from one new record to another
_OF_RECORD = (".temperature", ".initial")  # numbers that are each record's own
_FARTHEST = 6.0  # factor from its value within which a number stays that the fit table leaves out
_OF_MACHINE = (".capacity", ".conductance", ".natural.gain", ".conductance.value", ".seebeck.value",
               ".resistance.value")


@dataclass(frozen=True, eq=False)
class Reference:
    """Common fit to the reference records with the scatter of their parameters.

    Parameters
    ----------
    fit : Refit
        All reference records, one set of parameters.
    scatter : Scatter
        What differs from record to record.
    each : tuple of Refit
        Every reference record as if it were new: parameters held near those of a healthy day.
    listed : Ranges
        Parameters of the fit table, which come first among those of the fits; the others are the machine's numbers
        that the table leaves out, and scatter as well.
    """

    fit: Refit
    scatter: Scatter
    each: tuple[Refit, ...]
    listed: Ranges

    @property
    def whole(self) -> Array:
        """What a step of every listed parameter is relative to: it; the spread of its range, if that has signs."""
        ranges = self.listed
        center = np.abs(self.scatter.center[:len(ranges.names)])
        signed = (ranges.lower < 0.0) | (center == 0.0)
        return np.where(ranges.logarithmic, 1.0, np.where(signed, ranges.unit, center))

    @property
    def relative(self) -> dict[str, float]:
        """Scatter of every listed parameter from record to record, relative to it; to its range, if that has signs."""
        std = self.scatter.std[:len(self.listed.names)]
        return dict(zip(self.listed.names, map(float, std / self.whole), strict=True))


def reference_of(system: System, records: Measured | Sequence[Measured], new: Sequence[Measured], *,
                 parameters: Choice = None, noise: Mapping[str, float] | float | None = None,
                 session_gain: SessionGain = False, warmest: bool = False) -> Reference:
    """Fit the reference records, and measure how they differ.

    Parameters
    ----------
    system : System
        Nominal system of all records.
    records : Record or list of them
        Of the healthy machine.
    new : sequence of Record
        Of the day in question; only which ambients they hold is looked at.
    parameters, noise, session_gain
        As in `rt.diagnose`.
    warmest : bool
        Whether unknown ambients are no warmer than a machine that is only heated allows.
    """
    floor = noise_floor(system, records, noise=noise)
    data = without_outliers(system, as_measured(system, records, "reference"), floor.noise)
    later = as_measured(system, new, "records")
    if responses_of([*data, *later]):
        raise InputError("a frequency response is compared between two days", where="argument reference",
                         expected="records", remedy="Give the records themselves.")
    ranges = chosen_ranges(system, parameters) if parameters is not None or system.fit else NONE
    every = records_of([*data, *later])
    sessions = with_late_means(with_unknown_ambients(sessions_of(system, session_gain), system, every), every)
    starts = [one.initial(system, "free") for one in data]
    listed = _lasting(ranges)
    structure = structure_of(system, _with_others(listed, system), data, starts, sessions)
    structure = replace(structure, only_heated=warmest)
    try:
        start = np.clip(structure.start(structure.ranges.start, []), *structure.bounds)
        fit = fitted(structure, start, floor, NoiseScaling(1.0, {}))
    except Diverged as error:
        raise InputError(f"the nominal model runs away: {error}", where="argument system",
                         remedy="Correct it first; nothing can be diagnosed on a model that leaves all data.") from None
    fit = _declared(fit)
    scatter = scatter_of(fit)
    return Reference(fit, scatter, tuple(held(fit, scatter, [one], floor) for one in data), listed)


def held(fit: Refit, scatter: Scatter, data: Sequence[DataSet], floor: NoiseEstimate) -> Refit:
    """Fit to other records with the parameters held near those of a healthy day; noise levels of the reference.

    Parameters
    ----------
    fit : Refit
        Common fit to the reference records.
    scatter : Scatter
        What differs between them.
    data : sequence of DataSet
        Records to fit.
    floor : NoiseEstimate
        Noise of these records.
    """
    nominal = fit.structure
    values = np.clip(nominal.ranges.values(scatter.center), nominal.ranges.lower, nominal.ranges.upper)
    ranges = replace(nominal.ranges, start=values, sigma=np.full(values.size, np.inf))
    structure: Structure = Held(
        base=nominal.base.with_parameters(ranges.assigned(values)), ranges=ranges, data=tuple(data),
        starts=tuple(one.initial(nominal.base, "free") for one in data), tolerance=nominal.tolerance,
        sessions=_with_scatter(nominal.sessions, ranges, scatter) if len(data) > 1 else nominal.sessions,
        center=ranges.coordinates(values), root=root_of(scatter.next_one),
        only_heated=nominal.only_heated)
    wider = float(np.sqrt(scatter.inflation))
    levels = NoiseScaling(wider, dict.fromkeys(floor.noise, wider))
    v = np.clip(structure.start(values, []), *structure.bounds)
    for _ in range(_FILTERS):
        paths, whiteners = filters(structure, v, floor, levels)
        fitted_once = extended(Refit(structure, v, floor, levels, paths, whiteners, np.zeros(0), fit.outcome),
                               structure, v)
        structure, v = fitted_once.structure, fitted_once.v  # lags may have been settled at the start: fewer unknowns
    return relinearized(fitted_once)


def _with_scatter(sessions: Sessions, ranges: Ranges, scatter: Scatter) -> Sessions:
    """Sessions in which the parameters of every record scatter about those that all new records share."""
    relative = np.minimum(scatter.std / ranges.unit, _WIDEST)
    wide = np.where(ranges.logarithmic, relative * np.abs(ranges.start), relative * ranges.unit)
    own = [(name, float(width)) for group, width in zip(ranges.members, wide, strict=True) for name in group]
    return replace(sessions, inputs=(*sessions.inputs, *(name for name, _ in own)),
                   numbers=(*sessions.numbers, *(name for name, _ in own)),
                   sigma=(*sessions.sigma, *(width for _, width in own)))


def pinned(new: Refit) -> Refit:
    """The same records with the parameters of a healthy day as they are: what the unchanged model leaves of them.

    Parameters
    ----------
    new : Refit
        Fit from `held`, without any change.
    """
    structure = new.structure
    if not isinstance(structure, Held) or not structure.n_parameters:
        return new
    fixed = replace(structure, root=_PINNED * structure.root)
    v = np.concatenate([structure.center, new.v[structure.n_parameters:]])
    return relinearized(extended(new, fixed, v))


def _declared(fit: Refit) -> Refit:
    """The same fit with the noise as declared: what differs between the records has raised it."""
    levels = NoiseScaling(1.0, {})
    _, whiteners = filters(fit.structure, fit.v, fit.floor, levels)
    return relinearized(replace(extended(replace(fit, whiteners=whiteners), fit.structure, fit.v), levels=levels))


def _lasting(ranges: Ranges) -> Ranges:
    """Parameters of the machine: temperatures of the room and of the start belong to each record."""
    kept = [i for i, group in enumerate(ranges.members) if not any(name.endswith(_OF_RECORD) for name in group)]
    return Ranges(tuple(ranges.names[i] for i in kept), tuple(ranges.members[i] for i in kept), ranges.start[kept],
                  ranges.lower[kept], ranges.upper[kept], ranges.sigma[kept], ranges.logarithmic[kept])


def _with_others(listed: Ranges, system: System) -> Ranges:
    """With every other capacity, conductance and property of a module: known to the scatter of healthy days, not more.

    Without a fit table all numbers are taken to be right.
    """
    others = {name: value for name, value in system.parameters.items()
              if listed.names and value > 0 and name.endswith(_OF_MACHINE) and name not in listed.flat}
    value = np.array(list(others.values()), np.float64)
    return Ranges((*listed.names, *others), (*listed.members, *((name,) for name in others)),
                  np.r_[listed.start, value], np.r_[listed.lower, value / _FARTHEST],
                  np.r_[listed.upper, value * _FARTHEST], np.r_[listed.sigma, ASSUMED * value],
                  np.r_[listed.logarithmic, np.ones(value.size, np.bool_)])
