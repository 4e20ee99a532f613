"""Fits to a log read otherwise: without effects, with those accepted, with one more.

Its values may be means over a step, or its commands may stand a row from where they act.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal, get_args

import numpy as np

from ..errors import Diverged, InputError
from ..fitting import rmse
from ..signals import Record, as_means, shift_inputs
from .data import commands, moves
from .evidence import promised, score
from .fit import NoiseScaling, Refit, fitted
from .search import Accepted, refit_short_list, revised

Means = Literal["after", "readings"]
Reading = Literal["after", "readings", "earlier", "later"]
Refitted = Callable[[Sequence[Record]], Refit]
CLEARLY = 0.5  # of a mean square: what is clearly less
MEANS = get_args(Means)
_READINGS = get_args(Reading)
_ROWS: dict[Reading, int] = {"earlier": -1, "later": 1}  # that commands move


@dataclass(frozen=True, eq=False)
class ReadAs:
    """A fit to the records read otherwise.

    Parameters
    ----------
    fit : Refit
        Fit with no, some or all effects.
    how : {"after", "readings", "earlier", "later"}
        Which means the values are, or by a row earlier or later than theirs commands act.
    plain : Refit
        Fit without effects to the records read so.
    """

    fit: Refit
    how: Reading
    plain: Refit

    @property
    def square(self) -> float:
        """Mean square of the free-run residual [K²]."""
        return square(self.fit)

    @property
    def late(self) -> float:
        """How many steps the means are late or early, the largest of all records [-]."""
        structure = self.fit.structure
        return max(abs(structure.sessions.late(g)) for g in structure.gains(self.fit.v))

    @property
    def labels(self) -> tuple[str, ...]:
        """Effects in it."""
        return tuple(candidate.label for candidate in self.fit.structure.effects)


def read_otherwise(records: Sequence[Record], refitted: Refitted, found: Refit, alike: float, fewer: bool
                   ) -> list[ReadAs]:
    """Fits to the records read otherwise without effects, with those of another fit, and with every part of these.

    Effects that made up for means are not needed beside them: a part of them then does as well. Nor is a row worth
    anything by itself where lags are missing: these hide commands that are logged late.

    Parameters
    ----------
    records : sequence of Record
        Rows as they stand in the log.
    refitted : callable
        Fits the nominal system to other records.
    found : Refit
        Fit to the records as readings at their stamps.
    alike : float
        Mean square of a fit as good as that [K²]: parts of the effects are tried where all of them leave no more.
    fewer : bool
        Whether only fits with fewer effects are asked for.
    """
    fits = []
    system = found.structure.base
    for how in _READINGS if any(moves(system, one) for one in records) else MEANS:
        try:
            plain = refitted([_read(one, how, commands(system, one)) for one in records])
        except (Diverged, InputError):  # as means they would be too short, or lead where the model runs away
            continue
        fits += [ReadAs(fit, how, plain) for fit in (plain, *_with_effects(plain, found, alike, fewer))]
    return fits


def _with_effects(plain: Refit, found: Refit, alike: float, fewer: bool) -> list[Refit]:
    """The fit with all effects of another one, and with every part of these where all of them explain as much."""
    effects = len(found.structure.effects)
    whole = list(with_some(plain, found, effects)) if effects > fewer else []
    if whole and square(whole[0]) <= alike:
        return whole + [fit for n in range(1, effects) for fit in with_some(plain, found, n)]
    return whole


def _read(record: Record, how: Reading, sent: Sequence[str]) -> Record:
    """A record with its rows read otherwise; temperatures of ambients are readings, no commands."""
    if how == "after" or how == "readings":
        return as_means(record, how)
    return shift_inputs(record, _ROWS[how], sent)


def with_one_effect(plain: ReadAs, names: Sequence[str] | None, enough: float) -> ReadAs | None:
    """The fit with the effect that scores best beside means, if it promises to leave no more than enough.

    Parameters
    ----------
    plain : ReadAs
        Fit without effects.
    names : sequence of str or None
        Effects to try; None for the whole catalog.
    enough : float
        Mean square of the residual [K²].
    """
    fit = plain.fit
    try:
        scores = score(fit, names)
        least = min((promised(fit, scores, i) for i in scores.order), default=fit.rss)
        if least * plain.square > enough * fit.rss:
            return None
        entries = refit_short_list(fit, scores, length=1).entries
    except (Diverged, InputError):  # a model that runs away explains nothing
        return None
    return ReadAs(_of_its_own(plain.fit, entries[0].fit), plain.how, plain.fit) if entries else None


def stands(answer: ReadAs, rounds: Sequence[Accepted], names: Sequence[str] | None) -> bool:
    """Whether the same effects are chosen where the log is read otherwise, each again beside the others.

    Of a set of alternatives one is enough: the other reading may tell between them.

    Parameters
    ----------
    answer : ReadAs
        Fit with these effects.
    rounds : sequence of Accepted
        What was accepted with the log as it stands.
    names : sequence of str or None
        Effects to try; None for the whole catalog.
    """
    start = tuple(Accepted(answer.plain, best=replace(round_.best, fit=answer.fit)) for round_ in rounds)
    try:
        again, _ = revised(start, answer.plain, names)
    except (Diverged, InputError):  # a model that runs away chooses nothing
        return False
    sets, chosen = ([{one.key for entry in (round_.best, *round_.contenders)
                      for one in (entry.candidate, *entry.aliases)} for round_ in some] for some in (rounds, again))
    return len(chosen) == len(sets) and all(any(one & other for other in chosen) for one in sets)


def simplest(fits: Sequence[ReadAs], most: float) -> ReadAs | None:
    """The fit with the fewest effects that leaves no more than this; of several the best.

    Parameters
    ----------
    fits : sequence of ReadAs
        Fits to choose from.
    most : float
        Mean square of the residual [K²].
    """
    good = [one for one in fits if one.square <= most]
    return min(good, key=lambda one: (len(one.labels), one.square)) if good else None


def square(fit: Refit, n: int | None = None) -> float:
    """Mean square of the free-run residual on the first samples of every record [K²], the very first left out.

    That one tells of the time before the record: a mean over it, or a lag that was in motion.

    Parameters
    ----------
    fit : Refit
        Fit to records.
    n : int, optional
        Number of samples; default all.
    """
    return rmse([path.residual[1:n] for path in fit.records]) ** 2


def with_some(plain: Refit, found: Refit, n: int) -> Iterator[Refit]:
    """The fit with n effects of another one, in all choices, each from where it is there.

    Parameters
    ----------
    plain : Refit
        Fit without effects.
    found : Refit
        Fit with effects.
    n : int
        How many of its effects.
    """
    effects, quantities = found.structure.effects, found.structure.quantities(found.v)
    for places in combinations(range(len(effects)), n):
        values = [quantities[i] for i in places]
        try:
            structure = plain.structure.with_effects(tuple(effects[i] for i in places))
            if len(structure.data) == len(found.structure.data):
                v = structure.carried(found.structure, found.v, values)
            else:
                v = structure.start(plain.structure.ranges.values(plain.v[:structure.n_parameters]), values)
            yield fitted(structure, np.clip(v, *structure.bounds), plain.floor, NoiseScaling(1.0, {}))
        except (Diverged, InputError):  # an effect upon one that is left out, or a model that runs away
            continue


def _of_its_own(plain: Refit, other: Refit) -> Refit:
    """A fit beside the filters of another one, with its own."""
    return fitted(other.structure, other.v, plain.floor, NoiseScaling(1.0, {}))
