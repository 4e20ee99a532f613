"""Recursive filters 1/a of signals from rest, by LAPACK: what scipy.signal.lfilter does, without its import of 1 s."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray


def all_pole(a: NDArray[Any], signal: NDArray[Any]) -> NDArray[Any]:
    """Solve y[k] + a[1] y[k-1] + ... + a[p] y[k-p] = signal[k] from rest: a triangular band matrix, row by row.

    Parameters
    ----------
    a : ndarray, shape (p + 1,)
        Monic polynomial, real or complex [-].
    signal : ndarray, shape (n,) or (n, m)
        Real or complex, one signal per column.

    Returns
    -------
    ndarray
        Of the shape of `signal`.

    Examples
    --------
    >>> import numpy as np
    >>> all_pole(np.array([1.0, -0.5]), np.ones(4)).tolist()
    [1.0, 1.5, 1.75, 1.875]
    """
    if not len(signal):
        return signal.astype(np.result_type(a, signal, float))
    band = np.repeat(np.asarray(a)[: len(signal), None], len(signal), axis=1)
    lapack = scipy.linalg.lapack
    solve = lapack.ztbtrs if np.iscomplexobj(band) or np.iscomplexobj(signal) else lapack.dtbtrs
    found = solve(band, signal.reshape(len(signal), -1), uplo="L", diag="U")[0]
    return np.asarray(found.reshape(signal.shape))
