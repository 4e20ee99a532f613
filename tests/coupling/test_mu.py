"""The structured singular value of matrices: published numbers, closed forms, brute force, invariances, bad input."""

from __future__ import annotations

from itertools import product

import cvxpy
import numpy as np
import pytest
from scipy.linalg import block_diag

import robthermal as rt

SCALARS = [("full", 1, 1)]
STRUCTURES = {
    "two scalars": SCALARS * 2,
    "three scalars": SCALARS * 3,
    "two scalars and performance": [*SCALARS * 2, ("full", 2, 2)],
    "three rectangles": [("full", 2, 3), ("full", 3, 1), ("full", 1, 2)],
    "five scalars": SCALARS * 5,
    "repeated and full": [("repeated", 2), ("repeated", 3), ("full", 2, 1)],
    "one repeated": [("repeated", 4)],
}
UP_TO_THREE = ["two scalars", "three scalars", "two scalars and performance", "three rectangles"]
SEVEN = np.array([
    [1j, 2, 2j, 0, -1, -1 + 3j, 2 + 3j],
    [3 + 1j, 2 - 1j, -1 + 1j, 2 + 1j, -1 + 1j, 1, -1 + 1j],
    [3 + 1j, 1j, 2 + 2j, -1 + 2j, 3 - 1j, 3j, -1 + 1j],
    [-1 + 1j, -1 - 1j, 1j, 0, 1 - 1j, 2 - 1j, 2 + 2j],
    [3, 1j, 1 + 1j, 3j, 1 + 1j, 3j, -1j],
    [1, 3 + 2j, 2 + 2j, 3j, 1 + 2j, 2 + 1j, -1 + 2j],
    [2 + 1j, -1 - 1j, -1, 3 + 3j, 2 + 3j, 2j, 1 - 1j],
])
TEN_BY_FOUR = np.array([
    [1j, 2, 2j, 0], [3 + 1j, 2 - 1j, -1 + 1j, 2 + 1j], [3 + 1j, 1j, 2 + 2j, -1 + 2j], [3 - 1j, 3j, -1 + 1j, 2 + 2j],
    [-1 + 1j, -1 - 1j, 1j, 0], [1 - 1j, 2 - 1j, 2 + 2j, 1], [3, 1j, 1 + 1j, 3j], [1 + 2j, 2 + 1j, -1 + 2j, 1j],
    [2 + 1j, -1 - 1j, -1, 3 + 3j], [2 + 3j, 2j, 1 - 1j, 0],
])


def morton_doyle() -> np.ndarray:
    """Rank-two matrix with four scalar blocks for which mu is below the best scaling (Packard and Doyle, 1993, 9.2)."""
    gamma, beta = 3 + np.sqrt(3), np.sqrt(3) - 1
    a, b, d = np.sqrt(2 / gamma), 1 / np.sqrt(gamma), -np.sqrt(beta / gamma)
    f = (1 + 1j) * np.sqrt(1 / (gamma * beta))
    U = np.array([[a, 0], [b, b], [b, 1j * b], [d, f]])
    V = np.array([[0, a], [b, -b], [b, -1j * b], [-1j * f, -d]])
    return U @ V.conj().T


def assert_proven_by_its_delta(M: np.ndarray, blocks: list, bound: rt.coupling.MuBound) -> None:
    """Structure, size and singularity of every delta, from scratch."""
    M, delta = M.reshape(*M.shape[:2], -1), bound.delta.reshape(*bound.delta.shape[:2], -1)
    for k, lower in enumerate(np.atleast_1d(bound.lower)):
        inside = np.zeros(delta.shape[:2], bool)
        row = column = 0
        for kind, *size in blocks:
            part = delta[row:row + size[0], column:column + size[-1], k]
            inside[row:row + size[0], column:column + size[-1]] = True
            if kind == "repeated":
                np.testing.assert_array_equal(part, part[0, 0] * np.eye(size[0]))
            row, column = row + size[0], column + size[-1]
        assert not delta[~inside, k].any()
        np.testing.assert_allclose(np.linalg.norm(delta[:, :, k], 2), 1 / lower, rtol=1e-12)
        loop = np.eye(len(M)) - M[:, :, k] @ delta[:, :, k]
        assert np.linalg.svd(loop)[1][-1] < 1e-12 * (1 + np.linalg.norm(M[:, :, k] @ delta[:, :, k], 2))


