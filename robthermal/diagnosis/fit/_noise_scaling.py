"""Noise levels as nuisance parameters: re-estimated by likelihood, within limits, never free."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...fitting import rmse
from ..data import NoiseEstimate
from ..effects import conductances
from ..path import LinearizedRecord, RandomAmbients, SlowNoise, settled_cost

Array = NDArray[np.float64]
Noise = tuple[Array, Array, SlowNoise | None, RandomAmbients | None]
LARGEST_FACTOR = 1.4  # a free process noise would eat the physics: every level may change by at most this factor
WIDE = 2.2  # asked only when nothing explains the records: is the declared level itself wrong?
_CLOSE = 0.03
_N_TRIED = 15  # five per cent apart
_SHARES = np.geomspace(0.25, 1.0, 9)  # never more than the declared noise: it must not absorb physics
_MEMORIES = np.geomspace(2.0, 30.0, 9)  # samples; what drifts more slowly is physics
_WANDERS = [float(size) for size in np.geomspace(0.03, 3.0, 19)]  # K
_PACES = (300.0, 1000.0, 3000.0, 10000.0)  # s: air conditioning, a door, a day
_ROUNDS = 2  # of slow part and levels: each was found with the other


@dataclass(frozen=True)
class NoiseScaling:
    """Factors on the noise levels.

    Parameters
    ----------
    disturbance : float
        On the random heat of all lumps.
    noise : dict
        On the noise of every sensor.
    limit : float
        Largest factor, and the inverse of the smallest.
    share : float
        Standard deviation of a slow part of every sensor's noise, beside the white one, over that of the white one; 0
        without.
    memory : float
        Time constant of the slow part [s].
    wander : float
        Standard deviation of ambients that a record does not hold, about what the model says [K]; 0: they stand still.
    pace : float
        Time constant with which they wander [s].
    """

    disturbance: float
    noise: dict[str, float]
    limit: float = LARGEST_FACTOR
    share: float = 0.0
    memory: float = 0.0
    wander: float = 0.0
    pace: float = 0.0

    @property
    def declared(self) -> NoiseScaling:
        """Levels as declared, with ambients that wander as these say."""
        return NoiseScaling(1.0, {}, wander=self.wander, pace=self.pace)

    @property
    def sensors_exhausted(self) -> bool:
        """Whether the level of any sensor would be higher still, but for the limit."""
        return max(self.noise.values(), default=0.0) > 0.98 * self.limit

    @property
    def exhausted(self) -> bool:
        """Whether any level would be higher still, but for the limit."""
        return max([self.disturbance, *self.noise.values()]) > 0.98 * self.limit

    def of(self, path: LinearizedRecord, floor: NoiseEstimate) -> tuple[Array, Array]:
        """Noise of the record's sensors [K] and random heat of all lumps [W/√Hz]; lumps added since have none.

        Parameters
        ----------
        path : LinearizedRecord
            Simulated record with its sensors.
        floor : NoiseEstimate
            Declared noise levels.

        Returns
        -------
        tuple of ndarray
        """
        noise = np.array([floor.noise[name] * self.noise.get(name, 1.0) for name in path.one.sensors])
        return noise, self.disturbance * np.array([floor.disturbance.get(name, 0.0) for name in path.system.lumps])

    def slow(self, path: LinearizedRecord, floor: NoiseEstimate) -> SlowNoise | None:
        """Slow part of the noise of the record's sensors, at most as large as the declared noise; None without one.

        Parameters
        ----------
        path : LinearizedRecord
            Simulated record with its sensors.
        floor : NoiseEstimate
            Declared noise levels.

        Returns
        -------
        SlowNoise or None
        """
        if not self.share:
            return None
        declared = np.array([floor.noise[name] for name in path.one.sensors])
        std = np.minimum(self.share * self.of(path, floor)[0], declared)
        return SlowNoise(std, float(np.exp(-path.h / self.memory)))

    def wandering(self, path: LinearizedRecord) -> RandomAmbients | None:
        """Ambients that the record does not hold; None where all are recorded, or stand still.

        Parameters
        ----------
        path : LinearizedRecord
            Simulated record, with what it holds.

        Returns
        -------
        RandomAmbients or None
        """
        names = [name for name in path.system.ambients if name not in path.one.record.input_names]
        if not (self.wander and names):
            return None
        lumps = path.system.lump_names
        G = np.zeros((len(lumps), len(names)))
        for column, name in enumerate(names):
            for lump, slope in conductances(path.system, name).items():
                G[lumps.index(lump), column] = slope
        return RandomAmbients(np.full(len(names), self.wander), float(np.exp(-path.h / self.pace)), G)

    def noise_of(self, path: LinearizedRecord, floor: NoiseEstimate) -> Noise:
        """All that is random in a record: noise of its sensors, heat, slow part, ambients.

        Parameters
        ----------
        path : LinearizedRecord
            Simulated record with its sensors.
        floor : NoiseEstimate
            Declared noise levels.

        Returns
        -------
        tuple
            As `whitener` and `settled_cost` take it.
        """
        return *self.of(path, floor), self.slow(path, floor), self.wandering(path)

    def close_to(self, other: NoiseScaling) -> bool:
        """Whether all factors agree within three per cent, with the same slow part.

        Parameters
        ----------
        other : NoiseScaling
            To compare with.

        Returns
        -------
        bool
        """
        pairs = [(self.disturbance, other.disturbance)]
        pairs += [(value, other.noise.get(name, 1.0)) for name, value in self.noise.items()]
        pairs += [(self.wander, other.wander)] if self.wander and other.wander else []
        same = (self.share, self.memory, self.pace) == (other.share, other.memory, other.pace)
        return same and all(abs(a / b - 1.0) < _CLOSE for a, b in pairs)

    def __str__(self) -> str:
        sensors = ", ".join(f"{name} {factor:.2f}" for name, factor in self.noise.items())
        text = f"noise levels times: {sensors}; random heat {self.disturbance:.2f}"
        if self.wander:
            text += f"; ambients that are not recorded wander by {self.wander:.2g} K within {self.pace:.2g} s"
        return text if not self.share else (
            f"{text}; and the noise of every sensor has, besides its white part, a slow part of {self.share:.2f} times "
            f"its size that remembers {self.memory:.3g} s")


def refined(paths: Sequence[LinearizedRecord], floor: NoiseEstimate, levels: NoiseScaling) -> NoiseScaling:
    """Most likely factors within the limits, one after the other, once round."""
    residuals = _residuals(paths)
    cost = partial(_cost, paths, residuals, floor)
    factors = [float(t) for t in np.geomspace(1.0 / levels.limit, levels.limit, _N_TRIED)]
    heated = any(floor.disturbance.values())
    if levels.wander:
        levels = _wandering_as_likely(levels, cost)
    elif not heated and not levels.share:
        return replace(levels, noise=_by_spread(paths, residuals, floor, levels.limit))
    for name in floor.noise:
        levels = _lowest([replace(levels, noise={**levels.noise, name: factor}) for factor in factors], cost,
                         _nearest(factors, levels.noise.get(name, 1.0)))
    if not heated:
        return levels
    return _lowest([replace(levels, disturbance=factor) for factor in factors], cost,
                   _nearest(factors, levels.disturbance))


def with_slow_part(paths: Sequence[LinearizedRecord], floor: NoiseEstimate, levels: NoiseScaling
                   ) -> NoiseScaling | None:
    """Most likely slow part of the sensors' noise, one for all, and the factors that go with it.

    None if the smallest size or the longest memory tried is the most likely, or if any sensor is more likely to have
    white noise of the same size: weak physics looks like that, not noise.
    """
    cost, h = partial(_cost, paths, _residuals(paths), floor), min(path.h for path in paths)
    for _ in range(_ROUNDS):
        levels = _best([replace(levels, share=float(share), memory=float(memory * h))
                        for share in _SHARES for memory in _MEMORIES], cost)
        levels = refined(paths, floor, levels)
    inside = levels.share > _SHARES[0] and levels.memory < _MEMORIES[-1] * h
    return levels if inside and all(_is_slow(name, paths, floor, levels) for name in floor.noise) else None


def _wandering_as_likely(levels: NoiseScaling, cost: Callable[[NoiseScaling], float]) -> NoiseScaling:
    """Most likely time constant of the ambients' wandering, and its size: what was missing before has moved both."""
    paced = [replace(levels, pace=pace, wander=levels.wander * math.sqrt(pace / levels.pace)) for pace in _PACES]
    sized = [_lowest([replace(one, wander=size) for size in _WANDERS], cost, _nearest(_WANDERS, one.wander))
             for one in paced]
    return _best(sized, cost)


