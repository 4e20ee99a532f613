"""The current at which cold faces are coldest in steady state: beyond it more current heats them.

All modules carry the same current, and each carries it alone; ambients, heats at the corners of their ranges.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from ..thermal import Equations, System
from ._faces import Array
from ._sections import Interval

_MOST_CORNERS = 64
_FIRST = 0.01  # share of S T / R, the current of the greatest Peltier effect, where the search begins
_GROWTH = 1.15
_LARGEST = 1.5  # S T / R: no face is coldest beyond 1
_HALVINGS = 24
_NEWTON = 12
_HOTTEST = 1500.0  # K


def coldest_current(system: System, modules: Sequence[str], ambient: Mapping[str, Interval],
                    heat: Mapping[str, Interval]) -> float:
    """Smallest current [A] at which the cold face of a module is coldest in steady state, or no steady state is left.

    Parameters
    ----------
    system : System
        System that contains the module.
    modules : sequence of str
        Modules that carry the current; the others are off.
    ambient : mapping
        {ambient: (lower, upper)} [K], every ambient.
    heat : mapping
        {lump: (lower, upper)} [W].

    Returns
    -------
    float
    """
    cases = _Cases(system, tuple(modules), ambient, heat)
    largest = max(module.seebeck.value * 300.0 / module.resistance.value for module in system.modules.values())
    low, c = 0.0, _FIRST * largest
    x = cases.rest()
    while c < _LARGEST * largest:
        found = cases.at(c, x)
        if found is None:
            break
        low, x, c = c, found, c * _GROWTH
    else:
        return float("inf")
    high = c
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        found = cases.at(middle, x)
        if found is None:
            high = middle
        else:
            low, x = middle, found
    return low


@dataclass(frozen=True)
class _Cases:
    """Every corner of the ranges with every way to carry the current, solved together."""

    system: System
    modules: tuple[str, ...]
    ambient: Mapping[str, Interval]
    heat: Mapping[str, Interval]

    @cached_property
    def _eq(self) -> Equations:
        return Equations(self.system)

    @cached_property
    def _patterns(self) -> Array:
        """Who carries the current, (n_cases, n_modules)."""
        own = [self.system.module_names.index(name) for name in self.modules]
        alone = np.eye(len(self.system.modules))[own]
        patterns = alone if len(own) == 1 else np.concatenate([alone, alone.sum(axis=0)[None]])
        return np.repeat(patterns, len(self._corners), axis=0)

    @cached_property
    def _corners(self) -> list[tuple[Array, Array]]:
        """(ambients [K], heats of the lumps [W]) at the corners, or at some of them where they are many."""
        pairs = [*(self.ambient[name] for name in self.system.ambients), *self.heat.values()]
        wide = [k for k, (low, high) in enumerate(pairs) if high > low]
        chosen: Any = product((0, 1), repeat=len(wide))
        if 2 ** len(wide) > _MOST_CORNERS:  # all low, all high, and each alone at its other end
            one = np.eye(len(wide), dtype=int)
            chosen = [*one, *(1 - one), np.zeros(len(wide), int), np.ones(len(wide), int)]
        corners, n = [], len(self.system.ambients)
        for ends in chosen:
            at = [pair[0] for pair in pairs]
            for k, end in zip(wide, ends, strict=True):
                at[k] = pairs[k][end]
            load = np.zeros(len(self.system.lumps))
            for name, value in zip(self.heat, at[n:], strict=True):
                load[self.system.lump_names.index(name)] += value
            corners.append((np.array(at[:n]), load))
        return corners

    @cached_property
    def _outside(self) -> tuple[Array, Array]:
        """Exogenous values with no current (n_cases, n_u), and heats (n_cases, n)."""
        repeat = len(self._patterns) // len(self._corners)
        u = np.tile(self._eq.nominal(), (len(self._patterns), 1))
        u[:, u.shape[1] - len(self.system.ambients):] = np.tile([a for a, _ in self._corners], (repeat, 1))
        return u, np.tile([load for _, load in self._corners], (repeat, 1))

    def rest(self) -> Array:
        """First guess of the temperatures (n_cases, n)."""
        return np.repeat(self._outside[0][:, -1:], len(self.system.lumps), axis=1)

    def at(self, c: float, x: Array) -> Array | None:
        """Steady states at a current, from those nearby; None where one is not stable, or no longer cools."""
        u = self._outside[0].copy()
        first = len(self.system.inputs)
        u[:, first:first + len(self.system.modules)] = c * self._patterns
        for _ in range(_NEWTON):
            J, by_input = self._eq.jacobians(x, u)
            step = np.linalg.solve(J, (self._eq.heat(x, u) + self._outside[1])[..., None])[..., 0]
            x = x - step
            if not np.isfinite(x).all() or x.max() > _HOTTEST or x.min() <= 0:
                return None
            if np.abs(step).max() < 1e-8:
                break
        else:
            return None
        if np.linalg.eigvals(J / self._eq.capacity[:, None]).real.max() >= 0:
            return None
        by_current = by_input[:, :, first:first + len(self.system.modules)]
        change = np.linalg.solve(J, -np.einsum("bij,bj->bi", by_current, self._patterns)[..., None])[..., 0]
        cold = [self.system.lump_names.index(module.cold) for module in self.system.modules.values()]
        return None if (change[:, cold] >= 0)[self._patterns > 0].any() else x