def one_block_each(blocks: list) -> tuple[int, int]:
    """Shape (p, m) of the M that belongs to the blocks of Delta."""
    return sum(size[-1] for _, *size in blocks), sum(size[0] for _, *size in blocks)


def random_matrices(count: int, p: int, m: int, *, seed: int) -> np.ndarray:
    """Complex Gaussian matrices (p, m, count)."""
    random = np.random.default_rng(seed)
    return random.normal(size=(p, m, count)) + 1j * random.normal(size=(p, m, count))


def structured_unitary(blocks: list, random: np.random.Generator) -> np.ndarray:
    """Random Delta whose blocks have all their singular values at 1."""
    parts = []
    for kind, *size in blocks:
        if kind == "repeated":
            parts.append(np.exp(2j * np.pi * random.uniform()) * np.eye(size[0]))
        else:
            U, _, V = np.linalg.svd(random.normal(size=size) + 1j * random.normal(size=size), full_matrices=False)
            parts.append(U @ V)
    return block_diag(*parts)


def distillation(omega: np.ndarray) -> np.ndarray:
    """Skogestad and Postlethwaite, section 8.11.3: N(jw) (4, 4, n_f), two input uncertainties and performance.

    G = G0/(75 s + 1), K = 0.7 (75 s + 1)/(s + 1e-5) G0⁻¹, so that L = 0.7/(s + 1e-5) I; outputs of N: W_I u, W_P e.
    """
    G0, identity = np.array([[87.8, -86.4], [108.2, -109.6]]), np.eye(2)
    N = np.empty((4, 4, len(omega)), complex)
    for k, s in enumerate(1j * omega):
        S = 1 / (1 + 0.7 / (s + 1e-5))
        W_I, W_P = (s + 0.2) / (0.5 * s + 1), 0.5 * (10 * s + 1) / (10 * s + 1e-5)
        G, K = G0 / (75 * s + 1), 0.7 * (75 * s + 1) / (s + 1e-5) * np.linalg.inv(G0)
        N[:, :, k] = np.block([[-W_I * (1 - S) * identity, -W_I * K * S], [W_P * S * G, W_P * S * identity]])
    return N


# Published numbers


def test_skogestad_and_postlethwaite_example() -> None:
    M = np.array([[2.0, 2.0], [-1.0, -1.0]])
    full, diagonal = rt.coupling.mu(M), rt.coupling.mu(M, SCALARS * 2)
    np.testing.assert_allclose([full.lower, full.upper], np.sqrt(10), rtol=1e-12)
    np.testing.assert_allclose([diagonal.lower, diagonal.upper], 3.0, rtol=1e-9)


def test_repeated_and_rectangular_blocks() -> None:
    blocks = [("repeated", 2), ("repeated", 1), ("full", 2, 3), ("full", 2, 1)]
    b = rt.coupling.mu(SEVEN, blocks)
    np.testing.assert_allclose([b.lower, b.upper], 10.55181, rtol=2e-6)
    b = rt.coupling.mu(TEN_BY_FOUR, [("full", 2, 4), ("full", 2, 6)])
    np.testing.assert_allclose([b.lower, b.upper], 10.2438, rtol=5e-6)


def test_case_in_which_the_bounds_differ() -> None:
    b = rt.coupling.mu(morton_doyle(), SCALARS * 4)
    np.testing.assert_allclose(b.upper, 1.0, rtol=1e-6)
    np.testing.assert_allclose(b.lower, 0.8723592, rtol=1e-5)
    assert b.outcome.code == "gap"


