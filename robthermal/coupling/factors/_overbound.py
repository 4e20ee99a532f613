"""A stable transfer function above a measured envelope: what weighted H-infinity tools ask for."""

from __future__ import annotations

import numpy as np
import scipy

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ..systems import Zpk, paired, realize
from ._uncertainty import Uncertainty


def overbound(uncertainty: Uncertainty, row: int, column: int, order: int = 8) -> control.StateSpace:
    """Stable, minimum-phase W with \\|W\\| at or above the envelope of one entry at every measured frequency.

    \\|W\\|² is a sum of first-order spectra with positive weights, the smallest in the largest ratio to the envelope
    (a linear programme); W is its spectral factor. Valid at the grid points, and smooth between them.

    Parameters
    ----------
    uncertainty : Uncertainty
        Envelope of the measured plants.
    row, column : int
        Entry, from 0.
    order : int
        Number of first-order spectra, their corners spread evenly over the measured decades.

    Returns
    -------
    StateSpace
        Of that order, in the time domain of the loop.

    Raises
    ------
    InputError
        When the entry is zero, or an index or order is wrong.

    Examples
    --------
    >>> import control
    >>> import numpy as np
    >>> import robthermal as rt
    >>> P, C, w = control.tf([0.1], [1, -0.9], 0.01), control.tf([1.0], [1], 0.01), np.linspace(1.0, 314.0, 50)
    >>> measured = np.eye(2)[:, :, None] * 1.1 * P(np.exp(0.01j * w))
    >>> u = rt.coupling.dual_youla(control.FRD(measured, w), (P, P), (C, C))
    >>> W = rt.coupling.overbound(u, 0, 0)
    >>> bool(np.all(abs(W(np.exp(0.01j * w))) >= u.envelope[0, 0] * (1 - 1e-9)))
    True
    """
    if row not in (0, 1) or column not in (0, 1):
        raise InputError(f"entry ({row}, {column})", where="row, column", expected="0 or 1 each")
    if not isinstance(order, int) or order < 1:
        raise InputError(f"{order!r}", where="order", expected="a positive whole number")
    dt, envelope = uncertainty.factors.dt, uncertainty.envelope[row, column]
    if not np.any(envelope > 0):
        raise InputError(f"entry ({row}, {column}) of the envelope is zero", where="uncertainty",
                         expected="an entry with uncertainty")
    x = _warped(uncertainty.omega, dt) ** 2  # discrete time: the bilinear map, an axis for an axis
    target = np.maximum(envelope, 1e-6 * envelope.max()) ** 2
    positive = x[x > 0]
    corners = np.geomspace(positive[0], positive[-1], order)
    spectra = np.column_stack([np.ones(len(x)), 1 / (1 + x[:, None] / corners)])
    weights = _smallest_above(spectra, target)
    return realize(_factor(weights, corners, dt))


def _warped(omega: Array, dt: float) -> Array:
    return np.tan(np.minimum(omega * dt / 2, 0.4999 * np.pi)) if dt else omega


def _smallest_above(spectra: Array, target: Array) -> Array:
    """Nonnegative weights with target <= spectra @ weights <= t target, t smallest."""
    relative = spectra / target[:, None]
    scale = 1.0 / relative.max(axis=0)
    scaled, rows = relative * scale, len(target)
    A = np.block([[-scaled, np.zeros((rows, 1))], [scaled, -np.ones((rows, 1))]])
    solution = scipy.optimize.linprog(np.append(np.zeros(len(scale)), 1.0), A_ub=A, method="highs",
                                      b_ub=np.concatenate([-np.ones(rows), np.zeros(rows)]))
    candidate = np.ones(len(scale)) if solution.x is None else np.maximum(solution.x[:-1], 0.0)
    weights = candidate * scale
    return weights / float(np.min(relative @ weights))  # on or above, whatever the solver made of it


def _factor(weights: Array, corners: Array, dt: float) -> Zpk:
    """Spectral factor: roots of the numerator in x = omega² that lie in the left half-plane as s² = -x."""
    numerator = weights[0] * np.poly(-corners)
    for k, corner in enumerate(corners):
        others = np.poly(-np.delete(corners, k)) * weights[1 + k] * corner
        numerator = np.concatenate([[numerator[0]], numerator[1:] + others])
    numerator = np.trim_zeros(numerator, "f")
    s_zeros, s_poles = paired(-np.sqrt(-np.roots(numerator).astype(complex))), -np.sqrt(corners).astype(complex)
    gain = float(np.sqrt(numerator[0]))
    if not dt:
        return Zpk(s_zeros, s_poles, gain, 0.0)
    # s = (z - 1)/(z + 1): s - r = ((1 - r) z - (1 + r))/(z + 1)
    zeros, poles = (1 + s_zeros) / (1 - s_zeros), (1 + s_poles) / (1 - s_poles)
    rest = np.full(len(poles) - len(zeros), -1.0 + 0j)
    gain *= float(np.real(np.prod(1 - s_zeros) / np.prod(1 - s_poles)))
    return Zpk(np.concatenate([zeros, rest]), poles, gain, dt)
