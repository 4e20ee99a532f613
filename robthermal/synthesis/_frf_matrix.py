"""PI and PID of several inputs and as many outputs straight from frequency responses and their confidence circles."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .._arrays import Array
from .._checks import finite_number, quoted
from .._control import control
from ..errors import InputError, Outcome
from ..identify import FrequencyResponse
from ..linear import Plant, close, plant_norm, prove_closed_loop, read_plant, responder
from ..verification import Certificate
from ._design import RobustAgainst, as_system
from ._frf_data import model_grid, read_sample_time
from ._frf_matrix_design import FrfMatrixDesign, MatrixResponse, entries
from ._frf_matrix_program import MatrixBins, ascend_matrix
from ._outcomes import SynthesisCode
from ._plant import split
from ._structure import Structure, read_structure

_LARGEST_STEP = np.radians(75)  # of det(I + GK) between two bins: above it the loop is not followed
_STATIC = np.radians(60)  # of an eigenvalue of G G(first)⁻¹ real part: the first bin shows the static gain
MOST = 4  # inputs and outputs
_ASIDE = np.radians(135)  # of the static eigenvalues at the first bin: further round they could have wrapped
_TINY = 1e-3  # integral action of a start, relative
_REFINED = 6  # rounds in which the margin of a model is raised at the bins, until it holds between them


def is_matrix(G: Any) -> bool:
    """Whether a plant, or the first of several, has more than one input or output.

    Parameters
    ----------
    G : object
        What the user gave.
    """
    one = G[0] if isinstance(G, Sequence) and len(G) else G
    if isinstance(one, (control.StateSpace, control.TransferFunction)):
        return (one.ninputs, one.noutputs) != (1, 1)
    return isinstance(one, FrequencyResponse) and one.response.ndim == 3 and one.response.shape[:2] != (1, 1)


def frf_matrix(G: Any, structure: object, decentralized: bool, margin: float, probability: float,
               initial: Mapping[str, float] | None, sample_time: object) -> FrfMatrixDesign:
    """Design of `frf_pid` for two to four inputs and as many outputs; arguments as there, checked.

    Parameters
    ----------
    G : object
        Responses or models.
    structure : str
        "pi" or "pid".
    decentralized : bool
        Whether only the diagonal of the gains is free.
    margin : float
        Smallest singular value of I + GK that is asked for.
    probability : float
        Of all circles at once.
    initial : mapping or None
        Stabilizing gains by name.
    sample_time : float or None
        Sample time of the controller [s].
    """
    began = time.perf_counter()
    if structure not in ("pi", "pid"):
        raise InputError(f"structure = {quoted(structure)}", where="argument structure",
                         expected='"pi" or "pid" for several inputs and outputs')
    given = list(G) if isinstance(G, Sequence) else [G]
    found = [_read(one, probability, "argument G" if len(given) == 1 else f"argument G[{k}]")
             for k, one in enumerate(given)]
    if len({one.center.shape[1] for one in found}) > 1:
        raise InputError(f"responses with {' and '.join(str(one.center.shape[1]) for one in found)} inputs",
                         where="argument G", expected="as many in each")
    dt = read_sample_time([one.model for one in found], max(float(one.omega[-1]) for one in found), sample_time)
    own = read_structure(structure, found[0].omega, None, dt)
    bins = _bins(found, own, decentralized)
    start = _start(bins, own, initial, min(float(one.omega[0]) for one in found))

    def accept(x: Array) -> bool:
        return all(_stable(one, own, bins.gains(x)) for one in found)

    if not accept(start):
        raise InputError("det(I + GK) of the initial gains does not turn as that of a stable loop with a stable plant, "
                         "or cannot be followed", where="argument initial" if initial else "argument G",
                         expected="gains that stabilize the plant, and bins close enough to follow the loop",
                         remedy="Give initial gains of a stable loop; not every plant allows decentralized ones.")
    target, count, x = margin, 0, start
    for _ in range(_REFINED):
        x, steps = ascend_matrix(bins, start, target, accept)
        count += steps
        missing = margin - _between(found, own, bins.gains(x))
        if missing < 0 or bins.distance(x).min() < target:
            break
        target += 1.2 * missing + 1e-5 * margin
    return _finished(found, own, bins, x, margin, probability, accept(x), count, began)


def _read(G: Any, probability: float, where: str) -> MatrixResponse:
    if isinstance(G, (control.StateSpace, control.TransferFunction)):
        plant = read_plant(G, where)
        _expect_square(plant.D.shape, where)
        omega = model_grid(plant)
        return MatrixResponse(omega, responder(plant)(omega), np.zeros(len(omega)), plant, where)
    if not isinstance(G, FrequencyResponse):
        raise InputError(f"G is a {type(G).__name__}", where=where,
                         expected="a FrequencyResponse (rt.identify), several of them, or a python-control model")
    _expect_square(G.response.shape[:2], where)
    inside = G.frequencies > 0
    center, omega = np.moveaxis(G.response, -1, 0)[inside], 2 * np.pi * G.frequencies[inside]
    if len(omega) < 3:
        raise InputError(f"{len(omega)} bins above zero", where=where, expected="at least 3")
    radius = np.zeros(center.shape)
    if G.has_covariance:
        radius = np.moveaxis(G.confidence_radius(1 - (1 - probability) / (radius[0].size * len(omega))), -1, 0)[inside]
    lost = ~np.isfinite(center).all(axis=(1, 2)) | ~np.isfinite(radius).all(axis=(1, 2))
    if lost.any():
        f = omega[lost][0] / (2 * np.pi)
        raise InputError(f"{int(lost.sum())} bins are not determined, the first at {f:.4g} Hz", where=where,
                         expected="a finite response and radius at every bin", remedy="Cut them off with G.between.")
    return MatrixResponse(omega, center, np.linalg.norm(radius, 2, axis=(1, 2)), None, where)


def _expect_square(shape: tuple[int, ...], where: str) -> None:
    if shape[0] != shape[1] or not 2 <= shape[0] <= MOST:
        raise InputError(f"a response with {shape[1]} inputs and {shape[0]} outputs", where=where,
                         expected=f"one input and one output, or as many of each, at most {MOST}")


def _bins(found: Sequence[MatrixResponse], structure: Structure, decentralized: bool) -> MatrixBins:
    kinds, m = len(structure.names), found[0].center.shape[1]
    free = [(row, column) for row in range(m) for column in range(m) if row == column or not decentralized]
    patterns = np.zeros((kinds * len(free), kinds, m, m))
    for k in range(kinds):
        for j, (row, column) in enumerate(free):
            patterns[k * len(free) + j, k, row, column] = 1.0
    omega = np.concatenate([one.omega for one in found])
    return MatrixBins(np.concatenate([one.center for one in found]), np.concatenate([one.spread for one in found]),
                      structure.basis(omega), patterns, [one.center[0].real for one in found],
                      structure.names.index("Ki"))


def _start(bins: MatrixBins, structure: Structure, initial: Mapping[str, float] | None, lowest: float
           ) -> Array:
    """Free numbers of stabilizing gains: those given, or a little integral action of the right direction."""
    m = bins.center.shape[1]
    names = [f"{name}{entry}" for name in structure.names for entry in entries(m)]
    flat = bins.patterns.reshape(len(bins.patterns), -1)
    if initial is not None:
        allowed = [names[k] for k in np.flatnonzero(flat.any(axis=0))]
        if set(initial) != set(allowed):
            raise InputError(f"initial = {quoted(dict(initial))}", where="argument initial",
                             expected=f"gains {allowed}")
        whole = np.array([finite_number(initial[name], f"initial[{name!r}]") if name in initial else 0.0
                          for name in names])
        return np.asarray(flat @ whole)
    G = bins.static[0]
    if np.linalg.cond(G) > 1e6 or abs(np.angle(np.linalg.eigvals(np.linalg.solve(G, bins.center[0])))).max() > _STATIC:
        raise InputError("the first bin does not show an invertible static gain", where="argument G",
                         expected="bins down to where the response is its static gain, which is regular",
                         remedy="Measure longer, or give initial gains of a loop that is stable.")
    gains = np.zeros((len(structure.names), m, m))
    gains[bins.integral] = _TINY * lowest * np.linalg.inv(G)
    if not flat.any(axis=0).all():  # decentralized: signs of the diagonal of the inverse (relative gain array)
        gains[bins.integral] = np.diag(np.diag(gains[bins.integral]))
    return np.asarray(flat @ gains.reshape(-1))


def _stable(one: MatrixResponse, structure: Structure, gains: Array) -> bool:
    """Argument principle for a stable plant: from 0 to the end det(I + GK) turns by π/2 for each of m integrators.

    Near 0 it is det(G Ki)/s^m, of phase -mπ/2, with the eigenvalues of the static G Ki to the right. At the last bin
    the gain of GK is below one, so that the phase there is the sum of those of the eigenvalues of I + GK, each within a
    quarter turn. The smallest singular value of I + GK is positive over all circles, which therefore wind alike.
    """
    K = np.einsum("fb,bij->fij", structure.basis(one.omega), gains)
    L = one.center @ K
    eye = np.eye(L.shape[1])
    phi, size = np.linalg.det(eye + L), one.spread * np.linalg.norm(K, 2, axis=(1, 2))
    left = np.linalg.svd(eye + L, compute_uv=False)[:, -1] - size
    steps = np.angle(phi[1:] / phi[:-1])
    static = np.linalg.eigvals(one.center[0].real @ gains[structure.names.index("Ki")])
    if left.min() <= 0 or np.linalg.norm(L[-1], 2) + size[-1] >= 1 or abs(steps).max() > _LARGEST_STEP:
        return False
    aside = np.angle(1j * np.linalg.eigvals(eye + L[0]))
    start = float(aside.sum()) - len(eye) * np.pi / 2
    end = float(np.angle(np.linalg.eigvals(eye + L[-1])).sum())
    followed = abs(start + float(steps.sum()) - end) < 1e-6 and abs(aside).max() < _ASIDE
    return bool(followed and static.real.min() > 0)


def _unmeasured(one: MatrixResponse, structure: Structure, gains: Array) -> str:
    """Where a measured loop is not above 1 in every direction at the first bin; empty where it is, or with a model."""
    K = np.einsum("b,bij->ij", structure.basis(one.omega[:1])[0], gains)
    least = np.linalg.svd(one.center[0] @ K, compute_uv=False)[-1] - one.spread[0] * np.linalg.norm(K, 2)
    if one.model is not None or least > 1:
        return ""
    return f"below the first bin, {one.omega[0] / (2 * np.pi):.4g} Hz: measure longer, or further up"


def _realized(structure: Structure, gains: Array) -> Plant:
    """Controller from the errors to the controls: the states of the basis functions once for every error."""
    unit = [structure.realized(np.eye(len(structure.names))[k]) for k in range(len(structure.names))]
    m = gains.shape[1]
    A = np.kron(np.eye(m), unit[0].A)
    B = np.kron(np.eye(m), unit[0].B)
    C, D = np.zeros((m, len(A))), np.zeros((m, m))
    n = len(unit[0].A)
    for k, one in enumerate(unit):
        for column in range(m):
            C[:, column * n:(column + 1) * n] += gains[k][:, [column]] @ one.C
        D += gains[k] * one.D[0, 0]
    return Plant(A, B, C, D, structure.dt)


def _problem(model: Plant) -> Plant:
    """(w, u) to (S w, error): z = Gu + w, y = -z, so that u = +K y is negative feedback."""
    n, one = len(model.A), np.eye(len(model.D))
    return Plant(model.A, np.hstack([np.zeros((n, len(one))), model.B]), np.vstack([model.C, -model.C]),
                 np.block([[one, model.D], [-one, -model.D]]), model.dt)


def _between(found: Sequence[MatrixResponse], structure: Structure, gains: Array) -> float:
    """Margin of the models at every frequency; infinity without a model, or where the loop is not stable."""
    loops = [close(_problem(one.model), _realized(structure, gains)) for one in found if one.model is not None]
    return min((1 / plant_norm(loop)[0] for loop in loops if loop.stable), default=np.inf)


def _finished(found: Sequence[MatrixResponse], structure: Structure, bins: MatrixBins, x: Array, margin: float,
              probability: float, stable: bool, count: int, began: float) -> FrfMatrixDesign:
    gains, models = bins.gains(x), [one.model for one in found if one.model is not None]
    robust = min(float(bins.distance(x).min()), _between(found, structure, gains))
    unmeasured = next((text for one in found if (text := _unmeasured(one, structure, gains))), "")
    kept = stable and robust >= margin and not unmeasured
    K = _realized(structure, gains)
    certificates = [prove_closed_loop(_problem(model), K, bound=1 / margin) for model in models] if kept else []
    value = 1 / robust if kept and not models else np.inf
    if models and kept and all(one.holds for one in certificates):
        value = max(float(one.region["bound"]) for one in certificates)
    m = gains.shape[1]
    names = [f"{name}{entry}" for name in structure.names for entry in entries(m)]
    error, control_, w, z = ([f"{word}{k}" for k in range(1, m + 1)] for word in ("error", "control", "w", "z"))
    controller = as_system(K, error, control_)
    eye, at = np.eye(m), found[0].omega
    L = found[0].center @ np.einsum("fb,bij->fij", structure.basis(at), gains)
    S = np.moveaxis(np.linalg.inv(eye + L), 0, -1)
    loop = control.FRD(S, at) if not models else as_system(close(_problem(models[0]), K), w, z)
    return FrfMatrixDesign(
        controller, value, 1.0, loop, certificates, _covers(found, probability),
        _judge(kept, robust, margin, certificates, unmeasured), "convex-concave program (Karimi and Kammer)",
        "Clarabel", time.perf_counter() - began, count, split(_problem(models[0]), m, m) if models else None,
        gains=dict(zip(names, gains.ravel().tolist(), strict=True)),
        modulus_margin={"stated": margin, "robust": robust}, structure=structure, responses=list(found))


def _judge(kept: bool, robust: float, margin: float, certificates: Sequence[Certificate], unmeasured: str) -> Outcome:
    if unmeasured:
        return SynthesisCode.INFEASIBLE.outcome(f"The best loop found crosses 1 {unmeasured}.",
                                                remedy="Nothing measured tells whether such a loop is stable.")
    if not kept:
        return SynthesisCode.INFEASIBLE.outcome(
            "No gains were found that keep everything: of the best, the smallest singular value of I + GK over all "
            f"circles is {robust:.3g}.", remedy="Ask for less margin, free all entries, or measure longer.")
    if not certificates:
        return SynthesisCode.AT_THE_BINS.outcome()
    if all(one.holds for one in certificates):
        return SynthesisCode.CERTIFIED.outcome(
            "Certified for the numbers of the controller as returned: the smallest singular value of I + GK of the "
            f"model is above {margin:g} at every frequency.")
    return SynthesisCode.NOT_CERTIFIED.outcome(f"The loop with the model is not proven: {certificates[-1].reason}.")


def _covers(found: Sequence[MatrixResponse], probability: float) -> RobustAgainst:
    if any(one.model is not None for one in found):
        return RobustAgainst("Proven for the model as given, at every frequency.")
    bins = sum(len(one.omega) for one in found)
    if not any(one.spread.any() for one in found):
        return RobustAgainst(f"The response as given, at its {bins} bins; it has no covariance.", {"bins": bins})
    return RobustAgainst(f"Every plant of the confidence circles, which contain the true entries at all {bins} bins "
                         f"together with probability {probability:g}; nothing is claimed between the bins.",
                         {"probability": probability, "bins": bins})
