"""Anderson's mixing for fixed points that the plain iteration approaches slowly or not at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ._terms import Array

_MEMORY = 9


def mixed(points: Sequence[Array], changes: Sequence[Array]) -> Array:
    """Next point from the latest ones.

    The weights make the combined change smallest, as in GMRES (Anderson 1965; Walker and Ni 2011, "Anderson
    acceleration for fixed-point iterations").

    Parameters
    ----------
    points, changes : sequence of ndarray, shape (n,)
        x and g(x) - x, the latest last; two or more.
    """
    x, f = np.array(points[-_MEMORY:]), np.array(changes[-_MEMORY:])
    weights = np.linalg.lstsq(np.diff(f, axis=0).T, f[-1], rcond=1e-12)[0]
    step: Array = f[-1] - weights @ (np.diff(x, axis=0) + np.diff(f, axis=0))
    return x[-1] + step
