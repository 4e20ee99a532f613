"""A structure whose nominal parameters are known up to a full covariance: from the reference records."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..fit import Refit, Structure, Whitened, relinearized

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Held(Structure):
    """Nominal parameters near those of the reference records; the same unknowns as `Structure` otherwise.

    Parameters
    ----------
    center : ndarray, shape (p,)
        Coordinates of the parameters on a healthy day.
    root : ndarray, shape (p, p)
        R with RᵀR the inverse of their covariance.
    """

    center: Array = field(default_factory=lambda: np.zeros(0))
    root: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def known(self) -> range:
        """As `Structure.known`: the parameters."""
        return range(len(self.center))

    @property
    def n_priors(self) -> int:
        """As `Structure.n_priors`: one row per parameter."""
        return len(self.center)

    def prior(self, v: Array) -> tuple[Array, Array]:
        """As `Structure.prior`; the rows of the parameters come first."""
        z, J = super().prior(v)
        known = np.zeros((len(self.center), v.size))
        known[:, :len(self.center)] = self.root
        return np.concatenate([-self.root @ (v[:len(self.center)] - self.center), z]), np.concatenate([known, J])


def healthy_point(fit: Refit) -> Refit:
    """The same unknowns with the parameters of a healthy day, changes and filters as they are: not a fit.

    Parameters
    ----------
    fit : Refit
        With a structure whose parameters are held.
    """
    structure = fit.structure
    assert isinstance(structure, Held)
    v = fit.v.copy()
    v[:structure.n_parameters] = np.clip(structure.center, *(bound[:structure.n_parameters]
                                                             for bound in structure.bounds))
    return relinearized(replace(fit, v=v, z=Whitened(structure, fit.whiteners).residual(v), paths=structure.paths(v)))


def root_of(covariance: Array) -> Array:
    """R with RᵀR the inverse of a covariance."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors.T / np.sqrt(np.maximum(values, 1e-12 * max(values.max(initial=0.0), 1e-300)))[:, None],
                      np.float64)
