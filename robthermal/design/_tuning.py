"""The largest bandwidth of a PI that keeps stated margins for the nominal and all corner plants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .._checks import finite_number, positive_number
from ..errors import InputError, Outcome
from ._corner_values import Corner, Ranges, checked_ranges
from ._linearization import FeedbackLinearization
from ._loop_margins import LoopMargins, analyzed, margins_of
from ._margins import KEYS, UNITS, frequencies
from ._numbers import expect
from ._observer import GainObserver
from ._operated_plants import Operation
from ._outcomes import DesignCode
from ._pid import PID, check_pairs, pi_of_bandwidth
from ._plant import ColdSide, cold_side
from ._regulated_points import Regulate
from ._sampled_loop import LoopParts

_SPAN = 1e-6  # of half the sampling rate: the slowest loop that is tried
_GRID = 60
_LITTLE = np.radians(5.0)  # phase below which nothing is said to limit a loop
_FINE = 1.005  # ratio of bandwidths at which the search ends
_LIMITS = {"gain": (1.0, np.inf), "phase": (0.0, 90.0), "modulus": (0.0, 1.0), "delay": (0.0, np.inf)}


@dataclass(frozen=True)
class Tuning:
    """A PI per module with the largest bandwidth that keeps the margins; build it with `tune_pi`.

    Parameters
    ----------
    bandwidth : float
        Crossover of the loops [rad/s]; 0 where none keeps the margins.
    controller : PID or None
        None where no bandwidth keeps the margins.
    margins : LoopMargins or None
        Of this controller, for all plants.
    limited_by : str
        What takes phase, beside the thermal mass at the cold face, where the loop is nearest to instability.
    outcome : Outcome
        "tuned" or "not_tuned".
    """

    bandwidth: float
    controller: PID | None
    margins: LoopMargins | None
    limited_by: str
    outcome: Outcome

    def __str__(self) -> str:
        return self.outcome.text


def checked_margins(wanted: Mapping[str, float]) -> dict[str, float]:
    """Margins that are asked for, refused where no loop has them.

    Parameters
    ----------
    wanted : mapping
        Some of "gain" [-], "phase" [deg], "modulus" [-], "delay" [s].

    Examples
    --------
    >>> checked_margins({"gain": 2, "phase": 45})
    {'gain': 2.0, 'phase': 45.0}
    """
    found = {}
    for key, value in wanted.items():
        if key not in KEYS:
            raise InputError(f"there is no margin {key!r}", where="margins", expected="some of " + ", ".join(KEYS))
        number, (low, high) = finite_number(value, f"margins {key}"), _LIMITS[key]
        if not low < number < high:
            raise InputError(f"{key} = {number:g}", where="margins", expected=f"above {low:g}"
                             + (f" and below {high:g}" if np.isfinite(high) else "") + UNITS[key])
        found[key] = number
    if not found:
        raise InputError("no margin is given", where="margins", expected="some of " + ", ".join(KEYS),
                         remedy="For example gain = 2.0, phase = 45.0, modulus = 0.5.")
    return found


def tune_pi(law: FeedbackLinearization, setpoint: Mapping[str, float] | float, *, margins: Mapping[str, float],
            sample_time: float, regulate: Regulate = None, observer: GainObserver | None = None,
            parameters: Ranges | None = None, inputs: Mapping[str, float] | None = None) -> Tuning:
    """Find the PI of `pid` with the largest bandwidth that keeps margins for the nominal and all corner plants.

    Parameters
    ----------
    law : FeedbackLinearization
        Of the nominal model.
    setpoint : mapping of module to float, or one number for all
        What is held [K].
    margins : mapping
        Least "gain" [-], "phase" [deg], "modulus" [-], "delay" [s] of every loop; some of them.
    sample_time : float
        Time between two samples [s].
    regulate, observer, parameters, inputs
        As in `loop_margins`.

    Returns
    -------
    Tuning
        Where no bandwidth keeps the margins, `.outcome` is not ok and says what limits the loop.

    Raises
    ------
    InputError
        Margins that no loop has, set-points that cannot be held, unknown names.

    Examples
    --------
    >>> import robthermal as rt
    >>> law = rt.design.feedback_linearization(rt.systems.two_module())
    >>> found = rt.design.tune_pi(law, 288.15, margins={"phase": 45.0, "modulus": 0.5}, sample_time=1.0)
    >>> found.outcome.code, found.margins.worst("m1").modulus >= 0.5
    ('tuned', True)
    """
    expect(law, FeedbackLinearization, "law", "rt.design.feedback_linearization")
    wanted, h = checked_margins(margins), positive_number(sample_time, "sample_time", "s")
    ranges = checked_ranges(law.system, parameters)
    plant = cold_side(law, regulate=regulate)
    check_pairs(plant)
    search = _Search(Operation.of(law, setpoint, regulate, inputs), plant, observer, wanted, h)
    top = np.pi / h
    checked: list[Corner] = [{}]
    found: LoopMargins | None = None
    for _ in range(2 ** min(len(ranges), 8) + 1):
        best = search.largest(top, checked)
        if best is None:
            return _not_tuned(search, wanted, checked, found)
        found = margins_of(search.operation, search.parts(best), ranges)
        worst = min(found.plants, key=lambda one: search.share(one.margins.values()))
        if search.share(worst.margins.values()) >= 1:
            why = search.limited_by(found)
            return Tuning(best, search.controller(best), found, why, DesignCode.TUNED.outcome(
                f"A bandwidth of {best:.3g} rad/s is the largest that keeps {_said(wanted)} for all plants that were "
                f"computed; what limits it: {why}."))
        if not worst.held:
            return Tuning(0.0, None, found, "", DesignCode.NOT_TUNED.outcome(
                f"No bandwidth is tuned. {found.outcome.text}", remedy="Move the set-points, or narrow the ranges."))
        checked.append(worst.corner)
        top = best
    return _not_tuned(search, wanted, checked, found)


@dataclass(frozen=True)
class _Search:
    """Bandwidths tried on some plants."""

    operation: Operation
    plant: ColdSide
    observer: GainObserver | None
    wanted: dict[str, float]
    h: float

    def controller(self, bandwidth: float) -> PID:
        return pi_of_bandwidth(self.plant, bandwidth, self.h)

    def parts(self, bandwidth: float) -> LoopParts:
        return LoopParts.of(self.operation.law, self.controller(bandwidth), self.observer, self.operation.regulate)

    def share(self, found: object) -> float:
        """Least share of a wanted margin; 1 where all are kept. An unstable loop has none."""
        shares = [getattr(one, key) / least if one.stable else 0.0
                  for one in found for key, least in self.wanted.items()]  # type: ignore[attr-defined]
        return float(min(shares))

    def keeps(self, bandwidth: float, corners: Sequence[Corner]) -> bool:
        """Whether these plants keep the margins."""
        parts = self.parts(bandwidth)
        frequency = frequencies(self.operation.nominal.loop(parts))
        return all(self.share(analyzed(self.operation.at(corner), corner, parts, frequency).margins.values()) >= 1
                   for corner in reversed(corners))

    def largest(self, top: float, corners: Sequence[Corner]) -> float | None:
        """Largest bandwidth up to `top`; None where there is none."""
        tried = np.geomspace(top, _SPAN * np.pi / self.h, _GRID)
        k = next((k for k, bandwidth in enumerate(tried) if self.keeps(bandwidth, corners)), None)
        if not k:
            return None if k is None else float(tried[0])
        low, high = float(tried[k]), float(tried[k - 1])
        while high > _FINE * low:
            middle = float(np.sqrt(low * high))
            low, high = (middle, high) if self.keeps(middle, corners) else (low, middle)
        return low

    def limited_by(self, found: LoopMargins) -> str:
        """What takes most phase where the worst loop is nearest to -1."""
        loop = min(found.loops, key=lambda name: self.share([found.worst(name)]))
        i = found.loops.index(loop)
        k = int(np.nanargmin(np.abs(1 + found.worst_plant(loop).response[i])))
        return limiting(self.plant, i, float(found.frequency[k]), self.h)


def limiting(plant: ColdSide, i: int, frequency: float, sample_time: float) -> str:
    """What takes phase from a loop at a frequency, most first, in words with degrees.

    Parameters
    ----------
    plant : ColdSide
        With its regulated points.
    i : int
        Position of the module in the law.
    frequency : float
        In angular frequency [rad/s].
    sample_time : float
        Time between two samples [s].
    """
    point, face = plant.points[i], plant.law.modules.parts[i].cold
    X = np.linalg.solve(1j * frequency * np.eye(len(plant.A)) - plant.A, plant.B[:, i])
    at_face, at_point = X[plant.lumps.index(face)], X[plant.lumps.index(point.lump)]
    taken = {
        f"the lag of {point.name}": float(np.arctan(frequency * point.time_constant)),
        f"the delay of {point.name}": frequency * point.delay,
        f"the network between {face} and {point.lump}": max(float(-np.angle(at_point / at_face)), 0.0),
        "the sample time": 0.5 * frequency * sample_time}
    found = sorted((name for name in taken if taken[name] >= _LITTLE), key=lambda name: -taken[name])
    if not found:  # alone it takes 90° at most: it never limits a loop by itself
        return f"the thermal mass at {face} ({np.degrees(-np.angle(at_face)):.3g}°) at {frequency:.3g} rad/s"
    return ", ".join(f"{name} ({np.degrees(taken[name]):.3g}°)" for name in found) + f" at {frequency:.3g} rad/s"


def _said(wanted: Mapping[str, float]) -> str:
    return ", ".join(f"{key} {least:g}{UNITS[key]}" for key, least in wanted.items())


def _not_tuned(search: _Search, wanted: Mapping[str, float], checked: Sequence[Corner],
               found: LoopMargins | None) -> Tuning:
    at = ", ".join(f"{name} = {value:.6g}" for name, value in checked[-1].items())
    slowest = _SPAN * np.pi / search.h
    why = limiting(search.plant, 0, 1e-2 * np.pi / search.h, search.h) if found is None else search.limited_by(found)
    return Tuning(0.0, None, found, why, DesignCode.NOT_TUNED.outcome(
        f"No bandwidth above {slowest:.2g} rad/s keeps {_said(wanted)}{' with ' + at if at else ''}; "
        f"what takes phase: {why}."))
