"""Frequency responses of a plant as centers and radii of discs, with checks of what no design could be based on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._arrays import Array
from .._checks import positive_number
from .._control import control
from ..errors import InputError
from ..identify import FrequencyResponse
from ..linear import Plant, read_plant, responder

_MODEL_BINS = 600  # of the grid on which a model is taken
_LARGEST_STEP = np.radians(75)  # between two bins, of 1 + GC: above it the response is not followed
_STATIC = np.radians(60)  # phase at the first bin above which the plant is not yet at its static gain


@dataclass(frozen=True)
class Discs:
    """Plants |G - center| <= radius at frequencies omega [rad/s]; ``model``: the plant itself, where it is known."""

    omega: Array
    center: Array
    radius: Array
    model: Plant | None
    where: str


def read_discs(G: Any, probability: float) -> list[Discs]:
    """One set of discs per response; a model is taken on a grid of its own."""
    given = list(G) if isinstance(G, Sequence) else [G]
    if not given:
        raise InputError("no response", where="argument G", expected="a FrequencyResponse, several, or a model")
    return [_read(one, probability, "argument G" if len(given) == 1 else f"argument G[{k}]")
            for k, one in enumerate(given)]


def _read(G: Any, probability: float, where: str) -> Discs:
    if isinstance(G, (control.StateSpace, control.TransferFunction)):
        plant = read_plant(G, where)
        _expect_single(plant.D.shape, where)
        omega = model_grid(plant)
        return Discs(omega, responder(plant)(omega)[:, 0, 0], np.zeros(len(omega)), plant, where)
    if not isinstance(G, FrequencyResponse):
        raise InputError(f"G is a {type(G).__name__}", where=where,
                         expected="a FrequencyResponse (rt.identify), several of them, or a python-control model")
    _expect_single(G.response.shape[:2], where)
    inside = G.frequencies > 0
    center, omega = G.response[0, 0, inside], 2 * np.pi * G.frequencies[inside]
    count = len(omega)
    if count < 3:
        raise InputError(f"{count} bins above zero", where=where, expected="at least 3")
    radius = G.confidence_radius(1 - (1 - probability) / count)[0, 0, inside] if G.has_covariance else np.zeros(count)
    lost = ~np.isfinite(center) | ~np.isfinite(radius)
    if lost.any():
        f = omega[lost][0] / (2 * np.pi)
        raise InputError(f"{int(lost.sum())} bins are not determined, the first at {f:.4g} Hz", where=where,
                         expected="a finite response and radius at every bin", remedy="Cut them off with G.between.")
    return Discs(omega, center, radius, None, where)


def _expect_single(shape: tuple[int, ...], where: str) -> None:
    if tuple(shape) != (1, 1):
        raise InputError(f"a response with {shape[1]} inputs and {shape[0]} outputs", where=where,
                         expected="one input and one output")


def model_grid(plant: Plant) -> Array:
    """Frequencies from far below to far above the modes, dense at each of them [rad/s]."""
    poles = plant.poles
    if plant.dt:
        poles = np.log(np.where(abs(poles) > 1e-12, poles, 1e-12).astype(complex)) / plant.dt
    size = abs(poles)[abs(poles) > 1e-9]
    low, high = (size.min() / 300, size.max() * 300) if len(size) else (1e-2, 1e2)
    high = min(high, np.pi / plant.dt * (1 - 1e-6)) if plant.dt else high
    around = [abs(p.imag) + abs(p.real) * np.linspace(-5, 5, 41) for p in poles if abs(p.imag) > 1e-9]
    omega = np.unique(np.concatenate([np.geomspace(low, high, _MODEL_BINS), *around]))
    return omega[(omega >= low) & (omega <= high)]


def direction(discs: Sequence[Discs]) -> float:
    """Sign of the static gain, the same of all responses; refused where the first bin does not show it."""
    signs = set()
    for one in discs:
        first = one.center[0]
        sign = 1.0 if first.real >= 0 else -1.0
        if abs(np.angle(sign * first)) > _STATIC:
            raise InputError(f"the phase at the first bin, {one.omega[0] / (2 * np.pi):.3g} Hz, is "
                             f"{np.degrees(np.angle(first)):.0f} degrees: an integrator or a slow mode lies below it",
                             where=one.where, expected="bins down to where the response is its static gain",
                             remedy="Measure longer, or give initial gains of a loop that is stable.")
        signs.add(sign)
    if len(signs) > 1:
        raise InputError("the responses differ in the sign of their static gain", where="argument G",
                         expected="responses of one plant, or of plants that one controller can serve")
    return signs.pop()


def winding(one: Discs, loop: Array, integral: float) -> tuple[float, int, str]:
    """How far 1 + GC turns from frequency 0 to the last bin, how many integrators it has, and where it is not followed.

    Below the first bin it comes from where integrators put it: G there turns by a multiple of a right angle, the
    integral gain (0 if there is none) by another.
    """
    phi = 1 + loop
    steps = np.angle(phi[1:] / phi[:-1])
    wide = abs(steps) > _LARGEST_STEP
    if wide.any():
        k = int(wide.argmax())
        between = f"between {one.omega[k] / (2 * np.pi):.4g} and {one.omega[k + 1] / (2 * np.pi):.4g} Hz"
        return np.nan, 0, f"{between} the loop turns by {np.degrees(abs(steps[k])):.0f} degrees"
    quarter = round(float(np.angle(one.center[0])) / (np.pi / 2))
    integrators = quarter % 2 + (integral != 0)
    if integrators:
        origin = quarter * np.pi / 2 - (np.pi / 2 * (1 if integral > 0 else -1) if integral else 0.0)
    else:
        origin = 0.0 if phi[0].real > 0 else np.pi
    start = float(np.angle(phi[0] * np.exp(-1j * origin)))  # of the first bin, against the origin
    return start + float(steps.sum()), integrators, ""


def resonance_missed(one: Discs) -> str:
    """Where G itself turns too much between two bins to be followed, and is not small; empty where nowhere."""
    steps = abs(np.angle(one.center[1:] / one.center[:-1]))
    size = np.where(abs(one.center) > 2 * one.radius, abs(one.center), 0.0)  # noise turns as it likes
    large = np.minimum(size[1:], size[:-1]) > 0.02 * size.max()
    wide = (steps > np.radians(110)) & large
    if not wide.any():
        return ""
    k = int(wide.argmax())
    return f"between {one.omega[k] / (2 * np.pi):.4g} and {one.omega[k + 1] / (2 * np.pi):.4g} Hz"


def read_sample_time(models: Sequence[Plant | None], highest: float, value: object) -> float:
    """Sample time of the controller [s], 0 of a continuous one; `highest`: last frequency of the responses [rad/s]."""
    of_model = {one.dt for one in models if one is not None}
    if value is None:
        return of_model.pop() if len(of_model) == 1 else 0.0
    found = positive_number(value, "sample_time", "s")
    if of_model and of_model != {found}:
        raise InputError(f"sample_time = {found:g} s of a controller for a model of another",
                         where="argument sample_time", expected="a model with that sample time",
                         remedy="Sample the model first: control.c2d.")
    if highest > np.pi / found * (1 + 1e-9):
        raise InputError(f"the response goes up to {highest / (2 * np.pi):.4g} Hz, beyond the Nyquist frequency of "
                         f"sample_time = {found:g} s", where="argument sample_time",
                         expected=f"at most {np.pi / highest:.4g} s", remedy="Cut the response with G.between.")
    return found
