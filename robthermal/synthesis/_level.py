"""The smallest level at which a regular plant has an H-infinity controller: bisection on both Riccati equations.

Floats first; where the loop they give does not reach what they say, balls with more bits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace

import numpy as np

from ..linear import Plant, close, plant_norm
from ._arithmetic import Arithmetic, Balls, Floats
from ._central import Regular, controller, least_level, regular, solutions
from ._plant import GeneralizedPlant, balanced

_FREE = 1e30  # a level at which the disturbance costs nothing: the H2 controller
_MOST = 80  # bisections
_MOST_CHECKED = 16  # states of a plant whose optimum in floats is confirmed in balls
_SPAN = 1e-9  # of the H2 controller's norm: below it the optimum counts as zero
_PRECISIONS: tuple[Floats | Balls, ...] = (Floats(), Balls(192), Balls(448))
_FURTHER = (1.5, 2.0, 3.0, 5.0, 10.0)  # times the optimum, in search of a smaller gain
_BACK_OFF = (0.6, 2.0, 6.0, 20.0, 60.0)  # of the tolerance, above the optimum


@dataclass(frozen=True)
class Candidate:
    """A controller, the level it was made for, and the smallest level found."""

    controller: Plant
    level: float
    optimum: float
    precision: str
    iterations: int


def candidates(plant: GeneralizedPlant, tolerance: float, asked: float | None = None,
               limited: bool = False) -> Iterator[Candidate]:
    """Controllers of a continuous plant with D12, D21 of full rank, best first, in floats and then in balls.

    The caller proves what they reach, and stops when that is good enough. Nothing comes where no precision finds one.
    With `limited` they go on to ten times the optimum: their gains fall.
    """
    plant = balanced(plant)
    for arithmetic in _PRECISIONS:
        with arithmetic.working() if isinstance(arithmetic, Balls) else nullcontext():
            yield from _in(plant, arithmetic, tolerance, asked, _FURTHER if limited else ())


def central(plant: GeneralizedPlant, levels: Sequence[float]) -> Iterator[Plant]:
    """Central controllers in floats, at levels of a continuous plant with D12, D21 of full rank."""
    try:
        own = regular(balanced(plant), Floats())
    except np.linalg.LinAlgError:
        return
    for level in levels:
        if level > least_level(own) and (made := _made(own, level, Floats())) is not None:
            yield made


def _in(plant: GeneralizedPlant, arithmetic: Arithmetic, tolerance: float, asked: float | None,
        further: tuple[float, ...]) -> Iterator[Candidate]:
    name = f"{arithmetic.bits} bit" if isinstance(arithmetic, Balls) else "floats"
    try:
        own = regular(plant, arithmetic)
        start = _start(plant, own, arithmetic)
        if start is None:
            return
        optimum, count = _bisect(own, arithmetic, start, tolerance / 20)
        if isinstance(arithmetic, Floats) and _missed(plant, optimum * (1 - 0.6 * tolerance)):
            return
    except np.linalg.LinAlgError:
        return
    above = [*(optimum * (1 + factor * tolerance) for factor in _BACK_OFF), *(optimum * factor for factor in further)]
    levels = above
    if asked is not None and asked > optimum:
        levels = [asked, *(level for level in reversed(above) if level < asked)]
    for level in levels:
        made = _made(own, level, arithmetic)
        if made is not None:
            yield Candidate(made, level, optimum, name, count)


def _missed(plant: GeneralizedPlant, level: float) -> bool:
    """Whether balls find solutions at a level where floats found none."""
    if len(plant.A) > _MOST_CHECKED:
        return False
    balls = Balls(192)
    with balls.working():
        own = regular(plant, balls)
        return level > least_level(own) and solutions(own, level, balls) is not None


def _made(own: Regular, level: float, arithmetic: Arithmetic) -> Plant | None:
    """Central controller at a level, None where there is none or its numbers are no numbers."""
    try:
        found = solutions(own, level, arithmetic)
        made = None if found is None else controller(own, found, arithmetic)
    except np.linalg.LinAlgError:
        return None
    good = made is not None and all(np.isfinite(part).all() for part in (made.A, made.B, made.C, made.D))
    return made if good else None


def _start(plant: GeneralizedPlant, own: Regular, arithmetic: Arithmetic) -> float | None:
    """A level that is reached: the norm of the H2 controller's loop, where floats can tell."""
    found = solutions(own, _FREE, arithmetic)
    if found is None:
        return None
    made = _made(own, _FREE, arithmetic)
    loop = None if made is None else close(replace(plant, D22=own.D22).joined, made)
    if loop is not None and loop.stable:
        return max(plant_norm(loop)[0], least_level(own)) * 1.0001
    level = max(10 * least_level(own), 1e-3)
    for _ in range(15):
        if solutions(own, level, arithmetic) is not None:
            return level
        level *= 100
    return None


def _bisect(own: Regular, arithmetic: Arithmetic, high: float, accuracy: float) -> tuple[float, int]:
    """Smallest level with solutions, from above, and the number of steps."""
    low = max(least_level(own), _SPAN * high)
    count = 0
    while high > low * (1 + accuracy) and count < _MOST:
        level = max(float(np.sqrt(low * high)), high / 3)  # the H2 controller is seldom far from the optimum
        if solutions(own, level, arithmetic) is None:
            low = level
        else:
            high = level
        count += 1
    return high, count