def with_wandering_ambients(paths: Sequence[LinearizedRecord], floor: NoiseEstimate, levels: NoiseScaling
                            ) -> tuple[NoiseScaling, float] | None:
    """Most likely wandering of ambients that no record holds, and by how much -2 log likelihood falls with it.

    None where all are recorded, or joined to nothing.
    """
    if all(replace(levels, wander=1.0, pace=1.0).wandering(path) is None for path in paths):
        return None
    cost = partial(_cost, paths, _residuals(paths), floor)
    found = _best([replace(levels, wander=size, pace=pace) for size in _WANDERS[::3] for pace in _PACES], cost)
    found = refined(paths, floor, found)
    return found, cost(levels) - cost(found)


def _is_slow(name: str, paths: Sequence[LinearizedRecord], floor: NoiseEstimate, levels: NoiseScaling) -> bool:
    """Whether a slow part of this sensor's noise is more likely than white noise of the same size."""
    gain = 0.0
    for path, r in zip(paths, _residuals(paths), strict=True):
        (noise, disturbance), slow = levels.of(path, floor), levels.slow(path, floor)
        assert slow is not None
        own = np.array([sensor == name for sensor in path.one.sensors])
        white, others = np.where(own, np.hypot(noise, slow.std), noise), replace(slow, std=np.where(own, 0.0, slow.std))
        gain += settled_cost(path, r, white, disturbance, others) - settled_cost(path, r, noise, disturbance, slow)
    return gain > 0.0 or not any(name in path.one.sensors for path in paths)


