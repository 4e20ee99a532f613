"""Stage 5: refit the best candidates together with the nominal parameters, and compare them by ΔBIC."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._drawing import axes_for
from ...errors import Diverged, InputError
from ..effects import Candidate
from ..evidence import BIC_GAP, Scores, Twin, promised
from ..fit import Refit, extended
from ._implausible import implausible
from ._periods import on_all_records
from ._ramp import as_ramp
from ._scan import retried, scanned
from ._starts import BEHIND, Origin, elsewhere, in_reach, started

Array = NDArray[np.float64]
Key = tuple[str, tuple[str, ...]]
LENGTH = 7
_FIRST = 2  # evaluations before those out of reach are dropped
_LAST = 15  # more evaluations, for the others
_PROMISED = 0.1  # of the best ΔBIC reached: below it, a candidate's linearization would have to be very wrong
_LIKELY = 0.5  # of the best ΔBIC reached: promised by a candidate that may well get there
_GAINED = 0.1  # of what is left of the promise, by a few more evaluations
_NEAR = 0.7  # of the best ΔBIC: from another time constant it may be the best
_LARGE = 1.5  # whitened variance
_MOST = 0.7  # of the excess sum of squares: one of three equal effects removes about a third


@dataclass(frozen=True, eq=False)
class Entry:
    """A candidate refitted.

    Parameters
    ----------
    candidate : Candidate
        What was added last.
    fit : Refit
        Fit with the candidate.
    delta_bic : float
        N log(RSS₀/RSS) - dim log N against the structure without it: above 10 is very strong.
    p_value : float
        Family-wise, from its score.
    twins : tuple of Twin
        Effects with the same change of every reading, whether their size is possible or not.
    """

    candidate: Candidate
    fit: Refit
    delta_bic: float
    p_value: float
    twins: tuple[Twin, ...] = ()

    @property
    def aliases(self) -> tuple[Candidate, ...]:
        """Exact aliases whose own size is possible, linearized or at the size found here: no conductance below zero."""
        if not self.twins:
            return ()
        size = self.found[self.candidate.effect.size.name]
        return tuple(twin.candidate for twin in self.twins if twin.possible_beside(size))

    @property
    def _place(self) -> int:
        return [c.key for c in self.fit.structure.effects].index(self.candidate.key)

    @property
    def found(self) -> dict[str, float]:
        """Value of every quantity; their deviations cost derivatives of all readings."""
        return self.fit.structure.quantities(self.fit.v)[self._place]

    @property
    def values(self) -> dict[str, tuple[float, float]]:
        """Value and standard deviation of every quantity."""
        return quantities_of(self.fit, self._place)

    @property
    def converged(self) -> bool:
        """Whether the refit converged."""
        return self.fit.outcome.ok


@dataclass(frozen=True, eq=False)
class ShortList:
    """Refitted candidates, the best first.

    Parameters
    ----------
    before : Refit
        Without any of them.
    entries : tuple of Entry
        Refitted candidates in the order of ΔBIC.
    failed : dict
        Candidates whose refit failed, with the reason.
    """

    before: Refit
    entries: tuple[Entry, ...]
    failed: dict[Key, str]

    def __str__(self) -> str:
        lines = [f"{'candidate':<38} {'ΔBIC':>10} {'p':>9}  values"]
        for entry in self.entries:
            values = ", ".join(f"{name} {value:.4g} ± {std:.2g}" for name, (value, std) in entry.values.items())
            lines.append(f"{entry.candidate.label:<38} {entry.delta_bic:>10.1f} {entry.p_value:>9.2g}  {values}")
        lines += [f"{name}({', '.join(where)}): {why}" for (name, where), why in self.failed.items()]
        return "\n".join(lines)

    def plot(self, ax: Any = None) -> Any:
        """Bars of ΔBIC; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        ax.barh([entry.candidate.label for entry in self.entries], [entry.delta_bic for entry in self.entries])
        ax.axvline(BIC_GAP, color="black", linewidth=0.7)
        ax.invert_yaxis()
        ax.set(xlabel="ΔBIC [-]")
        return ax


