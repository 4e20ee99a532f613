"""The least-squares problem of a refit: whitened residuals of all readings, then of the priors, with fixed filters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..data import ResponseWhitener
from ..path import Whitener
from ._structure import Structure

Array = NDArray[np.float64]
White = Whitener | ResponseWhitener


@dataclass(frozen=True, eq=False)
class Whitened:
    """Residuals and derivatives of a structure in the coordinates of its filters.

    Parameters
    ----------
    structure : Structure
        Unknowns.
    whiteners : sequence of Whitener or ResponseWhitener
        One per record or frequency response.
    """

    structure: Structure
    whiteners: Sequence[White]

    def residual(self, v: Array) -> Array:
        """Residuals (m,): measured - modelled."""
        runs = zip(self.structure.runs(v), self.whiteners, strict=True)
        return np.concatenate([*(white(run.residual).ravel() for run, white in runs), self.structure.prior(v)[0]])

    def slopes(self, v: Array) -> Array:
        """Derivatives (m, p) of the model."""
        each = zip(self.structure.slopes(v), self.whiteners, strict=True)
        return np.concatenate([*(white(slopes).reshape(-1, v.size) for slopes, white in each),
                               self.structure.prior(v)[1]])
