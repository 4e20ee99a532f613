"""Stage 4: score every candidate on what the nominal parameters cannot explain."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from ..._distributions import f_sf
from ..._drawing import axes_for
from ..._pandas import pd
from ..effects import Candidate, candidates
from ..fit import Refit
from ._fewer_trials import FewerTrials
from ._frequency_tails import inflation, tail
from ._twin import Twin, possible_size

Array = NDArray[np.float64]
ALPHA = 0.01  # family-wise
POWER = 0.9
ALIAS = 1e-3  # sine of the angle below which two signatures are the same, and one is no signature
BIC_GAP = 10.0
_DIGITS = 6  # of the logarithm of a statistic
_TOGETHER = 64  # signatures at once
_LITTLE = 0.1  # of a signature: where less is left, what rounding has left along the unknowns is removed again
Trial = tuple[int, Candidate]  # number of a candidate, and its trial values
Pair = tuple[tuple[str, tuple[str, ...]], tuple[str, tuple[str, ...]]]


@dataclass(frozen=True, eq=False)
class Scores:
    """Score of every candidate at its best trial values; one entry each.

    Parameters
    ----------
    candidates : tuple of Candidate
        With the best trial values.
    size : ndarray
        One-step estimate of the size β = J'·z/‖J'‖², in its unit.
    std : ndarray
        Its standard deviation.
    statistic : ndarray
        T = (J'·z)²/(s² ‖J'‖²), F(1, ν) distributed if the candidate is absent.
    p_value : ndarray
        Of T, times the number of trials (Bonferroni): family-wise.
    possible : ndarray of bool
        Whether the sign and size are physically possible.
    identifiability : ndarray
        ρ = ‖J'‖/‖J‖: the part of the signature that the nominal parameters cannot imitate.
    limit : ndarray
        Detection limit of the size, at the power of 0.9.
    signatures : ndarray, shape (m, k)
        Whitened, projected, of unit length (0 for one without a signature).
    n_trials : int
        Number of signatures tested.
    """

    candidates: tuple[Candidate, ...]
    size: Array
    std: Array
    statistic: Array
    p_value: Array
    possible: NDArray[np.bool_]
    identifiability: Array
    limit: Array
    signatures: Array
    n_trials: int

    @cached_property
    def confusion(self) -> Array:
        """Cosines of the projected signatures, (k, k)."""
        return self.signatures.T @ self.signatures

    @property
    def order(self) -> list[int]:
        """Possible candidates, the best first; exact aliases as in the catalog, whatever their rounding."""
        height = np.round(np.log(np.maximum(self.statistic, 1e-300)), _DIGITS)
        best_first = np.argsort(-height, kind="stable")
        return [int(i) for i in best_first if self.possible[i] and self.statistic[i] > 0]

    def aliases(self, i: int) -> list[int]:
        """Candidates whose signature is that of candidate i, whatever the readings may be.

        Parameters
        ----------
        i : int
            Place in `candidates`.

        Returns
        -------
        list of int
        """
        alike = 1.0 - self.confusion[i] ** 2 < ALIAS**2
        return [int(j) for j in np.flatnonzero(alike) if j != i]

    def twins(self, i: int) -> tuple[Twin, ...]:
        """Aliases of a candidate, with the sizes that they have where it has one.

        Beside another effect the sign of a size may be another one: of a candidate that is impossible by itself all
        aliases count as possible.

        Parameters
        ----------
        i : int
            Place in `candidates`.

        Returns
        -------
        tuple of Twin
        """
        # the deviations of two sizes of one signature are as the sizes
        return tuple(Twin(self.candidates[j], math.copysign(self.std[j] / self.std[i], self.confusion[i, j]),
                          float(self.std[j]), bool(self.possible[j] or not self.possible[i]))
                     for j in self.aliases(i))

    @property
    def not_testable(self) -> dict[tuple[str, tuple[str, ...]], str]:
        """What these records cannot show, by (effect, where), with the reason."""
        out = {}
        for i, candidate in enumerate(self.candidates):
            size = candidate.effect.size
            if self.identifiability[i] < ALIAS:
                out[candidate.key] = ("no effect on any reading of these records" if self.identifiability[i] == 0
                                      else "the nominal parameters imitate it exactly")
            elif self.limit[i] > max(abs(size.lower), abs(size.upper)):
                out[candidate.key] = f"only a {size.name} above {self.limit[i]:.3g} {size.unit} would have been seen"
        return out

    def table(self) -> pd.DataFrame:
        """Scores as a table, best first.

        Returns
        -------
        pandas.DataFrame
            Index: candidate. Columns: size, std, unit, statistic, p_value, possible, identifiability, limit.
        """
        rows = {"size": self.size, "std": self.std, "unit": [c.effect.size.unit for c in self.candidates],
                "statistic": self.statistic, "p_value": self.p_value, "possible": self.possible,
                "identifiability": self.identifiability, "limit": self.limit}
        table = pd.DataFrame(rows, index=pd.Index([c.label for c in self.candidates], name="candidate"))
        return table.sort_values("statistic", ascending=False)

    def __str__(self) -> str:
        return self.table().head(10).to_string(float_format=lambda x: f"{x:.3g}")

    def plot(self, ax: Any = None) -> Any:
        """Bars of the ten best statistics; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        best = np.argsort(self.statistic)[-10:]
        ax = axes_for(ax)
        colors = ["C0" if self.possible[i] else "0.7" for i in best]
        ax.barh([self.candidates[i].label for i in best], np.maximum(self.statistic[best], 1e-3), color=colors)
        ax.set(xscale="log", xlabel="F statistic after the nominal parameters [-]")
        return ax


