"""One state feedback for every plant in a hull, also while the plant varies, with one certificate for all of them."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from .._arrays import Array
from .._checks import finite_number, quoted
from .._control import control
from .._drawing import axes_for
from ..errors import InputError, Outcome
from ..linear import Plant, close, made_by, read_plant
from ..verification import Certificate, establish
from ._arguments import choice, read_poles
from ._design import Design, RobustAgainst, as_system
from ._margins import Margins, margins
from ._outcomes import SynthesisCode
from ._polytope_program import Found, Wanted, find
from ._reached import Reached, reached
from ._slack_program import slack_design
from ._vertices import Vertices, blocking, read_vertices

_SPARES = (0.1, 0.02, 1e-3, 1e-5, 1e-6)  # of the speed of the plants: decay beyond what is asked, in turn
_SLACKS = (1e-3, 3e-3, 1e-2, 5e-2)  # of a bound above the least one of the program, in turn
_INSIDE = 1e-4  # of rate and region in the program of a bound, relative
_ROUNDING = 1e-6  # of a claim behind what floats say, so that it survives their rounding
_HALVINGS = 14


@dataclass(frozen=True)
class FeedbackDesign(Design):
    """A state feedback u = F x for every plant in the convex hull of some vertices.

    Parameters
    ----------
    controller : control.StateSpace
        F as a system from the states to the controls; zero where none was found.
    value : float
        Proven bound for all plants of the hull: of the norm, or with objective "stability" of the growth, -rate [1/s]
        (sampled the factor per sample, 1 - rate); infinity where nothing is proven.
    lower : float
        Estimate of what no state feedback of the worst vertex alone can beat; -infinity where none was computed.
    closed_loop : control.StateSpace
        Loop of the mean plant, in floats.
    certificates : list of Certificate
        Kind "polytope", about the numbers of the vertices and of F; `rt.verify` checks each again.
    robust_against : RobustAgainst
        What set of plants the claim covers.
    outcome : Outcome
        How it ended; its text is the remedy.
    method : str
        Program that gave the gain.
    solver : str
        What solved it.
    solve_time : float
        Time of the whole synthesis with its proofs [s].
    iterations : int
        Programs that were solved.
    plant : GeneralizedPlant or None
        Mean plant of the hull with its states as measurements.
    gain : ndarray, shape (m, n)
        F of u = F x [control unit per state unit].
    matrix : ndarray, shape (n, n)
        P of V = x'Px that falls for all plants; of the mean where there is one matrix per vertex.
    rate : float
        Proven rate: V falls at least as exp(-2 rate t) [1/s], sampled by the factor (1 - rate)² per sample.
    plants : tuple of control.StateSpace
        Plants at the vertices.
    """

    gain: Array = field(default_factory=lambda: np.zeros((0, 0)))
    matrix: Array = field(default_factory=lambda: np.zeros((0, 0)), repr=False)
    rate: float = 0.0
    plants: tuple[control.StateSpace, ...] = field(default=(), repr=False)

    @cached_property
    def margins(self) -> Margins:
        """Smallest margins over the vertices, as of `Design`, in floats; empty where a loop is not stable."""
        v = read_vertices(list(self.plants), len(self.gain), None, False)
        K = read_plant(self.controller)
        every = [margins(v.measured(np.eye(len(v))[k]), K, self.controller.output_labels) for k in range(len(v))]
        if not all(every):
            return {}
        return {name: {key: min(one[name][key] for one in every) for key in every[0][name]} for name in every[0]}

    def _facts(self) -> dict[str, Any]:
        return super()._facts() | {"gain": self.gain, "matrix": self.matrix, "rate": self.rate}

    def plot(self, ax: Any = None) -> Any:
        """Draw the eigenvalues of the loops at the vertices.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.

        Returns
        -------
        matplotlib.axes.Axes
        """
        ax = axes_for(ax)
        m = len(self.gain)
        poles = np.array([np.linalg.eigvals(one.A + one.B[:, -m:] @ self.gain) for one in self.plants]).ravel()
        ax.plot(poles.real, poles.imag, "x", label=f"loops at the {len(self.plants)} vertices")
        unit = "" if self.controller.dt else " [1/s]"
        ax.set(xlabel=f"real part{unit}", ylabel=f"imaginary part{unit}")
        ax.legend(loc="best")
        return ax


def polytopic_feedback(plants: Sequence[control.StateSpace], n_ctrl: int, *, rate: float = 0.0,
                       objective: str = "stability", n_out: int | None = None,
                       region: Mapping[str, float] | None = None, structure: Any = None) -> FeedbackDesign:
    """Design one state feedback for all plants in the convex hull of some vertices, with one certificate for all.

    x' = A x + B1 w + B2 u, z = C x + D1 w + D2 u (or x+), controls last among the inputs; u = F x. One quadratic form
    V = x'Px falls for every plant of the hull, so that the plant may also vary in any way. Where there is none, one
    form per vertex is tried: the claim is then about constant plants.

    Parameters
    ----------
    plants : sequence of control.StateSpace
        Plants at the vertices, with the same states, inputs and outputs, continuous or sampled.
    n_ctrl : int
        Number of controls u, the last inputs of every plant.
    rate : float
        Decay that is asked for: V falls at least as exp(-2 rate t) [1/s]; sampled by (1 - rate)² per sample [-].
    objective : {"stability", "hinf", "h2"}
        What is made small: the gain, at the rate asked for; the H-infinity norm from w to z; the H2 norm.
    n_out : int, optional
        Number of outputs that are z, the first ones; default all.
    region : mapping, optional
        Where the eigenvalues of every constant plant's loop have to lie: "decay" [1/s], "damping" [-], "radius" [1/s];
        sampled "radius" [-].
    structure : array_like of bool, shape (n_ctrl, n), optional
        Entries of F that may differ from zero; default all.

    Returns
    -------
    FeedbackDesign
        ``holds`` is False where nothing is proven; the text then names the best rate that was reached, or the plant of
        the hull and its mode that no input reaches.

    Raises
    ------
    InputError
        Plants of different sizes or states, numbers that are not finite, impossible n_ctrl, n_out, structure, region;
        for "h2" a direct path from w to z (continuous time).

    References
    ----------
    Bernussou, Peres and Geromel, Systems & Control Letters 13 (1989); Boyd, El Ghaoui, Feron and Balakrishnan (1994),
    section 7.2; de Oliveira, Bernussou and Geromel, Systems & Control Letters 37 (1999).

    Examples
    --------
    >>> import control, robthermal as rt
    >>> plants = [control.ss([[0, 1], [stiff, -0.1]], [[0], [1]], [[1, 0]], 0) for stiff in (-1.0, 2.0)]
    >>> d = rt.design.polytopic_feedback(plants, 1, rate=0.5)
    >>> d.holds, d.rate >= 0.5, rt.verify(d.certificates[0]).valid
    (True, True, True)
    """
    start = time.perf_counter()
    choice("objective", objective, ("stability", "hinf", "h2"))
    v = read_vertices(plants, n_ctrl, n_out, objective != "stability")
    listed = tuple(plants) if not isinstance(plants, control.StateSpace) else (plants,)
    asked = finite_number(rate, "rate", "1/s")
    if asked < 0 or (v.dt and asked >= 1):
        raise InputError(f"rate = {asked:g}", where="argument rate", expected="zero or above; sampled below 1")
    if objective == "h2" and not v.dt and (np.any(v.D1)):
        raise InputError("a direct path from w to z: the H2 norm is infinite", where="argument plants",
                         expected="D = 0 from w to z at every vertex", remedy="Filter the disturbance with a lag.")
    wanted = Wanted(objective, asked, read_poles(region, v.dt), _structure(structure, v))
    run = _Run(v, wanted)
    best = run.stable() if objective == "stability" else run.bounded()
    return _design(run, listed, best, time.perf_counter() - start)


@dataclass(frozen=True)
class _Best:
    """A gain with its proofs."""

    F: Array
    P: Array
    rate: float
    value: float
    certificates: list[Certificate]
    constant: bool


class _Run:
    """The programs of one design, counted."""

    def __init__(self, v: Vertices, wanted: Wanted):
        self.v, self.wanted, self.count = v, wanted, 0
        self.speed = 1.0 if v.dt else float(np.abs(np.linalg.eigvals(v.A)).max()) or 1.0

    def find(self, wanted: Wanted, level: float | None = None, v: Vertices | None = None) -> Found | None:
        self.count += 1
        return find(self.v if v is None else v, wanted, level)

    def stable(self) -> _Best | None:
        """Small gains that reach the rate, with some to spare where possible; else one matrix per vertex."""
        for found in self._spared(self.wanted):
            best = self._proven(found.gain, reached(self.v, found.gain, np.linalg.inv(found.W), "stability"))
            if best is not None:
                return best
        if self.wanted.poles:
            return None
        self.count += 1
        found_slack = slack_design(self.v, self.wanted)
        if found_slack is None:
            return None
        F, matrices, slack, rate = found_slack
        evidence = {"matrices": list(matrices), "slack": slack}
        cert = self._establish(F, {"measure": "stability", "rate": rate}, evidence)
        value = 1 - rate if self.v.dt else -rate
        return _Best(F, matrices.mean(axis=0), rate, value, [cert], True) if cert.holds else None

    def bounded(self) -> _Best | None:
        """The least bound of the program, then small gains at a little more."""
        wanted = replace(self.wanted, poles=_tighter(self.wanted.poles, _INSIDE))
        if wanted.rate > 0:
            wanted = replace(wanted, rate=wanted.rate + _INSIDE * (1 - wanted.rate if self.v.dt else wanted.rate))
        least = self.find(wanted)
        if least is None:
            return None
        for slack in _SLACKS:
            found = self.find(wanted, max(least.level, 1e-16) * (1 + slack) ** 2)
            if found is None:
                continue
            best = self._proven(found.gain, reached(self.v, found.gain, np.linalg.inv(found.W), self.wanted.objective))
            if best is not None:
                return best
        return None

    def _spared(self, wanted: Wanted) -> Iterator[Found]:
        for spare in _SPARES:
            more = wanted.rate + spare * self.speed if not self.v.dt else wanted.rate + spare * (1 - wanted.rate)
            found = self.find(replace(wanted, rate=more, poles=_tighter(wanted.poles, spare)))
            if found is not None:
                yield found

    def _proven(self, F: Array, here: Reached) -> _Best | None:
        """Certificates of what one matrix reaches; None where it is less than asked, or not proven."""
        asked, measure = self.wanted.rate, self.wanted.objective
        if not here.rate > asked or not (np.isfinite(here.bound) or measure == "stability"):
            return None
        rate = asked if asked > 0 and here.rate < 1.001 * asked else _shorter(here.rate * (1 - 1e-3), asked)
        found = []
        if measure == "stability" or asked > 0:
            found.append(self._establish(F, {"measure": "stability", "rate": rate}, {"matrix": here.P}))
        bound = float(f"{here.bound * (1 + _ROUNDING):.7g}") * (1 + 1e-7) if measure != "stability" else np.inf
        if measure != "stability":
            found.insert(0, self._establish(F, {"measure": measure, "bound": bound}, {"matrix": here.P}))
        if self.wanted.poles:
            found.append(self._establish(F, {"measure": "region", **self.wanted.poles}, {"matrix": here.P}))
        if not all(one.holds for one in found):
            return None
        value = bound if measure != "stability" else (1 - rate if self.v.dt else -rate)
        return _Best(F, here.P, rate if measure == "stability" or asked > 0 else 0.0, value, found, False)

    def _establish(self, F: Array, region: dict[str, Any], evidence: dict[str, Any]) -> Certificate:
        bounded = region["measure"] in ("hinf", "h2")
        return establish("polytope", system=self.v.section(F, bounded), region=region, evidence=evidence, margin={},
                         made_by=made_by("Clarabel semidefinite program", "candidate in floats"))

    def largest_rate(self) -> float:
        """Largest rate that one matrix reaches, by bisection on the program; not a number where none does."""
        low, high = np.nan, self.wanted.rate
        bottom = -2 * self.speed if not self.v.dt else -10.0
        for _ in range(_HALVINGS):
            middle = (high + (bottom if np.isnan(low) else low)) / 2
            found = self.find(replace(self.wanted, rate=middle, objective="stability", poles={}))
            here = None if found is None else reached(self.v, found.gain, np.linalg.inv(found.W), "stability")
            if here is not None and here.rate > middle - 1e-6 * self.speed:
                low = here.rate if np.isnan(low) else max(low, here.rate)
            else:
                high = middle
        return low

    def lower(self) -> float:
        """What the worst vertex alone allows, by the same program; -infinity for stability."""
        if self.wanted.objective == "stability" or len(self.v) > 12:
            return -np.inf
        parts = ("A", "B1", "B2", "C", "D1", "D2")
        every = [self.find(self.wanted, None, replace(self.v, **{key: getattr(self.v, key)[k:k + 1] for key in parts}))
                 for k in range(len(self.v))]
        return max((float(np.sqrt(max(one.level, 0.0))) for one in every if one is not None), default=-np.inf)


def _tighter(poles: Mapping[str, float], spare: float) -> dict[str, float]:
    """The region a little smaller, so that the solution lies inside."""
    change = {"decay": lambda x: x * (1 + spare), "damping": lambda x: x + spare * (1 - x),
              "radius": lambda x: x * (1 - spare)}
    return {key: change[key](value) for key, value in poles.items()}


def _shorter(value: float, least: float) -> float:
    """Four digits, rounded towards zero, where that stays at or above what was asked."""
    if not value > 0:
        return least
    digits = 3 - int(np.floor(np.log10(value)))
    short = float(np.floor(value * 10.0**digits) / 10.0**digits)
    return max(float(f"{short:.4g}") if float(f"{short:.4g}") <= value else short, least)


def _structure(structure: Any, v: Vertices) -> Array:
    n, _, m, _ = v.sizes
    if structure is None:
        return np.ones((m, n), bool)
    try:
        kept = np.asarray(structure, float)
    except (TypeError, ValueError):
        kept = np.zeros(0)
    if kept.shape != (m, n) or not np.isin(kept, (0.0, 1.0)).all() or not kept.any():
        raise InputError(f"structure = {quoted(structure)}", where="argument structure",
                         expected=f"{m} rows of {n} entries, true where the gain may differ from zero")
    return kept.astype(bool)


def _design(run: _Run, plants: tuple[control.StateSpace, ...], best: _Best | None, seconds: float) -> FeedbackDesign:
    v, first = run.v, plants[0]
    n, w, m, p = v.sizes
    F = np.zeros((m, n)) if best is None else best.F
    mean = v.measured(np.full(len(v), 1 / len(v)))
    K = Plant(np.zeros((0, 0)), np.zeros((0, n)), np.zeros((m, 0)), F, v.dt)
    controller = as_system(K, list(first.state_labels), list(first.input_labels[-m:]))
    shown = (close(mean.joined, K) if w and p else  # without w and z: from what is added to u, to the states
             Plant(mean.A + mean.B2 @ F, mean.B2, np.eye(n), np.zeros((n, m)), v.dt))
    loop = as_system(shown, [f"w{k + 1}" for k in range(shown.D.shape[1])], [f"z{k + 1}" for k in range(len(shown.D))])
    outcome = _refused(run) if best is None else _said(run, best)
    return FeedbackDesign(controller, np.inf if best is None else best.value, -np.inf if best is None else run.lower(),
                          loop, [] if best is None else best.certificates, _robust(run, best), outcome,
                          "state feedback over a polytope (matrix inequalities)", "Clarabel", seconds, run.count, mean,
                          F, np.eye(n) if best is None else best.P, 0.0 if best is None else best.rate, plants)


def _robust(run: _Run, best: _Best | None) -> RobustAgainst:
    if best is None:
        return RobustAgainst("Nothing is proven, of these plants or of others.")
    how = "as long as it is constant" if best.constant else "constant or varying with time in any way"
    return RobustAgainst(f"Proven for every plant in the convex hull of the {len(run.v)} vertices, {how}.",
                         {"vertices": float(len(run.v))})


def _said(run: _Run, best: _Best) -> Outcome:
    unit = "per sample" if run.v.dt else "1/s"
    if run.wanted.objective == "stability":
        how = ("one form per vertex decays" if best.constant else "one quadratic form x'Px decays")
        said = f"{how} with a rate of {best.rate:.6g} {unit} or more for all plants of the hull"
    else:
        said = f"{'H-infinity' if run.wanted.objective == 'hinf' else 'H2'} norm below {best.value:.7g} for all plants"
    return SynthesisCode.CERTIFIED.outcome(f"Certified for the numbers of the gain as returned: {said}.")


def _refused(run: _Run) -> Outcome:
    """The plant that blocks, or the best rate that is reached."""
    asked = run.wanted.rate
    blocks = blocking(run.v, asked)
    if blocks:
        return SynthesisCode.INFEASIBLE.outcome(f"No state feedback reaches {_say_rate(asked)}: {blocks}.",
                                                remedy="Add a control, or leave this plant out of the hull.")
    best = run.largest_rate()
    if np.isfinite(best) and best < asked:
        return SynthesisCode.INFEASIBLE.outcome(
            f"rate = {asked:g}: the best achievable with one quadratic form for all plants is about {best:.4g}.")
    return SynthesisCode.INFEASIBLE.outcome(
        f"No gain with one quadratic form for all plants was found at {_say_rate(asked)}, nor with one per vertex.",
        remedy="Ask for less, take fewer or closer vertices, or add controls.")


def _say_rate(rate: float) -> str:
    return f"a rate of {rate:g}" if rate else "stability"