def refit_short_list(fit: Refit, scores: Scores, *, length: int = LENGTH, tried: Key | None = None) -> ShortList:
    """Refit the candidates with the best scores.

    Parameters
    ----------
    fit : Refit
        Without any of them.
    scores : Scores
        Of all candidates on it.
    length : int
        How many to refit.
    tried : tuple, optional
        Key of a candidate that has been tried with other time constants before.

    Returns
    -------
    ShortList

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> heater = np.repeat([4.0, 0.0, 6.0, 2.0], 50)
    >>> drive = rt.Record(sample_time=10.0, inputs=heater, outputs=np.zeros((200, 0)), input_names=["heater"],
    ...                   output_names=[])
    >>> run = rt.thermal.simulate(bar.with_parameters({"sensors.T.time_constant": 30.0}), drive)
    >>> noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> fit = rt.diagnosis.refit(bar, noisy)
    >>> best = rt.diagnosis.refit_short_list(fit, rt.diagnosis.score(fit), length=3).entries[0]
    >>> best.candidate.label, round(best.values["time_constant"][0])
    ('sensor_lag(T)', 30)
    """
    scores = on_all_records(fit, scores)
    picked: list[int] = []
    for i in scores.order:
        if len(picked) < length and not set(scores.aliases(i)) & set(picked):
            picked.append(i)
    origin, failed = Origin(fit), {}
    entries: list[Entry] = []
    doubtful: list[Entry] = []  # no name as they are now: none is given up for being behind them
    for i in picked:
        best = max((entry.delta_bic for entry in entries), default=0.0)
        promise = fit.n_readings * math.log(fit.rss / promised(fit, scores, i))
        if promise < _PROMISED * best - BEHIND:
            continue
        try:
            entry = entry_of(origin, scores.candidates[i], float(scores.size[i]), float(scores.p_value[i]),
                             scores.twins(i), best, promise)
            (doubtful if _refused(entry) else entries).append(entry)
        except (Diverged, InputError) as error:
            failed[scores.candidates[i].key] = str(error)
    entries = competitive(_from_the_best(origin, entries))
    done = _plausible(map(finished, [*entries, *doubtful]), failed)
    return ShortList(fit, tuple(_plausible(_reconsidered(fit, done, tried), failed)), failed)


def _refused(entry: Entry) -> str:
    """Why no machine shows this; empty if one may."""
    return implausible(entry.candidate, entry.fit, entry.found, entry.twins)


def _plausible(entries: Iterable[Entry], failed: dict[Key, str]) -> list[Entry]:
    """Those that a machine may show; why it cannot be the others is added to `failed`."""
    why = [(entry, _refused(entry)) for entry in entries]
    failed.update((entry.candidate.key, refused) for entry, refused in why if refused)
    return [entry for entry, refused in why if not refused]


def _from_the_best(origin: Origin, entries: list[Entry]) -> list[Entry]:
    """Entries, those of the best's effect at other places from its values too, where these shape the effect."""
    best = max(entries, key=lambda entry: entry.delta_bic, default=None)
    if best is None or len(best.candidate.effect.free) < 2:
        return entries
    out = []
    for entry in entries:
        behind = entry.candidate.effect.name == best.candidate.effect.name and not in_reach(entry.delta_bic,
                                                                                             best.delta_bic)
        new = elsewhere(origin, entry.candidate, best.found) if behind else None
        out.append(entry if new is None or new.rss >= entry.fit.rss else replaced(entry, new))
    return out


def beside(short: ShortList, found: Entry) -> ShortList:
    """The list with a candidate found before, refitted from there.

    Parameters
    ----------
    short : ShortList
        Candidates refitted on the same nominal system, with a network that may be too coarse.
    found : Entry
        Candidate as it was found with the network taken to be right.
    """
    try:
        keys = [candidate.key for candidate in found.fit.structure.effects]
        place = keys.index(found.candidate.key)
        structure = short.before.structure.with_effect(found.fit.structure.effects[place])
        v = structure.carried(found.fit.structure, found.fit.v, [found.fit.structure.quantities(found.fit.v)[place]])
        new = extended(short.before, structure, v, _LAST)
    except (Diverged, InputError):
        return short
    own = Entry(found.candidate, new, delta_bic(short.before, new), found.p_value, found.twins)
    others = [entry for entry in short.entries if entry.candidate.key != own.candidate.key
              or entry.delta_bic > own.delta_bic]
    if len(others) == len(short.entries) and any(entry.candidate.key == own.candidate.key for entry in others):
        return short
    return replace(short, entries=tuple(sorted([own, *others], key=lambda entry: -entry.delta_bic)))


