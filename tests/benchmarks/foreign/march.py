"""Implicit time steps of a field: Ascher, Ruuth and Spiteri's ARS(2,2,2), stiffly accurate, of second order.

Conduction is implicit (one sparse factorization), heats that depend on temperature, time or currents are explicit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import diags
from scipy.sparse.linalg import splu

from .field import Array, Field, Heat

_G = 1.0 - 1.0 / np.sqrt(2.0)
_D = 1.0 - 1.0 / (2.0 * _G)


def march(plant: Field, U: Array, T0: Array, h: float, sub: int, heats: Sequence[Heat] = (),
          shake: Array | None = None, start: float = 0.0) -> Array:
    """What the sensors see at every step, (n sub, n_sensors), with columns U (n sub, n_columns) held over every step.

    `shake` (n sub, n_cells) is a random heat [W]; the clock of the heats starts at `start` [s].
    """
    C, K, B = plant.matrices()
    dt = h / sub
    solve = splu((diags(C / dt) - _G * K).tocsc()).solve
    seen = np.zeros((len(plant.sensors), C.size))
    for row, cells in enumerate(plant.sensors.values()):
        seen[row, cells] = 1.0 / len(cells)

    def source(t: float, T: Array, u: Array, k: int) -> Array:
        Q = B @ u
        if shake is not None:
            Q += shake[k]
        for one in plant.legs:
            one.heat(T, u, Q)
        for heat in heats:
            heat(t, T, u, Q)
        return Q

    T, out = np.array(T0, float), np.zeros((len(U), len(seen)))
    for k, u in enumerate(U):
        out[k] = seen @ T
        t = start + k * dt
        first = source(t, T, u, k)
        a = solve(C / dt * T + _G * first)
        second = source(t + _G * dt, a, u, k)
        T = solve(C / dt * T + (1.0 - _G) * (K @ a) + _D * first + (1.0 - _D) * second)
    return out