def test_distillation_column() -> None:
    N = distillation(np.logspace(-3, 3, 61))
    robust = rt.coupling.mu(N, [*SCALARS * 2, ("full", 2, 2)])
    np.testing.assert_allclose([robust.upper.max(), robust.lower.max()], 5.77262, rtol=2e-6)
    assert (robust.upper - robust.lower < 1e-3 * robust.upper).all()
    fine = distillation(np.logspace(-3, 3, 4001))
    top = np.s_[:, :, 2000:2300]  # the peak at 1.46 rad/s
    peak = rt.coupling.mu(fine[top], [*SCALARS * 2, ("full", 2, 2)])
    np.testing.assert_allclose(peak.upper.max(), 5.78181, rtol=2e-6)
    assert round(rt.coupling.mu(fine[:2, :2], SCALARS * 2).upper.max(), 5) == 0.52616
    assert round(rt.coupling.mu(N[2:, 2:]).upper.max(), 4) == 0.5


# Closed forms


def test_limits_are_the_largest_singular_value_and_the_spectral_radius() -> None:
    M = random_matrices(20, 4, 4, seed=1)
    one, repeated = rt.coupling.mu(M), rt.coupling.mu(M, [("repeated", 4)])
    gains = np.linalg.norm(np.moveaxis(M, 2, 0), 2, axis=(1, 2))
    radii = np.abs(np.linalg.eigvals(np.moveaxis(M, 2, 0))).max(1)
    for bound, truth in ((one, gains), (repeated, radii)):
        np.testing.assert_allclose(bound.lower, truth, rtol=1e-10)
        np.testing.assert_allclose(bound.upper, truth, rtol=1e-8)


def test_rank_one_matrix_with_any_number_of_scalars() -> None:
    u, v = random_matrices(2, 7, 1, seed=2)[:, 0].T
    b = rt.coupling.mu(np.outer(u, v.conj()), SCALARS * 7)
    np.testing.assert_allclose([b.lower, b.upper], np.abs(u * v).sum(), rtol=1e-5)


@pytest.mark.parametrize("scale", [1.0, 1e6, 1e-9])
def test_off_diagonal_pair(scale: float) -> None:
    b = rt.coupling.mu([[0, 2j * scale], [-3 / scale, 0]], SCALARS * 2)
    np.testing.assert_allclose([b.lower, b.upper], np.sqrt(6), rtol=1e-12)


@pytest.mark.parametrize("size", [1e-200, 1e200])
def test_numbers_of_any_size(size: float) -> None:
    b = rt.coupling.mu(size * np.array([[2.0, 2.0], [-1.0, -1.0]]), SCALARS * 2)
    np.testing.assert_allclose([b.lower, b.upper], 3.0 * size, rtol=1e-9)


def test_blocks_without_a_cycle_have_no_worst_perturbation() -> None:
    b = rt.coupling.mu([[0, 1.0, 2.0], [0, 0, 3.0], [0, 0, 0]], SCALARS * 3)
    assert (b.lower, b.upper) == (0.0, 0.0)
    assert np.isnan(b.delta).all()


def test_triangular_matrix_is_its_worst_diagonal_part() -> None:
    M = random_matrices(6, 6, 6, seed=3)
    M[3:, :3] = 0
    whole = rt.coupling.mu(M, SCALARS * 6)
    parts = [rt.coupling.mu(M[k:k + 3, k:k + 3], SCALARS * 3) for k in (0, 3)]
    np.testing.assert_allclose(whole.upper, np.maximum(parts[0].upper, parts[1].upper), rtol=1e-5)
    np.testing.assert_allclose(whole.lower, whole.upper, rtol=1e-3)


def test_upper_bound_of_a_jordan_block_is_honest() -> None:
    b = rt.coupling.mu(np.eye(3) + np.eye(3, k=1), [("repeated", 3)])  # no best scaling exists
    assert 1.0 <= b.upper < 1.002
    np.testing.assert_allclose(b.lower, 1.0, rtol=1e-9)


# Lower and upper bound


