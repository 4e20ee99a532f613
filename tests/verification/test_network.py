"""Large cooperative networks against exact rational sums, and the rigour of the floating-point bound."""

from __future__ import annotations

import time
from fractions import Fraction

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

from robthermal.errors import InputError
from robthermal.verification import Certificate, establish, verify


def make(E, A, weights, rate, method="max", margin=None):
    A = sparse.coo_array(A)
    return establish("network", system={"capacity": E, "rows": A.row, "cols": A.col, "values": A.data}, region={},
                     evidence={"method": method, "rate": rate, "weights": weights}, made_by={}, margin=margin)


def grid(n, seed=0):
    """n x n grid with random conductances and a weak path to ambient everywhere."""
    rng = np.random.default_rng(seed)
    line = sparse.diags_array([np.ones(n - 1)], offsets=[1], shape=(n, n))
    pattern = sparse.coo_array(sparse.kron(sparse.eye_array(n), line) + sparse.kron(line, sparse.eye_array(n)))
    half = sparse.coo_array((rng.uniform(0.5, 5, len(pattern.data)), (pattern.row, pattern.col)), shape=pattern.shape)
    A = (half + half.T).tocsr()
    return rng.uniform(1, 10, n * n), sparse.coo_array(A - sparse.diags_array(A.sum(axis=1) + 0.01))


def truth(E, A, weights, rate, method):
    """Exact statement with Fractions of the numbers' decimals."""
    A = sparse.coo_array(A)
    exact = [Fraction(repr(float(w))) for w in weights]
    sums = [Fraction(rate) * Fraction(repr(float(e))) * w for e, w in zip(E, exact, strict=True)]
    for i, j, v in zip(A.row.tolist(), A.col.tolist(), A.data.tolist(), strict=True):
        line, other = (i, j) if method == "max" else (j, i)
        sums[line] += Fraction(repr(v)) * exact[other]
    return all(s <= 0 for s in sums) if rate != "0" else all(s < 0 for s in sums)


@pytest.mark.parametrize("method", ["max", "sum"])
def test_grid(method):
    E, A = grid(40)
    weights = spsolve(-(A if method == "max" else A.T).tocsc(), E)  # A w = -E
    rate = float(1 / np.max(weights))
    good = make(E, A, weights, 0.9 * rate, method)
    assert good.holds and good.margin["rate"] == pytest.approx(0.1 * rate, rel=0.01)
    assert verify(good).valid
    assert truth(E, A, weights, repr(0.9 * rate), method)
    refused = make(E, A, weights, 1.0001 * rate, method)
    assert not refused.holds and not truth(E, A, weights, repr(1.0001 * rate), method)
    worst = int(np.argmax(weights))
    assert f" {worst} " in refused.reason


