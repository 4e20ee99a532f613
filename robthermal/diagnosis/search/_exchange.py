"""Effects that only together can be exchanged for others: a lag of all sensors for one of all heaters, say.

Each was chosen beside the other. Beside a late sensor the other late thermometer is a late sensor too, and beside a
late heater a late heater: every single exchange is excluded, and both pairs explain the records as well. Where one
heater alone moves, its lag does what equal lags of all sensors do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from ...errors import Diverged, InputError
from ..data import DataSet
from ..effects import Candidate, candidates
from ..evidence import BIC_GAP, negative_log_predictive_density
from ..fit import Refit, extended
from ._decide import Accepted
from ._joint_sets import bic
from ._short_list import Entry

_TRIED = 2  # rivals of either effect
_LATE_HEATER, _LATE_SENSOR = "input_lag", "sensor_lag"


def with_exchanged(rounds: tuple[Accepted, ...], fit: Refit, data: Sequence[DataSet],
                   names: Sequence[str] | None = None) -> tuple[Accepted, ...]:
    """List beside every effect what takes its place in a set that is as good, with another effect exchanged as well.

    Parameters
    ----------
    rounds : tuple of Accepted
        In the order of the effects of the fit.
    fit : Refit
        Fit with these effects.
    data : sequence of DataSet
        Validation data, which no fit has seen; none are needed.
    names : sequence of str, optional
        Effects that may be named; default the whole catalog.
    """
    out = list(rounds)
    for pair in combinations(range(len(rounds)), 2):
        tried = [both for both in product(*(_rivals(rounds[place]) for place in pair))
                 if not all(_listed(out[place], entry) for place, entry in zip(pair, both, strict=True))]
        for both in _as_good(fit, tried, pair, data):
            for place, entry in zip(pair, both, strict=True):
                out[place] = _with(out[place], entry)
    for place, round_ in enumerate(rounds):
        if round_.best.candidate.effect.name == _LATE_HEATER and (names is None or _LATE_SENSOR in names):
            for entry in _late_sensors(round_.best, place, fit, data):
                out[place] = _with(out[place], entry)
    return tuple(out)


def _late_sensors(late: Entry, place: int, fit: Refit, data: Sequence[DataSet]) -> list[Entry]:
    """Lags of all thermometers in the place of a late heater, where they explain all records as well."""
    if not _moves_alone(fit, late.candidate.where[0]):
        return []
    others = [candidate.key for i, candidate in enumerate(fit.structure.effects) if i != place]
    sensors = [replace(one, shape={}) for one in fit.testable(candidates(fit.structure.base, [_LATE_SENSOR]))
               if one.key not in others]
    if len(sensors) < 2:  # one alone is a rival like any other
        return []
    effects, values = list(fit.structure.effects), list(fit.structure.quantities(fit.v))
    effects[place:place + 1], values[place:place + 1] = sensors, [late.found] * len(sensors)
    new = _refitted(fit, effects, values)
    if new is None or not _explains(fit, [new], data)[0]:
        return []
    return [replace(late, candidate=sensor, fit=new, twins=()) for sensor in sensors]


def _with(round_: Accepted, entry: Entry) -> Accepted:
    """The round with one more contender."""
    if _listed(round_, entry):
        return round_
    left = tuple(one for one in round_.ruled_out if one.candidate.key != entry.candidate.key)
    return replace(round_, contenders=(*round_.contenders, entry), ruled_out=left)


def _rivals(round_: Accepted) -> list[Entry]:
    """What came nearest to an effect, whether the records exclude it in its place alone or not."""
    known = {round_.best.candidate.key: round_.best}
    for entry in sorted((*round_.contenders, *round_.ruled_out, *round_.beaten), key=lambda one: -one.delta_bic):
        known.setdefault(entry.candidate.key, entry)
    return list(known.values())[1:1 + _TRIED]


def _listed(round_: Accepted, entry: Entry) -> bool:
    return any(one.candidate.key == entry.candidate.key for one in round_.contenders)


def _moves_alone(fit: Refit, heater: str) -> bool:
    """Whether no other heater or module changes in any record."""
    others = {*fit.system.inputs, *fit.system.modules} - {heater}
    return bool(fit.records) and not any(np.ptp(path.one.record[name]) for path in fit.records
                                         for name in others & set(path.one.record.input_names))


def _as_good(fit: Refit, tried: Sequence[tuple[Entry, ...]], pair: tuple[int, int], data: Sequence[DataSet]
             ) -> list[tuple[Entry, ...]]:
    """Exchanges of two effects after which all records are explained as well, with the fit after them."""
    refitted = [(both, new) for both in tried if (new := _exchanged(fit, pair, both)) is not None]
    alike = _explains(fit, [new for _, new in refitted], data)
    return [tuple(replace(entry, fit=new) for entry in both)
            for (both, new), as_well in zip(refitted, alike, strict=True) if as_well]


def _explains(fit: Refit, others: Sequence[Refit], data: Sequence[DataSet]) -> list[bool]:
    """Whether other fits explain the training records, and with them the validation records, as well as one does."""
    behind = [bic(other) - bic(fit) for other in others]
    near = [i for i, gap in enumerate(behind) if gap < BIC_GAP]
    if data and near:
        own, *densities = negative_log_predictive_density([fit, *(others[i] for i in near)], fit, data)
        near = [i for i, density in zip(near, densities, strict=True) if density + behind[i] - own < BIC_GAP]
    return [i in near for i in range(len(others))]


def _exchanged(fit: Refit, pair: tuple[int, int], both: tuple[Entry, ...]) -> Refit | None:
    """The fit with two effects exchanged."""
    effects, values = list(fit.structure.effects), list(fit.structure.quantities(fit.v))
    for place, entry in zip(pair, both, strict=True):
        effects[place], values[place] = entry.candidate, entry.found
    return _refitted(fit, effects, values)


def _refitted(fit: Refit, effects: Sequence[Candidate], values: Sequence[dict[str, float]]) -> Refit | None:
    """Other effects with the same filters; None where two are one, or no simulation survives."""
    if len({effect.key for effect in effects}) < len(effects):
        return None
    try:
        structure = fit.structure.with_effects(tuple(effects))
        return extended(fit, structure, structure.carried(fit.structure, fit.v, values))
    except (Diverged, InputError):
        return None