@pytest.mark.parametrize("name", STRUCTURES)
def test_every_lower_bound_is_proven_by_its_delta(name: str) -> None:
    blocks = STRUCTURES[name]
    p, m = one_block_each(blocks)
    M = random_matrices(15, p, m, seed=4)
    b = rt.coupling.mu(M, blocks)
    assert_proven_by_its_delta(M, blocks, b)
    assert (b.lower <= b.upper).all()
    assert (b.upper <= np.linalg.norm(np.moveaxis(M, 2, 0), 2, axis=(1, 2)) * (1 + 1e-12)).all()


@pytest.mark.parametrize("name", UP_TO_THREE)
def test_three_or_fewer_full_blocks_meet(name: str) -> None:
    blocks = STRUCTURES[name]
    p, m = one_block_each(blocks)
    M = random_matrices(300, p, m, seed=5)
    M[:, :, ::5] = M[:, :, ::5].real
    M[:, :, 1::5] = np.where(np.abs(M[:, :, 1::5]) < 1.0, 0.0, M[:, :, 1::5])
    M[:, :, 2::5] *= np.logspace(-4, 4, p)[:, None, None]
    square = np.moveaxis(M[:, :, 3::5], 2, 0)
    U, _, V = np.linalg.svd(square, full_matrices=False)
    M[:, :, 3::5] = np.moveaxis(U @ V, 0, 2)  # every singular value is 1
    b = rt.coupling.mu(M, blocks)
    assert (b.upper - b.lower <= 1e-3 * b.upper).all()


def test_smallest_perturbation_by_brute_force() -> None:
    """Three scalars: rho(M diag(1, e^ja, e^jb)) on a grid of phases is mu from below, to the grid's second order."""
    M = random_matrices(8, 3, 3, seed=6)
    b = rt.coupling.mu(M, SCALARS * 3)
    angles = np.exp(1j * np.linspace(0, 2 * np.pi, 90, endpoint=False))
    phases = np.array([(1.0, s, t) for s, t in product(angles, angles)])
    for k in range(8):
        found = np.abs(np.linalg.eigvals(M[:, :, k] * phases[:, None, :])).max()
        assert found <= b.upper[k] * (1 + 1e-9)
        assert found >= b.lower[k] * (1 - 2e-3)


def test_no_smaller_perturbation_among_many() -> None:
    blocks = STRUCTURES["repeated and full"]
    M = random_matrices(1, *one_block_each(blocks), seed=7)[:, :, 0]
    b = rt.coupling.mu(M, blocks)
    random = np.random.default_rng(8)
    best = max(np.abs(np.linalg.eigvals(M @ structured_unitary(blocks, random))).max() for _ in range(4000))
    assert best <= b.lower * (1 + 1e-9)


@pytest.mark.filterwarnings("ignore:Solution may be inaccurate")  # it only has to find a margin, or none
@pytest.mark.parametrize("name", ["five scalars", "three rectangles", "repeated and full"])
def test_no_scaling_is_better(name: str) -> None:
    """A general conic solver finds no X for a bound 0.02 % smaller."""
    blocks = STRUCTURES[name]
    p, m = one_block_each(blocks)
    M = random_matrices(1, p, m, seed=9)[:, :, 0]
    upper = rt.coupling.mu(M, blocks).upper
    left, right = [], []
    for kind, *size in blocks:
        if kind == "repeated":
            X = cvxpy.Variable((size[0], size[0]), hermitian=True)
            left.append(X)
            right.append(X)
        else:
            x = cvxpy.Variable()
            left.append(x * np.eye(size[1]))
            right.append(x * np.eye(size[0]))
    margin = cvxpy.Variable()

    def diagonal(parts: list) -> cvxpy.Expression:
        return cvxpy.bmat([[part if i == j else np.zeros((part.shape[0], other.shape[1]))
                            for j, other in enumerate(parts)] for i, part in enumerate(parts)])

    X_L, X_R = diagonal(left), diagonal(right)
    for factor, feasible in ((1.0002, True), (0.9998, False)):
        F = (factor * upper) ** 2 * X_R - M.conj().T @ X_L @ M
        problem = cvxpy.Problem(cvxpy.Maximize(margin), [
            (F + F.H) / 2 >> margin * np.eye(m), cvxpy.real(cvxpy.trace(X_R)) == m, X_R >> 0])
        problem.solve(solver=cvxpy.CLARABEL)
        assert (margin.value > 1e-7) == feasible


