"""What it does to the state when the time of a jump moves: delays, steps, and lags that are still zero.

A drive that jumps at time t from w⁻ to w⁺ and does so δ later adds δ (ż(w⁻) - ż(w⁺)) to the state. A lag τ → 0 replaces
the jump by w⁺ + (w⁻ - w⁺) e^{-s/τ}; heats are at most quadratic in a drive, so that its effect over all s is
2 τ (ż(½(w⁻ + w⁺)) - ż(w⁺)) exactly.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ._exponential import Integrator
from ._parameters import locate
from ._schedule import Schedule
from ._terms import Array


def rates(by: Integrator, z: Array, w: Array) -> Array:
    """ż of the free states (n, n_free) at states z (n, at least n_free) and drives w (n, n_w)."""
    n, parts = by.layout.n_free, by.parts
    heat = by.port_heat(np.concatenate([z[:, by.ports], w.astype(np.result_type(z, w))], axis=1))
    return z[:, :n] @ parts.F[:n, :n].T + w @ parts.B[:n].T + heat @ parts.N[:n].T


def jump_slopes(by: Integrator, names: Sequence[str], z: Array, plan: Schedule) -> dict[str, Array]:
    """Derivative (n_segments, n_free) added at the start of every segment, for the parameters that move jumps."""
    found = {}
    for name in names:
        table, part, field = locate(by.eq.system, name)
        if field == "step.time":
            found[name] = _moved(by, z, plan, [by.eq.drives.steps[part]])
        elif field == "drive.delay":
            sign = [by.eq.drives.signs[part]] if part in by.eq.drives.signs and table == "modules" else []
            found[name] = _moved(by, z, plan, [by.eq.drives.column[part], *sign])
        elif field == "drive.time_constant" and by.eq.drives.column[part] not in by.layout.drives:
            found[name] = _blurred(by, z, plan, by.eq.drives.column[part])
    return found


def _before(plan: Schedule, columns: list[int]) -> Array:
    """Drives with some columns still as in the segment before."""
    w = plan.w.copy()
    w[1:, columns] = plan.w[:-1, columns]
    return w


def _moved(by: Integrator, z: Array, plan: Schedule, columns: list[int]) -> Array:
    return rates(by, z, _before(plan, columns)) - rates(by, z, plan.w)


def _blurred(by: Integrator, z: Array, plan: Schedule, column: int) -> Array:
    halfway = 0.5 * (_before(plan, [column]) + plan.w)
    return 2 * (rates(by, z, halfway) - rates(by, z, plan.w))
