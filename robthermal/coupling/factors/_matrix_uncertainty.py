"""The dual-Youla parameter of measured plants of several inputs and outputs: (6.21) with matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..._arrays import Array
from ...errors import InputError
from ..systems import Response
from ._frf import Measured, label, read_plants
from ._matrix_factors import MatrixFactors, MatrixLoop
from ._uncertainty import Uncertainty, circle_bound, expect_grid, first_decided, loop_change
from ._winding import MeasuredLoop, undecided

_JOINED = 400  # frequencies beyond the last bin at which the model is looked at
_FAR = 1e4  # times the last frequency: as far as the model of a continuous loop is looked at
_LARGEST_T = 1.0 + 1e-9
_OTHER_PLANT = 1e-6  # relative difference of responses beyond which an uncertainty belongs to other plants


def matrix_uncertainty(plants: Measured, factors: MatrixFactors, where: str, confidence: float = 0.95,
                       measured_in_closed_loop: bool = False) -> Uncertainty:
    """Delta_p = (Dk + P Nk)⁻¹ (P - P0) Dp of measured plants, entry by entry.

    Parameters
    ----------
    plants : frequency response, or list of them
        Measured plants; outputs and inputs of subsystem 1, then of 2.
    factors : MatrixFactors
        Of model and controllers.
    where : str
        Name of the argument, for messages.
    confidence : float
        Joint probability of the circles, as in `dual_youla`.
    measured_in_closed_loop : bool
        Whether K0 ran during the measurement, as in `dual_youla`.
    """
    outputs, inputs = (sum(getattr(loop.P, side) for loop in factors.loops) for side in ("noutputs", "ninputs"))
    measured = read_plants(plants, factors.dt, where, (outputs, inputs), confidence)
    whole = factors.at(measured.omega)
    P, radius = (np.moveaxis(part, -1, 1) for part in (measured.response, measured.radius))  # (n_plants, n_f, p, m)
    left = np.linalg.inv(whole["Dk"] + P @ whole["Nk"])
    loop = loop_change(left, radius, whole)
    first = first_decided(np.any(np.isnan(loop), axis=(0, 2, 3)), measured, where)
    omega = measured.omega[first:]
    for number, one in enumerate(factors.loops, 1):
        expect_grid(omega, np.linalg.eigvals(one.P.A), factors.dt, number, where)
    if not measured_in_closed_loop:
        if first:
            raise undecided(measured.omega[:first], where, "plants in the confidence set make det(I + P K0) zero", True)
        _expect_beyond_crossover(factors.loops, float(omega[-1]), where)
        for k, covered in enumerate(measured.covered):
            ratios, swings = _ratio(P[k], loop[k], whole)
            MeasuredLoop(omega, ratios, swings, covered, label(where, k, len(P))).expect_stable()
    kept = {name: part[first:] for name, part in whole.items()}
    samples = left[:, first:] @ (P[:, first:] - kept["P0"]) @ kept["Dp"]
    circles = None
    if measured.covered.any():
        circles = np.moveaxis(circle_bound(left[:, first:], radius[:, first:], loop[:, first:], kept, samples), 1, -1)
    samples = np.moveaxis(samples, 1, -1)
    return Uncertainty(omega, samples, np.max(np.abs(samples), axis=0), factors, circles,
                       confidence if circles is not None else None, measured.omega[:first])


def matched_matrix(uncertainty: Uncertainty, factors: MatrixFactors) -> Uncertainty:
    """The same uncertainty for factors made anew; refused if it belongs to other plants or controllers.

    Parameters
    ----------
    uncertainty : Uncertainty
        Result of `dual_youla` for these subsystems.
    factors : MatrixFactors
        Of the design.
    """
    old = uncertainty.factors
    if not isinstance(old, MatrixFactors) or old.dt != factors.dt:
        raise InputError("made for other plants", where="uncertainty", expected="the same plants and controllers",
                         remedy="Call dual_youla with them.")
    now, was = (each.at(uncertainty.omega) for each in (factors, old))
    for name in now:
        if now[name].shape != was[name].shape or (
                np.max(np.abs(now[name] - was[name])) > _OTHER_PLANT * np.max(np.abs(now[name]))):
            raise InputError("made for other plants, controllers or another cut-off", where="uncertainty",
                             expected="the same plants and controllers", remedy="Call dual_youla with them.")
    return replace(uncertainty, factors=factors)


def _ratio(P: Array, loop: Array, whole: dict[str, Array]) -> tuple[Array, Array]:
    """det(I + P K0)/det(I + P0 K0) and how far its phase may turn within the circles, (1, n_f)."""
    ratio = np.linalg.det(whole["Dk"] + P @ whole["Nk"]) / np.linalg.det(whole["Dk"] + whole["P0"] @ whole["Nk"])
    rho = np.max(np.abs(np.linalg.eigvals(loop)), axis=1)
    size = loop.shape[-1]
    return ratio[None], np.minimum(size * np.arcsin(rho), -np.log(np.linalg.det(np.eye(size) - loop)))[None]


def _expect_beyond_crossover(loops: tuple[MatrixLoop, ...], last: float, where: str) -> None:
    """Refuse a count from a response that ends where the model's largest gain of T0 still exceeds 1 above.

    Beyond the last bin I + PC = (I + (P - P0) C S0)(I + P0 C). It stays regular while P = (I + E) P0 with a gain of E
    below 1, since E T0 is then below 1: all that is assumed where the gain of T0 is at most 1.
    """
    for number, loop in enumerate(loops, 1):
        top = np.pi / loop.P.dt if loop.P.dt else _FAR * last
        omega = np.geomspace(last, top, _JOINED) if top > last else np.array([last])
        T = np.linalg.norm(np.eye(loop.P.noutputs) - np.moveaxis(Response(loop.S)(omega), -1, 0), 2, axis=(1, 2))
        k = int(np.argmax(T))
        if T[k] > _LARGEST_T:
            raise InputError(f"the response ends at {last / (2 * np.pi):.4g} Hz, and the largest gain of the model's "
                             f"T{number} is {T[k]:.3g} at {omega[k] / (2 * np.pi):.4g} Hz: nothing measured tells "
                             "whether the loop is stable", where=where, expected="a response up to beyond crossover",
                             remedy="Measure further up, or say measured_in_closed_loop = true if it was measured "
                             "while these controllers ran.")
