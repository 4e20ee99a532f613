"""Stage 9: the input, within limits, that best separates what the records could not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import Diverged, InputError
from ...signals import Record
from ...thermal import simulate
from ..effects import Candidate
from ..evidence import score_candidates
from ..fit import Refit
from ..search import Decision, Entry, refit_set
from ._measurement import Measurement, instead
from ._separation import Pair
from ._trial_inputs import crossed, drawn
from ._trial_search import ALIKE, LONGEST, MOST, Search, Trial, search_of

Array = NDArray[np.float64]
_FULL = 4  # candidates for which all trials are made; more candidates, fewer trials
_HELPS = 20.0  # expected ΔBIC from which the advice is to apply it as it is: a probability of 0.87
_FASTER = 10.0  # of the sample time, where no input at the present one is enough
_FAST_TRIALS = 6
_FAST_ATTEMPTS = 2  # of them, before one has to be better than those at the present sample time
_FIRST = 5  # evaluations of the refit of an alias, which is as good as its twin already


@dataclass(frozen=True, eq=False)
class NextExperiment:
    """What to measure next.

    Parameters
    ----------
    record : Record
        Inputs to apply; its outputs are what the best candidate predicts [K].
    expected : float
        Expected ΔBIC between the closest two candidates that any input separates, from this record with the present
        ones, everything refitted.
    present : float
        The same if the present inputs were repeated, those of the first 2000 samples of a longer record.
    pairs : dict
        Expected ΔBIC of every pair, by labels.
    inseparable : tuple of (str, str)
        Pairs that neither a trial input nor the measurement separates: something else has to be measured.
    advice : str
        What to do, in words.
    measurement : Measurement or None
        A parameter to measure by itself besides; `expected` and `pairs` count on it.
    inputs : tuple of str
        Inputs to apply; the others of the record are ambients, as they were.
    """

    record: Record
    expected: float
    present: float
    pairs: dict[Pair, float]
    inseparable: tuple[Pair, ...]
    advice: str
    measurement: Measurement | None = None
    inputs: tuple[str, ...] = ()

    def __str__(self) -> str:
        return self.advice

    def plot(self) -> NDArray[Any]:
        """Plot the inputs to apply and the readings that the best candidate predicts; returns the matplotlib axes."""
        axes = self.record.select(inputs=self.inputs or None).plot()
        axes[0].figure.suptitle("Next experiment")
        axes[0].set_ylabel("inputs to apply [unit of the input]")
        axes[1].set_ylabel("predicted readings [K]")
        return axes


def next_experiment(entries: Sequence[Entry], *, trials: int = 10, seed: int = 0,
                    temperature: tuple[float, float] | None = None) -> NextExperiment:
    """Find an input that separates candidates.

    T-optimality (Hunter and Reiner 1965) with everything refitted: the smallest over the pairs of the expected gain of
    ΔBIC is made large over switched, stepped and multisine inputs within the limits, one input at a time or all
    together; a coordinate search then improves the best. Where that is not enough, some inputs are tried at a tenth of
    the sample time, and then resistances and Seebeck coefficients of modules as measured by themselves; at last the
    inputs are repeated, up to eight times the present number of samples.

    Parameters
    ----------
    entries : sequence of Entry
        Two candidates or more that the records cannot distinguish; the first six are separated.
    trials : int
        Inputs tried for up to four candidates, fewer for more; half as many again to improve the best. A search that
        has found plenty ends earlier.
    seed : int
        Of the random numbers.
    temperature : tuple of float, optional
        Lowest and highest temperature allowed of any lump [K], as the best candidate predicts it.

    Returns
    -------
    NextExperiment

    Raises
    ------
    InputError
        Fewer than two candidates; frequency responses only, and no noise declared of any sensor.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}],
    ...                 inputs={"heater": {"lump": "bar", "limits": (0.0, 8.0)}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> heater = np.repeat([4.0, 0.0, 6.0, 2.0], 50)
    >>> drive = rt.Record(sample_time=10.0, inputs=heater, outputs=np.zeros((200, 0)), input_names=["heater"],
    ...                   output_names=[])
    >>> run = rt.thermal.simulate(bar.with_parameters({"sensors.T.time_constant": 30.0}), drive)
    >>> noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> fit = rt.diagnosis.refit(bar, noisy)
    >>> short = rt.diagnosis.refit_short_list(fit, rt.diagnosis.score(fit), length=3)
    >>> plan = rt.diagnosis.next_experiment(short.entries[:2], trials=4)
    >>> plan.expected > plan.present
    True
    """
    search = search_of(entries[:MOST], temperature)
    rng = np.random.default_rng(seed)
    present = search.conditions.one
    repeated = search.at(present.record)
    tried = [repeated]
    count = max(trials * _FULL // max(len(search.hypotheses), _FULL), 1)
    for number in range(count):
        tried.append(search.at(drawn(present, search.limits, number, rng)))
        if search.plenty(tried):
            break
    else:
        for _ in range((count + 1) // 2 if search.limits else 0):
            tried.sort(key=Trial.worth)
            other = tried[int(rng.integers(len(tried)))]
            tried.append(search.at(crossed(tried[-1].record, other.record, search.limits, rng)))
            if search.plenty(tried):
                break
    if search.limits and not search.enough(tried):
        tried += _fast(search, max(trial.worth(LONGEST) for trial in tried), rng)
    return _plan(entries, search, repeated, tried)


def _fast(search: Search, slow: float, rng: np.random.Generator) -> list[Trial]:
    """Trials at a fraction of the sample time; few if they are no better than the slow ones."""
    tried: list[Trial] = []
    for number in range(_FAST_TRIALS):
        if number == _FAST_ATTEMPTS and max(trial.worth(LONGEST) for trial in tried) <= slow:
            break
        tried.append(search.at(drawn(search.conditions.one, search.limits, number, rng, _FASTER)))
    return tried


def rivals(decision: Decision) -> tuple[Entry, ...]:
    """Best candidate and everything the records cannot distinguish from it, exact aliases refitted too."""
    best = decision.best
    if best is None:
        return ()
    entries = [best, *decision.contenders]
    known = {entry.candidate.key for entry in entries}
    for entry in tuple(entries):
        for alias in entry.aliases:
            if alias.key not in known and len(entries) < MOST:
                known.add(alias.key)
                entries += _alias(decision.before, alias, entry)
    return tuple(entries)


def _alias(before: Refit, alias: Candidate, entry: Entry) -> list[Entry]:
    """An alias refitted; with the same times as the effect it is an alias of, where both have the same."""
    scores = score_candidates(before, [alias])
    if not scores.candidates:
        return []
    candidates, sizes, near = scores.candidates, scores.size.tolist(), before
    if alias.effect.paired:
        (candidates, sizes), near = _alike(before, alias, entry), entry.fit
    try:
        found = refit_set(before, candidates, sizes, near, _FIRST)
    except (Diverged, InputError):
        return []
    return [Entry(found.candidates[0], found.fit, found.delta_bic, float(scores.p_value[0]))]


def _alike(before: Refit, alias: Candidate, entry: Entry) -> tuple[tuple[Candidate], list[float]]:
    """A sine with the period and phase of the one it is an alias of, and the size that changes the readings as much."""
    values = dict(entry.found)
    size = values.pop(entry.candidate.effect.size.name)
    pair = [replace(candidate, shape=values) for candidate in (alias, entry.candidate)]
    own, other = before.whiten([path.columns(pair) for path in before.paths]).T
    return (pair[0],), [size * float(own @ other) / float(own @ own)]


def _clearest(tried: Sequence[Trial], times: int) -> list[Trial]:
    """The best trial of every sample time, if so many times as long, and the best of those first."""
    of: dict[float, list[Trial]] = {}
    for trial in tried:
        if trial.pairs:
            of.setdefault(trial.record.sample_time, []).append(trial)
    best = [max(trials, key=lambda one: one.worth(times)) for trials in of.values()]
    return sorted(best, key=lambda one: -one.worth(times))


def _plan(entries: Sequence[Entry], search: Search, repeated: Trial, tried: Sequence[Trial]) -> NextExperiment:
    if not any(trial.pairs for trial in tried):
        return NextExperiment(search.conditions.one.record, 0.0, 0.0, {}, (), "Every trial input leaves the limits or "
                              "runs away: set limits of the inputs, or start from another state.")
    clearest = [search.measured(trial) for trial in _clearest(tried, 1 if search.enough(tried) else LONGEST)]
    most = {pair: max(trial.pairs.get(pair, 0.0) for trial in (*tried, *clearest)) for pair in clearest[0].pairs}
    apart = [pair for pair in most if most[pair] >= ALIKE]
    alike = tuple(pair for pair in most if most[pair] < ALIKE)
    best = _best(search, clearest, apart)
    expected, now = _expected(best, apart), _expected(repeated, apart)
    times = len(best.record) // len(search.conditions.one.record)
    record = simulate(search.system, best.record)
    named = {entry.candidate.label: entry.candidate for entry in entries}
    faster = best.record.sample_time < search.conditions.one.record.sample_time
    besides = _besides(best.record, faster, times, best.measurement)
    text = _advice(named, alike, apart, expected, now, besides)
    return NextExperiment(record, expected, now, best.pairs, alike, text, best.measurement,
                          tuple(search.limits))


def _expected(trial: Trial, apart: Sequence[Pair]) -> float:
    """Expected ΔBIC between the closest two candidates of these pairs."""
    return min((trial.pairs.get(pair, 0.0) for pair in apart), default=0.0)


def _best(search: Search, clearest: Sequence[Trial], apart: Sequence[Pair]) -> Trial:
    """The most informative trial, prolonged where that is worth its trouble."""
    best = clearest[0]
    for trial in clearest:
        if trial is best or trial.worth(LONGEST) > best.worth():
            best = max(best, search.prolonged(trial, _expected(trial, apart)), key=Trial.worth)
    return best


def _besides(record: Record, faster: bool, times: int, measurement: Measurement | None) -> str:
    """What more than other inputs the plan asks for."""
    asked = [f"sample every {record.sample_time:.3g} s"] if faster else []
    hours = len(record) * record.sample_time / 3600.0
    asked += [f"measure {times} times as many samples as before, {hours:.2g} h"] if times > 1 else []
    asked += [str(measurement)] if measurement is not None else []
    return f" Also {' and '.join(asked)}." if asked else ""


def _advice(named: Mapping[str, Candidate], alike: Sequence[Pair], apart: Sequence[Pair], expected: float,
            now: float, besides: str) -> str:
    text = []
    if apart and expected > _HELPS:
        text.append(f"Apply the inputs of this plan: expected ΔBIC {expected:.0f} between the closest two candidates "
                    f"that it separates (the present inputs once more: {now:.0f}).{besides}")
    elif apart:
        hints = {named[label].effect.separated_by for pair in apart for label in pair} - {""}
        text.append(f"The inputs of this plan separate them little (expected ΔBIC {expected:.1f}). "
                    f"What separates them: {'; '.join(sorted(hints))}.{besides}")
    if alike:
        labels = list(dict.fromkeys(label for pair in alike for label in pair))
        text.append(f"No input within the limits separates {' from '.join(labels)}. Measure something else: "
                    f"{instead(named[label] for label in labels)}.")
    return " ".join(text)
