"""Weights by sparse solves against linear programs over every vertex."""

from itertools import product

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.sparse import csr_array

from robthermal.certify._jacobian import Block, BoxJacobian
from robthermal.certify._weights import best_weights, has_weights


def random_box(rng: np.random.Generator) -> BoxJacobian:
    """A random Metzler network with blocks that share lumps, some towards ambients."""
    n = int(rng.integers(2, 6))
    base = rng.uniform(0, 1, (n, n)) * (rng.random((n, n)) < 0.6)
    np.fill_diagonal(base, -base.sum(axis=1) - rng.uniform(0, 0.3, n))
    blocks = []
    for _ in range(int(rng.integers(0, 4))):
        a, b = (int(i) for i in rng.choice(n, 2, replace=False))
        vertices = rng.normal(0, 0.15, (int(rng.integers(1, 5)), 2, 2))
        blocks.append(Block(a, -1 if rng.random() < 0.2 else b, vertices))
    return BoxJacobian(rng.uniform(0.5, 20, n), csr_array(base), tuple(blocks))


def worst_lines(box: BoxJacobian, method: str) -> list[list[np.ndarray]]:
    """For every line, the rows of every combination of vertices, off-diagonals of blocks by absolute value."""
    base = box.base.toarray()
    base = base.T if method == "sum" else base
    lines = []
    for i, row in enumerate(base):
        options = []
        for block in box.blocks:
            V = block.vertices.transpose(0, 2, 1) if method == "sum" else block.vertices
            for k, (own, other) in enumerate(((block.a, block.b), (block.b, block.a))):
                if own == i:
                    shares = np.zeros((len(V), len(base)))
                    shares[:, i] += V[:, k, k]
                    if other >= 0:
                        shares[:, other] += np.abs(V[:, k, 1 - k])
                    options.append(shares)
        lines.append([row + sum(chosen, np.zeros(len(base))) for chosen in product(*options)])
    return lines


def best_rate(box: BoxJacobian, method: str) -> float:
    """Bisection over linear programs."""
    lines, E = worst_lines(box, method), box.capacity

    def feasible(rate: float) -> bool:
        A = np.array([row + rate * E[i] * np.eye(len(E))[i] for i, rows in enumerate(lines) for row in rows])
        found = linprog(np.zeros(len(E)), A_ub=A, b_ub=np.full(len(A), -1e-6), bounds=[(1e-2, 1e6)] * len(E))
        return bool(found.status == 0)

    low, high = -10.0, 10.0
    for _ in range(26):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if feasible(middle) else (low, middle)
    return low


@pytest.mark.parametrize("method", ["sum", "max"])
def test_rate_is_the_best_of_a_linear_program(method: str) -> None:
    rng, seen = np.random.default_rng(4), set()
    for _ in range(14):
        box = random_box(rng)
        expected, found = best_rate(box, method), best_weights(box, method)
        seen.add(found is not None)
        assert has_weights(box, method) == (found is not None)
        if abs(expected) < 1e-6:
            continue
        assert (found is not None) == (expected > 0)
        if found is None:
            continue
        weights, rate = found
        assert rate == pytest.approx(expected, rel=2e-3, abs=1e-6)
        assert weights.min() > 0
        for i, rows in enumerate(worst_lines(box, method)):
            assert max(row @ weights for row in rows) <= -rate * box.capacity[i] * weights[i] * (1 - 1e-9)
    assert seen == {True, False}
