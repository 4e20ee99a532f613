"""The parts of the second checker against independent truth: numpy, scipy, ball arithmetic, closed forms."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from recheck._ball import BITS, exponential
from recheck._definite import Factor, Scaling, definite, finish
from recheck._exact import Malformed, exact, power
from recheck._hash import short_hash
from recheck._network_peak import _at, _powers, read
from recheck._polynomial import positive_on, variables
from recheck._sentences import decimal
from recheck._stability import characteristic, routh
from scipy.linalg import expm

from robthermal.errors import InputError
from robthermal.verification._hash import short_hash as first_hash
from robthermal.verification._numbers import decimal as first_decimal
from robthermal.verification._numbers import exact as first_exact

NUMBERS = st.one_of(st.floats(), st.integers(), st.text(max_size=12), st.booleans(), st.none(),
                    st.floats(allow_nan=False, allow_infinity=False).map(float.hex),
                    st.from_regex(r"[+-]?[0-9]{0,3}\.?[0-9]{0,25}([eE][+-]?[0-9]{1,4})?", fullmatch=True))


@settings(max_examples=200, deadline=None, derandomize=True)
@given(NUMBERS)
def test_numbers_mean_the_same_to_both(value):
    try:
        first = first_exact(value, "")
    except InputError:
        with pytest.raises(Malformed):
            exact(value, "")
        return
    second = exact(value, "")
    assert (int(first.p), int(first.q)) == (second.numerator, second.denominator)
    assert first_decimal(first) == decimal(second) and Fraction(decimal(second)) == second
    assert first_hash([value, {"k": value}]) == short_hash([value, {"k": value}])


@settings(max_examples=80, deadline=None, derandomize=True)
@given(st.fractions(min_value=0, max_value=10**6), st.fractions(min_value=0, max_value=10, max_denominator=10**9))
def test_powers_are_enclosed(base, exponent):
    low, high = power(base, exponent)
    before, ctx.prec = ctx.prec, 400
    try:
        true = arb(f"{base.numerator}") / arb(base.denominator)
        true = true ** (arb(exponent.numerator) / arb(exponent.denominator)) if base else arb(int(exponent == 0))
        assert not arb(low.numerator) / arb(low.denominator) > true
        assert not arb(high.numerator) / arb(high.denominator) < true
    finally:
        ctx.prec = before
    assert high - low <= high * Fraction(1, 2**190)


def test_definite_matrices_are_told_from_others():
    """Integer matrices of every signature; those that are singular are never called definite."""
    rng = np.random.default_rng(0)
    told = {True: 0, False: 0, None: 0}
    for _ in range(400):
        n = int(rng.integers(1, 9))
        A = rng.integers(-5, 6, (n, int(rng.integers(1, n + 2))))
        M = A @ A.T + int(rng.integers(-3, 3)) * np.eye(n, dtype=int)
        least = np.linalg.eigvalsh(M)[0]
        unit = Scaling([Fraction(int(M[i, i])) for i in range(n)])
        rows = unit.matrix({(i, j): Fraction(int(M[i, j])) for i in range(n) for j in range(n)})
        found = definite(rows, 1)
        told[found] += 1
        assert found is (bool(least > 0) if abs(least) > 1e-9 else found) and (abs(least) > 1e-9 or found is not True)
    assert min(told[True], told[False]) > 50


def test_errors_of_entries_count():
    unit = Scaling([Fraction(1), Fraction(1)])
    near = unit.matrix({(0, 0): Fraction(1), (1, 1): Fraction(1), (0, 1): 1 - Fraction(1, 2**100),
                        (1, 0): 1 - Fraction(1, 2**100)})
    assert definite(near, 1) is True and definite(near, 2**160) is None
    far = unit.matrix({(0, 0): Fraction(1), (1, 1): Fraction(1), (0, 1): Fraction(2), (1, 0): Fraction(2)})
    assert definite(far, 2**160) is False and definite(far, 2**256) is None


def test_a_factor_can_be_finished_with_blocks():
    rng = np.random.default_rng(1)
    seen = set()
    for _ in range(200):
        n = int(rng.integers(3, 8))
        A = rng.integers(-4, 5, (n, n))
        M, B = A @ A.T + 2 * np.eye(n, dtype=int), rng.integers(-3, 4, (2, 2))
        B = B + B.T
        less = M.astype(float)
        less[-2:, -2:] -= B
        least = np.linalg.eigvalsh(less)[0]
        unit = Scaling([Fraction(int(M[i, i])) for i in range(n)])
        rows = unit.matrix({(i, j): Fraction(int(M[i, j])) for i in range(n) for j in range(n)})
        factor = Factor(rows, 2, n - 2, others=2**260)
        assert factor.failed is None
        block = [[unit.units(Fraction(int(B[a, b])), n - 2 + a, n - 2 + b) for b in range(2)] for a in range(2)]
        if abs(least) > 1e-9:
            seen.add(bool(least > 0))
            assert finish(factor.rest(rows), [((0, 1), block)]) is bool(least > 0)
    assert seen == {True, False}


@pytest.mark.parametrize("time", [Fraction(1, 10), Fraction(3), Fraction(400)])
def test_exponentials_and_their_integrals_are_enclosed(time):
    rng = np.random.default_rng(2)
    for n in (1, 2, 5):
        A = rng.integers(0, 9, (n, n)) / 8
        np.fill_diagonal(A, -A.sum(axis=1) - 0.25)
        F = {(i, j): Fraction(A[i, j]) for i in range(n) for j in range(n)}
        exp, integral = exponential(F, n, time)
        both = expm(np.block([[A, np.eye(n)], [np.zeros((n, 2 * n))]]) * float(time))
        unit = 2**BITS
        assert exp.error < 2**(BITS - 300) and integral.error < 2**(BITS - 290)
        for found, true in ((exp, both[:n, :n]), (integral, both[:n, n:])):
            values = [[entry / unit for entry in row] for row in found.rows]
            np.testing.assert_allclose(values, true, rtol=1e-9, atol=1e-12)


def test_the_exponential_of_one_number_is_right_to_its_bound():
    """exp(-1/3) to 300 bits."""
    exp, integral = exponential({(0, 0): Fraction(-1, 3)}, 1, Fraction(1))
    before, ctx.prec = ctx.prec, 600
    try:
        true = (arb(-1) / 3).exp()
        for value, error, wanted in ((exp.rows[0][0], exp.error, true),
                                     (integral.rows[0][0], integral.error, 3 * (1 - true))):
            ball = arb(value, error) / arb(2) ** BITS
            assert ball.overlaps(wanted) and float(ball.rad()) < 1e-100
    finally:
        ctx.prec = before


def test_eigenvalues_decide_stability():
    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(300):
        n = int(rng.integers(1, 7))
        A = rng.integers(-9, 10, (n, n))
        A = A - int(rng.integers(0, 15)) * np.eye(n, dtype=int)
        falling = characteristic([[Fraction(int(value), 8) for value in row] for row in A])
        np.testing.assert_allclose([float(value) for value in falling], np.poly(A / 8), rtol=1e-6, atol=1e-6)
        largest = np.linalg.eigvals(A / 8).real.max()
        if abs(largest) > 1e-6:
            seen.add(bool(largest < 0))
            assert routh(falling) is bool(largest < 0)
    assert seen == {True, False}


def test_signs_of_polynomials_on_boxes():
    x, y = variables(2)
    unit = [(Fraction(0), Fraction(1)), (Fraction(1), Fraction(2))]
    assert positive_on(y * y - x * y + x * x, unit) is True  # least 3/4
    assert positive_on(x * x * 4 - y * x * 4 + y * y, unit) is not True  # zero inside, on 2 x = y
    assert positive_on(x, unit, strict=False) is True and positive_on(x, unit) is False
    assert positive_on(y - x * 3, unit) is False
    point = [(Fraction(1, 2), Fraction(1, 2)), (Fraction(1), Fraction(1))]
    assert positive_on(y - x * 2, point, strict=False) is True and positive_on(y - x * 2, point) is False


def test_temperatures_by_powers_are_enclosed():
    """z and its slope with their errors, against scipy's exponential; the growth of the warmest row taken out."""
    rng = np.random.default_rng(6)
    for n in (1, 2, 6):
        A = np.triu(np.round(rng.uniform(0, 2, (n, n)), 2), 1)
        A = A + A.T - np.diag(np.round(A.sum(axis=0) + A.sum(axis=1) + rng.uniform(0.1, 1, n), 2))
        E, start = np.round(rng.uniform(1, 9, n), 1), np.round(rng.uniform(-5, 9, n), 1)
        rows, cols = np.nonzero(np.ones((n, n)))
        found = read({"system": {"capacity": E.tolist(), "rows": rows.tolist(), "cols": cols.tolist(),
                                 "values": A[rows, cols].tolist()},
                      "region": {"start": start.tolist(), "lump": 0, "horizon": 40, "bound": 1}, "margin": {},
                      "evidence": {"degree": 9, "edges": [40]}})
        for growth in (Fraction(0), Fraction(1, 7)):
            powers = _powers(found, Fraction(20), growth)
            for t in (Fraction(1, 1000), Fraction(3), Fraction(40)):
                z, slope, error, slope_error = map(float, _at(powers, t))
                flow = A / E[:, None] - float(growth) * np.eye(n)
                state = expm(flow * float(t)) @ start
                assert error < 1e-25 and slope_error < 1e-24
                assert abs(z - state[0]) < 1e-11 and abs(slope - (flow @ state)[0]) < 1e-11
