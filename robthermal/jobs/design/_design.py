"""From a system to a controller with certified limits: law, PI, observer, certificates, simulated behavior."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ...certify import RunawayFree
from ...design import (
    PID,
    ClosedLoop,
    Collapse,
    FeedbackLinearization,
    GainObserver,
    LoopMargins,
    Reachable,
    RegulatedPoint,
    cold_side,
    collapse,
    feedback_linearization,
    observer,
    pid,
    reachable,
    simulate_loop,
)
from ...errors import InputError
from ...thermal import System, drivable_range
from ..claims import Certification
from ._claims import certified_design, certified_observer
from ._corners import Corner, corners, first_missed
from ._limits import (
    Pairs,
    candidates,
    certified_limits,
    check_given,
    hottest,
    what_limits,
    worst_runaway,
)
from ._loops import BANDWIDTH as _BANDWIDTH
from ._loops import Loops, tuned_loops
from ._request import DesignRequest, celsius

_LONG = 12.0  # simulated time in units of 1/bandwidth
_LARGEST_STEP = 10.0  # K, of the comparison with and without the feedback law
_SMALLEST_STEP = 0.1  # K
_TRIES = 5  # halvings of the step until no limit is active


@dataclass(frozen=True)
class ControllerDesign:
    """A controller and everything that is known about it.

    Parameters
    ----------
    request : DesignRequest
        What was asked for.
    certification : Certification
        Limits, certificates and their independent check.
    law : FeedbackLinearization
        With its current limits.
    controller : PID
        One PI per module.
    observer : GainObserver or None
        None without sensors.
    reach : Reachable
        How far the cold faces, or what is regulated instead, can be brought within the limits.
    loop : ClosedLoop
        Simulated step from rest to the set-points, with the observer and its sensors' noise.
    collapse : Collapse or None
        Normalized steps with the feedback law and without it; None where the set-points leave no room for steps.
    margins : LoopMargins
        Of every loop, for the nominal and all corner plants of the parameter ranges.
    bandwidth : float
        Crossover of the loops, asked for or tuned [rad/s].
    missed : tuple of str
        Margins that were asked for and are not kept, with the bandwidth that would keep them.
    robust : RunawayFree or None
        The box that is never left for all parameters in their ranges; None without ranges.
    tuning : str
        How the bandwidth was found, where it was tuned.
    corners : tuple of Corner
        Whether the set-points are held at the ends of ambients and heats, and what they need there; `reach` is the
        first.
    """

    request: DesignRequest
    certification: Certification
    law: FeedbackLinearization
    controller: PID
    observer: GainObserver | None
    reach: Reachable
    loop: ClosedLoop
    collapse: Collapse | None
    margins: LoopMargins
    bandwidth: float
    missed: tuple[str, ...] = ()
    robust: RunawayFree | None = None
    tuning: str = ""
    corners: tuple[Corner, ...] = ()

    @property
    def points(self) -> dict[str, RegulatedPoint]:
        """What every module regulates."""
        return self.request.points(self.law.system)

    @property
    def holds(self) -> bool:
        """Whether what is required is certified and verified, its box inside the stated one, and the margins kept."""
        return self.certification.holds and self.contained and bool(self.margins.outcome) and not self.missed

    @property
    def contained(self) -> bool:
        """Whether the box that is never left ends below the upper end of the stated one."""
        return all(hottest(box) <= self.request.temperature[1] for box in (self.certification.safe, self.robust) if box)


def design_system(system: System, request: DesignRequest,
                  progress: Callable[[str], None] = lambda stage: None) -> ControllerDesign:
    """Design a controller with certified current limits for a system.

    Parameters
    ----------
    system : System
        With modules; calibrated, one hopes.
    request : DesignRequest
        Set-points, box, bandwidth, sensors.
    progress : callable, optional
        Called with a sentence before every stage.

    Returns
    -------
    ControllerDesign

    Raises
    ------
    InputError
        Set-points that cannot be held, with the reachable range; current limits that are not certified; sensors that
        do not see every lump; a sample time that is too slow.

    Examples
    --------
    >>> import robthermal as rt
    >>> system = rt.System(
    ...     ambients={"room": {"temperature": 295.15}},
    ...     lumps={"sink": {"capacity": 120.0}, "stage": {"capacity": 35.0}},
    ...     links=[{"between": ("sink", "room"), "conductance": 0.9},
    ...            {"between": ("stage", "room"), "conductance": 0.05}],
    ...     modules={"m1": rt.systems.surrogate_module("sink", "stage")})
    >>> done = rt.jobs.design_system(system, rt.jobs.DesignRequest(setpoint={"m1": 288.15}))
    >>> done.holds, done.loop.outcome.code
    (True, 'settled')
    """
    request.check(system)
    progress("asking whether the set-points can be held")
    free = feedback_linearization(system, current_limits=_asked(system, request))  # refusals before the long work
    plant = cold_side(free, regulate=request.regulate)
    kalman = _kalman(system, request)
    if (missed := first_missed(free, request)) is not None:
        raise _refusal(missed, free, request, "by the system file or the request")
    if request.bandwidth is not None or request.margins is None:
        pid(plant, bandwidth=request.bandwidth or _BANDWIDTH, sample_time=request.sample_time)
    progress("searching the runaway limit")
    fold = worst_runaway(system, request)
    progress("searching the contraction limits")
    certified = certified_limits(system, request)
    check_given(system, request, fold, certified)
    progress("choosing the current limits")
    law = _law(system, request, candidates(system, request, fold, certified))
    found = corners(law, request)
    reach = reachable(law, request.setpoint, inputs=found[0].ambient, regulate=request.regulate)
    pairs = {name: (float(low), float(high)) for name, low, high in
             zip(law.names, law.current_low, law.current_high, strict=True)}
    progress("certifying the observer")
    watcher, seen = certified_observer(kalman, request, pairs)
    progress("tuning the loops and searching their margins")
    loops = tuned_loops(law, request, watcher)
    progress("certifying contraction and the box that is never left")
    certification, robust = certified_design(system, request, pairs, watcher, seen, fold, certified)
    progress("simulating the step to the set-points")
    target, duration = _reference(law, request, 2 * _LONG / loops.bandwidth)
    loop = simulate_loop(system, loops.controller, target, law=law, duration=duration,
                         observer=watcher, noise_seed=0 if watcher else None, regulate=request.regulate)
    progress("comparing steps with and without the feedback law")
    return ControllerDesign(request, certification, law, loops.controller, watcher, reach, loop,
                            _collapse(law, loops, request, reach), loops.margins, loops.bandwidth, loops.missed, robust,
                            loops.tuning, found)


def _asked(system: System, request: DesignRequest) -> Pairs:
    """Current limits of the user and of the file."""
    declared = {name: drivable_range(module, request.temperature) for name, module in system.modules.items()}
    return {name: (request.current or {}).get(name, (one.low, one.high)) for name, one in declared.items()}


def _refusal(missed: Corner, law: FeedbackLinearization, request: DesignRequest, limits: str,
             remedy: str = "Move the set-points, or cool the hot side better.") -> InputError:
    """Set-points that cannot be held, in the words of the command line."""
    r = missed.reach
    if r is None:
        return InputError(f"with {missed} no set-point can be held: {missed.why}", where="--setpoint",
                          remedy="State less heat, or cool the hot side better.")
    reason = r.why
    drivable = {name: drivable_range(module, request.temperature) for name, module in law.system.modules.items()
                if module.supply is not None and r.binding == "current"}
    reason += "".join(f"; {name} can have {one}" for name, one in drivable.items())
    if r.binding == "current" and not drivable:
        ends = {name: high if r.current[name] > 0 else low
                for name, low, high in zip(law.names, law.current_low, law.current_high, strict=True)}
        reason += f", {', '.join(f'{name} {value:.4g} A' for name, value in ends.items())} {limits}"
    reason += f", with {missed}" if str(missed) else ""
    ranges = "; ".join(f"{name} {celsius(min(r.passive[name], r.limit[name]))} to "
                       f"{celsius(max(r.passive[name], r.limit[name]))}" for name in r.setpoint)
    wanted = ", ".join(f"{name} at {celsius(value)}" for name, value in r.setpoint.items())
    return InputError(f"{wanted} cannot be held: {reason}", where="--setpoint",
                      expected=f"within the reachable range, {ranges}", remedy=remedy)


def _law(system: System, request: DesignRequest, tried: Iterator[Pairs]) -> FeedbackLinearization:
    """Law with the first of the limits that hold the set-points."""
    refusal = InputError("no current limit is possible", where="design")
    for pairs in tried:
        law = feedback_linearization(system, current_limits=pairs)
        missed = first_missed(law, request)
        if missed is None:
            return law
        refusal = _refusal(missed, law, request, *what_limits(system, request))
    raise refusal


def _reference(law: FeedbackLinearization, request: DesignRequest, settling: float) -> tuple[np.ndarray, float]:
    """Set-points of the simulation, at once or along the ramp from the temperatures at rest, and its duration [s]."""
    target, ramp = np.array([request.setpoint[name] for name in law.names]), request.ramp(law.names)
    if ramp is None:
        return target, settling
    passive = reachable(law, request.setpoint, regulate=request.regulate).passive
    start = np.array([passive[name] for name in law.names])
    duration = settling + float(np.max(np.abs(target - start) / np.where(target > start, ramp.up, ramp.down)))
    samples = max(round(duration / request.sample_time), 1)
    return ramp.sequence(start, target, samples=samples, sample_time=request.sample_time), duration


def _kalman(system: System, request: DesignRequest) -> GainObserver | None:
    """Steady Kalman gain of the passive network; None without sensors."""
    if not request.sensors:
        return None
    made = observer(system, request.sensors, sample_time=request.sample_time)
    assert isinstance(made, GainObserver)
    return made


def _collapse(law: FeedbackLinearization, loops: Loops, request: DesignRequest, reach: Reachable) -> Collapse | None:
    """Steps around the middle of the way to the set-points, halved until no limit of the law is active."""
    passive, target = (float(np.mean(list(part.values()))) for part in (reach.passive, reach.setpoint))
    base, size = 0.5 * (passive + target), min(0.5 * abs(target - passive), _LARGEST_STEP)
    done = None
    if size < _SMALLEST_STEP or not reachable(law, base, regulate=request.regulate).outcome:
        return None
    for _ in range(_TRIES):
        steps = (-size, -0.5 * size, 0.5 * size, size)
        done = collapse(law.system, loops.controller, law=law, base=base, steps=steps,
                        duration=_LONG / loops.bandwidth, regulate=request.regulate)
        if done.outcome:
            return done
        size /= 2
    return done
