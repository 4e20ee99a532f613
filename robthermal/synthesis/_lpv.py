"""Gain scheduling: a controller that changes with measured quantities, for every plant in a hull, also a moving one."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._arrays import Array
from .._checks import positive_number, quoted
from .._control import control
from ..errors import InputError, Outcome
from ..linear import Plant, close, made_by
from ..verification import Certificate, establish
from ._design import RobustAgainst, as_system, named, zero_controller
from ._hinf import best_of
from ._lpv_design import LpvDesign, average
from ._lpv_filters import Filters, filters_for
from ._lpv_program import MOST_UNKNOWNS, Scheduled, scheduled, unknowns_of
from ._outcomes import SynthesisCode
from ._plant import GeneralizedPlant, read_generalized
from ._reached import reached
from ._schedule import Schedule, read_schedule
from ._vertices import Vertices, read_vertices

_ROUNDING = 1e-6  # of a bound above what floats say, so that it survives their rounding
_ENOUGH = 1.001  # of the level that controllers are made for: what they reach is good enough
_MOST_LOWER = 16  # vertices whose own optimum is computed


def lpv(plants: Sequence[control.StateSpace], scheduling: Mapping[str, Sequence[float]], n_meas: int, n_ctrl: int, *,
        rates: Mapping[str, float] | None = None, gamma: float | None = None) -> LpvDesign:
    """Design a controller scheduled by measured quantities, for all plants in the convex hull of some vertices.

    The plant is the average of the vertices with weights that depend on the scheduling quantities; the controller is
    the average of the controllers at the vertices with the same weights. One quadratic form proves the H-infinity norm
    for all of them, so that the quantities may vary in any way. Conventions are those of `hinf`.

    Parameters
    ----------
    plants : sequence of control.StateSpace
        Generalized plants at the vertices, with the same states, inputs and outputs, continuous or sampled.
    scheduling : mapping
        Values of the scheduling quantities by name [their units]: one per plant, or along the axes of a grid whose
        points, the last quantity fastest, are the plants.
    n_meas, n_ctrl : int
        Numbers of measurements y and of controls u.
    rates : mapping, optional
        Largest rate of every quantity [its unit per second]. What is proven holds for every rate; with rates given the
        outcome also says how far below that bound any design could come that makes use of them.
    gamma : float, optional
        Norm that is enough [output unit per input unit]; the controllers are then made for it, not for the optimum.

    Returns
    -------
    LpvDesign
        ``holds`` is False where nothing is proven, or less than gamma; the text names the best that is reached.

    Raises
    ------
    InputError
        Plants of different sizes or states, numbers that are not finite, impossible n_meas, n_ctrl, scheduling, rates;
        a mode of a vertex that is not stabilisable or not detectable (it is named); too many vertices for the program.

    Notes
    -----
    Where B2, C2, D12, D21 differ between the vertices, or D22 is not zero, lags in front of u or behind y, ten times as
    fast as the plants (sampled: of one sample), are part of the controller, so that no product of two varying factors
    appears in the loop. A plant between the vertices that is not their average at its weights is not covered.

    References
    ----------
    Apkarian, Gahinet and Becker, Automatica 31 (1995); Scherer, Gahinet and Chilali, IEEE Transactions on Automatic
    Control 42 (1997).

    Examples
    --------
    >>> import control, robthermal as rt
    >>> plants = [control.ss([[a]], [[1, 0, 1]], [[1], [0], [1]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]]) for a in (-1, 1)]
    >>> d = rt.design.lpv(plants, {"a": [-1.0, 1.0]}, 1, 1)  # x' = a x + w1 + u; for a = 1 alone the optimum is 1 + √3
    >>> d.holds, 2.73 < d.value < 2.77, rt.verify(d.certificates[0]).valid
    (True, True, True)
    >>> d.gain({"a": 0.25}).nstates
    1
    """
    start = time.perf_counter()
    listed = [plants] if isinstance(plants, control.StateSpace) else plants
    read_vertices(listed, n_ctrl, None, True)  # alike, finite
    given = [read_generalized(one, n_meas, n_ctrl, f"argument plants[{k}]") for k, one in enumerate(listed)]
    schedule = read_schedule(scheduling, len(given))
    _check_rates(rates, schedule)
    asked = None if gamma is None else positive_number(gamma, "gamma")
    unknowns = unknowns_of(given[0], len(given))
    if unknowns > MOST_UNKNOWNS:
        raise InputError(f"{len(given)} vertices of {len(given[0].A)} states: {unknowns} unknowns",
                         where="argument plants", expected=f"at most {MOST_UNKNOWNS}",
                         remedy="Take fewer vertices, or reduce the plants.")
    run = _Run(given, filters_for(given), asked)
    return run.design(listed, schedule, rates is not None, start)


def _check_rates(rates: Any, schedule: Schedule) -> None:
    if rates is None:
        return
    if not isinstance(rates, Mapping) or set(rates) != set(schedule.names):
        raise InputError(f"rates = {quoted(rates)}", where="argument rates",
                         expected=f"one number for each of {list(schedule.names)}")
    for name, value in rates.items():
        positive_number(value, f"rates[{name!r}]")


@dataclass
class _Run:
    """One design: plants, the lags that are added, the norm asked for."""

    given: list[GeneralizedPlant]
    filters: Filters
    asked: float | None
    count: int = 0
    level: float = np.inf

    def design(self, listed: Sequence[control.StateSpace], schedule: Schedule, rates: bool, start: float) -> LpvDesign:
        """The result."""
        mean, best = _mean(self.given), self._best()
        lower = -np.inf
        if len(self.given) <= _MOST_LOWER:
            optima = [best_of(one, 0.005, None, {}, None)[1] for one in self.given]
            lower = max((value for value in optima if np.isfinite(value)), default=-np.inf)
        holds = best is not None and (self.asked is None or best[2] <= self.asked)
        shown = best[0] if holds and best is not None else [zero_controller(mean)] * len(self.given)
        controller, loop = named(listed[0], mean, average(shown, np.full(len(shown), 1 / len(shown))))
        labels = list(controller.input_labels), list(controller.output_labels)
        method = "scheduled controllers over a polytope (matrix inequalities)" + self.filters.words
        return LpvDesign(controller, best[2] if holds and best is not None else np.inf, lower, loop,
                         [best[1]] if holds and best is not None else [], self._robust(holds, rates),
                         self._said(best, holds, lower if rates else -np.inf), method, "Clarabel",
                         time.perf_counter() - start, self.count, mean,
                         tuple(as_system(K, *labels) for K in shown), tuple(listed),
                         dict(zip(schedule.names, schedule.points.T, strict=True)))

    def _best(self) -> tuple[list[Plant], Certificate, float] | None:
        """Controllers, certificate and bound; None where nothing is proven."""
        work = [self.filters.before(plant) for plant in self.given]
        mean = _mean(work)
        known = best_of(mean, 0.005, None, {}, None)[0]
        if known is None:
            return None
        best: tuple[list[Plant], Certificate, float] | None = None
        for found in scheduled(work, mean, known.K, self.asked):
            self.count, self.level = self.count + 1, found.least
            made = self._proven(found)
            if made is not None and (best is None or made[2] < best[2]):
                best = made
            if best is not None and best[2] <= _ENOUGH * found.level:
                break
        return best

    def _proven(self, found: Scheduled) -> tuple[list[Plant], Certificate, float] | None:
        """The lags moved from the plants to the controllers, and the proof about the plants as given."""
        controllers = [self.filters.behind(K) for K in found.controllers]
        loops = [close(plant.joined, K) for plant, K in zip(self.given, controllers, strict=True)]
        n = len(loops[0].A)  # the states of the program's loops in the same order: plant, lags of u and y, controller
        A, B, C, D = (np.array([getattr(one, key) for one in loops]) for key in "ABCD")
        v = Vertices(A, B, np.zeros((len(A), n, 0)), C, D, np.zeros((*C.shape[:2], 0)), self.given[0].dt)
        here = reached(v, np.zeros((0, n)), found.P, "hinf")
        if not np.isfinite(here.bound):
            return None
        bound = float(f"{here.bound * (1 + _ROUNDING):.7g}") * (1 + 1e-7)
        system = {"vertices": [_matrices(plant.joined) for plant in self.given],
                  "controller": [_matrices(K) for K in controllers], "n_meas": len(self.given[0].C2),
                  "n_ctrl": self.given[0].B2.shape[1], "sample_time": self.given[0].dt}
        certificate = establish("polytope", system=system, region={"measure": "hinf", "bound": bound},
                                evidence={"matrix": here.P}, margin={},
                                made_by=made_by("Clarabel semidefinite program", "candidate in floats"))
        return (controllers, certificate, bound) if certificate.holds else None

    def _robust(self, holds: bool, rates: bool) -> RobustAgainst:
        if not holds:
            return RobustAgainst("Nothing is proven, of these plants or of others.")
        return RobustAgainst(
            f"Proven for every plant that is an average of the {len(self.given)} vertices, constant or varying with "
            f"time in any way{' at the rates given and at any other' * rates}, with the controllers averaged by the "
            "same weights; a plant between the vertices that is not their average is not covered.",
            {"vertices": float(len(self.given))})

    def _said(self, best: tuple[list[Plant], Certificate, float] | None, holds: bool, frozen: float) -> Outcome:
        """`frozen`: largest optimum of one vertex, which no scheduled controller beats at any rate; -inf: not asked."""
        if holds and best is not None:
            gain = "" if not np.isfinite(frozen) else (
                f" A design that uses the rates could reach {frozen:.4g} at best, the largest optimum of one vertex "
                "alone (estimated).")
            return SynthesisCode.CERTIFIED.outcome(
                f"Certified for the numbers of the controllers as returned: H-infinity norm, of a varying plant L2 "
                f"gain, below {best[2]:.7g} for all plants of the hull.{gain}")
        if best is not None:
            return SynthesisCode.INFEASIBLE.outcome(
                f"gamma = {self.asked:g}: the best achievable with one quadratic form is about {self.level:#.4g}.")
        if self.count:
            return SynthesisCode.NOT_CERTIFIED.outcome(
                remedy="Give a larger gamma, scale the plants, or take fewer vertices and weights that are less slow.")
        return SynthesisCode.INFEASIBLE.outcome(
            "No scheduled controller was found with one quadratic form for all plants of the hull.",
            remedy="Take fewer or closer vertices, or add controls or sensors; bounded rates do not help here.")


def _mean(plants: Sequence[GeneralizedPlant]) -> GeneralizedPlant:
    parts = {key: np.mean([getattr(one, key) for one in plants], axis=0)
             for key in ("A", "B1", "B2", "C1", "C2", "D11", "D12", "D21", "D22")}
    return replace(plants[0], **parts)


def _matrices(system: Plant) -> dict[str, Array]:
    return {"A": system.A, "B": system.B, "C": system.C, "D": system.D}
