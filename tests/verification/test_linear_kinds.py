"""Kinds "stability", "hinf", "peak", "frequency": closed forms, sampled truth, refusals, mutated files."""

from __future__ import annotations

import copy
import json
import math

import numpy as np
import pytest
from flint import arb, arb_poly, fmpq, fmpq_poly

from robthermal.errors import InputError
from robthermal.verification import Certificate, establish, verify
from robthermal.verification._bernstein import coefficients, largest_ratio, sign_on
from robthermal.verification._lti import read_linear
from robthermal.verification._transfer import transfer, unstable


def section(A, B, C, D, dt=0.0):
    return {"A": np.atleast_2d(A), "B": np.atleast_2d(B), "C": np.atleast_2d(C), "D": np.atleast_2d(D),
            "sample_time": dt}


def made(kind, system, region, evidence):
    return establish(kind, system=system, region=region, evidence=evidence, made_by={}, margin={})


def resonator(damping, gain=1.0):
    """1/(s² + damping s + 1): peak 1/(damping √(1 - damping²/4)) at ω = √(1 - damping²/2)."""
    return section([[0, 1], [-1, -damping]], [[0], [1]], [[gain, 0]], [[0]])


def norm_region(edges, bounds, **more):
    return {"form": "norm", "edges": edges, "bounds": bounds, **more}


def response(system, omega):
    A, B, C, D = (np.asarray(system[key], float) for key in "ABCD")
    dt = system["sample_time"]
    z = np.exp(1j * omega * dt) if dt else 1j * omega
    return C @ np.linalg.solve(z * np.eye(len(A)) - A, B) + D


def random_system(rng, n, m, p, dt):
    A = rng.standard_normal((n, n))
    A = 0.97 * A / abs(np.linalg.eigvals(A)).max() if dt else A - (np.linalg.eigvals(A).real.max() + 0.05) * np.eye(n)
    return section(A, rng.standard_normal((n, m)), rng.standard_normal((p, n)), rng.standard_normal((p, m)), dt)


# The polynomials


@pytest.mark.parametrize("dt", [0.0, 0.2])
def test_exact_transfer_matrix_has_the_values_of_the_state_space(dt):
    rng = np.random.default_rng(4)
    system = random_system(rng, 5, 2, 3, dt)
    found = transfer(read_linear(system))
    omega = 0.83
    s = 1j * math.tan(omega * dt / 2) if dt else 1j * omega

    def value(polynomial):
        return sum(float(arb(entry)) * s**k for k, entry in enumerate(polynomial.coeffs()))

    M = [[value(entry) / value(found.denominator) for entry in row] for row in found.numerators]
    np.testing.assert_allclose(M, response(system, omega), rtol=1e-9)


def test_routh_array_agrees_with_roots():
    rng = np.random.default_rng(7)
    stable = 0
    for _ in range(200):
        n = int(rng.integers(1, 8))
        roots = rng.uniform(-2.0, 0.25, n) + 1j * rng.uniform(-3, 3, n) * (rng.random(n) < 0.7)
        pairs = np.concatenate([[z, z.conjugate()] if z.imag else [z] for z in roots])
        numbers = [fmpq(*float(value).as_integer_ratio()) for value in np.poly(pairs).real[::-1]]
        truth = bool(np.roots([float(arb(value)) for value in numbers[::-1]]).real.max() < 0)
        stable += truth
        assert (unstable(fmpq_poly(numbers), len(pairs)) == "") == truth
    assert 50 < stable < 150


def test_bernstein_coefficients_decide_and_bound():
    p = arb_poly([fmpq(101, 100), -2, 1])  # (x - 1)² + 0.01
    assert sign_on(p, 2, (arb(0), None)).positive
    touching = sign_on(arb_poly([fmpq(99, 100), -2, 1]), 2, (arb(0), arb(3)))  # negative near 1
    assert not touching.positive and touching.certain and abs(float(touching.at) - 1) < 0.11
    cell = (arb(fmpq(1, 2)), arb(2))
    ratio = largest_ratio(coefficients(arb_poly([0, 1]), 2, cell), coefficients(arb_poly([1, 0, 1]), 2, cell))
    assert 0.5 <= float(ratio) < 0.7  # x/(1 + x²), largest 1/2 at x = 1


