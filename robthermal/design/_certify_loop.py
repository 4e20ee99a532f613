"""A designed loop as a certificate: its controller's matrices, the box its currents cannot leave, its observer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._celsius import ZERO_CELSIUS
from ..certify import check_loop_parameters, runaway_free
from ..certify import invariance as certify_invariance
from ..certify import loop as certify_plain_loop
from ..certify import observer as certify_observer
from ..errors import InputError, Outcome
from ..thermal import System
from ..verification import Certificate, not_certified
from ._linearization import FeedbackLinearization
from ._lti import LinearController
from ._modules import Array
from ._numbers import expect
from ._observer import GainObserver
from ._outcomes import DesignCode
from ._pid import PID
from ._plant import cold_side
from ._regulated_points import Regulate, RegulatedPoint
from ._state_feedback import StateFeedback

Interval = tuple[float, float]
Matrices = dict[str, Array]


@dataclass(frozen=True)
class CertifiedLoop:
    """What is proven of a closed loop: of the continuous plant, or of the sampled model only, and then it says so.

    Parameters
    ----------
    loop : Certificate
        In the box the loop contracts, limits active or not; with an observer, plant, estimates and controller together.
        Where that is not proven of the continuous plant it may be about the sampled model (the heat of the modules held
        over a sample), which says nothing about what the machine does between the samples: it may oscillate where the
        sampled model does not. The outcome then has the code "certified_sampled_model".
    invariance : Certificate
        Currents within the limits never drive a temperature of the continuous plant out of the box.
    observer : Certificate or None
        In the box the estimation error of the sampled model shrinks; none where the temperatures are measured, or
        `loop` covers the estimates.
    outcome : Outcome
        "certified", or what is missing and why.
    """

    loop: Certificate
    invariance: Certificate
    observer: Certificate | None
    outcome: Outcome

    @property
    def holds(self) -> bool:
        """Whether all parts are proven."""
        parts = (self.loop, self.invariance, self.observer)
        return all(part.holds for part in parts if part is not None)

    def __str__(self) -> str:
        return self.outcome.text


def certify_loop(system: System, controller: PID | StateFeedback | LinearController, law: FeedbackLinearization, *,
                 temperature: Interval | Mapping[str, Interval] | None = None,
                 ambient: Mapping[str, Interval] | None = None, heat: Mapping[str, Interval] | None = None,
                 observer: GainObserver | None = None, drift: float | None = None,
                 parameters: Mapping[str, Interval] | None = None, regulate: Regulate = None) -> CertifiedLoop:
    """Certify that a closed loop forgets its start, and stays in its box.

    Parameters
    ----------
    system : System
        The plant, which the feedback law must have been built for: every module driven.
    controller : PID, StateFeedback or LinearController
        Sampled controller of the outer loop.
    law : FeedbackLinearization
        With current limits, without voltage or slew limits.
    temperature : tuple or mapping, optional
        Box of temperatures [K]; default the box of `rt.certify.runaway_free`, which currents within the limits cannot
        leave.
    ambient, heat : mapping, optional
        {ambient: (lower, upper)} [K], {lump: (lower, upper)} [W]: what else acts; default nominal, and the declared
        limits of the heaters, or none where `temperature` is given.
    observer : GainObserver, optional
        Where the linearizing feedback law and the controller use estimates. If the loop is too large, or no
        proof is found for the plant in continuous time, the claim is about the *sampled model* of the observer, the
        heat of the modules held over a sample, not about the machine between the samples, and the outcome says so.
    drift : float, optional
        As in `rt.certify.loop`.
    parameters : mapping, optional
        {parameter name: (lower, upper)}, for example `Fit.ranges`: uncertain conductances of links, without observer.
        Ranges that the loop does not depend on are ignored, others refused by name, as in `rt.certify.loop`.
    regulate : mapping of module to str, optional
        Sensor or lump that a module regulates; default its cold face. A loop of a sensor that lags, or that the
        controller reads beside an observer, is not certified, and the outcome says so.

    Returns
    -------
    CertifiedLoop
        If it holds there is, for constant set-points, ambients and loads, one steady state, reached from everywhere in
        the box as long as estimates stay in it; where this is said of the sampled model only, the outcome says so.

    Raises
    ------
    InputError
        Voltage or slew limits, no current limits, a module the feedback law does not drive, another kind of controller,
        sample times that differ.

    Examples
    --------
    >>> import robthermal as rt
    >>> system = rt.System(ambients={"room": {"temperature": 298.15}},
    ...     lumps={"hot": {"capacity": 50.0}, "cold": {"capacity": 20.0}},
    ...     links=[{"between": ("hot", "room"), "conductance": 2.0}, {"between": ("cold", "room"), "conductance": 0.1}],
    ...     modules={"m": {"hot": "hot", "cold": "cold", "seebeck": {"value": 0.05}, "resistance": {"value": 4.0},
    ...                    "conductance": {"value": 0.3}, "reference_temperature": 298.15}})
    >>> law = rt.design.feedback_linearization(system, current_limits=(-0.2, 0.5))
    >>> pi = rt.design.pid(rt.design.cold_side(law), bandwidth=0.05, sample_time=1.0)
    >>> print(rt.design.certify_loop(system, pi, law))
    Certified: whatever its start in the box, 5.8 to 36.9 °C, the loop forgets it, with limits active or not.
    """
    expect(law, FeedbackLinearization, "law", "rt.design.feedback_linearization")
    limits = _limits(system, law)
    points = cold_side(law, regulate=regulate).points
    matrices = _matrices(controller, law, points)
    if observer is not None:
        expect(observer, GainObserver, "observer", "rt.design.observer")
        if observer.sample_time != controller.sample_time:
            raise InputError(f"the observer's sample time is {observer.sample_time:g} s", where="argument observer",
                             expected=f"the controller's, {controller.sample_time:g} s")
    check_loop_parameters(system, parameters, observer=observer is not None)
    if temperature is None:
        free = runaway_free(system, current=limits, ambient=ambient, heat=heat, parameters=parameters)
        stays, box = free.invariance, free.temperature
        if not box:
            return CertifiedLoop(stays, stays, None, DesignCode.NOT_CERTIFIED.outcome(
                f"Not certified: no box was found that the currents cannot leave. {stays.reason}", remedy=""))
    else:
        box = dict(temperature) if isinstance(temperature, Mapping) else dict.fromkeys(system.lumps, temperature)
        stays = certify_invariance(system, current=limits, temperature=box, ambient=ambient, heat=heat,
                                   parameters=parameters)
    missing = _not_covered(points, observer)
    if missing:
        text = f"Not certified: it is not shown that the loop contracts in the box: {missing}"
        return CertifiedLoop(not_certified("loop", system={}, region={}, evidence={}, reason=missing, made_by={},
                                           claim="The loop contracts in the box."), stays, None,
                             DesignCode.NOT_CERTIFIED.outcome(text, remedy=""))
    limits_and_box: dict[str, Any] = {"current": limits, "temperature": box, "sample_time": controller.sample_time,
                                      "controller": matrices}
    if observer is None:
        loop = certify_plain_loop(system, **limits_and_box, drift=drift, parameters=parameters)
        return CertifiedLoop(loop, stays, None, _outcome(loop, stays, None, box, drift))
    # the certificate's sensors read gain times their lump, this observer undoes that first
    gain = observer.gain / np.array([system.sensors[name].gain for name in observer.sensors])
    read: dict[str, Any] = {"gain": gain, "sensors": list(observer.sensors), "parameters": parameters}
    both = certify_plain_loop(system, **limits_and_box, **read)
    if both.holds:
        return CertifiedLoop(both, stays, None, _outcome(both, stays, None, box, None))
    held = certify_plain_loop(system, **limits_and_box, plant="held")
    error = certify_observer(system, **read, sample_time=observer.sample_time, current=limits, temperature=box)
    outcome = _outcome(held, stays, error, box, None)
    text = f"{outcome.text} Why not for the machine itself: {both.reason}" if outcome.ok else outcome.text
    return CertifiedLoop(held, stays, error, replace(outcome, text=text))


def _outcome(loop: Certificate, stays: Certificate, estimate: Certificate | None, box: Mapping[str, Interval],
             drift: float | None) -> Outcome:
    named = {"the loop contracts in the box": loop, "the box is never left": stays,
             "the estimation error shrinks in the box": estimate}
    for what, part in named.items():
        if part is not None and not part.holds:
            return DesignCode.NOT_CERTIFIED.outcome(f"Not certified: it is not shown that {what}: {part.reason}",
                                                    remedy="")
    low = min(pair[0] for pair in box.values()) - ZERO_CELSIUS
    high = max(pair[1] for pair in box.values()) - ZERO_CELSIUS
    if estimate is not None:
        return DesignCode.CERTIFIED_SAMPLED_MODEL.outcome(
            "Certified for the sampled model only (the heat of the modules "
                       "held over a sample): whatever its start in the box of temperatures and estimates, "
                       f"{low:.1f} to {high:.1f} °C, the sampled model of the loop forgets it, with limits active or "
                       "not, as long as its temperatures and estimates stay in the box. The machine moves between the "
                       "samples and is not covered; of the continuous plant it is proven that it stays in the box.")
    where = " of temperatures and estimates" if "gain" in loop.system else ""
    moves = "" if drift is None else f", as long as no face of a module moves by more than {drift:g} K within a sample"
    stay = ", as long as the estimates stay in it; the temperatures do" if where else ""
    return DesignCode.CERTIFIED.outcome(
        f"Certified: whatever its start in the box{where}, {low:.1f} to {high:.1f} °C, the loop forgets it, with "
        f"limits active or not{moves}{stay}.")


def _limits(system: System, law: FeedbackLinearization) -> dict[str, Interval]:
    if law.system != system:
        raise InputError("the feedback law was built for another system", where="argument law",
                         expected="the plant's own", remedy="Build it with rt.design.feedback_linearization(system).")
    if set(law.names) != set(system.module_names):
        raise InputError(f"the feedback law drives {', '.join(law.names)}", where="argument law",
                         expected="every module: " + ", ".join(system.module_names))
    if np.isfinite([law.voltage_low, law.voltage_high]).any() or np.isfinite(law.slew).any():
        raise InputError("the feedback law has a voltage or slew limit", where="argument law",
                         expected="current limits only")
    if not np.isfinite([law.current_low, law.current_high]).all():
        raise InputError("the feedback law has no current limits", where="argument law",
                         expected="a range for every module", remedy="Give current_limits=(lower, upper).")
    return {name: (float(low), float(high)) for name, low, high in
            zip(law.names, law.current_low, law.current_high, strict=True)}


def _not_covered(points: tuple[RegulatedPoint, ...], observer: GainObserver | None) -> str:
    """What of a loop no certificate covers; empty where all is."""
    for point in points:
        if point.time_constant or point.delay:
            return (f"the lag of sensor {point.name!r} is no part of the certificate. Describe its mass as a lump, "
                    "linked to the lump it measures, and regulate that.")
        if point.kind == "sensor" and observer is not None:
            return (f"the controller reads sensor {point.name!r} itself, and the certificate's reads estimates. "
                    f"Regulate the lump {point.lump!r} instead.")
    return ""


def _matrices(controller: object, law: FeedbackLinearization, points: tuple[RegulatedPoint, ...]) -> Matrices:
    """A, B, C, D, windup of a controller, modules in the order of the system; what never changes is no state."""
    plant = cold_side(law)
    n = len(law.system.lumps)
    # what is regulated: gains of sensors count, offsets do nothing to a difference of temperatures
    faces = np.array([point.gain * np.eye(n)[law.system.lump_names.index(point.lump)] for point in points])
    if isinstance(controller, PID):
        found = _of_pid(controller, faces)
    elif isinstance(controller, StateFeedback):
        lumps = np.eye(n)[controller.plant.indices]
        m = len(faces)
        found = {"A": np.eye(m), "B": -controller.sample_time * controller.integral @ faces, "C": np.eye(m),
                 "D": -controller.K @ lumps,
                 "windup": -np.expm1(-controller.sample_time / controller.tracking_time) * np.eye(m)}
    elif isinstance(controller, LinearController):
        found = {"A": controller.A, "B": -controller.B @ faces, "C": controller.C, "D": -controller.D @ faces,
                 "windup": controller.L}
    else:
        raise InputError(f"controller is a {type(controller).__name__}", where="argument controller",
                         expected="a PID, StateFeedback or LinearController",
                         remedy="Make one with rt.design.pid, state_feedback or linear_controller.")
    own = [law.names.index(name) for name in plant.law.system.module_names]
    return {"A": found["A"], "B": found["B"], "C": found["C"][own], "D": found["D"][own],
            "windup": found["windup"][:, own]}


def _of_pid(controller: PID, faces: Array) -> Matrices:
    h, m = controller.sample_time, len(faces)
    slope = controller.derivative / controller.filter_time
    keep = np.exp(-h / controller.filter_time)
    give = -np.expm1(-h / controller.tracking_time)
    A = np.diag(np.concatenate([np.ones(m), np.full(m, keep)]))
    B = np.vstack([-(h * controller.integral)[:, None] * faces, (1 - keep) * faces])
    C = np.hstack([np.eye(m), np.diag(slope)])
    D = -(controller.proportional + slope)[:, None] * faces
    windup = np.vstack([np.diag(give), np.zeros((m, m))])
    used = np.concatenate([(controller.integral != 0) | (give != 0), controller.derivative != 0])
    return {"A": A[np.ix_(used, used)], "B": B[used], "C": C[:, used], "D": D, "windup": windup[used]}
