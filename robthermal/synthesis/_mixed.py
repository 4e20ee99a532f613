"""Mixed synthesis: the smallest H2 norm of some channels under a bound of the H-infinity norm of others."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .._checks import positive_number, quoted
from .._control import control
from ..errors import InputError, Outcome
from ..linear import Plant, close, h2_norm, plant_norm, prove_closed_loop
from ..verification import Certificate
from . import _h2 as h2_synthesis
from ._arguments import read_poles, state_space
from ._design import Design, RobustAgainst, named, zero_controller
from ._hinf import best_of, central_family
from ._inequalities import MOST_STATES, Aims, solved_for
from ._outcomes import SynthesisCode
from ._plant import GeneralizedPlant, chosen, read_generalized

Choice = tuple[Sequence[int], Sequence[int]]
_LEVELS = 25  # central controllers that are compared
_FARTHEST = 1e3  # times the bound: levels of central controllers
_BISECTIONS = 5  # of the level that the inequalities are asked for, above the bound that is wanted
_CLOSE = 1e-3  # relative to the H2 optimum: good enough
_BELOW = 1 - 1e-5  # of the bound: what a candidate in floats has to keep
_SLACKS = (1e-5, 1e-4, 1e-3, 1e-2)  # of the H2 bound above the norm in floats


@dataclass(frozen=True)
class _Problem:
    """Plant, its two sets of channels, the bound and the region."""

    plant: GeneralizedPlant
    norm2: GeneralizedPlant
    norminf: GeneralizedPlant
    choice2: Choice
    choiceinf: Choice
    limit: float
    poles: Mapping[str, float]

    def evaluated(self, K: Plant) -> float:
        """H2 norm in floats, infinity where the bound or the region is not kept."""
        try:
            loop = close(self.norm2.joined, K)
        except InputError:
            return np.inf
        norm = h2_norm(loop)
        if not np.isfinite(norm) or not _inside(loop, self.poles):
            return np.inf
        return norm if self.hinf(K) <= self.limit * _BELOW else np.inf

    def hinf(self, K: Plant) -> float:
        """H-infinity norm of its channels in floats."""
        loop = close(self.norminf.joined, K)
        return plant_norm(loop)[0] if loop.stable else np.inf


def mixed(P: control.StateSpace, n_meas: int, n_ctrl: int, *, hinf_limit: float, h2: Choice | None = None,
          hinf: Choice | None = None, region: Mapping[str, float] | None = None) -> Design:
    """Design the controller with the smallest H2 norm that keeps an H-infinity norm below a limit, and prove both.

    Candidates are the H2 controller, central H-infinity controllers at many levels, and controllers by the matrix
    inequalities of Scherer, Gahinet and Chilali. They are compared by the norms that they reach, so that the result is
    never worse than a central controller. Conventions are those of `hinf`.

    Parameters
    ----------
    P : control.StateSpace
        Generalized plant, continuous or sampled.
    n_meas, n_ctrl : int
        Numbers of measurements y and of controls u.
    hinf_limit : float
        Bound of the H-infinity norm [output unit per input unit].
    h2, hinf : tuple of (outputs, inputs), optional
        Which performance outputs and disturbances each norm is about, counted from 0; by default all.
    region : mapping, optional
        Where the closed-loop eigenvalues have to lie: "decay" [1/s], "damping" [-], "radius" [1/s]; sampled "radius"
        [-].

    Returns
    -------
    Design
        ``value``: proven H2 norm; certificates of the H2 norm, of the H-infinity norm below the limit, and of the
        region. ``lower``: the smallest H2 norm of any controller, limit and region ignored.

    Raises
    ------
    InputError
        As `h2`, about its channels; channels that do not exist.

    References
    ----------
    Scherer, Gahinet and Chilali, IEEE Transactions on Automatic Control 42 (1997); Chilali and Gahinet, 41 (1996).

    Examples
    --------
    >>> import control, robthermal as rt
    >>> P = control.ss([[1.0]], [[1, 0, 1]], [[1], [0], [1]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]])  # x' = x + w1 + u
    >>> d = rt.design.mixed(P, 1, 1, hinf_limit=3.0)  # optima: H-infinity 1 + √3, H2 4.06
    >>> d.holds, 4.06 < d.value < 7.2, [c.region["bound"] for c in d.certificates[1:]]
    (True, True, [3.0])
    """
    start = time.perf_counter()
    plant = read_generalized(P, n_meas, n_ctrl)
    limit = positive_number(hinf_limit, "hinf_limit")
    choices = [_read(choice, plant, name) for choice, name in ((h2, "h2"), (hinf, "hinf"))]
    problem = _Problem(plant, chosen(plant, *choices[0]), chosen(plant, *choices[1]), choices[0], choices[1], limit,
                       read_poles(region, plant.dt))
    direct = h2_synthesis.direct_gain(problem.norm2)
    best2, lower, _ = h2_synthesis.best_of(problem.norm2, direct)
    found, count, best = _best(problem, None if best2 is None else best2[1], lower)
    if found is None:
        return _result(P, problem, None, [], _none(limit, best, problem.poles), lower, start, count, "none")
    certificates, outcome = _proven(problem, found[1])
    return _result(P, problem, found[1], certificates, outcome, lower, start, count, found[2])


def _read(choice: object, plant: GeneralizedPlant, name: str) -> Choice:
    counts = len(plant.C1), plant.B1.shape[1]
    if choice is None:
        return list(range(counts[0])), list(range(counts[1]))
    good = isinstance(choice, Sequence) and not isinstance(choice, str) and len(choice) == 2 and all(
        isinstance(part, Sequence) and not isinstance(part, str) and len(part) and len(set(part)) == len(part)
        and all(isinstance(k, (int, np.integer)) and not isinstance(k, bool) and 0 <= k < count for k in part)
        for part, count in zip(choice, counts, strict=True))
    if not good:
        raise InputError(f"{name} = {quoted(choice)}", where=f"argument {name}",
                         expected=f"(outputs, inputs): different whole numbers from 0 to {counts[0] - 1} and from 0 to "
                                  f"{counts[1] - 1}")
    assert isinstance(choice, Sequence)
    return [int(k) for k in choice[0]], [int(k) for k in choice[1]]


def _best(problem: _Problem, of_h2: Plant | None, lower: float) -> tuple[tuple[float, Plant, str] | None, int, float]:
    """Best controller with its norm and its name, how many there were, and the smallest H-infinity norm known."""
    best: tuple[float, Plant, str] | None = None
    count, smallest = 0, np.inf
    if of_h2 is not None:
        best, count = _better(problem, best, of_h2, "Riccati equations (H2)"), 1
    if best is not None and best[0] <= lower * (1 + _CLOSE):
        return best, count, smallest
    reached, smallest = best_of(problem.norminf, 0.005, problem.limit, problem.poles, None)
    if reached is not None:
        levels = (problem.limit * np.geomspace(1, _FARTHEST, _LEVELS)).tolist()
        for K in (reached.K, *central_family(problem.norminf, reached.channels, levels, problem.poles)):
            best, count = _better(problem, best, K, "central controller (Glover and Doyle)"), count + 1
    known = best[1] if best is not None else reached.K if reached is not None else of_h2
    for K in _by_inequalities(problem, known):
        best, count = _better(problem, best, K, "matrix inequalities (Scherer, Gahinet and Chilali)"), count + 1
    return best, count, smallest


def _better(problem: _Problem, best: tuple[float, Plant, str] | None, K: Plant,
            name: str) -> tuple[float, Plant, str] | None:
    norm = problem.evaluated(K)
    return (norm, K, name) if np.isfinite(norm) and (best is None or norm < best[0]) else best


def _by_inequalities(problem: _Problem, known: Plant | None) -> Iterator[Plant]:
    """One Lyapunov matrix for both norms is cautious: larger levels are asked for while the bound is kept."""
    if known is None or len(problem.plant.A) > MOST_STATES:
        return
    starts = [known]  # of the coordinates
    if problem.poles:  # the region with one norm alone
        for aims in (Aims(None, problem.norminf, None, problem.poles), Aims(problem.norm2, None, None, problem.poles)):
            found = solved_for(problem.plant, aims, starts[0])
            if found is not None:
                starts.insert(0, found)
                yield found
    low, high = problem.limit, 4 * problem.limit
    for step in range(_BISECTIONS + 1):
        level = float(np.sqrt(low * high)) if step else low
        own = [K for K in (solved_for(problem.plant, Aims(problem.norm2, problem.norminf, level, problem.poles), start)
                           for start in starts) if K is not None]
        yield from own
        if own and min(problem.hinf(K) for K in own) <= problem.limit:
            low = level
        elif step:
            high = level


def _inside(loop: Plant, poles: Mapping[str, float]) -> bool:
    values = loop.poles
    return bool((values.real < -poles.get("decay", 0.0)).all() if not loop.dt else True) and bool(
        (abs(values) < poles.get("radius", np.inf)).all()) and bool(
        (-values.real >= poles.get("damping", -np.inf) * abs(values)).all() if "damping" in poles else True)


def _proven(problem: _Problem, K: Plant) -> tuple[list[Certificate], Outcome]:
    """Certificates of what the controller reaches, and how that ended."""
    norm = max(problem.evaluated(K), 1e-12)
    joined = problem.plant.joined
    for slack in _SLACKS:
        first = prove_closed_loop(joined, K, measure="h2", bound=norm * (1 + slack), channels=problem.choice2)
        if first.holds:
            break
    found = [first, prove_closed_loop(joined, K, bound=problem.limit, channels=problem.choiceinf)]
    if problem.poles:
        found.append(prove_closed_loop(joined, K, measure="region", poles=problem.poles))
    if not all(one.holds for one in found):
        reason = next(one.reason for one in found if not one.holds)
        return found, SynthesisCode.NOT_CERTIFIED.outcome(
            f"The best candidate keeps the limits in floats, which is not proven: {reason}.")
    return found, SynthesisCode.CERTIFIED.outcome(
        f"Certified for the numbers of the controller as returned: H2 norm below {first.region['bound']:.7g}, "
        f"H-infinity norm below {problem.limit:.7g}.")


def _none(limit: float, smallest: float, poles: Mapping[str, float]) -> Outcome:
    if smallest < limit:
        return SynthesisCode.NOT_FOUND.outcome(
            f"hinf_limit = {limit:g}: no candidate keeps it together with {dict(poles) or 'a finite H2 norm'}; the "
            f"H-infinity norm alone can be made about {smallest:#.4g}.")
    if not np.isfinite(smallest):
        return SynthesisCode.NOT_FOUND.outcome()
    return SynthesisCode.INFEASIBLE.outcome(f"hinf_limit = {limit:g}: the best achievable is about {smallest:#.4g}.")


def _result(P: control.StateSpace, problem: _Problem, K: Plant | None, certificates: list[Certificate],
            outcome: Outcome, lower: float, start: float, count: int, method: str) -> Design:
    plant = problem.plant
    controller, loop = named(state_space(P), plant, zero_controller(plant) if K is None else K)
    value = float(certificates[0].region["bound"]) if outcome.ok else np.inf
    robust = RobustAgainst("Nothing is proven, of this plant or of others.")
    if outcome.ok:
        robust = RobustAgainst("The H2 norm is proven for the plant as given, alone; stability also for every stable "
                               "perturbation w = Delta z of the H-infinity channels with a norm of up to "
                               f"{1 / problem.limit:.6g}.", {"delta_norm": 1 / problem.limit})
    return Design(controller, value, lower, loop, certificates if outcome.ok else [], robust, outcome, method,
                  "floats", time.perf_counter() - start, count, plant)