def test_decided_at_the_last_digit():
    """0.1 + 0.2 <= 0.3 in decimals (true) although the binary sum is above: rows too close are decided exactly."""
    E = [1.0, 1.0, 1.0]
    A = np.array([[-0.3, 0.1, 0.2], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
    assert not make(E, A, [1.0, 1.0, 1.0], 0.0).holds  # equality is not strict
    A[0, 0] = -0.30000000000000004
    assert make(E, A, [1.0, 1.0, 1.0], 0.0).holds
    A[0, 0] = -0.3
    A[1, 1] = A[2, 2] = -0.5
    assert make(E, 2 * A - np.diag([0.1, 0, 0]), [1.0, 1.0, 1.0], 0.1).holds  # equality, allowed for a rate above zero
    assert not make(E, 2 * A - np.diag([0.1, 0, 0]), [1.0, 1.0, 1.0], "0.10000000000000000000001").holds


@pytest.mark.parametrize("scale", [1e-300, 1e-160, 1.0, 1e160, 1e300])
def test_extreme_scales_never_become_valid_by_underflow(scale):
    E = np.array([1.0, 1.0])
    true = np.array([[-2.0, 1.0], [1.0, -2.0]]) * scale
    false = np.array([[-1.0, 2.0], [2.0, -1.0]]) * scale
    for weights in ([1.0, 1.0], [1e-300, 1e-300], [1e300, 1e300]):
        assert make(E, true, weights, 0.0, margin={}).holds
        assert not make(E, false, weights, 0.0, margin={}).holds
        assert not make(E, true, weights, 1.1 * scale, margin={}).holds


def test_a_float_sum_below_zero_is_no_proof():
    """Ten tenths minus one is zero in decimals and -1.1e-16 in floats: not strictly negative."""
    A = -np.eye(11)
    A[10, :10] = 0.1
    assert sum([0.1] * 10) - 1.0 < 0
    refused = make(np.ones(11), A, np.ones(11), 0.0)
    assert not refused.holds and "row 10" in refused.reason


def test_products_below_the_smallest_float_are_no_proof():
    """Each product rounds to -1 or 0 times 2**-1074 in floats; exactly the row is positive."""
    tiny = 2.0**-534
    A = np.array([[-0.6 * tiny, 0.45 * tiny, 0.45 * tiny], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
    weights = np.full(3, 2.0**-540)
    assert A[0] @ weights < 0
    assert not make(np.ones(3), A, weights, 0.0).holds


def test_random_against_fractions():
    rng = np.random.default_rng(0)
    counts = {True: 0, False: 0}
    for _ in range(150):
        n = int(rng.integers(1, 6))
        A = np.round(rng.uniform(0, 1, (n, n)) * (rng.random((n, n)) < 0.6), 1)
        weights = np.round(rng.uniform(0.1, 2, n), 1)
        A[np.diag_indices(n)] = np.round(-(A @ weights / weights) - rng.choice([-0.1, 0.0, 0.0, 0.1], n), 1)
        E, rate = np.round(rng.uniform(0.1, 2, n), 1), str(rng.choice(["0", "0.1"]))
        for method in ("max", "sum"):
            holds = make(E, A, weights, rate, method).holds
            assert holds == truth(E, A, weights, rate, method)
            counts[holds] += 1
    assert min(counts.values()) > 20


def test_not_metzler_and_bad_weights():
    assert "Metzler" in make([1.0, 1.0], np.array([[-1.0, -0.1], [0.0, -1.0]]), [1.0, 1.0], 0.0).reason
    assert "weight of lump 1" in make([1.0, 1.0], -np.eye(2), [1.0, 0.0], 0.0).reason
    assert "weight of lump 0" in make([1.0, 1.0], -np.eye(2), [-1.0, 1.0], 0.0).reason


def test_large_network_is_fast(capsys):
    n = 300
    E, A = grid(n)
    weights = spsolve(-A.tocsc(), E)
    certificate = make(E, A, weights, 1e-4, margin={})
    assert certificate.holds
    start = time.perf_counter()
    assert verify(certificate).valid
    with capsys.disabled():
        print(f"\n{n * n} lumps, {A.nnz} entries: verified in {time.perf_counter() - start:.2f} s", end="")


def test_saved_network_means_the_same(tmp_path):
    E, A = grid(5)
    weights = spsolve(-A.tocsc(), E)
    certificate = make(E, A, weights, 1e-4)
    certificate.save(tmp_path / "n.json")
    loaded = Certificate.load(tmp_path / "n.json")
    assert verify(loaded).valid and verify(loaded).margins == verify(certificate).margins
    assert not verify(Certificate(**{**vars(loaded), "margin": {"rate": 1e6}})).valid


@pytest.mark.parametrize(("change", "words"), [
    ({"rows": [0]}, "the same number"), ({"rows": [0, 2]}, "index"), ({"rows": [0, -1]}, "index"),
    ({"rows": [0, True]}, "index"), ({"rows": [0, 1.0]}, "index"), ({"rows": np.array([0.0, 1.0])}, "float64"),
    ({"rows": ["0", 1]}, "index"), ({"rows": [0, 0], "cols": [0, 0]}, "twice"), ({"capacity": [1.0, 0.0]}, "lump 1"),
    ({"capacity": []}, "capacity"), ({"capacity": 3}, "capacity"), ({"values": [-1.0, float("nan")]}, "values"),
    ({"values": np.array([-1.0, np.inf])}, "entry 1"), ({"values": [-1.0, None]}, "values"),
    ({"rows": [0, 10**30]}, "index"), ({"capacity": [1.0]}, "index")])
def test_malformed(change, words):
    system = {"capacity": [1.0, 1.0], "rows": [0, 1], "cols": [0, 1], "values": [-1.0, -1.0], **change}
    with pytest.raises(InputError) as caught:
        establish("network", system=system, region={}, evidence={"rate": 0.1, "weights": [1, 1]}, made_by={})
    assert words in str(caught.value)


def chain(n, loss=0.5):
    """A rod of n lumps that loses heat at one end."""
    A = np.diag(np.full(n - 1, 2.0), 1) + np.diag(np.full(n - 1, 2.0), -1)
    A -= np.diag(A.sum(axis=1))
    A[0, 0] -= loss
    return np.full(n, 3.0), A


def test_two_lumps_with_uncertain_conductances():
    """Rows 2 f (d_j - d_i) and -loss f d_0 with every f at its worst: exact by hand."""
    E, A = chain(2)
    d, u = np.array([1.0, 1.5]), 0.1
    rows = [2.2 * 0.5 - 0.45 * 1.0, -1.8 * 0.5]
    system = {"capacity": E, **dict(zip(("rows", "cols"), np.nonzero(A), strict=True)), "values": A[np.nonzero(A)]}

    def holds(rate, weights):
        return establish("network", system=system, region={"uncertainty": u}, made_by={}, margin={},
                         evidence={"rate": rate, "weights": weights}).holds

    assert not holds(0.0, d) and rows[0] > 0
    d = np.array([1.0, 1.15])
    rate = min(-(2.2 * 0.15 - 0.45), 1.8 * 0.15 / 1.15) / 3.0
    assert holds(rate * (1 - 1e-12), d) and not holds(rate * (1 + 1e-12), d)


def test_sampled_conductances_never_violate_an_uncertain_network():
    """Row inequalities with random factors, most at their ends, in floats."""
    rng = np.random.default_rng(0)
    accepted = violated = 0
    for _ in range(150):
        E, A = grid(3, int(rng.integers(1000)))
        A = A.toarray() - 0.5 * np.diag(E)
        u = float(rng.choice([0.01, 0.05, 0.2]))
        weights = np.round(np.linalg.solve(-A, E) * rng.uniform(1 - u / 4, 1 + u / 4, len(E)), 3)
        nominal = float(np.max(A @ weights / E / weights))
        rate = max(-nominal * float(rng.uniform(0, 1)), 0.0)
        made = establish("network", system={"capacity": E, **dict(zip(("rows", "cols"), np.nonzero(A), strict=True)),
                                            "values": A[np.nonzero(A)]}, region={"uncertainty": u}, made_by={},
                         evidence={"rate": rate, "weights": weights}, margin={})
        worst = -np.inf
        for _ in range(40):
            f = 1 + u * np.sign(rng.standard_normal(A.shape))
            off = (A - np.diag(np.diag(A))) * f
            other = off - np.diag(off.sum(axis=1)) + np.diag(A.sum(axis=1) * np.diag(f))
            worst = max(worst, float(np.max((other @ weights + rate * E * weights) / (np.abs(other) @ weights))))
        assert not (made.holds and worst > 1e-12)
        accepted += made.holds
        violated += worst > 0
    assert accepted > 10 and violated > 10


def test_uncertain_networks_say_so_and_refuse_what_they_cannot():
    E, A = chain(3)
    system = {"capacity": E, **dict(zip(("rows", "cols"), np.nonzero(A), strict=True)), "values": A[np.nonzero(A)]}

    def made(uncertainty, method="max"):
        return establish("network", system=system, region={"uncertainty": uncertainty}, made_by={},
                         evidence={"method": method, "rate": 0.0, "weights": [1.0, 1.1, 1.15]})

    certificate = made(0.01)
    assert certificate.holds and "within 1 % of the given ones" in certificate.claim
    wider = Certificate(**{**vars(certificate), "region": {"uncertainty": 0.02}})
    assert "claim is not the one" in verify(wider).reason
    for uncertainty, method in ((1.0, "max"), (-0.1, "max"), (0.1, "sum"), ("NaN", "max")):
        with pytest.raises(InputError):
            made(uncertainty, method)