# Invariances


@pytest.mark.parametrize("name", ["three rectangles", "repeated and full", "five scalars"])
def test_unitary_perturbations_scalings_and_factors_change_nothing(name: str) -> None:
    blocks = STRUCTURES[name]
    p, m = one_block_each(blocks)
    M = random_matrices(1, p, m, seed=10)[:, :, 0]
    before = rt.coupling.mu(M, blocks)
    random = np.random.default_rng(11)
    factors = random.uniform(0.01, 9, len(blocks))
    left, right = (np.repeat(factors, [size[end] for _, *size in blocks]) for end in (-1, 0))
    scaled = rt.coupling.mu(left[:, None] * M / right, blocks)
    turned = rt.coupling.mu(-2.5j * M, blocks)
    np.testing.assert_allclose(scaled.upper, before.upper, rtol=2e-5)
    np.testing.assert_allclose(turned.upper, 2.5 * before.upper, rtol=2e-5)
    if all(size[0] == size[-1] for _, *size in blocks):
        U = structured_unitary(blocks, random)
        np.testing.assert_allclose(rt.coupling.mu(M @ U, blocks).upper, before.upper, rtol=2e-5)


def test_more_structure_never_raises_mu() -> None:
    M = random_matrices(20, 4, 4, seed=12)
    chain = [[("full", 4, 4)], [("full", 2, 2)] * 2, [("full", 2, 2), *SCALARS * 2], SCALARS * 4, [("repeated", 4)]]
    uppers = [rt.coupling.mu(M, blocks).upper for blocks in chain]
    assert len(uppers) == 5
    for coarse, fine in zip(uppers, uppers[1:], strict=False):
        assert (fine <= coarse * (1 + 1e-5)).all()


def test_many_frequencies_are_the_same_as_one_at_a_time() -> None:
    M = random_matrices(6, 3, 3, seed=13)
    together = rt.coupling.mu(M, SCALARS * 3)
    assert together.upper.shape == (6,) and together.delta.shape == (3, 3, 6)
    for k in range(6):
        alone = rt.coupling.mu(M[:, :, k], SCALARS * 3)
        assert isinstance(alone.upper, float) and alone.delta.shape == (3, 3)
        np.testing.assert_allclose([alone.lower, alone.upper], [together.lower[k], together.upper[k]], rtol=2e-4)


# Bad input, and how it looks


@pytest.mark.parametrize(("M", "blocks", "message"), [
    (np.eye(3), SCALARS * 2, "the blocks make Delta 2 by 2"),
    (np.ones((3, 2)), [("full", 3, 2)], "Delta 3 by 2.*Expected 2 by 3"),
    (np.eye(2), [("full", 2)], "is not a block"),
    (np.eye(2), [("real", 2)], "is not a block"),
    (np.eye(2), [("repeated", 2, 2)], "is not a block"),
    (np.eye(2), ["full", "full"], "is not a block"),
    (np.eye(2), [], "blocks is"),
    (np.eye(2), "full", "blocks is"),
    (np.eye(2), [("full", 1, 1), ("repeated", 0)], "size of"),
    (np.eye(2), [("full", 2.0, 2)], "size of"),
    (np.array([[1, np.nan], [0, 1]]), None, r"nan.*at index \(0, 1\)"),
    (np.array([[1, np.inf], [0, 1]]), None, "finite"),
    (np.ones(3), None, "shape"),
    (np.ones((2, 2, 0)), None, "shape"),
    ([["a"]], None, "not an array of numbers"),
])
def test_bad_input_is_named(M: object, blocks: object, message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        rt.coupling.mu(M, blocks)


def test_result_prints_and_draws() -> None:
    b = rt.coupling.mu(random_matrices(5, 2, 2, seed=14), SCALARS * 2)
    assert str(b).startswith("mu, largest of 5: ")
    axes = b.plot()
    assert [line.get_label() for line in axes.lines] == ["upper bound", "lower bound"]
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), b.upper)
