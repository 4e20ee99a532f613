"""Select several effects at once: a sign-constrained group-sparse convex program, then a refit of what it points at."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._drawing import axes_for
from ...errors import Outcome
from .._outcomes import DiagnosisCode
from ..effects import Candidate
from ..evidence import Scores
from ..fit import Refit
from ._joint_program import Program, program_of
from ._joint_sets import EffectSet, Key, best_sets, near_trial

Array = NDArray[np.float64]
_POOL = 6  # candidates whose sets are compared: up to half from the best pairs, the rest as they enter the path
_PAIRS = 5
_PENALTIES = 16
_NOISE = 2.0  # standard deviations beyond the largest of that many noises: where the path ends
_SMALL = 1e-6  # KKT residual, relative to the penalty


@dataclass(frozen=True, eq=False, kw_only=True)
class JointSelection:
    """Path of the convex program and the sets it points at.

    Parameters
    ----------
    candidates : tuple of Candidate
        In the program; of exact aliases only one.
    penalties : ndarray, shape (n,)
        λ, from the largest at which anything is selected down to the noise.
    sizes : ndarray, shape (n, n_candidates)
        Size of every effect along the path, shrunk by λ, in its unit.
    supports : tuple of tuple of Candidate
        What is selected at every λ.
    kkt : ndarray, shape (n,)
        Distance from optimality at every λ, relative to it: what a proximal step still changes.
    irrepresentable : float
        Of the best set. At 1 or above no λ need select exactly this set, however strong the effects are.
    likeness : float
        Largest cosine between an effect of the best set and any other candidate.
    sets : tuple of EffectSet
        Refitted, the best first.
    before : Refit
        Without any of them.
    outcome : Outcome
        Codes "selected", "nothing" (no candidate above the noise), "inexact" (not ok: the program was not solved).
    """

    candidates: tuple[Candidate, ...]
    penalties: Array
    sizes: Array
    supports: tuple[tuple[Candidate, ...], ...]
    kkt: Array
    irrepresentable: float
    likeness: float
    sets: tuple[EffectSet, ...]
    before: Refit
    outcome: Outcome

    def compared(self, candidates: Iterable[Candidate]) -> str:
        """Say where another set, such as that of the stepwise search, agrees with the best one here.

        Parameters
        ----------
        candidates : iterable of Candidate
            The other set.

        Returns
        -------
        str
        """
        mine = {c.key: c.label for c in self.sets[0].candidates} if self.sets else {}
        other = {c.key: c.label for c in candidates}
        if set(mine) == set(other):
            return "the joint selection and the stepwise search agree"
        parts = [("both", [other[k] for k in other if k in mine]),
                 ("joint only", [mine[k] for k in mine if k not in other]),
                 ("stepwise only", [other[k] for k in other if k not in mine])]
        return "; ".join(f"{what}: {', '.join(labels)}" for what, labels in parts if labels)

    def __str__(self) -> str:
        lines = [f"{'λ':>10}  selected"]
        last: tuple[Candidate, ...] | None = None
        for penalty, support in zip(self.penalties, self.supports, strict=True):
            if support != last:
                lines.append(f"{penalty:>10.4g}  " + (", ".join(c.label for c in support) or "nothing"))
            last = support
        lines += [f"refitted: {found}" for found in self.sets]
        if self.sets:
            lines.append(f"irrepresentable condition {self.irrepresentable:.3g}" + (
                " < 1: the path can select this set" if self.irrepresentable < 1.0 else
                " >= 1, violated: the path alone proves nothing, the refits decide")
                + f" (most alike: cosine {self.likeness:.3f})")
        return "\n".join([*lines, str(self.outcome)])

    def plot(self, ax: Any = None) -> Any:
        """Sizes along the path, each over its largest; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        for i in np.flatnonzero(np.any(self.sizes != 0.0, axis=0)):
            ax.plot(self.penalties, self.sizes[:, i] / np.abs(self.sizes[:, i]).max(), label=self.candidates[i].label)
        ax.set(xscale="log", xlabel="penalty λ [-]", ylabel="size over its largest [-]")
        ax.invert_xaxis()
        ax.legend(fontsize="small")
        return ax


