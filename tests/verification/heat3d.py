"""HEAT3D of the ARCH-COMP competition (affine category): heat equation on a cube, one block hot, its middle watched.

S. Bak, H.-D. Tran, T. T. Johnson, "Numerical verification of affine systems with up to a billion dimensions",
HSCC 2019.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array, kron

MAXIMA = {5: 0.10369, 10: 0.02966, 20: 0.01716, 50: 0.01161, 100: 0.01005}  # published, within 40 s


def heat3d(n: int) -> tuple[csr_array, np.ndarray, int]:
    """Return A of n³ lumps of unit capacity, the warmest start and the lump in the middle; first axis fastest."""
    conductance = 0.01 * (n + 1) ** 2

    def line(loss: float) -> csr_array:
        diagonal = np.full(n, -2.0)
        diagonal[[0, -1]] = -1.0
        diagonal[-1] -= loss
        return csr_array(conductance * diags_array([np.ones(n - 1), diagonal, np.ones(n - 1)], offsets=[-1, 0, 1]))

    one, (x, y, z) = eye_array(n), (line(1 / (2 * n + 3)), line(0.0), line(0.0))
    A = csr_array(kron(one, kron(one, x)) + kron(one, kron(y, one)) + kron(z, kron(one, one)))
    start = np.zeros((n, n, n))
    start[: math.ceil(0.1 * n) + 1, : math.ceil(0.2 * n) + 1, : math.ceil(0.4 * n) + 1] = 1.1
    return A, start.ravel(), (n // 2 * n + n // 2) * n + n // 2
