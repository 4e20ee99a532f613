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
    T = positive_number(sample_time, "sample_time", "s")
    if plant.dt:
        raise InputError(f"the plant is already sampled, at {plant.dt:g} s", where="argument sample_time",
                         expected="a continuous plant", remedy="Leave sample_time out.")
    n, m = len(plant.A), plant.joined.B.shape[1]
    if not np.isfinite(grown := expm(np.block([[plant.A, plant.joined.B], [np.zeros((m, n + m))]]) * T)).all():
        raise InputError(f"sample_time = {T:g} s is too long for the modes of the plant", where="argument sample_time",
                         expected="a shorter time")
    w = plant.B1.shape[1]
    return replace(plant, A=grown[:n, :n], B1=grown[:n, n:n + w], B2=grown[:n, n + w:], dt=T)


def state_space(P: Any) -> control.StateSpace:
    """P as a state space, whose names the results keep."""
    return P if isinstance(P, control.StateSpace) else control.ss(P)
