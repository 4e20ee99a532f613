"""Kind "network_peak": against eigenvectors and ball arithmetic, what must not be certified, all bounds of errors."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest
from flint import acb_mat, arb, arb_mat, ctx
from heat3d import MAXIMA, heat3d
from mutant_network_peak import make, network, trajectory, violation
from scipy.sparse import coo_array, csr_array

import robthermal as rt
from robthermal.errors import InputError
from robthermal.verification import establish, verify
from robthermal.verification._chebyshev import _tail, early, expansion, scaled
from robthermal.verification._numbers import exact
from robthermal.verification._sparse import read_sparse


def proven(document, **changes):
    """Whether the checker proves a document with changed entries of region and evidence."""
    document = copy.deepcopy(document)
    for key, value in changes.items():
        document["evidence" if key in document["evidence"] else "region"][key] = value
    return establish("network_peak", made_by={}, margin={}, **{key: document[key] for key in
                                                               ("system", "region", "evidence")})


@pytest.mark.parametrize("n", [5, 10])
def test_heat3d(n):
    """Published largest temperature, and the window of the competition."""
    A, start, lump = heat3d(n)
    found = rt.certify.network_peak(np.ones(n**3), A, lump, start, 40.0)
    assert found.holds and verify(found).valid, found.reason
    assert MAXIMA[n] - 1e-5 < found.region["bound"] < MAXIMA[n] + 1e-4
    assert f"lump {lump} (counted from 0) never exceeds {found.region['bound']} K in the first 40 s" in found.claim
    assert not rt.certify.network_peak(np.ones(n**3), A, lump, start, 40.0, bound=MAXIMA[n] * 0.999).holds


def test_bounds_are_true_and_tight():
    rng = np.random.default_rng(1)
    for _ in range(25):
        document = make(rng)
        over = -violation(document, rng)
        assert 0 <= over < 1.2e-3, over  # relative; 5e-4 and the digits of the bound


def test_what_is_false_is_not_certified_whatever_the_evidence():
    """Bounds below the truth, with more and finer evidence than any honest search gives."""
    rng = np.random.default_rng(2)
    for _ in range(10):
        document = make(rng)
        region, low = document["region"], document["evidence"]["edges"][0]
        true = region["bound"] * (1 + violation(document, rng))
        fine = np.geomspace(low * 1e-3, region["horizon"], 1500).tolist()[:-1] + [region["horizon"]]
        for edges in (document["evidence"]["edges"], fine):
            refused = proven(document, bound=true * (1 - 1e-6), edges=edges, degree=400)
            assert not refused.holds and "bounded by" in refused.reason
        colder = copy.deepcopy(document)
        colder["region"]["start"] = [value - 0.5 for value in region["start"]]
        assert proven(colder).holds  # less start, still below


@pytest.mark.parametrize(("change", "words"), [
    ({"edges": [1.0]}, "do not rise"), ({"edges": []}, "do not rise"), ({"edges": [0.0, 30.0]}, "do not rise"),
    ({"edges": [2.0, 1.0, 30.0]}, "do not rise"), ({"edges": [1e-3, 30.0, 30.0]}, "do not rise"),
    ({"edges": [30.0]}, "before 30 s"), ({"edges": [1e-3, 30.0]}, "between 0.001 s and 30 s"),
    ({"degree": 3}, "between"), ({"start": [1e-91, 0.0]}, "below 1e-90"), ({"start": [5.0, 5.0]}, "before"),
    ({"horizon": 31.0}, "do not rise"), ({"degree": 100_000}, "too many products"),
    ({"edges": np.linspace(1e-3, 30.0, 5_001)}, "too many products")])
def test_evidence_that_proves_nothing(change, words):
    document = chain()
    assert proven(document).holds
    found = proven(document, **change)
    assert not found.holds and words in found.reason, found.reason


def chain(values=(-1.0, 1.0, 1.0, -2.0), capacity=(10.0, 10.0)):
    """Two lumps, the first at 5 K, the second watched."""
    edges = np.geomspace(0.01, 30.0, 150).tolist()[:-1] + [30.0]
    return {"system": {"capacity": list(capacity), "rows": [0, 0, 1, 1], "cols": [0, 1, 0, 1], "values": list(values)},
            "region": {"start": [5.0, 0.0], "lump": 1, "horizon": 30.0, "bound": 1.5},
            "evidence": {"degree": 60, "edges": edges}}


@pytest.mark.parametrize(("values", "words"), [
    ((-1.0, 1.0, 1.1, -2.0), "not symmetric"), ((-1.0, 1.0, "1.00000000000000000001", -2.0), "not symmetric"),
    ((-1.0, -0.1, -0.1, -2.0), "negative"), ((0.1, 1.0, 1.0, -2.0), "positive"), ((-1.0, 1e-95, 1e-95, -2.0), "1e-90"),
    ((-1e-80, 1e-85, 1e-85, -1e80), "too small"), ((0.0, 0.0, 0.0, 0.0), "fastest rate"),
    ((-1.0, 9.0, 9.0, -2.0), "only bounded by")])
def test_networks_that_are_refused(values, words):
    found = proven(chain(values))
    assert not found.holds and words in found.reason, found.reason


def test_rows_that_gain_heat_are_bounded_with_their_growth():
    """Row sums above zero: the sum grows as exp(s t), and the bound with it."""
    E, A = np.array([10.0, 5.0]), np.array([[-1.0, 1.05], [1.05, -1.0]])
    found = rt.certify.network_peak(E, coo_array(A), 1, [5.0, 0.0], 20.0)
    y = trajectory(E, A, 1, np.array([5.0, 0.0]), np.linspace(0, 20, 4001))
    assert found.holds and y.argmax() == 4000, found.reason
    assert y.max() < found.region["bound"] < y.max() * 1.001


def test_errors_of_the_sums_hold():
    """z and z' as balls, against the exponential of the exact matrix at 300 bits; also of a degree that is too low."""
    rng = np.random.default_rng(3)
    with ctx.workprec(300):
        for n in (2, 5, 9):
            E, A = network(rng, n)
            start = rng.uniform(-3, 10, n)
            entries = coo_array(A)
            matrix = read_sparse({"capacity": E, "rows": entries.row.astype(int), "cols": entries.col.astype(int),
                                  "values": entries.data})
            system = scaled(matrix)
            exactly = arb_mat(n, n, [arb(exact(float(A[i, j]), "")) / arb(exact(float(E[i]), "")) for i in range(n)
                                     for j in range(n)])
            x = arb_mat(n, 1, [arb(exact(float(value), "")) for value in start])
            for degree in (12, 80):
                found = expansion(matrix, system, 0, start, degree)
                for t in ("0.001", "0.7", "12"):
                    z, slope = found.at(arb(t))
                    decay = (-found.growth * arb(t)).exp()
                    state = acb_mat(exactly * arb(t)).exp() * acb_mat(x)
                    change = acb_mat(exactly) * state
                    true = state[0, 0].real * decay
                    assert z.overlaps(true) and z.rad() < (1 if degree == 12 else 1e-10)
                    assert slope.overlaps(change[0, 0].real * decay - found.growth * true)