# Stability


def test_stability_up_to_the_boundary_and_not_beyond():
    loop = section([[0, 1], [-1, -2e-6]], [[0], [1]], [[1, 0]], [[0]])  # real parts -1e-6
    assert made("stability", loop, {"rate": 0.99e-6}, {"method": "polynomial"}).holds
    assert not made("stability", loop, {"rate": 1.01e-6}, {"method": "polynomial"}).holds
    assert not made("stability", loop, {"rate": 1e-6}, {"method": "polynomial"}).holds  # equality is not strict
    integrator = section([[0]], [[1]], [[1]], [[0]])
    assert not made("stability", integrator, {}, {"method": "polynomial"}).holds
    for pole, holds in ((0.999999, True), (1.0, False), (-1.0, False), (-0.999999, True), (1.0000001, False)):
        one = section([[pole, 0.3], [0, 0.5]], [[0], [1]], [[1, 0]], [[0]], 0.1)
        assert made("stability", one, {}, {"method": "polynomial"}).holds is holds


def test_hundred_states_close_to_the_boundary():
    rng = np.random.default_rng(0)
    A = rng.standard_normal((100, 100))
    A /= abs(np.linalg.eigvals(A)).max()
    near = section(A * (1 - 1e-6), np.ones((100, 1)), np.ones((1, 100)), [[0]], 1.0)
    beyond = section(A * (1 + 1e-6), np.ones((100, 1)), np.ones((1, 100)), [[0]], 1.0)
    assert made("stability", near, {}, {"method": "polynomial"}).holds
    assert not made("stability", beyond, {}, {"method": "polynomial"}).holds


def test_lyapunov_matrix_must_fit():
    loop = section([[-1, 3], [0, -1]], [[0], [1]], [[1, 0]], [[0]])
    assert not made("stability", loop, {}, {"method": "lyapunov", "matrix": [[1, 0], [0, 1]]}).holds
    assert made("stability", loop, {}, {"method": "lyapunov", "matrix": [[1, 0], [0, 5]]}).holds
    assert not made("stability", loop, {}, {"method": "lyapunov", "matrix": [[1, 0.1], [0, 5]]}).holds  # not symmetric
    assert not made("stability", loop, {}, {"method": "lyapunov", "matrix": [[-1, 0], [0, -5]]}).holds


# The H-infinity norm


def test_bounded_real_matrix_of_one_lag():
    """1/(s + 1) has norm 1; P = 1 proves every bound above it and none below."""
    lag = section([[-1]], [[1]], [[1]], [[0]])
    for bound, holds in ((1 + 1e-9, True), (1 - 1e-9, False), (1, False)):
        assert made("hinf", lag, {"bound": bound}, {"method": "bounded_real", "matrix": [[1]]}).holds is holds
        assert made("hinf", lag, {"bound": bound}, {"method": "polynomial"}).holds is holds
    double = {"bound": 2.0001, "left": [[4]], "right": [[2]]}
    assert made("hinf", lag, double, {"method": "polynomial"}).holds
    assert made("hinf", lag, double, {"method": "bounded_real", "matrix": [[16]]}).holds
    assert not made("hinf", lag, {**double, "bound": 1.9999}, {"method": "polynomial"}).holds


def test_lightly_damped_peak_of_slicot():
    """AB13DD: 5.000000001e5 at √2."""
    A = np.kron(np.eye(3), [[0.0, 1.0], [0.0, 0.0]])
    for k, (stiffness, damping) in enumerate(((0.5, 2e-4), (1.0, 2e-5), (2.0, 2e-6))):
        A[2 * k + 1, 2 * k:2 * k + 2] = -stiffness, -damping
    b = np.kron(np.ones((3, 1)), [[1.0], [0.0]])
    system = section(A, b, b.T, [[0]])
    assert made("hinf", system, {"bound": 500000.001}, {"method": "polynomial"}).holds
    failed = made("hinf", system, {"bound": 500000.0}, {"method": "polynomial"})
    assert not failed.holds and "1.41421356" in failed.reason
    assert made("stability", system, {}, {"method": "polynomial"}).holds


