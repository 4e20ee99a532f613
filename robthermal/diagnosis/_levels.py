"""Noise levels as nuisance parameters: re-estimated by likelihood, within limits, never free."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ._along import Along
from ._noise_floor import NoiseFloor
from ._whitening import settled_cost

Array = NDArray[np.float64]
LIMIT = 1.4  # a free process noise would eat the physics: every level may change by at most this factor
WIDE = 2.2  # asked only when nothing explains the records: is the declared level itself wrong?
_CLOSE = 0.03
_N_TRIED = 15  # five per cent apart


@dataclass(frozen=True)
class Levels:
    """Factors on the noise levels.

    Parameters
    ----------
    disturbance : float
        On the random heat of all lumps.
    noise : dict
        On the noise of every sensor.
    limit : float
        Largest factor, and the inverse of the smallest.
    """

    disturbance: float
    noise: dict[str, float]
    limit: float = LIMIT

    def of(self, path: Along, floor: NoiseFloor) -> tuple[Array, Array]:
        """Noise of the record's sensors [K] and random heat of all lumps [W/√Hz]; lumps added since have none.

        Parameters
        ----------
        path : Along
            Simulated record.
        floor : NoiseFloor
            Declared levels.

        Returns
        -------
        tuple of ndarray
        """
        noise = np.array([floor.noise[name] * self.noise.get(name, 1.0) for name in path.one.sensors])
        return noise, self.disturbance * np.array([floor.disturbance.get(name, 0.0) for name in path.system.lumps])

    def close_to(self, other: Levels) -> bool:
        """Whether all factors agree within three per cent.

        Parameters
        ----------
        other : Levels
            To compare with.

        Returns
        -------
        bool
        """
        pairs = [(self.disturbance, other.disturbance)]
        pairs += [(value, other.noise.get(name, 1.0)) for name, value in self.noise.items()]
        return all(abs(a / b - 1.0) < _CLOSE for a, b in pairs)

    def __str__(self) -> str:
        sensors = ", ".join(f"{name} {factor:.2f}" for name, factor in self.noise.items())
        return f"noise levels times: {sensors}; random heat {self.disturbance:.2f}"


def refined(paths: Sequence[Along], floor: NoiseFloor, levels: Levels) -> Levels:
    """Most likely factors within the limits, one after the other, once round."""
    residuals = [path.one.readings - path.readings[:, path.one.columns] for path in paths]

    def cost(trial: Levels) -> float:
        total = 0.0
        for path, r in zip(paths, residuals, strict=True):
            total += settled_cost(path, r, *trial.of(path, floor))
        return total

    tried = [float(t) for t in np.geomspace(1.0 / levels.limit, levels.limit, _N_TRIED)]
    if not any(floor.disturbance.values()):
        return replace(levels, noise=_by_spread(paths, residuals, floor, levels.limit))
    for name in floor.noise:
        levels = _best([replace(levels, noise={**levels.noise, name: factor}) for factor in tried], cost)
    return _best([replace(levels, disturbance=factor) for factor in tried], cost)


def _by_spread(paths: Sequence[Along], residuals: Sequence[Array], floor: NoiseFloor, limit: float
               ) -> dict[str, float]:
    """Without random heat the most likely level is the root mean square of the residual."""
    out = {}
    for name, level in floor.noise.items():
        own = [r[:, path.one.sensors.index(name)] for path, r in zip(paths, residuals, strict=True)
               if name in path.one.sensors]
        ratio = float(np.sqrt(np.mean(np.concatenate(own) ** 2))) / level
        out[name] = float(np.clip(ratio, 1.0 / limit, limit))
    return out


def _best(tried: list[Levels], cost: Callable[[Levels], float]) -> Levels:
    return min(tried, key=cost)
