"""Matrices of the samples of a record: those that differ, and their derivative where every unknown is one number."""

from __future__ import annotations

import numpy as np

from robthermal.diagnosis.path._rates import is_diagonal, kinds_of


def test_matrices_that_differ_are_found_as_numpy_finds_rows():
    rng = np.random.default_rng(1)
    some = rng.integers(-10**9, 10**9, (40, 5, 5)).astype(float)
    some[1] = some[0]
    some[1, 4, 4] += 1.0  # the smallest difference there is
    rounded = some[rng.integers(0, 40, 3000)]
    each = rounded + 0.25
    kinds, kind = kinds_of(each, rounded)
    assert len(kinds) == len(np.unique(rounded.reshape(3000, -1), axis=0))
    assert np.array_equal(kinds[kind], each)


def test_a_square_matrix_with_nothing_beside_its_diagonal_is_diagonal():
    assert is_diagonal(np.diag([1.0, 0.0, 2.0])) and not is_diagonal(np.eye(3)[:2])
    assert not is_diagonal(np.eye(3) + 1e-9 * np.eye(3, k=1))
