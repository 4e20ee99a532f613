"""Ambients that a record does not hold: an unknown of every record, beside its session gains."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...thermal import System
from ..data import RecordData, records_of, warmest_rooms
from ._refit import Refit
from ._sessions import Sessions

SIGMA = 5.0  # K: how far a room may be from what the system says


@dataclass(frozen=True)
class FoundAmbient:
    """Temperature of an ambient that a record does not hold, as the readings of that record say it.

    Parameters
    ----------
    ambient : str
        Name of the ambient in the system.
    record : str
        Name of the record.
    value, std : float
        Estimate, and its standard deviation: that of the prior, 5 K, where the readings say nothing [K].
    declared : float
        Temperature that the system says [K], the center of the prior.
    warmest : float
        Temperature [K] that it cannot exceed beside a machine that is only heated; infinite where nothing is known.
    """

    ambient: str
    record: str
    value: float
    std: float
    declared: float
    warmest: float = math.inf


def with_unknown_ambients(sessions: Sessions, system: System, records: Sequence[RecordData],
                          common: Collection[str] = ()) -> Sessions:
    """Sessions whose ambients are unknown where no record holds them.

    Parameters
    ----------
    sessions : Sessions
        Gains of the records.
    system : System
        Nominal system; its temperatures are the centers of the priors.
    records : sequence of RecordData
        Records of all sessions.
    common : collection of str
        Numbers of the system that are fitted to all records at once: an ambient among them is no record's own.
    """
    names = [name for name in system.ambients if f"ambients.{name}.temperature" not in common
             and any(name not in one.record.input_names for one in records)]
    return replace(sessions, inputs=(*sessions.inputs, *names),
                   numbers=(*sessions.numbers, *(f"ambients.{name}.temperature" for name in names)),
                   sigma=(*sessions.sigma, *(SIGMA for _ in names)))


def found_ambients(fit: Refit) -> tuple[FoundAmbient, ...]:
    """Ambients that were unknowns of the records, as found.

    Parameters
    ----------
    fit : Refit
        Fit to the records.
    """
    structure = fit.structure
    sessions, std = structure.sessions, np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))
    of = {f"ambients.{name}.temperature": name for name in structure.base.ambients}
    sized = ([g for one, g in zip(structure.data, structure.gains(v), strict=True) if one.n_sessions]
             for v in (fit.v, std))
    found = []
    records = records_of(structure.data)
    warmest = warmest_rooms(structure.base, records)
    for one, most, values, deviations in zip(records, warmest, *sized, strict=True):
        for number, sigma, value, deviation in zip(sessions.numbers, sessions.sigma, values, deviations, strict=True):
            name = of.get(number)
            if name is not None and name not in one.record.input_names:
                declared = structure.base.ambients[name].temperature
                found.append(FoundAmbient(name, one.label, declared + sigma * float(value), sigma * float(deviation),
                                          declared, most))
    return tuple(found)


def too_warm(fit: Refit, beyond: float = 0.0) -> bool:
    """Whether an ambient that was not recorded comes out warmer than a machine can have that is only heated.

    Parameters
    ----------
    fit : Refit
        Fit to the records, with ambients free.
    beyond : float
        By how much at least [K].
    """
    return not fit.structure.only_heated and any(one.value > one.warmest + beyond for one in found_ambients(fit))
