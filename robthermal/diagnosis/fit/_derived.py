"""Numbers of a system that an effect derives from nominal parameters: they move with them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = Callable[[Array], dict[str, float]]
STEP = 1e-4  # of a quantity, relative: for the derivative of the system's numbers, which are smooth in it
_LEAST_PARAMETER, _LEAST_QUANTITY = 1e-3, 1e-6  # sizes a step is taken of at least: some quantities are that small
_UNLIKE = 0.01  # of a change: more than the curvature of a step makes


def unexplained(numbers: Numbers, v: Array, values: dict[str, float], columns: list[dict[str, float]], upper: Array,
                some: Sequence[int]) -> set[str]:
    """Numbers that an effect derives from some nominal parameters: all moved at once, they move as no column says.

    Parameters
    ----------
    numbers : callable
        All numbers of the system at some unknowns.
    v : ndarray
        Unknowns of the fit, nominal parameters first.
    values : dict
        Numbers of the system at v.
    columns : list of dict
        Derivatives of the numbers that each parameter is known to move.
    upper : ndarray
        Upper bounds of the parameters, at which numbers stand still.
    some : sequence of int
        Places of the parameters that are moved.
    """
    at, known = v.copy(), dict.fromkeys(values, 0.0)
    for i in some:
        step = _step(v[i], upper[i], _LEAST_PARAMETER)
        at[i] += step
        for name, slope in columns[i].items():
            known[name] += step * slope
    moved = numbers(at)
    changes = {name: moved[name] - value for name, value in values.items()}
    return {name for name, change in changes.items() if abs(change - known[name]) > _UNLIKE * abs(change)}


def _deriving(numbers: Numbers, v: Array, values: dict[str, float], columns: list[dict[str, float]], upper: Array,
              some: Sequence[int]) -> list[int]:
    """Which of some nominal parameters an effect derives numbers from; few do, and most of them a number of their own.

    Those that have none among the unexplained numbers are asked for again together, and then by halves.
    """
    names = unexplained(numbers, v, values, columns, upper, some) if some else set()
    if not names or len(some) == 1:
        return list(some) if names else []
    own = [i for i in some if names & columns[i].keys()]
    rest = [i for i in some if i not in own]
    half = 0 if own else len(rest) // 2
    return [*own, *(i for part in (rest[:half], rest[half:])
                    for i in _deriving(numbers, v, values, columns, upper, part))]


def moved_by(numbers: Numbers, v: Array, i: int, values: dict[str, float], own: dict[str, float], upper: float
             ) -> dict[str, float]:
    """Derivatives of all numbers that move with one unknown; those that are known are taken where they hold.

    They do not where an effect scales the number: a change of a parameter, a gain.

    Parameters
    ----------
    numbers : callable
        All numbers of the system at some unknowns.
    v : ndarray
        Unknowns of the fit.
    i : int
        Place of the unknown that moves.
    values : dict
        Numbers of the system at v.
    own : dict
        Derivatives that are known.
    upper : float
        Upper bound of the unknown, at which numbers stand still.
    """
    found = _slopes(numbers, v, i, values, _step(v[i], upper, _LEAST_PARAMETER))
    return {name: own[name] if abs(own.get(name, np.inf) - slope) <= _UNLIKE * abs(slope) else slope
            for name, slope in found.items()}


def _step(value: float, upper: float, least: float) -> float:
    """Away from the upper bound, where there is no room for a step."""
    step = STEP * max(abs(value), least)
    return -step if value + step > upper else step


def _slopes(numbers: Numbers, v: Array, i: int, values: dict[str, float], step: float) -> dict[str, float]:
    """Derivatives by unknown i of the numbers that move with it."""
    moved = v.copy()
    moved[i] += step
    other = numbers(moved)
    return {name: (other[name] - values[name]) / step for name in values if other[name] != values[name]}


def with_quantities(numbers: Numbers, v: Array, columns: list[dict[str, float]], upper: Array
                    ) -> list[dict[str, float]]:
    """Derivatives of the numbers by all parameters and quantities of effects, from those by parameters alone.

    Parameters
    ----------
    numbers : callable
        All numbers of the system at some unknowns.
    v : ndarray
        Unknowns of the fit: nominal parameters, then quantities of effects, then others.
    columns : list of dict
        Derivatives by every parameter of the numbers that it is known to move.
    upper : ndarray, shape (n,)
        Upper bounds of parameters and quantities.
    """
    p, out, values = len(columns), list(columns), numbers(v)
    for i in range(p, len(upper)):
        out.append(_slopes(numbers, v, i, values, _step(v[i], upper[i], _LEAST_QUANTITY)))
    for i in _deriving(numbers, v, values, columns, upper, range(p)):
        out[i] = moved_by(numbers, v, i, values, columns[i], upper[i])
    return out
