"""Stage 9: the input, within limits, that best separates what the records could not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from ..errors import Diverged, InputError
from ..signals import Record
from ..thermal import System, simulate, trajectory
from ._decide import Decision
from ._effect import Candidate
from ._joint_sets import refit_set
from ._measurement import Measurement, instead, measurements, most_telling
from ._refit import Refit
from ._score import BIC_GAP, score_candidates
from ._separation import Hypothesis, Pair, hypotheses_of, separation
from ._setting import Setting, setting_of
from ._short_list import Entry
from ._trial_inputs import Limits, crossed, drawn, limits_of, towards_rest

Array = NDArray[np.float64]
MOST = 6  # candidates that one experiment is designed for
_FULL = 4  # candidates for which all trials are made; more candidates, fewer trials
_ENOUGH = 40.0  # expected ΔBIC that exceeds 10 with a probability of 0.99
_HELPS = 20.0  # expected ΔBIC from which the advice is to apply it as it is: a probability of 0.87
_PLENTY = 80.0  # a search that reaches it ends
_LITTLE = 1e-3  # pairs per unit of ΔBIC: so that a search finds its way where nothing is told apart yet
_TIE = 1e-7  # pairs per unit of ΔBIC of the closest pair: of equals the clearest
_MORE = 0.2  # pairs told apart: what makes another measurement worth its trouble
_HOPELESS = 6  # trials
_FASTER = 10.0  # of the sample time, where no input at the present one is enough
_FAST_TRIALS = 3
_LONGEST = 4  # times the present number of samples, where a plan separates too little
_LEAST = 2.0  # expected ΔBIC below which a longer record is not worth it
_ALIKE = 0.5  # expected ΔBIC below which no input is said to separate a pair
_FIRST = 5  # evaluations of the refit of an alias, which is as good as its twin already


@dataclass(frozen=True, eq=False)
class NextExperiment:
    """What to measure next.

    Parameters
    ----------
    record : Record
        Inputs to apply; its outputs are what the best candidate predicts [K].
    expected : float
        Expected ΔBIC between the closest two candidates that any input tells apart, from this record with the present
        ones, everything refitted.
    present : float
        The same if the present inputs were repeated.
    pairs : dict
        Expected ΔBIC of every pair, by labels.
    inseparable : tuple of (str, str)
        Pairs that neither a trial input nor the measurement tells apart: something else has to be measured.
    advice : str
        In words.
    measurement : Measurement or None
        A parameter to measure by itself besides; `expected` and `pairs` count on it.
    """

    record: Record
    expected: float
    present: float
    pairs: dict[Pair, float]
    inseparable: tuple[Pair, ...]
    advice: str
    measurement: Measurement | None = None

    def __str__(self) -> str:
        return self.advice

    def plot(self) -> Any:
        """Plot the inputs to apply; returns the matplotlib axes."""
        return self.record.plot()


def next_experiment(entries: Sequence[Entry], *, trials: int = 10, seed: int = 0,
                    temperature: tuple[float, float] | None = None) -> NextExperiment:
    """Find an input that separates candidates.

    T-optimality (Hunter and Reiner 1965) with everything refitted: the smallest over the pairs of the expected gain of
    ΔBIC is made large over switched, stepped and multisine inputs within the limits, one input at a time or all
    together; a coordinate search then improves the best. Where that is not enough, some inputs are tried at a tenth of
    the sample time, and then resistances and Seebeck coefficients of modules as measured by themselves; at last the
    inputs are repeated, up to four times the present number of samples.

    Parameters
    ----------
    entries : sequence of Entry
        Two candidates or more that the records cannot tell apart; the first six are told apart.
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
    search = _search_of(entries[:MOST], temperature)
    rng = np.random.default_rng(seed)
    present = search.setting.one
    repeated = search.at(present.record)
    tried = [repeated]
    count = max(trials * _FULL // max(len(search.hypotheses), _FULL), 1)
    for number in range(count):
        tried.append(search.at(drawn(present, search.limits, number, rng)))
        if search.plenty(tried):
            break
    else:
        for _ in range((count + 1) // 2 if search.limits else 0):
            tried.sort(key=search.worth)
            other = tried[int(rng.integers(len(tried)))]
            tried.append(search.at(crossed(tried[-1].record, other.record, search.limits, rng)))
            if search.plenty(tried):
                break
    if search.limits and not search.enough(tried):
        tried += [search.at(drawn(present, search.limits, number, rng, _FASTER)) for number in range(_FAST_TRIALS)]
    return _plan(entries, search, repeated, tried)


def rivals(decision: Decision) -> tuple[Entry, ...]:
    """Best candidate and everything the records cannot tell from it, exact aliases refitted too."""
    best = decision.best
    if best is None:
        return ()
    entries = [best, *decision.contenders]
    known = {entry.candidate.key for entry in entries}
    for entry in tuple(entries):
        for alias in entry.aliases:
            if alias.key not in known and len(entries) < MOST:
                known.add(alias.key)
                entries += _alias(decision.before, alias)
    return tuple(entries)


def _alias(before: Refit, alias: Candidate) -> list[Entry]:
    scores = score_candidates(before, [alias])
    if not scores.candidates:
        return []
    try:
        found = refit_set(before, scores.candidates, scores.size.tolist(), limit=_FIRST)
    except (Diverged, InputError):
        return []
    return [Entry(found.candidates[0], found.fit, found.delta_bic, float(scores.p_value[0]))]


@dataclass(frozen=True, eq=False)
class _Trial:
    """Inputs with the separation they promise; no pairs if they cannot be applied."""

    record: Record
    pairs: dict[Pair, float]


def _worth(pairs: Mapping[Pair, float]) -> float:
    """Expected number of pairs that will be told apart; where that is none, or all, the gains themselves, a little.

    The gain of ΔBIC is normal with mean λ and variance 4 λ, and has to exceed 10.
    """
    gain = np.array(list(pairs.values()))
    apart = norm.cdf((gain - BIC_GAP) / (2.0 * np.sqrt(np.maximum(gain, 1e-9))))
    least = float(gain.min()) if gain.size else 0.0
    return float(np.sum(apart + _LITTLE * np.minimum(gain, _ENOUGH))) + _TIE * least


@dataclass(frozen=True, eq=False)
class _Search:
    """What all trials share."""

    hypotheses: tuple[Hypothesis, ...]
    setting: Setting
    system: System
    limits: Mapping[str, Limits]
    temperature: tuple[float, float] | None

    def at(self, record: Record) -> _Trial:
        """Evaluate inputs; those that get too warm are brought nearer to rest."""
        for _ in range(4):
            try:
                if self._allowed(record):
                    return _Trial(record, separation(self.hypotheses, self.setting, record).pairs())
            except (Diverged, InputError):  # one of the candidates runs away
                pass
            record = towards_rest(record, self.limits, 0.6)
        return _Trial(record, {})

    def _allowed(self, record: Record) -> bool:
        if self.temperature is None:
            return True
        x = trajectory(self.system, record).lumps
        return bool(x.min() >= self.temperature[0] and x.max() <= self.temperature[1])

    def worth(self, trial: _Trial) -> float:
        """How much a trial tells."""
        return _worth(trial.pairs)

    def enough(self, tried: Sequence[_Trial], gain: float = _ENOUGH) -> bool:
        """Whether the best trial gains as much for every pair."""
        return min(max(tried, key=self.worth).pairs.values(), default=0.0) >= gain

    def measured(self, trial: _Trial) -> tuple[Measurement | None, dict[Pair, float]]:
        """The parameter that tells most if measured by itself, where the trial is not enough; pairs with it."""
        if self.enough([trial]):
            return None, trial.pairs
        found = separation(self.hypotheses, self.setting, trial.record)
        options = {option: found.pairs(option) for option in measurements(self.hypotheses[0].structure.ranges)}
        best = most_telling({option: _worth(pairs) for option, pairs in options.items()}, self.worth(trial) + _MORE)
        return (None, trial.pairs) if best is None else (best, options[best])

    def prolonged(self, trial: _Trial, times: int, measurement: Measurement | None) -> _Trial | None:
        """The inputs of a trial several times, one after the other; None if that is too warm or runs away."""
        r = trial.record
        long = Record(sample_time=r.sample_time, inputs=np.tile(r.inputs, (times, 1)),
                      outputs=np.tile(r.outputs, (times, 1)), input_names=r.input_names, output_names=r.output_names,
                      name=r.name)
        try:
            if not self._allowed(long):
                return None
            return _Trial(long, separation(self.hypotheses, self.setting, long).pairs(measurement))
        except (Diverged, InputError):
            return None

    def plenty(self, tried: Sequence[_Trial]) -> bool:
        """Whether a trial separates every pair; or nothing has separated any."""
        hopeless = len(tried) > _HOPELESS and all(gain < _ALIKE for one in tried for gain in one.pairs.values())
        return hopeless or self.enough(tried, _PLENTY)


def _search_of(entries: Sequence[Entry], temperature: tuple[float, float] | None) -> _Search:
    if len(entries) < 2:
        raise InputError(f"{len(entries)} candidates", where="argument entries", expected="two or more to tell apart")
    best = entries[0].fit
    setting = setting_of(best)
    if setting is None:
        raise InputError("no record, and no noise declared of any sensor", where="argument entries",
                         remedy="Declare noise of the sensors in the system: a record is planned, not a response.")
    system = best.system if setting.place is None else best.structure.systems(best.v)[setting.place]
    limits = limits_of(best.system, setting.one.record)
    return _Search(hypotheses_of(entries), setting, system, limits, temperature)


def _plan(entries: Sequence[Entry], search: _Search, repeated: _Trial, tried: Sequence[_Trial]) -> NextExperiment:
    best = max(tried, key=search.worth)
    if not best.pairs:
        return NextExperiment(search.setting.one.record, 0.0, 0.0, {}, (), "Every trial input leaves the limits or "
                              "runs away: set limits of the inputs, or start from another state.")
    measurement, pairs = search.measured(best)
    alike = tuple(pair for pair in pairs if max(pairs[pair], *(t.pairs.get(pair, 0.0) for t in tried)) < _ALIKE)
    apart = [pair for pair in pairs if pair not in alike]
    expected = min((pairs[pair] for pair in apart), default=0.0)
    now = min((repeated.pairs.get(pair, 0.0) for pair in apart), default=0.0)
    times = min(int(np.ceil(_ENOUGH / max(expected, 1e-9))), _LONGEST) if expected > _LEAST else 1
    if times > 1 and (longer := search.prolonged(best, times, measurement)) is not None:
        best, pairs = longer, longer.pairs
        expected = min(pairs[pair] for pair in apart)
    times = len(best.record) // len(search.setting.one.record)
    record = simulate(search.system, best.record)
    named = {entry.candidate.label: entry.candidate for entry in entries}
    faster = best.record.sample_time < search.setting.one.record.sample_time
    besides = _besides(best.record if faster else None, times, measurement)
    text = _advice(named, alike, apart, expected, now, besides)
    return NextExperiment(record, expected, now, pairs, alike, text, measurement)


def _besides(faster: Record | None, times: int, measurement: Measurement | None) -> str:
    """What more than other inputs the plan asks for."""
    asked = [f"sample every {faster.sample_time:.3g} s"] if faster is not None else []
    asked += [f"measure {times} times as many samples as before"] if times > 1 else []
    asked += [str(measurement)] if measurement is not None else []
    return f" Also {' and '.join(asked)}." if asked else ""


def _advice(named: Mapping[str, Candidate], alike: Sequence[Pair], apart: Sequence[Pair], expected: float,
            now: float, besides: str) -> str:
    text = []
    if apart and expected > _HELPS:
        text.append(f"Apply the inputs of this plan: expected ΔBIC {expected:.0f} between the closest two candidates "
                    f"that it tells apart (the present inputs once more: {now:.0f}).{besides}")
    elif apart:
        hints = {named[label].effect.separated_by for pair in apart for label in pair} - {""}
        text.append(f"The inputs of this plan separate them little (expected ΔBIC {expected:.1f}). "
                    f"What separates them: {'; '.join(sorted(hints))}.{besides}")
    if alike:
        labels = list(dict.fromkeys(label for pair in alike for label in pair))
        text.append(f"No input within the limits tells {' from '.join(labels)}. Measure something else: "
                    f"{instead(named[label] for label in labels)}.")
    return " ".join(text)
