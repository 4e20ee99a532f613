"""Symmetric matrices as the columns the solver's cone wants."""

from __future__ import annotations

import numpy as np

from ._solver import Array


def stack(matrices: Array) -> Array:
    """Upper triangles column by column, off-diagonals times √2, as the solver's cone wants them."""
    n = matrices.shape[-1]
    j, i = np.tril_indices(n)
    return matrices[:, i, j] * np.where(i == j, 1.0, np.sqrt(2.0))


def strictly(form: Array, margin: float) -> Array:
    """Append the column of ``margin * eye`` to the columns of a form: form(Q) - margin I >= 0.

    The only place where strictness enters: an elementwise `form >> margin` would subtract margin from every entry.
    """
    side = round((np.sqrt(8 * len(form) + 1) - 1) / 2)
    return np.column_stack([form, -margin * stack(np.eye(side)[None])[0]])
