"""Trial inputs of a planned experiment: what each would tell, and when to stop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from ...errors import Diverged, InputError
from ...signals import Record
from ...thermal import System, trajectory
from ..evidence import BIC_GAP
from ..search import Entry
from ._measurement import Measurement, measurements, most_informative
from ._separation import Hypothesis, Pair, hypotheses_of, separation
from ._trial_conditions import TrialConditions, trial_conditions
from ._trial_inputs import Limits, limits_of, repeated, towards_rest

MOST = 6  # candidates that one experiment is designed for
_ENOUGH = 40.0  # expected ΔBIC that exceeds 10 with a probability of 0.99
_PLENTY = 80.0  # a search that reaches it ends
_LITTLE = 1e-3  # pairs per unit of ΔBIC: so that a search finds its way where nothing is separated yet
_TIE = 1e-7  # pairs per unit of ΔBIC of the closest pair: of equals the clearest
_MORE = 0.2  # pairs separated: what makes another measurement, or a longer one, worth its trouble
_HOPELESS = 6  # trials
LONGEST = 8  # times the present number of samples, where a plan separates too little
ALIKE = 0.5  # expected ΔBIC below which no input is said to separate a pair


@dataclass(frozen=True, eq=False)
class Trial:
    """Inputs with the separation they promise, with a measurement or not; no pairs if they cannot be applied."""

    record: Record
    pairs: dict[Pair, float]
    measurement: Measurement | None = None

    def worth(self, times: int = 1) -> float:
        """Approximate information if so many times as long."""
        return _worth(self.pairs, times)


def _worth(pairs: Mapping[Pair, float], times: int = 1) -> float:
    """Expected number of pairs that will be separated; where that is none, or all, the gains themselves, a little.

    The gain of ΔBIC is normal with mean λ and variance 4 λ, and has to exceed 10; λ grows about as the record.
    """
    gain = times * np.array(list(pairs.values()))
    apart = special.ndtr((gain - BIC_GAP) / (2.0 * np.sqrt(np.maximum(gain, 1e-9))))
    least = float(gain.min()) if gain.size else 0.0
    return float(np.sum(apart + _LITTLE * np.minimum(gain, _ENOUGH))) + _TIE * least


@dataclass(frozen=True, eq=False)
class Search:
    """What all trials share."""

    hypotheses: tuple[Hypothesis, ...]
    conditions: TrialConditions
    system: System
    limits: Mapping[str, Limits]
    temperature: tuple[float, float] | None

    def at(self, record: Record) -> Trial:
        """Evaluate inputs; those that get too warm are brought nearer to rest."""
        for _ in range(4):
            try:
                if self._allowed(record):
                    return Trial(record, separation(self.hypotheses, self.conditions, record).pairs())
            except (Diverged, InputError):  # one of the candidates runs away
                pass
            record = towards_rest(record, self.limits, 0.6)
        return Trial(record, {})

    def _allowed(self, record: Record) -> bool:
        if self.temperature is None:
            return True
        x = trajectory(self.system, record).lumps
        return bool(x.min() >= self.temperature[0] and x.max() <= self.temperature[1])

    def enough(self, tried: Sequence[Trial], gain: float = _ENOUGH) -> bool:
        """Whether the best trial gains as much for every pair."""
        return min(max(tried, key=Trial.worth).pairs.values(), default=0.0) >= gain

    def measured(self, trial: Trial) -> Trial:
        """With the most informative parameter measured by itself, where the trial is not enough."""
        if self.enough([trial]):
            return trial
        possible = measurements(self.hypotheses[0].structure.ranges)
        found = separation(self.hypotheses, self.conditions, trial.record) if possible else None
        options = {option: found.pairs(option) for option in possible} if found else {}
        best = most_informative({option: _worth(pairs) for option, pairs in options.items()}, trial.worth() + _MORE)
        return trial if best is None else Trial(trial.record, options[best], best)

    def prolonged(self, trial: Trial, expected: float) -> Trial:
        """The inputs of a trial several times, one after the other, unless they are enough or that is too warm."""
        times = int(np.clip(np.ceil(_ENOUGH / max(expected, 1e-9)), 1, LONGEST))
        if trial.worth(times) < trial.worth() + _MORE:
            return trial
        long = repeated(trial.record, times)
        try:
            if not self._allowed(long):
                return trial
            pairs = separation(self.hypotheses, self.conditions, long).pairs(trial.measurement)
        except (Diverged, InputError):  # one of the candidates runs away
            return trial
        return Trial(long, pairs, trial.measurement)

    def plenty(self, tried: Sequence[Trial]) -> bool:
        """Whether a trial separates every pair; or nothing has separated any."""
        hopeless = len(tried) > _HOPELESS and all(gain < ALIKE for one in tried for gain in one.pairs.values())
        return hopeless or self.enough(tried, _PLENTY)


def search_of(entries: Sequence[Entry], temperature: tuple[float, float] | None) -> Search:
    """What the trials for these entries share.

    Raises
    ------
    InputError
        Fewer than two entries; no record, and no noise declared of any sensor.
    """
    if len(entries) < 2:
        raise InputError(f"{len(entries)} candidates", where="argument entries", expected="two or more to separate")
    best = entries[0].fit
    conditions = trial_conditions(best)
    if conditions is None:
        raise InputError("no record, and no noise declared of any sensor", where="argument entries",
                         remedy="Declare noise of the sensors in the system: a record is planned, not a response.")
    system = best.system if conditions.place is None else best.structure.systems(best.v)[conditions.place]
    limits = limits_of(best.system, conditions.one.record)
    return Search(hypotheses_of(entries), conditions, system, limits, temperature)
