"""Splines in time of extra heat into a lump, in which a test looks for what is left."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
N_SPLINES = 16


def heat_splines(time: Array, count: int = N_SPLINES) -> Array:
    """Cubic B-splines on even knots over the record, (n, count)."""
    t = (time - time[0]) / (time[-1] - time[0])
    inner = np.linspace(0.0, 1.0, count - 2)
    knots = np.concatenate([[0.0] * 3, inner, [1.0] * 3])
    basis = scipy.interpolate.BSpline.design_matrix(np.minimum(t, 1.0 - 1e-12), knots, 3)
    return np.asarray(basis.toarray(), np.float64)