def score(fit: Refit, effects: Iterable[str] | None = None) -> Scores:
    """Score all candidates on a refit.

    Parameters
    ----------
    fit : Refit
        Fit without the candidates, from `refit`.
    effects : iterable of str, optional
        Names; default the whole catalog.

    Returns
    -------
    Scores

    Raises
    ------
    InputError
        An unknown effect.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> heater = np.repeat([4.0, 0.0, 6.0, 2.0], 50)
    >>> drive = rt.Record(sample_time=10.0, inputs=heater, outputs=np.zeros((200, 0)), input_names=["heater"],
    ...                   output_names=[])
    >>> late = bar.with_parameters({"sensors.T.time_constant": 30.0})
    >>> run = rt.thermal.simulate(late, drive)
    >>> noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> scores = rt.diagnosis.score(rt.diagnosis.refit(bar, noisy))
    >>> scores.candidates[scores.order[0]].label
    'sensor_lag(T)'
    """
    return score_candidates(fit, fit.testable(candidates(fit.system, effects, fit.drifting)))


@dataclass(frozen=True, eq=False)
class _Tried:
    """Candidates at the best of their trial values, one entry each, with what their scores need."""

    trials: list[Trial]
    n_columns: NDArray[np.intp]
    size: Array
    std: Array
    statistic: Array
    possible: NDArray[np.bool_]
    identifiability: Array
    own: Array  # length of the projected signature; 0 where nothing is left of it
    unit: Array


def score_candidates(fit: Refit, tested: Sequence[Candidate]) -> Scores:
    """Score these candidates, each at the best of its trial values."""
    fewer = FewerTrials(fit)
    chosen = [fewer.of(candidate) for candidate in tested]
    n_trials = sum(count for _, count in chosen)
    groups = [_tried(fit, trials) for trials in _together([trials for trials, _ in chosen])]

    def joined(name: str) -> Any:
        return np.concatenate([getattr(group, name) for group in groups], axis=-1)

    unit, n_columns, own = joined("unit"), joined("n_columns"), joined("own")
    nu = max(fit.degrees_of_freedom - 1, 1)
    # the phase of a pair was chosen by the data: two degrees of freedom
    chance = f_sf(joined("statistic") / n_columns, n_columns, np.minimum(tail(fit, unit), nu))
    threshold = math.sqrt(max(special.ndtri(ALPHA / 2 / max(n_trials, 1)) ** 2, BIC_GAP + math.log(fit.n_readings)))
    # unit noise, whatever is missing
    limit = np.where(own > 0, (threshold + special.ndtri(POWER)) / np.where(own > 0, own, 1.0), np.inf)
    return Scores(tuple(trial for group in groups for _, trial in group.trials), joined("size"), joined("std"),
                  joined("statistic"), np.minimum(chance * max(n_trials, 1), 1.0), joined("possible"),
                  joined("identifiability"), limit, unit, n_trials)


def _together(tested: Sequence[Sequence[Candidate]]) -> Iterator[list[Trial]]:
    """Trials of some candidates at a time: all signatures of a long record at once would not fit into the memory."""
    some: list[Trial] = []
    for number, trials in enumerate(tested):
        some += [(number, trial) for trial in trials]
        if len(some) >= _TOGETHER:
            yield some
            some = []
    yield some


def _tried(fit: Refit, trials: list[Trial]) -> _Tried:
    """All trials of some candidates, and the best of each."""
    J = (fit.whiten([path.columns([trial for _, trial in trials]) for path in fit.paths]) if trials else
         np.zeros((fit.z.size, 0)))
    explained = fit.basis.T @ J
    J -= fit.basis @ explained
    little = _lengths(J) < _LITTLE * _lengths(explained)
    J[:, little] = fit.project(J[:, little])  # rounding counts there alone
    trials, turn, n_columns = turned(fit, trials, J)
    unit = turn(J)
    own = _lengths(unit)
    length = np.hypot(own, _lengths(turn(explained)))
    visible = (length > 0) & (own > 1e-9 * length)
    own_safe = np.where(visible, own, 1.0)
    unit /= own_safe
    unit[:, ~visible] = 0.0
    along = unit.T @ fit.rest
    power = float(fit.rest @ fit.rest)
    variance = np.maximum(power - along**2, 1e-12 * power) / max(fit.degrees_of_freedom - 1, 1)
    statistic = along**2 / variance / inflation(fit, unit)
    size, std = along / own_safe, np.sqrt(variance) / own_safe
    identifiability = np.where(length > 0, own / np.where(length > 0, length, 1.0), 0.0)
    possible = np.array([possible_size(trial, beta, deviation) for (_, trial), beta, deviation
                         in zip(trials, size, std, strict=True)], bool)
    best = _best_of(trials, statistic, size, possible)
    return _Tried([trials[i] for i in best], n_columns[best], size[best], std[best], statistic[best],
                  (possible & visible)[best], identifiability[best], np.where(visible, own, 0.0)[best],
                  unit[:, best])


