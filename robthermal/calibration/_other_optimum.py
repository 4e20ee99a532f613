"""Lags exchanged with the time constants of their lumps: taken where that explains far more, said where as much."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from .._arrays import Floats
from ..errors import Diverged, InputError
from ..fitting import Loss, choices_of, exchanged_lags, is_elsewhere, lagged_parts
from ..thermal import parameter_in_words
from ._joint import JointProblem
from ._solution import Solution, cost_of

_FAR_LESS = 0.5  # of the cost: what is left with the times exchanged, where these are taken
_NEAR = 10.0  # times the cost: what exchanged times leave before they are fitted, where an optimum is near
_AS_GOOD = 10.0  # of the cost, in what a reading adds to it: the data do not tell one from the other

Solved = Callable[[JointProblem, Floats], Solution]


@dataclass(frozen=True)
class _Exchanged:
    """A solution from times exchanged: lags by the name of the parameter, before it, at its start, in it [s]."""

    solution: Solution
    before: dict[str, float]
    asked: dict[str, float]
    lags: dict[str, float]

    @property
    def elsewhere(self) -> bool:
        """Whether it is nearer to the exchanged times than to those before: else the optimizer came back."""
        return all(is_elsewhere(before, self.asked[name], self.lags[name]) for name, before in self.before.items())


def with_exchanged_lags(solution: Solution, loss: Loss, solved: Solved) -> tuple[Solution, tuple[Floats, ...], str]:
    """The better of a solution and those with lags and the time constants of their lumps exchanged; what stays open.

    Parameters
    ----------
    solution : Solution
        Where the optimizer ended.
    loss : {"linear", "soft_l1", "huber"}
        Of the weighted residuals.
    solved : callable
        Solves a problem from the unknowns given.

    Returns
    -------
    Solution
    tuple of ndarray, shape (p,)
        Values of all parameters where the data are explained as well.
    str
        A sentence for every lag that may as well be the other way round; empty where the data tell.
    """
    alike: list[_Exchanged] = []
    for _ in range(1 + len(_lags(solution))):  # each may have to be exchanged beside the others
        alike, cost = [], cost_of(solution.problem, solution.v, loss)
        for other in _others(solution, cost, loss, solved):
            left = cost_of(solution.problem, other.solution.v, loss)
            if left < _FAR_LESS * cost:
                solution, alike = other.solution, []
                break
            if other.elsewhere and left - cost < _AS_GOOD * max(cost / solution.problem.n_numbers, 1.0):
                alike.append(other)
        else:
            break
    p, ranges = len(solution.problem.ranges.names), solution.problem.ranges
    return solution, tuple(ranges.values(one.solution.v[:p]) for one in alike), " ".join(map(_either, alike))


def _lags(solution: Solution) -> dict[str, str]:
    """Lump of every lag that is estimated, by the name of the parameter."""
    flat = solution.problem.ranges.flat
    return {name: lump for name, lump in lagged_parts(solution.problem.system).items() if name in flat}


def _others(solution: Solution, cost: float, loss: Loss, solved: Solved) -> Iterator[_Exchanged]:
    """Solutions from one lag exchanged with its lump, then from those of all thermometers together."""
    def near(joint: JointProblem, v: Floats) -> Solution | None:
        return solved(joint, v) if cost_of(joint, v, loss) < _NEAR * cost else None

    for some in choices_of(_lags(solution)):
        found = _exchanged(solution, some, near)
        if found is not None:
            yield found


def _exchanged(solution: Solution, lags: dict[str, str], solved: Callable[[JointProblem, Floats], Solution | None]
               ) -> _Exchanged | None:
    """The solution from some lags exchanged with their lumps; None where that is no start, or far from every optimum.
    """
    joint, ranges = solution.problem, solution.problem.ranges
    p, at = len(ranges.names), {name: i for i, group in enumerate(ranges.members) for name in group}
    values = ranges.values(solution.v[:p])
    before = {name: float(values[at[name]]) for name in lags}
    system = joint.system.with_parameters(ranges.assigned(values))
    found = exchanged_lags(system, ranges, values, {lump: before[name] for name, lump in lags.items()})
    if found is None:
        return None
    start, own = found
    for name, lump in lags.items():
        start[at[name]] = np.clip(own[lump], ranges.lower[at[name]], ranges.upper[at[name]])
    asked = {name: float(start[at[name]]) for name in lags}
    try:
        new = solved(replace(joint, records=replace(joint.records)),  # a fit sets the weights of its records
                     np.concatenate([ranges.coordinates(start), solution.v[p:]]))
    except (Diverged, InputError):  # the model runs away from there: no optimum
        return None
    if new is None:
        return None
    ended = ranges.values(new.v[:p])
    return _Exchanged(new, before, asked, {name: float(ended[at[name]]) for name in lags})


def _either(other: _Exchanged) -> str:
    """That lags and their lumps may be the other way round, what that means, and what would tell."""
    lags = " and ".join(f"{parameter_in_words(name)} {other.lags[name]:.3g} s as well as {before:.3g} s"
                        for name, before in other.before.items())
    return (f"The data are explained as well with lag and time constant of the lump exchanged: {lags}. The temperature "
            "of the lump itself is another one then, its reading the same. Measure the lag by itself, or give what "
            "else is known of the lump (capacity, gain of its heater, losses) with its standard deviation under [fit].")
