"""Smallest box around the ambients that a machine cannot leave, by Newton's method on all faces at once.

Each face takes its own worst case (current, partner, parameters); a step solves the worst cases' linear problem
(policy iteration). Heat through a face grows as the other faces move out, so the smallest box is the first solution.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from .._celsius import LOWEST_KELVIN
from ._faces import SIGNS, Array, Faces, Outward

HOTTEST = 1000.0  # K
COLDEST = LOWEST_KELVIN  # no certificate is made below
_STEPS = 100
_SLOW_STEPS = 12  # after as many steps without a solution of the worst cases ahead there is taken to be none
_ROUNDING = 1e-9
_CLOSE = 0.4  # share of the least margin within which the heat must come


def smallest_box(faces: Faces, current: Mapping[str, Any], start: Array | None = None) -> Array | None:
    """Smallest box that contains all ambients and is never left, with the reserve of `faces`; None if it diverges.

    Parameters
    ----------
    faces : Faces
        Of the machine and its ranges.
    current : mapping
        {module: (lower, upper)} [A].
    start : ndarray, shape (2, n), optional
        Box known to lie inside the one that is looked for, for example that of smaller currents.

    Returns
    -------
    ndarray, shape (2, n), or None
        Lower and upper ends [K].
    """
    signs = np.repeat(SIGNS, faces.count)
    around = faces.surroundings
    least = signs * np.repeat([around[0].min(), around[1].max()], faces.count)  # outward positions of the faces
    out = least if start is None else np.maximum(least, signs * start.ravel())
    tolerance = _CLOSE * float(np.min(faces.margin))
    slow = 0
    for _ in range(_STEPS):
        box = (signs * out).reshape(2, -1)
        if not np.isfinite(box).all() or box[1].max() > HOTTEST or box[0].min() < COLDEST:
            return None
        found = faces.around(current, box)
        if (found.heat <= tolerance).all():
            return np.round(box, 6)
        step = _newton(found, out - least)
        if step is None:
            slow += 1
            if slow > _SLOW_STEPS:
                return None
            step = _slow(found)
        out = np.maximum(out + step, least)
    return None


def _newton(found: Outward, room: Array) -> Array | None:
    """Step to where no worst case pushes outwards; None where the worst cases have no such point ahead.

    Faces that their heat would draw inside the ambients' range go to its end instead.
    """
    diagonal = found.slopes.diagonal()
    if not (diagonal < 0).all():
        return None
    held = found.heat / -diagonal < -room
    keep = diags_array(np.where(held, 0.0, 1.0))
    matrix = csc_array(diags_array(np.where(held, 1.0, 0.0)) - keep @ found.slopes)
    try:
        lu = splu(matrix)
    except RuntimeError:  # exactly singular
        return None
    answer = lu.solve(np.where(held, 0.0, 1.0))  # zero where held, but for rounding
    if not (answer >= -_ROUNDING * np.abs(answer).max()).all():  # no M-matrix: beyond a fold
        return None
    return np.asarray(lu.solve(np.where(held, -room, found.heat)))


def _slow(found: Outward) -> Array:
    """Step of the faces that still push outwards, by their own loss alone: away from where Newton fails."""
    loss = np.maximum(-found.slopes.diagonal(), np.abs(found.slopes).max() * 1e-3)
    return np.maximum(found.heat, 0.0) / loss