def test_a_degree_whose_rounding_has_no_bound_is_refused():
    matrix = read_sparse({key: np.array(value) for key, value in chain()["system"].items()})
    crowded = replace(scaled(matrix), entries=10**6)  # in a row
    found = expansion(matrix, crowded, 1, np.array([5.0, 0.0]), 50_000)
    assert found == "degree 50000 is too high for double precision"


def test_the_tail_is_above_the_sum_it_bounds():
    with ctx.workprec(200):
        for rho, m in (("0.01", 3), ("5", 2), ("5", 30), ("400", 60), ("400", 200)):
            a = sum((arb(rho).bessel_i(k, scaled=True) for k in range(m, m + 150)), arb(0)) * 2
            assert a <= _tail(arb(rho), m) and _tail(arb(rho), m) < 60 * a


def test_before_the_first_edge():
    E, A = network(np.random.default_rng(4), 6)
    entries, start = coo_array(A), np.array([3.0, 9.0, -2.0, 0.0, 4.0, 1.0])
    matrix = read_sparse({"capacity": E, "rows": entries.row.astype(int), "cols": entries.col.astype(int),
                          "values": entries.data})
    for until in (0.01, 0.3):
        for lump in range(6):
            y = trajectory(E, A, lump, start, np.linspace(0, until, 200)).max()
            most = early(matrix, scaled(matrix), lump, exact(float(start[lump]), ""), exact(9.0, ""), exact(until, ""))
            assert arb(y) <= most + arb(1e-12)


@pytest.mark.parametrize(("arguments", "words"), [
    ((2, [1.0, 0.0], 10.0), "lump"), ((0, [1.0], 10.0), "start"), ((0, [1.0, np.nan], 10.0), "start"),
    ((0, [1.0, 0.0], 0.0), "horizon"), ((0, [1.0, 0.0], np.inf), "horizon"), ((0, ["a", 0.0], 1.0), "start")])
def test_bad_input(arguments, words):
    A = csr_array(np.array([[-1.0, 1.0], [1.0, -2.0]]))
    with pytest.raises(InputError, match=words):
        rt.certify.network_peak([1.0, 1.0], A, *arguments)
    with pytest.raises(InputError, match="bound"):
        rt.certify.network_peak([1.0, 1.0], A, 0, [1.0, 0.0], 1.0, bound=-1.0)


@pytest.mark.parametrize(("section", "key", "value"), [
    ("region", "lump", 2), ("region", "lump", 0.0), ("region", "lump", True), ("region", "start", [1.0]),
    ("region", "bound", 0), ("region", "colder", 1), ("evidence", "degree", -1), ("evidence", "degree", 100_001),
    ("evidence", "edges", "1"), ("evidence", "edges", [None])])
def test_malformed(section, key, value):
    document = chain()
    document[section][key] = value
    with pytest.raises(InputError):
        proven(document)


def test_what_the_search_refuses_has_a_reason():
    A = np.array([[-1.0, 1.0], [1.0, -2.0]])
    asymmetric = np.array([[-1.0, 1.0], [0.5, -2.0]])
    for matrix, options, words in ((asymmetric, {}, "not symmetric"), (0 * A, {}, "no lump loses"),
                                   (A, {"bound": 1.0}, "reaches"), (A, {"start": [-1.0, -1.0]}, "reaches")):
        found = rt.certify.network_peak([10.0, 10.0], csr_array(matrix), 1, options.pop("start", [5.0, 0.0]), 50.0,
                                        **options)
        assert not found.holds and words in found.reason, found.reason
