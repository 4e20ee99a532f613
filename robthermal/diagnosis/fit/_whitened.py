"""The least-squares problem of a refit: whitened residuals of all readings, then of the priors, with fixed filters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..path import White, Whitener
from ._columns import Beside, Columns, Plain, Still, still
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
        return self._stacked(self.structure.slopes(v), self.structure.prior(v)[1])

    def columns(self, v: Array) -> Columns:
        """The same, as a descent asks for them: what a finer network would change does not depend on v."""
        structure, first = self.structure, self.whiteners[0]
        if not structure.in_coarse.stop > structure.in_coarse.start or not isinstance(first, Whitener):
            return Plain(self.slopes(v))
        prior = np.delete(structure.prior(v)[1], structure.in_coarse, axis=1)
        own = structure.n_readings + structure.n_priors
        return Beside(self._stacked(structure.moving_slopes(v), prior),
                      first.kept((structure.coarse, *self.whiteners[1:]), self._still), structure.in_coarse,
                      slice(own, own + structure.n_coarse))

    def _still(self) -> Still:
        """Derivatives by what a finer network would change, in the rows of the readings and of their own priors."""
        return still(self._stacked(self.structure.coarse, np.eye(self.structure.n_coarse)))

    def _stacked(self, of_readings: Sequence[Array], of_priors: Array) -> Array:
        """Whitened derivatives of the readings of all data sets, then those of the priors."""
        J, row = np.empty((self.structure.n_readings + len(of_priors), of_priors.shape[1])), 0
        for slopes, white in zip(of_readings, self.whiteners, strict=True):
            rows = slopes.shape[0] * slopes.shape[1]
            white(slopes, J[row:row + rows].reshape(slopes.shape))
            row += rows
        J[row:] = of_priors
        return J
