"""Coupling filters by convex optimization: solve, look between the frequencies, prove, back off until it holds."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..._arrays import Array
from ...errors import InputError, Outcome
from .._outcomes import CouplingCode
from ..evaluation import Filters, finish, refused
from ..factors import Uncertainty
from ..problem import NORMS, Problem, prepare
from ..systems import LTI
from ._basis import make_basis
from ._design import Design, Limits, default_pole
from ._program import solve

_FIELDS = {key: norm.limit for key, norm in NORMS.items() if norm.limit} | {"msd": "msd"}  # of `Limits`
_MARGINS = {key: norm.proof_margin for key, norm in NORMS.items()}
_ATTEMPTS = 6
_WIDER = 1000.0  # cut-off of Z over the fastest corner, where the peak in continuous time is what counts
_DECADES = (1.0, 10.0, 100.0)  # of the default pole: a flat spectrum needs filters that act far above the bandwidth
_SPARE = 2e-3  # taken off beyond what a bound was missed by
_BARELY = CouplingCode.NOT_PROVEN.outcome(
    "Filters meet the limits on a grid of frequencies, but too barely for a proof between them.",
    remedy="Relax the limits by a percent. Both filters are zero.")


def synthesize(
    P1: LTI, P2: LTI, C1: LTI, C2: LTI, *,
    uncertainty: Uncertainty | Sequence[Any] | None = None,
    disturbances: tuple[Any, Any] = (1, 1),
    weight: Any = 1,
    window: float | None = None,
    msd_limit: float | None = None,
    objective: str = "h2",
    hinf_limit: float | None = None,
    improvement_limit: float | None = None,
    margin: float = 0.1,
    stable_controller: bool = False,
    basis: str = "laguerre",
    order: int = 24,
    pole: complex | Sequence[complex] | None = None,
    couple: Sequence[str] = ("X", "Y"),
    cutoff: float | None = None,
) -> Filters:
    """Design coupling filters that make the synchronization error small, and prove what they reach.

    X̂ and Ŷ are combinations of stable basis functions; every map of the coupled loop is affine in the coefficients
    (Evers 2021, Theorem 6.4 (b)), so the design is one second-order cone program. Robustness ``|X̂||Ŷ| r1 r2`` is not
    convex; ellipses inside it that touch it at the last solution are, and are refitted a few times. What comes back is
    evaluated anew: norms valid at every frequency, certificates, and beside them the solver's own values (`requested`).

    Parameters
    ----------
    P1, P2, C1, C2 : control.StateSpace or control.TransferFunction
        Nominal plants and their controllers, negative feedback, one sample time; each loop stable.
    uncertainty : Uncertainty or list of measured 2x2 plants, optional
        What the filters must tolerate; frequency responses are turned into one by `dual_youla`.
    disturbances : pair of LTI or number
        Shaping filters of v1, v2: white noise of variance 1 per sample (continuous: spectral density 1) to [m].
    weight : LTI or number
        Filter on e12. Not together with `window`.
    window : float, optional
        Exposure time [s], discrete only: the moving average of e12 over round(window/dt) samples is minimized.
    msd_limit : float, optional
        With `window`: largest moving standard deviation, relative to the uncoupled one [-].
    objective : {"h2", "hinf", "mixed"}
        Variance of weighted e12, peak of its spectrum, or variance below `hinf_limit`.
    hinf_limit : float, optional
        With "mixed": bound of || weight [(1+Y)S1W1, (1+X)S2W2] ||_inf.
    improvement_limit : float, optional
        Bound of ||1+X||_inf and ||1+Y||_inf [-].
    margin : float
        The robust number stays below 1 - margin [-].
    stable_controller : bool
        Keep ||XY||_inf < 1 as well: the controller then has no unstable poles that C1, C2 do not have.
    basis : {"laguerre", "fir", "poles"}
        Family of basis functions; "fir" in discrete time only.
    order : int
        Coefficients of each filter; ignored by "poles".
    pole : float or sequence of complex, optional
        Laguerre pole (default: from the bandwidth; "hinf" in continuous time: the best of it, 10 and 100 times it), or
        the list of "poles". Continuous: negative real part [rad/s].
    couple : sequence of str
        Filters that may be nonzero: ("X",) and ("Y",) are master-slave. With both allowed, one is still left out where
        the uncertainty is so large that the other alone does more.
    cutoff : float, optional
        Continuous time: corner of the low-pass in Z [rad/s]. Default: ten times the fastest pole or zero of the plant;
        with "hinf" a thousand times the fastest corner of either loop, since every roll-off below costs peak.

    Returns
    -------
    Filters
        Without a filter that meets every demand and is proven to: X = Y = 0 and an outcome that says why.

    Raises
    ------
    InputError
        For loops, sample times, frequency responses or options that make no sense.

    Examples
    --------
    >>> import robthermal as rt
    >>> machine = rt.systems.scanner()
    >>> filters = rt.coupling.synthesize(machine.P1, machine.P2, machine.C1, machine.C2, window=0.01, msd_limit=1.2,
    ...                                  disturbances=machine.disturbances, order=8)
    >>> filters.holds, bool(filters.performance.ma_before / filters.performance.ma_after > 3.5)
    (True, True)
    """
    started = time.perf_counter()
    prepared = partial(prepare, P1, P2, C1, C2, uncertainty=uncertainty, disturbances=disturbances, weight=weight,
                       window=window)
    problem = prepared(cutoff=cutoff)
    _check_goal(objective, hinf_limit, window, msd_limit)
    _check_numbers(margin=margin, order=order, msd_limit=msd_limit, hinf_limit=hinf_limit,
                   improvement_limit=improvement_limit)
    _check_choice("basis", basis, ("laguerre", "fir", "poles"))
    flat = objective == "hinf" and not problem.dt
    if flat and cutoff is None:
        problem = prepared(cutoff=_WIDER * _fastest(problem))
    limits = Limits(msd=msd_limit, hinf=hinf_limit, improvement=improvement_limit,
                    robust=None if problem.uncertainty is None else 1 - margin,
                    product=1.0 if stable_controller else None)
    designs = [Design(problem, make_basis(basis, order, each, problem.dt), "hinf" if objective == "hinf" else "h2",
                      read_couple(couple)) for each in _poles(problem, basis, pole, flat)]
    return _prove_or_back_off(*_most_effective(designs, limits), limits, started)


def _fastest(problem: Problem) -> float:
    """Largest corner of both loops [rad/s]."""
    return float(np.max([np.abs(half.S.poles).max(initial=0.0) for half in (problem.one, problem.two)])) or 1.0


def _poles(problem: Problem, basis: str, pole: complex | Sequence[complex] | None, flat: bool) -> list[Any]:
    """What `make_basis` is asked for: the pole given, or the default ones of a Laguerre basis."""
    if basis != "laguerre" or pole is not None:
        return [pole]
    own = default_pole(problem)
    return [own * factor for factor in _DECADES] if flat else [own]


def _most_effective(designs: list[Design], limits: Limits) -> tuple[Design, Array | None]:
    """The best basis, both ways or one way, with coefficients to start from.

    Against a large uncertainty one filter alone does more.
    """
    ways = list(designs)
    if all(designs[0].free) and (limits.robust is not None or limits.product is not None):
        ways += [replace(design, free=free) for design in designs for free in ((True, False), (False, True))]
    found = [(solve(way.responses, way.demands(limits)), way) for way in ways]
    solved = [(solution, way) for solution, way in found if solution.solved]
    if not solved:
        return designs[0], None
    solution, way = min(solved, key=lambda pair: pair[0].value)
    return way, solution.coefficients


def _prove_or_back_off(design: Design, start: Array | None, limits: Limits, started: float) -> Filters:
    """Solve inside the limits; where one is missed by what can be proven, ask for that much less and solve again."""
    tried, asked = limits, _asked(design, limits)
    requested: dict[str, float] = {}
    outcome = _BARELY
    for _ in range(_ATTEMPTS):
        solution = solve(design.responses, design.demands(tried), start)
        if not solution.solved:
            outcome = _infeasible(design, limits) if tried == limits else outcome
            break
        requested, start = design.values(solution.coefficients), solution.coefficients
        excess = _excess(requested | design.relative_spread(solution.coefficients), asked, _MARGINS)
        if all(ratio <= 1 for ratio in excess.values()):  # proofs take longest: only where they can succeed
            X_hat, Y_hat = (design.basis.filter(c) for c in solution.coefficients)
            filters = finish(design.problem, X_hat, Y_hat, basis=design.basis.name, order=design.basis.size,
                             requested=requested, asked=asked, solve_time=time.perf_counter() - started)
            if filters.holds:
                return filters
            outcome = filters.outcome
            spread = filters.performance.msd_after / filters.performance.msd_before
            excess = _excess(filters.norms | {"msd": spread}, asked, {})
        tried = _tightened(tried, excess)
    return refused(design.problem, outcome, basis=design.basis.name, order=design.basis.size,
                   solve_time=time.perf_counter() - started, requested=requested)


def _asked(design: Design, limits: Limits) -> dict[str, float]:
    """The limits as `finish` names them."""
    Y_acts, X_acts = design.free[1], design.free[0]
    acting = {"improvement_1": Y_acts, "improvement_2": X_acts}
    named = {name: getattr(limits, field) for name, field in _FIELDS.items() if acting.get(name, True)}
    return {name: bound for name, bound in named.items() if bound is not None}


def _excess(reached: dict[str, float], asked: dict[str, float], margins: dict[str, float]) -> dict[str, float]:
    """What was reached, with the margin its proof needs, over what was asked."""
    return {name: reached[name] * margins.get(name, 1.0) / bound for name, bound in asked.items()}


def _tightened(limits: Limits, excess: dict[str, float]) -> Limits:
    """Limits lowered by what they were missed by; all of them a little when none was missed (the proof failed)."""
    missed = {name: ratio for name, ratio in excess.items() if ratio > 1} or dict.fromkeys(excess, 1 + _SPARE)
    lowered: dict[str, float] = {}
    for name, ratio in missed.items():
        field = _FIELDS[name]
        bound = getattr(limits, field) / ratio * (1 - _SPARE)
        lowered[field] = min(bound, lowered.get(field, bound))
    return replace(limits, **lowered)


def _infeasible(design: Design, limits: Limits) -> Outcome:
    """Which of the limits on performance no filter meets, and what the smallest possible value is."""
    names = {"msd": ("msd_limit", limits.msd, 1.0), "hinf": ("hinf_limit", limits.hinf, design.size),
             "improvement": ("improvement_limit", limits.improvement, 1.0)}
    sentences = []
    for what, (argument, bound, unit) in names.items():
        if bound is None:
            continue
        smallest = solve(design.responses, design.least(what, limits)).value * unit
        if not smallest <= bound:
            sentences.append(f"{argument} = {bound:g} is below what is possible: {smallest:.4g} is the smallest value "
                             "that filters of this basis and uncertainty reach")
    text = "; ".join(sentences) or "each limit is possible alone, all of them together are not"
    return CouplingCode.INFEASIBLE.outcome(f"No coupling filter: {text}.")


def _check_goal(objective: str, hinf_limit: float | None, window: float | None, msd_limit: float | None) -> None:
    _check_choice("objective", objective, ("h2", "hinf", "mixed"))
    if (objective == "mixed") != (hinf_limit is not None):
        raise InputError(f'objective = "{objective}" with hinf_limit = {hinf_limit}', where="synthesize",
                         expected='a hinf_limit with objective "mixed", and only there')
    if window is not None and objective == "hinf":
        raise InputError('window with objective = "hinf"', where="synthesize",
                         expected='objective "h2" or "mixed": a window asks for the variance of the moving average')
    if msd_limit is not None and window is None:
        raise InputError(f"msd_limit = {msd_limit} without a window", where="synthesize",
                         expected="window, the exposure time [s], which defines the moving standard deviation")


def _check_numbers(*, margin: float, order: int, **limits: float | None) -> None:
    if not 0 <= margin < 1:
        raise InputError(f"margin = {margin}", where="synthesize", expected="a number from 0 up to, not including, 1",
                         remedy="The robust number stays below 1 - margin.")
    if isinstance(order, bool) or not isinstance(order, (int, np.integer)) or order < 1:
        raise InputError(f"order = {order!r}", where="synthesize", expected="a positive number of coefficients")
    for name, bound in limits.items():
        if bound is not None and not 0 < bound < np.inf:
            raise InputError(f"{name} = {bound}", where="synthesize", expected="a positive number")


def _check_choice(argument: str, value: Any, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise InputError(f"{argument} = {value!r}", where="synthesize", expected=" or ".join(f'"{c}"' for c in choices))


def read_couple(couple: Sequence[str]) -> tuple[bool, bool]:
    """Which filters may act, from the names.

    Parameters
    ----------
    couple : sequence of str
        "X", "Y" or both.
    """
    names = [couple] if isinstance(couple, str) else list(couple)
    if not names or not all(name in ("X", "Y") for name in names):
        raise InputError(f"couple = {couple!r}", where="synthesize", expected='("X", "Y"), ("X",) or ("Y",)')
    return "X" in names, "Y" in names