def _lengths(columns: Array) -> Array:
    """Length of every column, without a copy of them."""
    return np.sqrt(np.einsum("mk,mk->k", columns, columns))


def promising(fit: Refit, scores: Scores) -> bool:
    """Whether any score could pass: refits are not started for nothing."""
    least = 0.5 * (BIC_GAP + math.log(fit.n_readings))  # half: a refit may gain over its linearization
    return any(scores.p_value[i] < ALPHA and scores.statistic[i] > least for i in scores.order)


def promised(fit: Refit, scores: Scores, i: int) -> float:
    """Sum of squares that the linearization about the fit leaves with candidate i.

    Parameters
    ----------
    fit : Refit
        That was scored.
    scores : Scores
        Scores on that fit.
    i : int
        Place in `candidates`.
    """
    power = float(fit.rest @ fit.rest)
    return max(power - float(scores.signatures[:, i] @ fit.rest) ** 2, 1e-12 * power)


def explains(fit: Refit, scores: Scores) -> float:
    """Largest share of the misfit, as far as it is more than noise, that one candidate promises to explain.

    Parameters
    ----------
    fit : Refit
        That leaves more than noise.
    scores : Scores
        Scores on that fit.
    """
    least = min((promised(fit, scores, i) for i in scores.order), default=fit.rss)
    return (fit.rss - least) / (fit.rss - fit.n_readings)


def turned(fit: Refit, trials: list[Trial], rest: Array
           ) -> tuple[list[Trial], Callable[[Array], Array], NDArray[np.intp]]:
    """Join the two columns of every paired trial to the one at the best angle.

    Parameters
    ----------
    fit : Refit
        What is to be explained.
    trials : list of tuple
        One per column; pairs follow each other.
    rest : ndarray, shape (m, k)
        Columns without what the unknowns can explain.

    Returns
    -------
    list of tuple
        Trials that are left, at their angles.
    callable
        Makes their columns of the (m, k) of all.
    ndarray of int
        Columns that each one had.
    """
    if not any(trial.effect.paired for _, trial in trials):
        return trials, lambda columns: columns, np.ones(len(trials), np.intp)
    first, at = [], 0
    while at < len(trials):
        first.append(at)
        at += 2 if trials[at][1].effect.paired else 1
    paired = np.array([bool(trials[i][1].effect.paired) for i in first], bool)
    one = np.array(first, np.intp)
    a, b = rest[:, one[paired]], rest[:, one[paired] + 1]
    aa, ab, bb = (np.einsum("mk,mk->k", x, y) for x, y in ((a, a), (a, b), (b, b)))
    gram = np.stack([aa, ab, ab, bb], axis=-1).reshape(-1, 2, 2)
    along = np.stack([fit.rest @ a, fit.rest @ b], axis=-1)[..., None]
    weights = np.linalg.pinv(gram, rcond=1e-12, hermitian=True) @ along
    angles = np.zeros(len(one))
    angles[paired] = np.arctan2(weights[:, 1, 0], weights[:, 0, 0])

    def turn(columns: Array) -> Array:
        out = columns[:, one]
        out[:, paired] *= np.cos(angles[paired])
        out[:, paired] += np.sin(angles[paired]) * columns[:, one[paired] + 1]
        return out

    kept = [(number, replace(trial, shape={**trial.shape, trial.effect.paired: float(angle)}) if is_pair else trial)
            for (number, trial), is_pair, angle in zip([trials[i] for i in first], paired, angles, strict=True)]
    return kept, turn, np.where(paired, 2, 1)


def _best_of(trials: Sequence[tuple[int, Candidate]], statistic: Array, size: Array, possible: NDArray[np.bool_]
             ) -> NDArray[np.intp]:
    """Best trial of every candidate that has one: possible ones first; of equals the one whose size was tried."""
    best: dict[int, tuple[tuple[bool, float, float], int]] = {}
    for i, (number, trial) in enumerate(trials):
        tried = trial.shape.get(trial.effect.size.name)
        off = abs(math.log(max(size[i], 1e-300) / tried)) if tried else 0.0
        height = math.log(max(statistic[i], 1e-300))
        rank = (bool(possible[i]), round(height, 1) if tried else height, -off)
        if number not in best or rank > best[number][0]:
            best[number] = rank, i
    return np.array([best[number][1] for number in sorted(best)], np.intp)