def _residuals(paths: Sequence[LinearizedRecord]) -> list[Array]:
    return [path.residual for path in paths]


def _cost(paths: Sequence[LinearizedRecord], residuals: Sequence[Array], floor: NoiseEstimate, levels: NoiseScaling
          ) -> float:
    """-2 log likelihood of the residuals of all records."""
    return sum(settled_cost(path, r, *levels.noise_of(path, floor)) for path, r in zip(paths, residuals, strict=True))


def _by_spread(paths: Sequence[LinearizedRecord], residuals: Sequence[Array], floor: NoiseEstimate, limit: float
               ) -> dict[str, float]:
    """Without random heat the most likely level is the root mean square of the residual."""
    out = {}
    for name, level in floor.noise.items():
        own = [r[:, path.one.sensors.index(name)] for path, r in zip(paths, residuals, strict=True)
               if name in path.one.sensors]
        ratio = rmse(own) / level
        out[name] = float(np.clip(ratio, 1.0 / limit, limit))
    return out


def _best(tried: list[NoiseScaling], cost: Callable[[NoiseScaling], float]) -> NoiseScaling:
    return min(tried, key=cost)


def _nearest(factors: Sequence[float], now: float) -> int:
    """Place of the factor that comes nearest."""
    return min(range(len(factors)), key=lambda i: abs(math.log(factors[i] / now)))


def _lowest(tried: list[NoiseScaling], cost: Callable[[NoiseScaling], float], near: int) -> NoiseScaling:
    """As `_best` along a cost with one minimum, such as that of a single level: downhill from a place near it."""
    least = cost(tried[near])
    for way in (1, -1):
        start = near
        while 0 <= near + way < len(tried) and (found := cost(tried[near + way])) < least:
            near, least = near + way, found
        if near != start:
            break
    return tried[near]
