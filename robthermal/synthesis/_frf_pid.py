"""PI, PID and controllers of fixed structure straight from frequency responses and their confidence circles."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .._arrays import Array
from .._checks import finite_number, positive_number, quoted, whole_number
from .._control import control
from ..errors import InputError, Outcome
from ..linear import Plant, close, plant_norm, prove_closed_loop
from ..verification import Certificate
from ._design import RobustAgainst, as_system
from ._frf_data import Discs, direction, read_discs, read_sample_time, resonance_missed, winding
from ._frf_design import FrfDesign
from ._frf_matrix import frf_matrix, is_matrix
from ._frf_program import Bins, best_start
from ._outcomes import SynthesisCode
from ._plant import split
from ._structure import Structure, read_structure

_STARTS = (0.0, 0.3, -0.3)  # proportional gains of the starts, times the inverse of the largest response
_TINY = 1e-3  # integral action of a start, relative
_REFINED = 6  # rounds in which the margin of a model is raised at the bins, until it holds between them
_FOLLOWED = np.radians(90)  # of 1 + GC at the last bin: beyond it the winding is not that of a stable loop


def frf_pid(G: Any, *, structure: str | int = "pi", modulus_margin: float = 0.5, probability: float = 0.99,
            bandwidth: float | None = None, weights: Mapping[str, Any] | None = None, unstable_poles: int = 0,
            initial: Mapping[str, float] | None = None, sample_time: float | None = None,
            decentralized: bool = False) -> FrfDesign:
    """Design the PI, PID or PD with the largest integral gain (PD: proportional gain) that keeps a modulus margin.

    The margin is kept by every plant in the confidence circles of the response, jointly over all bins with the stated
    probability. Negative feedback: u = C (r - y), sensitivity 1/(1 + GC). No model is fitted.

    Parameters
    ----------
    G : FrequencyResponse, sequence of them, control.StateSpace or control.TransferFunction
        Response from control to measurement, one input and one output; several are served by one controller. A
        measured response of a sampled plant contains the hold. With a model the result is certified at every frequency.
        Two to four inputs and as many outputs: matrices of gains, "pi" or "pid", of stable plants, without bandwidth
        and weights.
    structure : {"pi", "pid", "pd"} or int
        Kp + Ki/s, the same with a filtered derivative (filter time 1/the highest frequency), Kp with derivative, or PI
        with so many lags (a/(s + a))^k at the bandwidth.
    modulus_margin : float
        Smallest distance of the loop GC from -1 [-], above 0 and below 1; of matrices the smallest singular value of
        I + GC.
    probability : float
        Probability that the circles of all bins contain the plant [-].
    bandwidth : float, optional
        Frequency up to which the sensitivity is to stay below 1/√2 [rad/s].
    weights : mapping, optional
        "S", "KS", "T": numbers, arrays (one per bin) or python-control systems W with \\|W S\\| < 1, \\|W C S\\| < 1,
        \\|W T\\| < 1.
    unstable_poles : int
        Number of unstable poles of the plant. Above zero `initial` has to stabilize it.
    initial : mapping, optional
        Gains by name of a stabilizing controller to start from.
    sample_time : float, optional
        Sample time of a sampled controller [s]; by default a continuous one, of a sampled model that of the model.
    decentralized : bool
        Of several inputs and outputs, whether only the diagonal of every matrix of gains may differ from zero.

    Returns
    -------
    FrfDesign
        ``gains``, ``modulus_margin``; ``holds`` False, with the margin reached, where it is below what is asked.
        ``value``: largest sensitivity over circles and bins, in floats; with a model the certified bound.

    Raises
    ------
    InputError
        A bin that is not determined, a grid too coarse to follow, an integrator below the first bin, an initial
        controller that does not stabilize, unknown names.

    References
    ----------
    Karimi and Galdos, Fixed-order H∞ controller design for nonparametric models by convex optimization, Automatica 46
    (2010); Karimi and Kammer, A data-driven approach to robust control of multivariable systems by convex
    optimization, Automatica 85 (2017); Karimi, Nicoletti and Zhu, Int. J. Robust Nonlinear Control 28 (2018).

    Examples
    --------
    >>> import control, robthermal as rt
    >>> d = rt.design.frf_pid(control.tf([1], [1, 3, 3, 1]), modulus_margin=0.5)  # 1/(s + 1)³
    >>> d.holds, d.modulus_margin["robust"] >= 0.5, rt.verify(d.certificates[0]).valid
    (True, True, True)
    """
    began = time.perf_counter()
    margin = positive_number(modulus_margin, "modulus_margin")
    if margin >= 1:
        raise InputError(f"modulus_margin = {margin:g}", where="argument modulus_margin", expected="below 1")
    if is_matrix(G):
        for name, value in (("bandwidth", bandwidth), ("weights", weights), ("unstable_poles", unstable_poles)):
            if value:
                raise InputError(f"{name} beside several inputs and outputs", where=f"argument {name}",
                                 expected="modulus_margin, structure, decentralized, initial, sample_time",
                                 remedy="rt.design.hinf takes weights and unstable plants.")
        return frf_matrix(G, structure, decentralized, margin, _probability(probability), initial, sample_time)
    if decentralized:
        raise InputError("decentralized with one input and one output", where="argument decentralized",
                         expected="False, or a plant of several inputs and outputs")
    discs = read_discs(G, _probability(probability))
    dt = read_sample_time([one.model for one in discs], max(float(one.omega[-1]) for one in discs), sample_time)
    speed = None if bandwidth is None else positive_number(bandwidth, "bandwidth", "rad/s")
    own = read_structure(structure, discs[0].omega, speed, dt)
    bins = _bins(discs, own, margin, speed, weights)
    poles = whole_number(unstable_poles, "unstable_poles", 0)
    objective, starts = _starts(discs, own, bins, poles, initial)
    target = margin

    def accept(tried: Array) -> bool:
        return all(_stable(one, own, tried, poles) for one in discs)

    count = 0
    for _ in range(_REFINED):
        gains, steps = best_start(bins, starts, objective, target, accept)
        count += steps
        missing = margin - _between(discs, own, gains)
        if missing < 0 or bins.excess(gains) > 0:
            break
        target += 1.2 * missing + 1e-5 * margin
        bins = replace(bins, S=np.maximum(bins.S, target))
    return _finished(discs, own, bins, gains, margin, probability, poles, count, began)


def _between(discs: Sequence[Discs], structure: Structure, gains: Array) -> float:
    """Modulus margin of the models at every frequency; infinity without a model, or where the loop is not stable."""
    loops = [close(_problem(one.model), structure.realized(gains)) for one in discs if one.model is not None]
    return min((1 / plant_norm(loop)[0] for loop in loops if loop.stable), default=np.inf)


def _probability(value: object) -> float:
    found = positive_number(value, "probability")
    if found >= 1:
        raise InputError(f"probability = {found:g}", where="argument probability", expected="between 0 and 1")
    return found


def _bins(discs: Sequence[Discs], structure: Structure, margin: float, bandwidth: float | None,
          weights: Mapping[str, Any] | None) -> Bins:
    """All responses one after the other, and the weights at their bins."""
    given = dict(weights or {})
    if unknown := [name for name in given if name not in ("S", "KS", "T")]:
        raise InputError(f"weights[{quoted(unknown[0])}]", where="argument weights", expected="S, KS and T")
    omega = np.concatenate([one.omega for one in discs])
    values = {name: _weight(given.get(name), omega, f"weights[{name!r}]") for name in ("S", "KS", "T")}
    S = np.maximum(values["S"], margin)
    if bandwidth is not None:
        if bandwidth < omega.min():
            raise InputError(f"bandwidth = {bandwidth:g} rad/s lies below the first bin, {omega.min():.3g} rad/s",
                             where="argument bandwidth", expected="a frequency of the response")
        S = np.where(omega <= bandwidth, np.maximum(S, np.sqrt(2)), S)
    return Bins(np.concatenate([one.center for one in discs]), np.concatenate([one.radius for one in discs]),
                structure.basis(omega), S, values["KS"], values["T"])


def _weight(value: Any, omega: Array, where: str) -> Array:
    if value is None:
        return np.zeros(len(omega))
    if isinstance(value, (control.StateSpace, control.TransferFunction)):
        found = abs(np.array([complex(value(1j * w)) for w in omega]))
    else:
        found = np.broadcast_to(abs(np.asarray(value, complex)), len(omega)) if np.ndim(value) == 0 else abs(
            np.asarray(value, complex))
    if found.shape != omega.shape or not np.isfinite(found).all():
        raise InputError(f"{where} has shape {found.shape}", where="argument weights",
                         expected=f"a finite number, {len(omega)} numbers, or a system")
    return found


def _starts(discs: Sequence[Discs], structure: Structure, bins: Bins, poles: int,
            initial: Mapping[str, float] | None) -> tuple[Array, list[Array]]:
    """What is maximized, and stabilizing gains to start from; their winding is checked by the argument principle."""
    names = structure.names
    if initial is not None:
        if set(initial) != set(names):
            raise InputError(f"initial = {quoted(dict(initial))}", where="argument initial", expected=f"gains {names}")
        start = np.array([finite_number(initial[name], f"initial[{name!r}]") for name in names])
        starts = [start]
        lead = start[names.index("Ki" if "Ki" in names else "Kp")]
        sign = 1.0 if lead >= 0 else -1.0
    else:
        if poles:
            raise InputError(f"unstable_poles = {poles} without initial gains", where="argument initial",
                             expected="gains of a controller that stabilizes the plant")
        for one in discs:
            if missed := resonance_missed(one):
                raise InputError(f"the response turns too far {missed}: the grid is coarser than a resonance",
                                 where=one.where, expected="bins close enough to follow the response",
                                 remedy="Use a longer record, or a parametric model.")
        sign = direction(discs)
        top = float((abs(bins.center) + bins.radius).max())
        starts = []
        for share in _STARTS if "Ki" in names else (0.1,):
            start = np.zeros(len(names))
            start[0] = sign * share / top
            if "Ki" in names:
                start[1] = sign * _TINY / top * float(min(one.omega[0] for one in discs))
            starts.append(start)
    objective = np.zeros(len(names))
    objective[names.index("Ki" if "Ki" in names else "Kp")] = sign
    kept = [start for start in starts if all(_stable(one, structure, start, poles) for one in discs)]
    for one in discs:
        missed = winding(one, one.center * (structure.basis(one.omega) @ starts[0]), structure.integral(starts[0]))[2]
        if missed:
            raise InputError(f"{missed}: the grid is coarser than a resonance", where=one.where,
                             expected="bins close enough to follow the response",
                             remedy="Use a longer record, or a parametric model.")
    if not kept:
        raise InputError("the loop of the initial gains does not turn around -1 as a stable loop with "
                         f"{poles} unstable poles does", where="argument initial" if initial else "argument G",
                         expected="gains that stabilize the plant, and the right number of unstable_poles")
    return objective, kept


def _stable(one: Discs, structure: Structure, gains: Array, poles: int) -> bool:
    """Argument principle: from 0 to the end 1 + GC turns by π times (unstable poles + half of the integrators).

    The distance from zero holds over all circles, which therefore wind alike at the bins.
    """
    C = structure.basis(one.omega) @ gains
    if (abs(1 + one.center * C) - one.radius * abs(C)).min() <= 0:
        return False
    turned, integrators, missed = winding(one, one.center * C, structure.integral(gains))
    return not missed and bool(abs(turned - np.pi * (poles + integrators / 2)) < _FOLLOWED)


def _finished(discs: list[Discs], structure: Structure, bins: Bins, gains: Array, margin: float, probability: float,
              poles: int, count: int, began: float) -> FrfDesign:
    """Evaluate the gains at the bins, and prove the loop where there is a model."""
    robust = min(float(bins.distance(gains).min()), _between(discs, structure, gains))
    stable = all(_stable(one, structure, gains, poles) for one in discs)
    unmeasured = next((text for one in discs if (text := _crossing_not_measured(one, structure, gains))), "")
    kept = stable and robust >= margin and bins.excess(gains) <= 1e-9 and not unmeasured
    K = structure.realized(gains)
    models = [one.model for one in discs if one.model is not None]
    certificates = [_sensitivity_below(model, K, margin) for model in models] if kept else []
    outcome = _judge(kept, robust, margin, bins.excess(gains), certificates, unmeasured)
    value = 1 / robust if kept and not models else np.inf
    if models and kept and all(one.holds for one in certificates):
        value = max(float(one.region["bound"]) for one in certificates)
    sizes = dict(zip(structure.names, gains.tolist(), strict=True))
    controller = as_system(K, ["error"], ["control"])
    S = 1 / (1 + discs[0].center * (structure.basis(discs[0].omega) @ gains))
    loop = control.FRD(S, discs[0].omega) if not models else as_system(close(_problem(models[0]), K), ["w"], ["z"])
    return FrfDesign(controller, value, 1.0, loop, certificates, _covers(discs, probability, bool(models)), outcome,
                     "convex-concave program (Karimi and Galdos)", "Clarabel", time.perf_counter() - began, count,
                     split(_problem(models[0]), 1, 1) if models else None, gains=sizes,
                     modulus_margin={"stated": margin, "robust": robust}, discs=discs, structure=structure)


def _crossing_not_measured(one: Discs, structure: Structure, gains: Array) -> str:
    """Where the loop of a measured response crosses 1 outside of its bins; empty where it does so within them.

    There the bins say nothing about stability: a loop is above 1 below the first bin only by its integrator, and has to
    be below 1 at the last one over the whole circle.
    """
    if one.model is not None:
        return ""
    C = abs(structure.basis(one.omega) @ gains)
    if (abs(one.center[-1]) + one.radius[-1]) * C[-1] >= 1:
        return f"above the last bin, {one.omega[-1] / (2 * np.pi):.4g} Hz: measure further up"
    if structure.integral(gains) and abs(one.center[0]) * C[0] <= 1:
        return f"below the first bin, {one.omega[0] / (2 * np.pi):.4g} Hz: measure longer, or further up"
    return ""


def _judge(kept: bool, robust: float, margin: float, excess: float, certificates: Sequence[Certificate],
           unmeasured: str) -> Outcome:
    if unmeasured:
        return SynthesisCode.INFEASIBLE.outcome(f"The best loop found crosses 1 {unmeasured}.",
                                                remedy="Nothing measured tells whether such a loop is stable.")
    if not kept:
        missed = f"{100 * excess:.3g} % of a weight is missing" if np.isfinite(excess) and robust >= margin else (
            f"the modulus margin over all circles is {robust:.3g}")
        return SynthesisCode.INFEASIBLE.outcome(f"No gains were found that keep everything: of the best, {missed}.",
                                                remedy="Ask for less bandwidth or margin, or measure longer.")
    if not certificates:
        return SynthesisCode.AT_THE_BINS.outcome()
    if all(one.holds for one in certificates):
        return SynthesisCode.CERTIFIED.outcome("Certified for the numbers of the controller as returned: the modulus "
                                               f"margin of the model is above {margin:g} at every frequency.")
    return SynthesisCode.NOT_CERTIFIED.outcome(f"The loop with the model is not proven: {certificates[-1].reason}.")


def _covers(discs: Sequence[Discs], probability: float, model: bool) -> RobustAgainst:
    if model:
        return RobustAgainst("Proven for the model as given, at every frequency.")
    bins = sum(len(one.omega) for one in discs)
    if not any(one.radius.any() for one in discs):
        return RobustAgainst(f"The response as given, at its {bins} bins; it has no covariance.", {"bins": bins})
    return RobustAgainst(f"Every plant of the confidence circles, which contain the true one at all {bins} bins "
                         f"together with probability {probability:g}; nothing is claimed between the bins.",
                         {"probability": probability, "bins": bins})


def _problem(model: Plant) -> Plant:
    """(w, u) to (S w, error): z = Gu + w, y = -z, so that u = +K y is negative feedback."""
    n = len(model.A)
    one = np.ones((1, 1))
    return Plant(model.A, np.hstack([np.zeros((n, 1)), model.B]), np.vstack([model.C, -model.C]),
                 np.block([[one, model.D], [-one, -model.D]]), model.dt)


def _sensitivity_below(model: Plant, K: Plant, margin: float) -> Certificate:
    """Proof that the sensitivity of the model stays below 1/margin."""
    return prove_closed_loop(_problem(model), K, bound=1 / margin)
