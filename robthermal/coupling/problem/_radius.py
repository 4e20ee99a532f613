"""The robust number at a frequency, in closed form."""

from __future__ import annotations

import numpy as np

from ..._arrays import Array


def radius(envelope: Array, a: Array, b: Array) -> Array:
    """rho(|Delta_k| R) of Delta_k = [[0, a], [b, 0]]: larger root of x² - (a r21 + b r12) x - a b det R.

    Parameters
    ----------
    envelope : ndarray, shape (2, 2, n_f)
        Envelope R of the dual-Youla parameter.
    a, b : ndarray, shape (n_f,)
        Magnitudes of the two entries of Delta_k.
    """
    (r11, r12), (r21, r22) = envelope
    half = (a * r21 + b * r12) / 2
    return half + np.sqrt(np.maximum(half**2 + a * b * (r11 * r22 - r12 * r21), 0.0))
