"""From a system to a controller with certified limits: law, PI, observer, certificates, simulated behavior."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ...certify import contraction
from ...design import (
    PID,
    ClosedLoop,
    Collapse,
    FeedbackLinearization,
    GainObserver,
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
from ...thermal import System
from ...verification import Certificate, verify
from ..claims import Certification, Checked
from ..request import Boxes
from ._limits import (
    Pairs,
    ambient_ends,
    candidates,
    certified_limits,
    check_given,
    coldest_faces,
    contain,
    worst_runaway,
)
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
    """

    request: DesignRequest
    certification: Certification
    law: FeedbackLinearization
    controller: PID
    observer: GainObserver | None
    reach: Reachable
    loop: ClosedLoop
    collapse: Collapse | None

    @property
    def points(self) -> dict[str, RegulatedPoint]:
        """What every module regulates."""
        return self.request.points(self.law.system)

    @property
    def holds(self) -> bool:
        """Whether all that is required is certified and verified, and its box is never left and inside the stated."""
        return self.certification.holds and self.contained

    @property
    def contained(self) -> bool:
        """Whether the box that is never left ends below the upper end of the stated one."""
        hottest = max((high for _, high in self.certification.safe.temperature.values()), default=float("inf"))
        return hottest <= self.request.temperature[1]


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
    controller = pid(plant, bandwidth=request.bandwidth, sample_time=request.sample_time)
    kalman = _kalman(system, request)
    possible = _reach(free, request)
    if not possible.outcome:
        raise _refusal(possible)
    progress("searching the runaway limit")
    fold = worst_runaway(system, request)
    progress("searching the contraction limits")
    certified = certified_limits(system, request)
    check_given(system, request, fold, certified)
    progress("choosing the current limits")
    law, reach = _law(system, request, candidates(system, request, fold, certified))
    pairs = {name: (float(low), float(high)) for name, low, high in
             zip(law.names, law.current_low, law.current_high, strict=True)}
    progress("certifying the observer")
    watcher, seen = _certified_observer(kalman, request, pairs)
    progress("certifying contraction and the box that is never left")
    box = contraction(system, current=pairs, temperature=request.temperature, method=request.method)
    safe = contain(system, request, pairs)
    found = [("contraction", "Contraction at the current limits", box, True),
             ("box", "The box is never left", safe.invariance, True)]
    if safe.contraction is not safe.invariance:
        found.append(("box_contraction", "Contraction in the box that is never left", safe.contraction, True))
    if seen is not None:
        found.append(("observer", "The observer's error shrinks", seen, True))
    found += [(f"limit_{li.method}_{li.direction}", f"Contraction limit, {li.direction}: not a limit for use",
               li.certificate, False) for li in certified if li.certificate.holds]
    found += [(f"runaway_{name}", f"Closed form of {name}, constant properties (not the network)", cert, False)
              for name, cert in fold.certificates.items()]
    progress("verifying every certificate")
    checked = tuple(Checked(key, title, cert, verify(cert) if cert.holds else None, required)
                    for key, title, cert, required in found)
    boxes = Boxes(request.temperature, request.ambient, pairs, None, coldest_faces(system, request),
                  request.method)
    certification = Certification(system, boxes, checked, certified, fold, safe)
    progress("simulating the step to the set-points")
    target = [request.setpoint[name] for name in law.names]
    loop = simulate_loop(system, controller, target, law=law, duration=2 * _LONG / request.bandwidth, observer=watcher,
                         noise_seed=0 if watcher else None, regulate=request.regulate)
    progress("comparing steps with and without the feedback law")
    return ControllerDesign(request, certification, law, controller, watcher, reach, loop,
                            _collapse(law, controller, request, reach))


def _asked(system: System, request: DesignRequest) -> Pairs:
    """Current limits of the user and of the file."""
    free = (float("-inf"), float("inf"))
    return {name: (request.current or {}).get(name, module.current_limits or free)
            for name, module in system.modules.items()}


def _reach(law: FeedbackLinearization, request: DesignRequest) -> Reachable:
    """Whether the set-points are held, at the worst end of the ambient ranges."""
    found = [reachable(law, request.setpoint, inputs=at, regulate=request.regulate) for at in ambient_ends(request)]
    return next((r for r in found if not r.outcome), found[0])


def _refusal(r: Reachable) -> InputError:
    """Set-points that cannot be held, in the words of the command line."""
    reason = "the hot side runs away" if r.binding == "runaway" else f"the {r.binding} limit is reached"
    ranges = "; ".join(f"{name} {celsius(min(r.passive[name], r.limit[name]))} to "
                       f"{celsius(max(r.passive[name], r.limit[name]))}" for name in r.setpoint)
    wanted = ", ".join(f"{name} at {celsius(value)}" for name, value in r.setpoint.items())
    return InputError(f"{wanted} cannot be held: {reason}", where="--setpoint",
                      expected=f"within the reachable range, {ranges}",
                      remedy="Move the set-points, or cool the hot side better.")


def _law(system: System, request: DesignRequest, tried: Iterator[Pairs]) -> tuple[FeedbackLinearization, Reachable]:
    """Law with the first of the limits that hold the set-points."""
    for pairs in tried:
        law = feedback_linearization(system, current_limits=pairs)
        reach = _reach(law, request)
        if reach.outcome:
            return law, reach
    raise _refusal(reach)


def _kalman(system: System, request: DesignRequest) -> GainObserver | None:
    """Steady Kalman gain of the passive network; None without sensors."""
    if not request.sensors:
        return None
    made = observer(system, request.sensors, sample_time=request.sample_time)
    assert isinstance(made, GainObserver)
    return made


def _certified_observer(kalman: GainObserver | None, request: DesignRequest,
                        pairs: Pairs) -> tuple[GainObserver | None, Certificate | None]:
    """The Kalman gain; the positive gain where only that one is certified."""
    if kalman is None:
        return None, None
    certificate = kalman.certify(pairs, request.temperature)
    system = kalman.model.system
    nonlinear = any(link.natural is not None or link.radiation is not None for link in system.links)
    if certificate.holds or nonlinear:  # a positive gain needs linear links
        return kalman, certificate
    other = observer(system, request.sensors, sample_time=request.sample_time, method="positive", current=pairs,
                     temperature=request.temperature)
    assert isinstance(other, GainObserver)
    second = other.certify(pairs, request.temperature)
    return (other, second) if second.holds else (kalman, certificate)


def _collapse(law: FeedbackLinearization, controller: PID, request: DesignRequest, reach: Reachable) -> Collapse | None:
    """Steps around the middle of the way to the set-points, halved until no limit of the law is active."""
    passive, target = (float(np.mean(list(part.values()))) for part in (reach.passive, reach.setpoint))
    base, size = 0.5 * (passive + target), min(0.5 * abs(target - passive), _LARGEST_STEP)
    done = None
    if size < _SMALLEST_STEP or not reachable(law, base, regulate=request.regulate).outcome:
        return None
    for _ in range(_TRIES):
        steps = (-size, -0.5 * size, 0.5 * size, size)
        done = collapse(law.system, controller, law=law, base=base, steps=steps,
                        duration=_LONG / request.bandwidth, regulate=request.regulate)
        if done.outcome:
            return done
        size /= 2
    return done