def test_positive_systems_attain_their_norm_at_zero():
    """Metzler A, B, C, D >= 0: norm σ_max(D - C A⁻¹ B), Rantzer (2015)."""
    rng = np.random.default_rng(2)
    for _ in range(10):
        A = rng.uniform(0, 1, (4, 4))
        A -= (np.linalg.eigvals(A).real.max() + 0.1 + np.diag(A).max()) * np.eye(4)
        B, C, D = rng.uniform(0, 1, (4, 2)), rng.uniform(0, 1, (3, 4)), rng.uniform(0, 1, (3, 2))
        norm = np.linalg.norm(D - C @ np.linalg.solve(A, B), 2)
        system = section(A, B, C, D)
        assert made("hinf", system, {"bound": norm * (1 + 1e-9)}, {"method": "polynomial"}).holds
        assert not made("hinf", system, {"bound": norm * (1 - 1e-9)}, {"method": "polynomial"}).holds


# Between the grid points


def test_resonance_between_grid_points_is_seen():
    damping = 1e-4
    peak = 1 / (damping * math.sqrt(1 - damping**2 / 4))
    system = resonator(damping)
    edges = [0.99, 1.01]  # |G| at the edges is about 50, the peak 10 000 and 1e-4 rad/s wide
    assert made("frequency", system, norm_region(edges, [51, peak * 1.0001, 50]), {}).holds
    for wrong in (peak * 0.9999, peak * 0.999, 60):
        failed = made("frequency", system, norm_region(edges, [51, wrong, 50]), {})
        assert not failed.holds and "interval 1, from 0.99 to 1.01 rad/s: the bound does not hold" in failed.reason


def test_peak_at_the_nyquist_frequency():
    """0.1/(z + 0.9) is 1 at z = -1 and 0.1/1.9 at z = 1."""
    system = section([[-0.9]], [[1]], [[0.1]], [[0]], 0.5)
    assert made("frequency", system, norm_region([5.0], [0.2, 1.0001]), {}).holds
    assert not made("frequency", system, norm_region([5.0], [0.2, 0.9999]), {}).holds
    late = made("frequency", system, norm_region([6.3], [2, 2]), {})  # 2π is Nyquist
    assert not late.holds and "Nyquist" in late.reason
    assert made("frequency", system, norm_region([6.28], [2, 2]), {}).holds


@pytest.mark.exhaustive
@pytest.mark.parametrize(("m", "p", "dt"), [(1, 1, 0.0), (2, 3, 0.0), (3, 2, 0.1), (2, 2, 0.1)])
def test_bounds_against_dense_grids(m, p, dt):
    rng = np.random.default_rng(10 * m + p)
    end = math.pi / dt if dt else 1e5
    for trial in range(3):
        system = random_system(rng, 6, m, p, dt)
        edges = np.geomspace(0.05, end * 0.9, 7)
        left, right = (rng.standard_normal((8, k, k)) + 2 * np.eye(k) for k in (p, m))
        i = 1j if trial == 2 else 0.0  # complex scalings too
        left, right = left + i * rng.standard_normal(left.shape), right + i * rng.standard_normal(right.shape)
        full = np.concatenate([[0.0], edges, [end]])
        largest = []
        for k in range(8):
            omega = np.unique(np.concatenate([np.linspace(full[k], full[k + 1], 500),
                                              np.geomspace(max(full[k], 1e-3), full[k + 1], 300)]))
            largest.append(max(np.linalg.norm(left[k] @ response(system, w) @ np.linalg.inv(right[k]), 2)
                               for w in omega))
        split = {key: np.stack([value.real, value.imag], -1) for key, value in (("left", left), ("right", right))}
        bounds = np.array(largest)
        assert made("frequency", system, norm_region(edges, bounds * 1.003, **split), {}).holds
        for k in (0, 4, 7):
            wrong = bounds * 1.003
            wrong[k] = bounds[k] * 0.999
            failed = made("frequency", system, norm_region(edges, wrong, **split), {})
            assert not failed.holds and f"interval {k}," in failed.reason


