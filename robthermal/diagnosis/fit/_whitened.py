"""The least-squares problem of a refit: whitened residuals of all readings, then of the priors, with fixed filters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..path import White
from ._structure import Structure

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Whitened:
    """Residuals and derivatives of a structure in the coordinates of its filters.

    Parameters
    ----------
    structure : Structure
        Unknowns and their priors.
    whiteners : sequence of White
        One per record or frequency response.
    """

    structure: Structure
    whiteners: Sequence[White]

    def residual(self, v: Array) -> Array:
        """Residuals (m,): measured - modelled."""
        each = zip(self.structure.paths(v), self.whiteners, strict=True)
        return np.concatenate([*(white(path.residual).ravel() for path, white in each), self.structure.prior(v)[0]])

    def slopes(self, v: Array) -> Array:
        """Derivatives (m, p) of the model."""
        prior = self.structure.prior(v)[1]
        J, row = np.empty((self.structure.n_readings + len(prior), v.size)), 0
        for slopes, white in zip(self.structure.slopes(v), self.whiteners, strict=True):
            rows = slopes.shape[0] * slopes.shape[1]
            white(slopes, J[row:row + rows].reshape(slopes.shape))
            row += rows
        J[row:] = prior
        return J
