"""Arguments that several syntheses share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import expm

from .._checks import positive_number, quoted
from .._control import control
from ..errors import InputError
from ..linear import Plant
from ._plant import GeneralizedPlant


def choice(name: str, value: object, allowed: Sequence[str]) -> str:
    """One of a few words."""
    if not isinstance(value, str) or value not in allowed:
        raise InputError(f"{name} = {quoted(value)}", where=f"argument {name}", expected=f"one of {list(allowed)}")
    return value


def read_poles(region: Mapping[str, float] | None, dt: float) -> dict[str, float]:
    """Region of the closed-loop eigenvalues: decay, damping, radius."""
    if region is None:
        return {}
    known = ("radius",) if dt else ("decay", "damping", "radius")
    if not isinstance(region, Mapping) or not region or any(key not in known for key in region):
        raise InputError(f"region = {quoted(region)}", where="argument region",
                         expected=f"{'radius' if dt else 'decay, damping, radius'} with numbers above zero")
    found = {key: positive_number(value, f"region[{key!r}]") for key, value in region.items()}
    if found.get("damping", 0.0) >= 1 or (dt and found["radius"] > 1):
        raise InputError(f"region = {quoted(region)}", where="argument region",
                         expected="a damping ratio below 1, a radius of at most 1 if sampled")
    if set(found) == {"radius"} and not dt:
        raise InputError("a radius alone, which does not make a loop stable", where="argument region",
                         expected="also a decay or a damping ratio")
    return found


def sampled(plant: GeneralizedPlant, sample_time: object) -> GeneralizedPlant:
    """Plant with all inputs held between samples, exactly."""
    if sample_time is None:
        return plant
    if plant.dt:
        raise InputError(f"the plant is already sampled, at {plant.dt:g} s", where="argument sample_time",
                         expected="a continuous plant", remedy="Leave sample_time out.")
    grown, w = held(plant.joined, sample_time), plant.B1.shape[1]
    return replace(plant, A=grown.A, B1=grown.B[:, :w], B2=grown.B[:, w:], dt=grown.dt)


def held(plant: Plant, sample_time: object) -> Plant:
    """Plant with its inputs held between samples, exactly; one that is sampled already as it is."""
    T = plant.dt if sample_time is None else positive_number(sample_time, "sample_time", "s")
    if not T:
        raise InputError("sample_time is missing", where="argument sample_time", expected="a time in seconds",
                         remedy="The controller is sampled.")
    if plant.dt and plant.dt != T:
        raise InputError(f"the plant is sampled at {plant.dt:g} s", where="argument sample_time",
                         expected="the same, or a continuous plant")
    if plant.dt:
        return plant
    n, m = plant.B.shape
    grown = expm(np.block([[plant.A, plant.B], [np.zeros((m, n + m))]]) * T)
    if not np.isfinite(grown).all():
        raise InputError(f"sample_time = {T:g} s is too long for the modes of the plant", where="argument sample_time",
                         expected="a shorter time")
    return Plant(grown[:n, :n], grown[:n, n:], plant.C, plant.D, T)


def state_space(P: Any) -> control.StateSpace:
    """P as a state space, whose names the results keep."""
    return P if isinstance(P, control.StateSpace) else control.ss(P)