def test_spectral_radius_against_dense_grids_and_closed_form():
    """[0, 1/(s + 1); 2/(s + 2), 0] with R = diag(r1, r2): ρ = √(r1 r2) at zero."""
    system = section(np.diag([-1, -2]), [[0, 1], [2, 0]], np.eye(2), np.zeros((2, 2)))
    region = {"form": "radius", "edges": [], "envelopes": [np.diag([0.5, 0.7])], "bound": math.sqrt(0.35) * 1.0001}
    assert made("frequency", system, region, {}).holds
    failed = made("frequency", system, {**region, "bound": math.sqrt(0.35) * 0.9999}, {})
    assert not failed.holds and "does not hold" in failed.reason
    rng = np.random.default_rng(5)
    for dt in (0.0, 0.1):
        system = random_system(rng, 6, 2, 2, dt)
        end = math.pi / dt if dt else 1e4
        edges, R = [0.5, 2.0], rng.uniform(0, 1, (3, 2, 2))
        full = [1e-9, *edges, end]
        top = max(abs(np.linalg.eigvals(abs(response(system, w)) @ R[k])).max()
                  for k in range(3) for w in np.geomspace(full[k], full[k + 1], 1500))
        region = {"form": "radius", "edges": edges, "envelopes": R}
        assert made("frequency", system, {**region, "bound": top * 1.004}, {}).holds
        assert not made("frequency", system, {**region, "bound": top * 0.998}, {}).holds


def test_blocks_must_commute_with_the_scalings():
    """M = [2 2; -1 -1]: norm √10, μ = 3 for two scalar blocks (Skogestad and Postlethwaite)."""
    system = section(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((2, 0)), [[2, 2], [-1, -1]])
    system["A"], system["B"], system["C"] = [], [], [[], []]
    D = [[[1, 0], [0, math.sqrt(2)]]]
    blocks = [["full", 1, 1], ["full", 1, 1]]
    assert made("frequency", system, norm_region([], [3.0001], left=D, right=D, blocks=blocks), {}).holds
    assert not made("frequency", system, norm_region([], [2.9999], left=D, right=D, blocks=blocks), {}).holds
    for wrong in ([["full", 2, 2]], [["repeated", 2]]):
        cert = made("frequency", system, norm_region([], [3.0001], left=D, right=D, blocks=wrong), {})
        assert cert.holds is (wrong == [["repeated", 2]])  # diag(1, √2) commutes with δ I, not with a full block
    other = [[[1, 0], [0, 1]]]
    assert not made("frequency", system, norm_region([], [4], left=D, right=other, blocks=blocks), {}).holds
    with pytest.raises(InputError, match="rows and 3 columns"):
        made("frequency", system, norm_region([], [4], blocks=[["full", 2, 3]]), {})


# Peak gain


def test_peak_of_one_lag_and_of_a_positive_system():
    """b/(s + a) has peak gain b/a; the star norm of a single lag is exact."""
    lag = section([[-2]], [[3]], [[1]], [[0]])
    assert made("peak", lag, {"bound": 1.5}, {"method": "positive"}).holds
    assert not made("peak", lag, {"bound": 1.4999}, {"method": "positive"}).holds
    good = {"method": "ellipsoid", "decay": 2, "share": 0.9999999, "matrix": [[4.5000001]]}
    assert made("peak", lag, {"bound": 1.5001}, good).holds
    assert not made("peak", lag, {"bound": 1.4999}, good).holds
    assert not made("peak", lag, {"bound": 1.5001}, {**good, "decay": 2.001}).holds
    assert not made("peak", lag, {"bound": 9}, {**good, "share": 1}).holds
    turned = section([[-2]], [[-3]], [[1]], [[0]])
    assert not made("peak", turned, {"bound": 9}, {"method": "positive"}).holds
    assert not made("peak", section([[0]], [[1]], [[1]], [[0]]), {"bound": 9}, {"method": "positive"}).holds


# Files


CERTIFICATES = {
    "stability": (resonator(0.2), {"rate": 0.05}, {"method": "lyapunov", "matrix": [[1.01, 0.1], [0.1, 1.0]]}),
    "hinf": (section([[-1]], [[1]], [[1]], [[0]]), {"bound": 1.01}, {"method": "bounded_real", "matrix": [[1]]}),
    "peak": (section([[-2]], [[3]], [[1]], [[0]]), {"bound": 1.51},
             {"method": "ellipsoid", "decay": 2, "share": 0.999999, "matrix": [[4.51]]}),
    "frequency": (resonator(0.2), norm_region([0.9, 1.1], [4.5, 5.03, 3.6]), {}),
}