def _reconsidered(before: Refit, entries: Iterable[Entry], tried: Key | None) -> list[Entry]:
    """By ΔBIC; the best and what comes near it from other times, too, unless all of them leave a large misfit."""
    ordered = sorted(entries, key=lambda entry: -entry.delta_bic)
    if not ordered or leaves_large_misfit(before, ordered[0]):
        return ordered
    ordered[0] = replaced(ordered[0], as_ramp(scanned(ordered[0].fit)))
    if ordered[0].delta_bic < BIC_GAP:
        return ordered
    near = min(ordered[0].delta_bic - BEHIND, _NEAR * ordered[0].delta_bic)
    again = [entry if entry.delta_bic <= near or entry.candidate.key == tried else
             replaced(entry, retried(entry.fit, before)) for entry in ordered]
    return sorted(again, key=lambda entry: -entry.delta_bic)


def leaves_large_misfit(before: Refit, best: Entry) -> bool:
    """Whether the best candidate leaves most of a large misfit: more of the same kind would only be curve fitting."""
    n = before.n_readings
    after = before.rss * math.exp(-best.delta_bic / n)
    return bool(after > _LARGE * n and after - n > _MOST * (before.rss - n))


def competitive(entries: Sequence[Entry]) -> list[Entry]:
    """Entries that further iterations could bring to the top: not those far behind already."""
    best = max((entry.delta_bic for entry in entries), default=0.0)
    return [entry for entry in entries if in_reach(entry.delta_bic, best)]


def finished(entry: Entry) -> Entry:
    """The same, iterated until it converges."""
    if entry.converged:
        return entry
    return replaced(entry, extended(entry.fit, entry.fit.structure, entry.fit.v, _LAST))


def replaced(entry: Entry, fit: Refit) -> Entry:
    """The same candidate with a better fit."""
    gain = fit.n_readings * math.log(entry.fit.rss / fit.rss)
    return replace(entry, fit=fit, delta_bic=entry.delta_bic + gain)


def entry_of(origin: Origin, candidate: Candidate, size: float, p_value: float,
             twins: tuple[Twin, ...] = (), best: float = 0.0, promise: float = 0.0) -> Entry:
    """Refit one candidate from the better of its starts; not to the end yet. Another has reached the `best` ΔBIC."""
    new = started(origin, candidate, size, best)
    if promise > _LIKELY * best:
        new = _into_reach(origin.fit, new, best, promise)
    if in_reach(delta_bic(origin.fit, new), best):
        new = extended(new, new.structure, new.v, _FIRST)
    else:
        new.without_derivatives()
    return Entry(new.structure.effects[-1], new, delta_bic(origin.fit, new), p_value, twins)


def _into_reach(fit: Refit, new: Refit, best: float, promise: float) -> Refit:
    """More evaluations of a candidate that promises about what the best has reached, as long as it gets nearer to it.

    Along a curved valley a few evaluations say little of where it ends.
    """
    reached = delta_bic(fit, new)
    while not in_reach(reached, best):
        further = extended(new, new.structure, new.v, _FIRST)
        gained = delta_bic(fit, further) - reached
        if gained < _GAINED * (promise - reached):
            break
        new, reached = further, reached + gained
    return new


def delta_bic(before: Refit, after: Refit) -> float:
    """N log(RSS₀/RSS) - dim log N, with the same filters."""
    n, dim = before.n_readings, after.structure.n_effects - before.structure.n_effects
    dim += sum(len(s.mean) for s in after.structure.starts) - sum(len(s.mean) for s in before.structure.starts)
    return n * math.log(before.rss / after.rss) - dim * math.log(n)


def quantities_of(fit: Refit, place: int) -> dict[str, tuple[float, float]]:
    """Value and standard deviation of every quantity of one effect; what is known has no deviation."""
    structure = fit.structure
    values = structure.quantities(fit.v)[place]
    at = structure.column_of(place)
    out = {name: (value, 0.0) for name, value in values.items()}
    for i, quantity in enumerate(structure.effects[place].effect.free):
        std = math.sqrt(float(fit.covariance[at + i, at + i]))
        value = values[quantity.name]
        out[quantity.name] = (value, std * value if quantity.lower > 0 else std)  # a logarithm's deviation is relative
    return {q.name: out[q.name] for q in structure.effects[place].effect.quantities}


def refiltered(before: Refit, after: Refit, entries: Sequence[Entry]) -> Iterable[Entry]:
    """Entries refitted with the filters of `after`, warm."""
    for entry in entries:
        new = extended(after, entry.fit.structure, entry.fit.v)
        yield Entry(entry.candidate, new, delta_bic(before, new), entry.p_value, entry.twins)