def select_jointly(fit: Refit, scores: Scores, *, tries: int = 2, known: Refit | None = None) -> JointSelection:
    """Select effects together instead of one after the other.

    minimize ½‖z' - J'β‖² + λ Σ_g w_g ‖β_g‖ within the physical bounds, for λ from the smallest that selects nothing
    down to the noise. Up to six candidates, from the best pairs and as they enter the path, are a pool; its sets of
    up to three effects are compared by the linearized ΔBIC. The best, and the best pair, are refitted with the nominal
    parameters.

    Parameters
    ----------
    fit : Refit
        Without any of the effects.
    scores : Scores
        Of all candidates on it.
    tries : int
        Number of sets to refit.
    known : Refit, optional
        With some set of effects that has been refitted: where it is among those to refit it is warm.

    Returns
    -------
    JointSelection

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> true = bar.with_parameters({"sensors.T.time_constant": 30.0, "lumps.bar.heat": 0.2})
    >>> columns = np.column_stack([np.repeat([4.0, 0.0, 6.0, 2.0], 50), np.full(200, 295.0)])
    >>> drive = rt.Record(sample_time=10.0, inputs=columns, outputs=np.zeros((200, 0)), input_names=["heater", "room"],
    ...                   output_names=[])
    >>> run = rt.thermal.simulate(true, drive)
    >>> noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> fit = rt.diagnosis.refit(bar, noisy)
    >>> found = rt.diagnosis.select_jointly(fit, rt.diagnosis.score(fit, ["sensor_lag", "heat_source", "radiation"]))
    >>> sorted(candidate.label for candidate in found.sets[0].candidates)
    ['heat_source(bar)', 'sensor_lag(T)']
    """
    program = program_of(fit, scores)
    last = math.sqrt(2.0 * math.log(max(len(program.candidates), 2))) + _NOISE
    if not program.candidates or program.largest_penalty <= last:
        nothing = DiagnosisCode.NOTHING.outcome()
        return JointSelection(candidates=program.candidates, penalties=np.zeros(0), kkt=np.zeros(0), supports=(),
                              sizes=np.zeros((0, len(program.candidates))), irrepresentable=0.0, likeness=0.0, sets=(),
                              before=fit, outcome=nothing)
    penalties = np.geomspace(program.largest_penalty, last, _PENALTIES)
    solved = [program.solve(float(penalty)) for penalty in penalties]
    kkt = np.array([residual for _, residual in solved])
    supports = [program.chosen(beta) for beta, _ in solved]
    pairs = program.best_pairs(_PAIRS)
    pool = _pool_of(program, [i for support in supports for i in support], [i for pair in pairs for i in pair])
    sets = best_sets(fit, *_started(program, pool, solved[-1][0]), tries, [_started(program, *pair)
                     for pair in _solved_pairs(program, pairs[:1])], known)
    condition, likeness = _condition(program, sets)
    exact = bool(np.all(kkt < _SMALL))
    outcome = (DiagnosisCode.SELECTED.outcome(f"Solved: largest KKT residual {kkt.max():.1g}.") if exact else
               DiagnosisCode.INEXACT.outcome(f"The convex program was not solved: KKT residual {kkt.max():.1g}.",
                                             remedy=""))
    return JointSelection(
        candidates=program.candidates, penalties=penalties, sizes=np.array([program.sizes(b) for b, _ in solved]),
        supports=tuple(tuple(program.candidates[i] for i in support) for support in supports), kkt=kkt,
        irrepresentable=condition, likeness=likeness, sets=sets, before=fit, outcome=outcome)


def _pool_of(program: Program, path: Iterable[int], paired: Iterable[int]) -> list[int]:
    """Members of the best pairs, then what enters the path; of two forms of one effect, the first."""
    forms = {program.candidates[i].key: i for i in reversed([*paired, *path])}
    pool = [i for i in dict.fromkeys([*paired, *path]) if forms[program.candidates[i].key] == i]
    half = _POOL // 2
    first = [i for i in dict.fromkeys(paired) if i in pool][:half]
    return [*first, *(i for i in pool if i not in first)][:_POOL]


def _solved_pairs(program: Program, pairs: Iterable[tuple[int, int]]) -> list[tuple[tuple[int, int], Array]]:
    """Pairs with the coefficients of least squares."""
    out = []
    for pair in pairs:
        at = np.concatenate([program.groups[i] for i in pair])
        beta = np.zeros_like(program.c)
        beta[at] = np.linalg.lstsq(program.G[np.ix_(at, at)], program.c[at], rcond=None)[0]
        out.append((pair, beta))
    return out


def _started(program: Program, members: Sequence[int], beta: Array) -> tuple[tuple[Candidate, ...], list[float]]:
    """Candidates with the sizes from which a refit starts; a pair of columns at the phase it has there."""
    chosen, sizes = [], program.sizes(beta)
    for i in members:
        candidate, own = program.candidates[i], beta[program.groups[i]]
        if own.size > 1:
            phase = {candidate.effect.paired: float(np.arctan2(own[1], own[0]))}
            candidate = replace(candidate, shape={**candidate.shape, **phase})
        chosen.append(candidate)
    near = [near_trial(candidate, float(sizes[i])) for i, candidate in zip(members, chosen, strict=True)]
    return tuple(chosen), near


def _condition(program: Program, sets: Sequence[EffectSet]) -> tuple[float, float]:
    """Irrepresentable condition and largest likeness of the best set."""
    if not sets:
        return 0.0, 0.0
    numbers = {_form(candidate): i for i, candidate in enumerate(program.candidates)}
    support = tuple(numbers[_form(candidate)] for candidate in sets[0].candidates)
    inside = np.concatenate([program.groups[i] for i in support])
    beta = np.zeros_like(program.c)
    beta[inside] = np.linalg.lstsq(program.G[np.ix_(inside, inside)], program.c[inside], rcond=1e-12)[0]
    others = np.setdiff1d(np.arange(beta.size), inside)
    norms = np.sqrt(np.diag(program.G))
    cosines = np.abs(program.G[np.ix_(inside, others)]) / np.outer(norms[inside], norms[others])
    return program.irrepresentable(support, beta), float(cosines.max(initial=0.0))


def _form(candidate: Candidate) -> tuple[Key, str]:
    """What makes two columns the same: an effect may have two forms, such as a cubic and a clip."""
    return candidate.key, candidate.effect.size.name