@pytest.mark.parametrize("kind", CERTIFICATES)
def test_file_round_trip_and_changed_sentence(kind, tmp_path):
    certificate = made(kind, *CERTIFICATES[kind])
    assert certificate.holds, certificate.reason
    certificate.save(tmp_path / "c.json")
    assert verify(Certificate.load(tmp_path / "c.json")).valid
    document = json.loads((tmp_path / "c.json").read_text())
    document["claim"] = document["claim"].replace("stable", "very stable")
    (tmp_path / "d.json").write_text(json.dumps(document))
    assert not verify(Certificate.load(tmp_path / "d.json")).valid


MUTATIONS = [
    ("stability", ("system", "A", 1, 1), 0.001), ("stability", ("evidence", "matrix", 0, 1), 2.0),
    ("stability", ("region", "rate"), 0.2), ("stability", ("evidence", "matrix", 1, 1), -1.0),
    ("hinf", ("region", "bound"), 0.999), ("hinf", ("system", "B", 0, 0), 1.2), ("hinf", ("system", "D", 0, 0), 0.1),
    ("hinf", ("evidence", "matrix", 0, 0), 3.0), ("hinf", ("evidence", "matrix", 0, 0), -1.0),
    ("peak", ("system", "C", 0, 0), 1.1), ("peak", ("evidence", "matrix", 0, 0), 4.4),
    ("peak", ("evidence", "decay"), 3.0), ("peak", ("region", "bound"), 1.49),
    ("frequency", ("system", "A", 1, 1), -0.19), ("frequency", ("system", "A", 1, 1), 0.2),
    ("frequency", ("region", "bounds", 1), 5.01), ("frequency", ("region", "edges", 0), 0.95),
    ("frequency", ("system", "C", 0, 0), -1.02),
]


@pytest.mark.parametrize(("kind", "path", "value"), MUTATIONS)
def test_changed_digits_are_rejected(kind, path, value):
    certificate = made(kind, *CERTIFICATES[kind])
    parts = {key: copy.deepcopy(getattr(certificate, key)) for key in ("system", "region", "evidence")}
    place = parts
    for key in path[:-1]:
        place = place[key]
    assert place[path[-1]] != value
    place[path[-1]] = value
    assert not verify(Certificate(**{**vars(certificate), **parts})).valid  # the sentence, or the inequality
    assert not made(kind, *parts.values()).holds  # the inequality itself


@pytest.mark.parametrize(("kind", "change", "words"), [
    ("frequency", {"region": norm_region([0.9, 1.1], [5.1, 5.1])}, "one per interval"),
    ("frequency", {"region": norm_region([1.1, 0.9], [6, 6, 6])}, "increase"),
    ("frequency", {"region": norm_region([0.0], [6, 6])}, "not positive"),
    ("frequency", {"region": norm_region([], [-6])}, "not positive"),
    ("frequency", {"region": norm_region([], [6], margin=1)}, "unknown key"),
    ("frequency", {"region": {"form": "sum", "edges": []}}, "form"),
    ("frequency", {"region": {"form": "radius", "edges": [], "envelopes": [[[-1]]], "bound": 1}}, "negative"),
    ("hinf", {"system": {**resonator(0.2), "D": [[0, 1]]}}, "system.B"),
    ("hinf", {"system": {**resonator(0.2), "sample_time": -1}}, "negative"),
    ("hinf", {"evidence": {"method": "believe"}}, "method"),
    ("stability", {"region": {"rate": 1.0}, "system": section([[0.1]], [[1]], [[1]], [[0]], 1.0)}, "below 1"),
    ("peak", {"evidence": {"method": "ellipsoid"}}, "matrix"),
])
def test_malformed_content_is_an_input_error(kind, change, words):
    parts = dict(zip(("system", "region", "evidence"), CERTIFICATES[kind], strict=True)) | change
    with pytest.raises(InputError, match=words):
        establish(kind, **parts, made_by={})
