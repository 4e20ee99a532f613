"""Are new records worse than healthy ones, whatever the reason?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..._distributions import f_sf, t_isf
from ..fit import Refit
from ._held import Held
from ._reference import Reference
from ._scatter import COUNTS

_ASSUMED = 0.2  # scatter of the logarithm of the whitened variance before any record is seen
_SURE = 0.01
_FREE = 1.0  # whitened variance of noise alone


@dataclass(frozen=True)
class Excess:
    """How much worse new records are than the reference records.

    Parameters
    ----------
    variance : float
        Whitened variance of the new records over that of the reference records [-].
    limit : float
        Ratio that healthy records exceed with a chance of 1 %.
    p_value : float
        Chance that healthy parameters lie as far from their mean as those of the new records.
    """

    variance: float
    limit: float
    p_value: float

    @property
    def reasons(self) -> tuple[str, ...]:
        """What is outside the scatter, a sentence each."""
        out = []
        if self.variance > self.limit:
            out.append(f"The mean square of what the model leaves of the new records is {self.variance:.3g} times that "
                       f"of the reference records; healthy records stay below {self.limit:.3g}.")
        if self.p_value < _SURE:
            out.append(f"Together the parameters are farther from those of a healthy day than the scatter explains "
                       f"(p = {self.p_value:.1g}).")
        return tuple(out)

    def removed(self, before: Excess) -> float:
        """Part of the mean square beyond that of the reference records that changes have removed [-].

        Parameters
        ----------
        before : Excess
            Of the same records without any change.
        """
        excess = before.variance - 1.0
        return 1.0 - max(self.variance - 1.0, 0.0) / excess if excess > 0.0 else 0.0


def excess_of(new: Refit, reference: Reference) -> Excess:
    """Compare new records with the reference records.

    Parameters
    ----------
    new : Refit
        The new records, with the changes accepted, parameters held near those of a healthy day.
    reference : Reference
        What healthy records show.
    """
    each, n = reference.each, len(reference.each)
    noise = _FREE / reference.scatter.inflation
    logs = np.log([max(_variance(fit), noise) for fit in each])
    freedom = COUNTS + n - 1
    spread = math.sqrt((COUNTS * _ASSUMED**2 + float(np.sum((logs - logs.mean()) ** 2))) / freedom * (1.0 + 1.0 / n))
    limit = math.exp(float(t_isf(_SURE, freedom)) * spread)
    structure, usual = new.structure, math.exp(float(logs.mean()))
    expected = noise + (usual - noise) * louder(new, each)
    if not isinstance(structure, Held) or not structure.n_parameters:
        return Excess(_variance(new) / expected, limit, 1.0)
    rows = slice(new.n_readings, new.n_readings + structure.n_priors)
    far = float(np.sum(new.z[rows] ** 2))
    return Excess(_variance(new) / expected, limit,
                  float(f_sf(far / structure.n_priors, structure.n_priors, freedom)))


def louder(new: Refit, each: Sequence[Refit]) -> float:
    """By how much more the mean square of a relative error of the model shows than on the reference records; 1 or more.

    A remainder grows with the temperatures that drive it, as the derivatives by the parameters do.

    Parameters
    ----------
    new : Refit
        The new records.
    each : sequence of Refit
        Every reference record as if it were new.
    """
    usual = float(np.mean([_shown(fit) for fit in each]))
    return max(1.0, _shown(new) / usual) if usual > 0.0 else 1.0


def _shown(fit: Refit) -> float:
    """Mean square of the whitened derivatives of the readings by the relative parameters."""
    p = fit.structure.n_parameters
    return float(np.mean((fit.J[:fit.n_readings, :p] * fit.structure.ranges.unit) ** 2)) if p else 0.0


def _variance(fit: Refit) -> float:
    """Mean square of the whitened readings."""
    return float(np.mean(fit.z[:fit.n_readings] ** 2))
