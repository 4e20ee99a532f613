"""H-infinity synthesis: the controller of two Riccati equations, and the proof of what it reaches."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np

from .._checks import positive_number
from .._control import control
from ..errors import InputError, Outcome
from ..linear import Plant, close, plant_norm, prove_closed_loop
from ..verification import Certificate
from ._arguments import choice, read_poles, sampled, state_space
from ._design import Design, named, small_gain, zero_controller
from ._inequalities import MOST_STATES, Aims, solved_for
from ._level import Candidate, candidates, central
from ._outcomes import SynthesisCode
from ._plant import GeneralizedPlant, balanced, read_generalized, to_continuous, to_sampled
from ._reduce import shortened
from ._regularize import lacks_control_weight, lacks_noise, missing_weights, with_channels

_CHANNELS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)  # sizes of the added channels, in turn, until they cease to help
_ENOUGH = 0.3  # of the tolerance: a gain below it ends the search for smaller channels
_SLACKS = (3e-4, 1e-3, 3e-3, 1e-2, 1e-1)  # of the bound above the norm in floats, in turn


@dataclass(frozen=True)
class Reached:
    """A controller of the plant itself, and what is proven of it."""

    K: Plant
    certificate: Certificate
    source: Candidate
    channels: float

    @property
    def value(self) -> float:
        return float(self.certificate.region["bound"])


def hinf(P: control.StateSpace, n_meas: int, n_ctrl: int, *, gamma: float | None = None, method: str = "auto",
         tolerance: float = 0.005, region: Mapping[str, float] | None = None, order: int | None = None,
         max_gain: float | None = None, sample_time: float | None = None) -> Design:
    """Design the controller with the smallest H-infinity norm from w to z, and prove what it reaches.

    P maps (w, u) to (z, y), controls last among its inputs, measurements last among its outputs; u = +K y, as
    `control.hinfsyn`. D11, D22 are arbitrary; D12, D21 may lack rank and the plant may have zeros on the axis: small
    channels are added then, and what is proven is proven of P itself.

    Parameters
    ----------
    P : control.StateSpace
        Generalized plant, continuous or sampled.
    n_meas, n_ctrl : int
        Numbers of measurements y and of controls u.
    gamma : float, optional
        Norm that is enough [output unit per input unit]; the controller is then made for it, not for the optimum.
    method : {"auto", "riccati", "reference"}
        Riccati equations; "reference": the optimum by the matrix inequalities of Gahinet and Apkarian in cvxpy, slow
        and for comparison, the controller for a little more by the same equations
        (``pip install "robthermal[reference]"``).
    tolerance : float
        Allowed excess of the proven value over the optimum, relative [-].
    region : mapping, optional
        Where the closed-loop eigenvalues have to lie: "decay" [1/s], "damping" [-], "radius" [1/s]; sampled "radius"
        [-]. Decay (sampled: radius) is designed for by a shift of the plant; the others, of at most 12 states, by
        matrix inequalities where the central controller does not keep them already.
    order : int, optional
        Number of states the controller is reduced to, and certified with.
    max_gain : float, optional
        Largest singular value that the controller may have at any frequency [control unit per measurement unit].
    sample_time : float, optional
        Sample time of a controller for a continuous plant, all of whose inputs are taken as held between samples [s].

    Returns
    -------
    Design
        ``value`` is proven for the controller returned; ``holds`` is False, with the best that is reached, where
        gamma, region or max_gain are not.

    Raises
    ------
    InputError
        Numbers that are not finite, impossible n_meas or n_ctrl, a mode that is not stabilisable or not detectable (it
        is named), unknown keys; "reference" without cvxpy.

    References
    ----------
    Glover and Doyle, Systems & Control Letters 11 (1988); Zhou, Doyle and Glover, Robust and Optimal Control (1996),
    theorem 17.1; Gahinet and Apkarian, Int. J. Robust Nonlinear Control 4 (1994).

    Examples
    --------
    >>> import control, robthermal as rt
    >>> P = control.ss([[1.0]], [[1, 0, 1]], [[1], [0], [1]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]])  # x' = x + w1 + u
    >>> d = rt.design.hinf(P, 1, 1)  # optimum 1 + √3, from g² - 2 g - 2 = 0
    >>> d.holds, 2.732 <= d.value <= 2.733 * 1.005, rt.verify(d.certificates[0]).valid
    (True, True, True)
    """
    start = time.perf_counter()
    choice("method", method, ("auto", "riccati", "reference"))
    tolerance = positive_number(tolerance, "tolerance")
    asked = None if gamma is None else positive_number(gamma, "gamma")
    plant = sampled(read_generalized(P, n_meas, n_ctrl), sample_time)
    poles = read_poles(region, plant.dt)
    if max_gain is not None:
        max_gain = positive_number(max_gain, "max_gain")
    if method == "reference":
        return _reference(P, plant, tolerance, start)
    best, lower = best_of(plant, tolerance, asked, poles, max_gain)
    found = _finished(plant, best, order, poles)
    if found is None:
        return _design(P, plant, None, [], _nothing(best, max_gain), lower, start, best)
    K, certificates = found
    outcome = _judge(certificates, asked, lower, poles, missing_weights(plant) if best and best.channels else "")
    if best is not None and poles and order is None and max_gain is None and not certificates[-1].holds:
        other = _by_inequalities(plant, best, asked, poles)
        if other is not None and (judged := _judge(other[1], asked, lower, poles)).ok:
            made = _design(P, plant, *other, judged, lower, start, best)
            return replace(made, method="matrix inequalities (Chilali and Gahinet)")
    return _design(P, plant, K, certificates, outcome, lower, start, best)


def _by_inequalities(plant: GeneralizedPlant, best: Reached, asked: float | None,
                     poles: Mapping[str, float]) -> tuple[Plant, list[Certificate]] | None:
    """Controller with eigenvalues in the region, and its certificates: one Lyapunov matrix for norm and region."""
    if len(plant.A) > MOST_STATES:
        return None
    K = solved_for(plant, Aims(None, plant, asked, poles), best.K)
    certificate = None if K is None else certified_norm(plant, K)
    if K is None or certificate is None:
        return None
    return K, [certificate, prove_closed_loop(plant.joined, K, measure="region", poles=poles)]


def _reference(P: Any, plant: GeneralizedPlant, tolerance: float, start: float) -> Design:
    """The optimum of the cvxpy program, and a controller for a little more."""
    try:
        formulations = import_module("._formulations", __package__)  # cvxpy: an optional dependency, slow to import
    except ModuleNotFoundError as error:
        raise InputError(f"cvxpy is not there ({error})", where='method="reference"', expected="an installed cvxpy",
                         remedy="Install it with: pip install 'robthermal[reference]', or take another.") from None
    level: float = formulations.hinf_level(to_continuous(plant)[0] if plant.dt else plant)
    best, _ = best_of(plant, tolerance, level * (1 + 0.6 * tolerance), {}, None)
    found = _finished(plant, best, None, {})
    if found is None:
        return _design(P, plant, None, [], _nothing(best, None), level, start, best)
    made = _design(P, plant, *found, _judge(found[1], None, level, {}), level, start, best)
    return replace(made, method="matrix inequalities (Gahinet and Apkarian), cvxpy")


def _nothing(best: Reached | None, max_gain: float | None) -> Outcome:
    """Why there is no controller."""
    if best is None and max_gain is not None:
        return SynthesisCode.INFEASIBLE.outcome(f"max_gain = {max_gain:g}: every controller that was made for up to "
                                                "ten times the optimum has a larger gain.")
    return (SynthesisCode.NOT_FOUND if best is None else SynthesisCode.NOT_CERTIFIED).outcome()


def best_of(plant: GeneralizedPlant, tolerance: float, asked: float | None, poles: Mapping[str, float],
            max_gain: float | None) -> tuple[Reached | None, float]:
    """The controller with the smallest proven value, and the smallest level that was found."""
    work, side = to_continuous(_shifted(plant, poles)) if plant.dt else (_shifted(plant, poles), 1.0)
    control_weight, noise = lacks_control_weight(work), lacks_noise(work)
    best: Reached | None = None
    lower = np.inf
    sizes = _CHANNELS if control_weight or noise else (0.0,)
    for size in sizes:
        extended = with_channels(balanced(work), size, control_weight, noise) if size else work
        found = _reach(plant, extended, side, tolerance, asked, poles, max_gain, size)
        if found is None:
            continue
        gained = best is None or found.value < best.value * (1 - _ENOUGH * tolerance)
        lower = min(lower, found.source.optimum)
        if best is None or found.value < best.value:
            best = found
        if not gained or (asked is not None and best.value <= asked and max_gain is None):
            break
    return best, lower


def central_family(plant: GeneralizedPlant, size: float, levels: Sequence[float],
                   poles: Mapping[str, float]) -> Iterator[Plant]:
    """Central controllers of the plant at several levels, with channels of the size that the best one needed."""
    work, side = to_continuous(_shifted(plant, poles)) if plant.dt else (_shifted(plant, poles), 1.0)
    if size:
        work = with_channels(balanced(work), size, lacks_control_weight(work), lacks_noise(work))
    for made in central(work, levels):
        K = _of_plant(made, plant, side, poles)
        if K is not None:
            yield K


def _reach(plant: GeneralizedPlant, work: GeneralizedPlant, side: float, tolerance: float, asked: float | None,
           poles: Mapping[str, float], max_gain: float | None, size: float) -> Reached | None:
    """First candidate whose proven value is good enough, else the best of all."""
    best: Reached | None = None
    for candidate in candidates(work, tolerance, asked, limited=max_gain is not None):
        if best is not None and best.value <= candidate.level:
            continue  # what it was made for is reached already
        K = _of_plant(candidate.controller, plant, side, poles)
        if K is None or (max_gain is not None and _gain(K) > max_gain):
            continue
        certificate = certified_norm(plant, K)
        if certificate is None:
            continue
        found = Reached(K, certificate, candidate, size)
        if best is None or found.value < best.value:
            best = found
        if best.value <= (1 + tolerance) * candidate.optimum or (asked is not None and best.value <= asked):
            break
    return best


def certified_norm(plant: GeneralizedPlant, K: Plant) -> Certificate | None:
    """Certificate of a bound just above the norm in floats; None where none holds."""
    try:
        loop = close(plant.joined, K)
    except InputError:
        return None
    if not loop.stable:
        return None
    norm = plant_norm(loop)[0]
    if norm == 0:
        norm = 1e-12
    for slack in _SLACKS:
        certificate = prove_closed_loop(plant.joined, K, bound=norm * (1 + slack), norm=norm)
        if certificate.holds:
            return certificate
    return None


def _shifted(plant: GeneralizedPlant, poles: Mapping[str, float]) -> GeneralizedPlant:
    """Plant whose stability is decay of the plant itself: s - α in the place of s, or r z in that of z.

    By the maximum modulus principle the norm on the shifted line bounds that on the axis.
    """
    if plant.dt and "radius" in poles:
        r = 0.999 * poles["radius"]
        return replace(plant, A=plant.A / r, B1=plant.B1 / r, B2=plant.B2 / r)
    decay = 1.001 * poles.get("decay", 0.0)
    return replace(plant, A=plant.A + decay * np.eye(len(plant.A)))


def _of_plant(K: Plant, plant: GeneralizedPlant, side: float, poles: Mapping[str, float]) -> Plant | None:
    """Controller of the plant itself, from that of the shifted continuous one."""
    if not plant.dt:
        return replace(K, A=K.A - 1.001 * poles.get("decay", 0.0) * np.eye(len(K.A)))
    try:
        made = to_sampled(K, side, plant.dt)
    except np.linalg.LinAlgError:
        return None
    r = 0.999 * poles["radius"] if "radius" in poles else 1.0
    return replace(made, A=made.A * r, B=made.B * r)


def _gain(K: Plant) -> float:
    """Largest singular value of a controller, infinity with a pole on the axis; unstable ones have one too."""
    if not len(K.A):
        return float(np.linalg.norm(K.D, 2))
    edge = abs(abs(K.poles) - 1) if K.dt else abs(K.poles.real)
    return float("inf") if edge.min() < 1e-12 else plant_norm(K)[0]


def _finished(plant: GeneralizedPlant, best: Reached | None, order: int | None,
              poles: Mapping[str, float]) -> tuple[Plant, list[Certificate]] | None:
    """Controller of the order asked for and its certificates, new ones where it was reduced."""
    if best is None:
        return None
    K, certificate = best.K, best.certificate
    if order is not None:
        K = shortened(K, order)
        made = certified_norm(plant, K)
        if made is None:
            return None
        certificate = made
    certificates = [certificate]
    if poles:
        certificates.append(prove_closed_loop(plant.joined, K, measure="region", poles=poles))
    return K, certificates


def _judge(certificates: list[Certificate], asked: float | None, lower: float, poles: Mapping[str, float],
           lacking: str = "") -> Outcome:
    value = float(certificates[0].region["bound"])
    if asked is not None and value > asked:
        return SynthesisCode.INFEASIBLE.outcome(f"gamma = {asked:g}: the best achievable is about {lower:#.4g}.")
    if not all(certificate.holds for certificate in certificates):
        return SynthesisCode.INFEASIBLE.outcome(
            f"The closed-loop eigenvalues are not proven to lie in the region {dict(poles)}: "
            f"{certificates[-1].reason}.", remedy="Ask for decay (sampled: radius) alone, or for less.")
    found = f"H-infinity norm below {value:.6g}; the best possible is about {lower:.6g}, estimated."
    return SynthesisCode.CERTIFIED.outcome(f"Certified for the numbers of the controller as returned: {found}{lacking}")


def _design(P: Any, plant: GeneralizedPlant, K: Plant | None, certificates: list[Certificate], outcome: Outcome,
            lower: float, start: float, best: Reached | None) -> Design:
    """The result; a zero gain and no value where nothing reaches what was asked."""
    reached = K is not None and (outcome.ok or outcome.code != SynthesisCode.INFEASIBLE.code or len(certificates) > 1)
    shown = K if reached and K is not None else zero_controller(plant)
    controller, loop = named(state_space(P), plant, shown)
    value = float(certificates[0].region["bound"]) if reached and certificates else np.inf
    method = "Riccati equations (Glover and Doyle)"
    if best is not None and best.channels:
        method += f", channels of size {best.channels:g} added"
    return Design(controller, value, lower, loop, certificates if reached else [], small_gain(value), outcome, method,
                  best.source.precision if best else "none", time.perf_counter() - start,
                  best.source.iterations if best else 0, plant)

