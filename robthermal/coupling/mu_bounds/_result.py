"""Bounds of the structured singular value, with the perturbation that proves the lower one."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from robthermal.errors import Outcome
from robthermal.verification import Certificate

from ..._drawing import axes_for
from ._blocks import Complex, Real

MET = 1e-3  # relative gap at which lower and upper bound are called equal


@dataclass(frozen=True)
class MuBound:
    """Lower and upper bound of mu: 1/mu is the size of the smallest Delta that makes I − M Delta singular.

    Parameters
    ----------
    lower, upper : float or ndarray, shape (n_f,)
        mu lies between them [-]. One number each for one matrix and for `mu_bound`.
    delta : ndarray, shape (m, p) or (m, p, n_f)
        Perturbation of the structure with sigma_max(delta) = 1/lower and det(I − M delta) = 0; nan where lower is 0.
    outcome : Outcome
        Whether both bounds meet (0.1 %), and for `mu_bound` whether the upper one is proven; its text says what to do.
    frequency : float
        Where `lower` is attained [rad/s]; `mu_bound` only, else nan.
    certificate : Certificate or None
        Proof that `upper` holds at every frequency; `mu_bound` only, else None.
    omega : ndarray, shape (n_f,)
        Frequencies at which mu was computed [rad/s]; `mu_bound` only, else empty.
    curve : tuple of ndarray
        Lower and upper bound at `omega`; `mu_bound` only, else empty.

    Examples
    --------
    >>> import robthermal as rt
    >>> b = rt.coupling.mu([[2.0, 2.0], [-1.0, -1.0]], [("full", 1, 1), ("full", 1, 1)])
    >>> round(b.upper, 6), round(b.lower, 6)
    (3.0, 3.0)
    >>> print(b)
    mu: 3 (lower and upper bound meet)
    """

    lower: float | Real
    upper: float | Real
    delta: Complex
    outcome: Outcome
    frequency: float = np.nan
    certificate: Certificate | None = None
    omega: Real = field(default_factory=lambda: np.zeros(0))
    curve: tuple[Real, ...] = ()

    def plot(self, ax: Any = None) -> Any:
        """Draw lower and upper bound.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.

        Returns
        -------
        matplotlib axes
            Over frequency [rad/s] with the proven bound for `mu_bound`, else over the number of the matrix.
        """
        ax = axes_for(ax)
        lower, upper = self.curve or (np.atleast_1d(self.lower), np.atleast_1d(self.upper))
        x = self.omega if len(self.omega) else np.arange(len(upper))
        ax.plot(x, upper, label="upper bound")
        ax.plot(x, lower, "--", label="lower bound")
        if self.certificate is not None:
            if self.certificate.holds:
                ax.axhline(float(self.upper), color="k", lw=0.8, label="holds at every frequency")
            ax.set_xscale("symlog", linthresh=float(min(x[x > 0], default=1.0)))
        ax.set_xlabel("frequency [rad/s]" if len(self.omega) else "number of the matrix [-]")
        ax.set_ylabel("structured singular value [-]")
        ax.legend(fontsize="small")
        return ax

    def __str__(self) -> str:
        lower, upper = float(np.max(self.lower)), float(np.max(self.upper))
        met = upper - lower <= MET * upper
        value = f"{upper:.5g} (lower and upper bound meet)" if met else f"{lower:.5g} to {upper:.5g}"
        if self.certificate is not None:
            return f"mu at every frequency: {value}\nworst at {self.frequency:.5g} rad/s. {self.outcome}"
        number = np.size(self.upper)
        return f"mu: {value}" if number == 1 else f"mu, largest of {number}: {value}"
