"""Lags in front of the controls and behind the measurements, so that what varies of the plant meets constant factors.

Where B2, C2, D12, D21 vary, products with a varying controller would be quadratic in the weights. With the lag
x_f' = a (v - x_f), u = x_f they stand in A and C1, and the controller has a constant C_K and no D_K; the same holds of
y behind a lag. The lags are part of the controller that is returned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..linear import Plant
from ._plant import GeneralizedPlant

_FASTER = 10.0  # than the fastest mode of the plants


@dataclass(frozen=True)
class Filters:
    """Whether u and y are filtered, and by which pole [rad/s]; sampled by one sample."""

    controls: bool
    measurements: bool
    pole: float

    @property
    def words(self) -> str:
        """For the name of the method."""
        where = " and ".join([*(["u"] if self.controls else []), *(["y"] if self.measurements else [])])
        return f", lags at {where}" if where else ""

    def before(self, plant: GeneralizedPlant) -> GeneralizedPlant:
        """The plant with the lags."""
        dt, k, q = plant.dt, plant.B2.shape[1], len(plant.C2)
        own, into = (0.0, 1.0) if dt else (-self.pole, self.pole)
        if self.controls:
            n = len(plant.A)
            plant = replace(plant, A=np.block([[plant.A, plant.B2], [np.zeros((k, n)), own * np.eye(k)]]),
                            B1=np.vstack([plant.B1, np.zeros((k, plant.B1.shape[1]))]),
                            B2=np.vstack([np.zeros((n, k)), into * np.eye(k)]), C1=np.hstack([plant.C1, plant.D12]),
                            C2=np.hstack([plant.C2, plant.D22]), D12=0 * plant.D12, D22=0 * plant.D22)
        if self.measurements:
            n = len(plant.A)
            plant = replace(plant, A=np.block([[plant.A, np.zeros((n, q))], [into * plant.C2, own * np.eye(q)]]),
                            B1=np.vstack([plant.B1, into * plant.D21]), B2=np.vstack([plant.B2, into * plant.D22]),
                            C1=np.hstack([plant.C1, np.zeros((len(plant.C1), q))]),
                            C2=np.hstack([np.zeros((q, n)), np.eye(q)]), D21=0 * plant.D21, D22=0 * plant.D22)
        return plant

    def behind(self, K: Plant) -> Plant:
        """The controller with the lags: states of the lag of u, of that of y, its own."""
        n, k, q = len(K.A), *K.D.shape
        own, into = (0.0, 1.0) if K.dt else (-self.pole, self.pole)
        if self.measurements:
            K = Plant(np.block([[own * np.eye(q), np.zeros((q, n))], [K.B, K.A]]),
                      np.vstack([into * np.eye(q), np.zeros((n, q))]), np.hstack([K.D, K.C]), np.zeros((k, q)), K.dt)
            n += q
        if self.controls:
            K = Plant(np.block([[own * np.eye(k), into * K.C], [np.zeros((n, k)), K.A]]),
                      np.vstack([into * K.D, K.B]), np.hstack([np.eye(k), np.zeros((k, n))]), np.zeros((k, q)), K.dt)
        return K


def filters_for(plants: Sequence[GeneralizedPlant]) -> Filters:
    """Which lags the plants need."""
    acts = _vary(plants, "B2") or _vary(plants, "D12") or any(one.D22.any() for one in plants)
    sees = _vary(plants, "C2") or _vary(plants, "D21") or _vary(plants, "D22")
    fastest = max((float(np.abs(np.linalg.eigvals(one.A)).max()) for one in plants if len(one.A)), default=0.0)
    return Filters(acts, sees, _FASTER * (fastest or 1.0))


def _vary(plants: Sequence[GeneralizedPlant], key: str) -> bool:
    return any(not np.array_equal(getattr(one, key), getattr(plants[0], key)) for one in plants[1:])
