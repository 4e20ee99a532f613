"""Margins of a closed loop: how far gain, phase and delay of each control may be wrong, from the sensitivities."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..linear import Plant, plant_norm, responder
from ._plant import GeneralizedPlant

Margins = dict[str, dict[str, float]]


def margins(plant: GeneralizedPlant, controller: Plant, names: Sequence[str]) -> Margins:
    """Margins at every control, the other loops closed, and for all controls at once.

    Disk margin α = 2 / ‖S - T‖∞ with S = (1 - K G)⁻¹ at the controls (Blight, Dailey and Gangsaas 1994): every gain
    from (2 - α)/(2 + α) to its inverse and every phase up to 2 arctan(α/2) is borne.
    In floats, not proven.
    """
    S = _sensitivity(plant, controller)
    if not S.stable:
        return {}
    found = {name: _of(_part(S, [k])) for k, name in enumerate(names)}
    return found | {"all loops at once": _of(S)}


def _sensitivity(plant: GeneralizedPlant, K: Plant) -> Plant:
    """S from a signal added at the controls to the controls: u = K y + v."""
    n, k, m = len(plant.A), len(K.A), K.D.shape[0]
    E = np.linalg.inv(np.eye(m) - K.D @ plant.D22)
    ux, uk = E @ K.D @ plant.C2, E @ K.C
    yx, yk, yv = plant.C2 + plant.D22 @ ux, plant.D22 @ uk, plant.D22 @ E
    A = np.block([[plant.A + plant.B2 @ ux, plant.B2 @ uk], [K.B @ yx, K.A + K.B @ yk]])
    B = np.vstack([plant.B2 @ E, K.B @ yv])
    return Plant(A, B, np.hstack([ux, uk]).reshape(m, n + k), E, plant.dt)


def _part(S: Plant, which: list[int]) -> Plant:
    return Plant(S.A, S.B[:, which], S.C[which], S.D[np.ix_(which, which)], S.dt)


def _of(S: Plant) -> dict[str, float]:
    """Disk, gain, phase and delay margin of one set of loops; S - T = 2 S - 1."""
    both = Plant(S.A, S.B, 2 * S.C, 2 * S.D - np.eye(len(S.D)), S.dt)
    alpha = 2 / plant_norm(both)[0]
    gain = (2 + alpha) / (2 - alpha) if alpha < 2 else np.inf
    return {"disk": alpha, "gain": gain, "phase": float(np.degrees(2 * np.arctan(alpha / 2))), "delay": _delay(S),
            "modulus": 1 / plant_norm(S)[0]}


def _delay(S: Plant) -> float:
    """Largest delay for which ‖T (e^{-jωτ} - 1)‖ < 1 at every frequency [s]: small gain, so rather too small."""
    T = Plant(S.A, S.B, S.C, S.D - np.eye(len(S.D)), S.dt)
    poles = abs(S.poles)
    slow, fast = (poles[poles > 0].min(), poles.max()) if poles.any() else (1.0, 1.0)
    end = np.pi / S.dt if S.dt else np.inf
    if S.dt:
        slow, fast = 1e-4 / S.dt, end
    omega = np.geomspace(slow * 1e-2, min(fast * 1e3, end), 2000)
    size = np.array([np.linalg.norm(value, 2) for value in responder(T)(omega)])
    large = size > 0.5  # |e^{-jωτ} - 1| is at most 2
    if not large.any():
        return float("inf")
    return float((2 * np.arcsin(0.5 / size[large]) / omega[large]).min())
