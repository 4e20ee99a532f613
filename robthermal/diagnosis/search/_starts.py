"""Where the refit of a candidate starts: from the nominal fit, or from the declared parameters.

A strong effect that is missing pulls the nominal parameters far away; the linearization there knows little of the
truth. The declared parameters are wrong by their priors only.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...errors import Diverged, InputError
from ..effects import Candidate
from ..evidence import BIC_GAP
from ..fit import ENOUGH, Refit, Structure, Whitened, descend, extended, turned

Array = NDArray[np.float64]
_SETTLING = 2  # evaluations before what shapes an effect is moved
_FEW = 3  # evaluations of every start
_KEPT = 0.7  # share of the predicted decrease that a good start keeps
_MOVES = 0.1  # share of it that a start from nothing must reach not to be called standing still
_MANY = 12  # evaluations along a curved valley
_AS_MUCH = 0.75  # of the best ΔBIC reached, that a candidate must promise for as many
BEHIND = 60.0  # ΔBIC by which a candidate may lie below the best, and still get there
_SHARE = 0.3  # of the best ΔBIC, less that much
_FACTOR = 1.0  # of a logarithm: a linearization says nothing of a parameter that changes by more than a factor e


@dataclass(frozen=True, eq=False)
class Origin:
    """A fit and, where needed, its structure at the declared parameters.

    Parameters
    ----------
    fit : Refit
        Without the candidate.
    """

    fit: Refit

    @cached_property
    def declared(self) -> Refit:
        """The structure at the declared parameters, with the filters of the fit and its effects as they are."""
        structure = self.fit.structure
        v = structure.start(structure.ranges.start, structure.quantities(self.fit.v))
        z = Whitened(structure, self.fit.whiteners).residual(v)
        return replace(self.fit, v=v, z=z, paths=structure.paths(v))


def in_reach(delta_bic: float, best: float) -> bool:
    """Whether more evaluations could bring a candidate to the top: not if it is far behind the best already."""
    return delta_bic > _SHARE * best - BEHIND


def started(origin: Origin, candidate: Candidate, size: float, best: float = 0.0) -> Refit:
    """The candidate added and refitted a little: from the first start that keeps its promise, or else from the best.

    Other starts than the first are for candidates that promise enough beside the best ΔBIC that another has reached.
    """
    fit = origin.fit
    tried: list[Refit] = []
    least = fit.rss
    for start in _starts(origin, candidate, size):
        if tried and not in_reach(fit.n_readings * np.log(fit.rss / start.promise), best):
            continue
        new = _refitted(fit, start)
        if new is None:
            continue
        if start.promise < fit.rss and fit.rss - new.rss > _KEPT * (fit.rss - start.promise):
            return new
        tried.append(new)
        least = min(least, start.promise)
    worth = not tried or in_reach(fit.n_readings * np.log(fit.rss / least), best)
    if worth and not any(new.rss < fit.rss for new in tried):
        tried += _from_nothing(fit, candidate, size, tried, least, best)
    return min(tried, key=lambda new: new.rss)


def elsewhere(origin: Origin, candidate: Candidate, values: Mapping[str, float]) -> Refit | None:
    """The candidate refitted from the declared parameters and the values that the same effect has at another place.

    There it has pulled the parameters to where a body that is in another place needs them; along a curved valley a few
    evaluations from the nominal fit do not lead out of it. None where it does not survive its simulation.

    Parameters
    ----------
    origin : Origin
        Fit without the candidate.
    candidate : Candidate
        The effect at its place.
    values : mapping of str to float
        Value of every quantity of the effect.
    """
    try:
        at = origin.declared
    except (Diverged, InputError):
        return None
    shape = {name: values[name] for name in candidate.shape if name in values}
    size = values[candidate.effect.size.name]
    new = _refitted(origin.fit, _Start(at, replace(candidate, shape=shape), at.v, size, origin.fit.rss))
    return None if new is None else extended(new, new.structure, new.v, _MANY)


def _from_nothing(fit: Refit, candidate: Candidate, size: float, tried: list[Refit], least: float, best: float
                  ) -> list[Refit]:
    """Refits from a size that hardly shows and, where that stands still, further iterations of the best start.

    These cost as much as all starts together: for those that promise about what another has reached, the `best` ΔBIC.
    """
    nothing = float(np.sign(size)) * candidate.effect.size.typical
    new = _refitted(fit, _Start(fit, candidate, fit.v, nothing, fit.rss))
    if new is None and not tried:
        raise Diverged(f"no start of {candidate.label} survives its simulation", time=0.0)
    promised = fit.n_readings * np.log(fit.rss / least)
    further = (_further_iterations(fit, tried, least, fit.rss if new is None else new.rss)
               if promised > _AS_MUCH * best else None)
    return [one for one in (new, further) if one is not None]


@dataclass(frozen=True, eq=False)
class _Start:
    """Linearized at a fit: trial values, unknowns, size, and the sum of squares that the linearization promises."""

    at: Refit
    trial: Candidate
    v: Array
    size: float
    promise: float


def _starts(origin: Origin, candidate: Candidate, size: float) -> Iterator[_Start]:
    """From the fit, and from the declared parameters."""
    yield _Start(origin.fit, candidate, *_linear(origin.fit, candidate, size))
    try:
        declared = origin.declared
    except (Diverged, InputError):
        declared = origin.fit
    trial, best = _best_trial(declared, candidate)
    yield _Start(declared, trial, *_linear(declared, trial, best))


def _refitted(fit: Refit, start: _Start) -> Refit | None:
    """A few evaluations from a start; None if it does not survive its simulation."""
    structure = start.at.structure.with_effect(start.trial)
    values = [*start.at.structure.quantities(start.v), {**start.trial.shape, start.trial.effect.size.name: start.size}]
    v = structure.carried(start.at.structure, start.v, values)
    try:
        if any(callable(quantity.grid) for quantity in start.trial.effect.free[1:]):
            v = descend(Whitened(structure, fit.whiteners), v, held(structure, v), _SETTLING, ENOUGH).at.v
        return extended(fit, structure, v, _FEW)
    except (Diverged, InputError):
        return None


def held(structure: Structure, v: Array) -> tuple[Array, Array]:
    """Bounds that hold the times and levels that shape the last effect where the trial put them.

    Until the nominal parameters have settled around it their misfit would move a time across the record. A time
    constant stays free: it and its capacity have to move together.
    """
    low, high = (bound.copy() for bound in structure.bounds)
    quantities = structure.effects[-1].effect.free
    for at, quantity in enumerate(quantities, start=structure.n_parameters + structure.n_effects - len(quantities)):
        if quantity is not quantities[0] and callable(quantity.grid):
            low[at] = high[at] = np.clip(v[at], low[at], high[at])
    return low, high


def _further_iterations(fit: Refit, tried: list[Refit], least: float, stands: float) -> Refit | None:
    """The best of the starts iterated on, where a start from nothing stands still and much more is promised.

    A capacity beside a capacity lies in a curved valley: from nothing no step along its tangent survives.
    """
    promised = fit.rss - least
    if not tried or fit.rss - stands > _MOVES * promised or fit.n_readings * np.log(fit.rss / least) < 2.0 * BIC_GAP:
        return None
    best = min(tried, key=lambda new: new.rss)
    return extended(best, best.structure, best.v, _MANY)


def _linear(fit: Refit, candidate: Candidate, size: float) -> tuple[Array, float, float]:
    """Optimum of the linearized problem for a size within its bounds, and its sum of squares.

    No parameter starts farther than a factor e from where it was: a conductance of which the linearization asks a
    millionth would start at its bound, where hardly anything depends on it.
    """
    size = _believable(candidate, size, _smallest(candidate.trials(fit.paths[0])))
    target = fit.z - size * fit.whiten([path.columns([candidate]) for path in fit.paths])[:, 0]
    shift = np.linalg.lstsq(*turned(fit.J, target), rcond=1e-9)[0]
    left = target - fit.J @ shift
    ranges = fit.structure.ranges
    far = np.where(ranges.logarithmic, _FACTOR, np.inf)
    shift[:far.size] = np.clip(shift[:far.size], -far, far)
    return np.clip(fit.v + shift, *fit.structure.bounds), size, float(left @ left)


def _believable(candidate: Candidate, size: float, smallest: float) -> float:
    """Within the bounds; near the trial value, if the signature holds only there.

    Below the smallest trial value the signature, the change of the readings per size, is all that is known: a lag much
    shorter than a sample is found there, and started from the trial value it would need more evaluations than it gets.
    """
    bounds, trial = candidate.effect.size, candidate.shape.get(candidate.effect.size.name)
    if trial is None:
        return float(np.clip(size, bounds.lower, bounds.upper))
    low = bounds.lower if trial == smallest and bounds.typical < trial else 0.7 * trial
    return float(np.clip(size, low, 1.4 * trial))


def _smallest(trials: Sequence[Candidate]) -> float:
    """Smallest size that is tried; infinite for effects whose signature holds for every size."""
    return min((one.shape.get(one.effect.size.name, math.inf) for one in trials), default=math.inf)


def _best_trial(fit: Refit, candidate: Candidate) -> tuple[Candidate, float]:
    """Trial values and size that explain most."""
    trials = [candidate] if candidate.effect.paired else candidate.trials(fit.paths[0])
    J = fit.project(fit.whiten([path.columns(trials) for path in fit.paths]))
    power, along = np.sum(J**2, axis=0), J.T @ fit.rest
    smallest = _smallest(trials)
    sizes = np.array([_believable(trial, size, smallest)
                      for trial, size in zip(trials, along / np.maximum(power, 1e-300), strict=True)])
    best = int(np.argmax(2 * sizes * along - sizes**2 * power))
    return trials[best], float(sizes[best])
