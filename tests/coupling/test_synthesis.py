"""Coupling synthesis: bases, exact variances, the convex program, and what comes back from `synthesize`."""

from __future__ import annotations

from dataclasses import replace

import control
import cvxpy
import numpy as np
import pytest

import robthermal as rt
from robthermal.conic import NormBounds, smallest_bound
from robthermal.coupling.analysis._worst_case import _Maps
from robthermal.coupling.problem import radius, youla_parameter
from robthermal.coupling.synthesis import make_basis, moments, square_root
from robthermal.coupling.synthesis._program import _ellipse

DT = 1e-3


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


# Bases


def impulse(system: control.StateSpace, n: int) -> np.ndarray:
    """Impulse response (outputs, n) by the recursion itself."""
    x, values = system.B[:, 0], [system.D[:, 0]]
    for _ in range(n - 1):
        values.append(system.C @ x)
        x = system.A @ x
    return np.array(values).T


@pytest.mark.parametrize(("name", "pole"), [("fir", None), ("laguerre", 0.7), ("laguerre", -0.4),
                                            ("poles", [0.5, 0.6 + 0.3j, 0.6 - 0.3j, 0.2, 0.2, 0.8 + 0.5j])])
def test_discrete_bases_are_orthonormal_and_start_with_the_constant(name, pole):
    basis = make_basis(name, 8, pole, DT)
    h = impulse(basis.all(), 3000)
    assert np.allclose(h @ h.T, np.eye(basis.size), atol=1e-9)
    assert h[0, 0] == 1 and not np.any(h[0, 1:])


def test_fir_functions_are_delays():
    assert np.allclose(abs(impulse(make_basis("fir", 5, None, DT).all(), 5)), np.eye(5))


def test_laguerre_functions_are_the_textbook_ones():
    a, z = 0.6, np.exp(1j * np.linspace(0.1, 3, 7))
    found = make_basis("laguerre", 4, a, DT).all()(z)[:, 0]
    for k in range(3):
        exact = np.sqrt(1 - a**2) / (z - a) * ((1 - a * z) / (z - a)) ** k
        ratio = found[k + 1] / exact
        assert np.allclose(ratio, np.sign(ratio[0].real), atol=1e-12)


def test_continuous_laguerre_functions_are_the_textbook_ones():
    p, s = 30.0, 1j * np.geomspace(1, 1000, 7)
    found = make_basis("laguerre", 4, -p, 0.0).all()(s)[:, 0]
    for k in range(3):
        ratio = found[k + 1] / (np.sqrt(2 * p) / (s + p) * ((s - p) / (s + p)) ** k)
        assert np.allclose(ratio, np.sign(ratio[0].real), atol=1e-12)


def test_prescribed_poles_span_the_filters_that_have_them():
    poles = [0.5, 0.6 + 0.3j, 0.6 - 0.3j]
    z = np.exp(1j * np.linspace(0.01, 3.1, 40))
    basis = make_basis("poles", 0, poles, DT).all()(z)[:, 0]
    wanted = 0.3 + 1 / (z - 0.5) + (0.2 * z + 1) / ((z - poles[1]) * (z - poles[2]))
    rows = np.vstack([basis.T.real, basis.T.imag])
    target = np.concatenate([wanted.real, wanted.imag])
    assert np.linalg.lstsq(rows, target, rcond=None)[1].sum() < 1e-20


@pytest.mark.parametrize(("name", "pole", "dt", "word"), [
    ("laguerre", 1.0, DT, "not stable"), ("laguerre", 3.0, 0.0, "not stable"), ("laguerre", [0.5, 0.6], DT, "one real"),
    ("laguerre", 0.5j, DT, "one real"), ("poles", None, DT, "without poles"), ("poles", [0.5, 1.2], DT, "not stable"),
    ("poles", [np.nan], DT, "not stable"), ("fir", None, 0.0, "discrete")])
def test_bases_that_cannot_be(name, pole, dt, word):
    with pytest.raises(rt.InputError, match=word):
        make_basis(name, 4, pole, dt)


# Variances


def colored(dt: float) -> control.StateSpace:
    return control.ss([[0.9, 0.2], [-0.1, 0.8]], [[1.0], [0.5]], [[0.3, 1.0]], [[0.7]], dt)


def test_variance_of_the_moving_average_equals_that_of_a_long_impulse_response():
    basis, delay, N = make_basis("laguerre", 5, 0.5, DT), control.ss([[0.0]], [[1.0]], [[1.0]], [[0.0]], DT), 7
    total, average = moments(colored(DT), delay, basis, N)
    signal = impulse(colored(DT), 4000)[0]
    shaped = np.vstack([signal] + [np.convolve(signal, np.concatenate([[0.0], h]))[:4000]
                                   for h in impulse(basis.all(), 3999)])
    averaged = np.array([np.convolve(row, np.full(N, 1 / N)) for row in shaped])
    assert np.allclose(total, shaped @ shaped.T, rtol=1e-9)
    assert np.allclose(average, averaged @ averaged.T, rtol=1e-9)


def test_continuous_variance_is_the_frequency_integral():
    signal = control.ss([[-3.0, 10.0], [-10.0, -2.0]], [[1.0], [0.5]], [[2.0, 1.0]], [[0.0]])
    factor = control.ss([[-50.0]], [[1.0]], [[50.0]], [[0.0]])
    basis = make_basis("laguerre", 3, -20.0, 0.0)
    total, _ = moments(signal, factor, basis, 1)
    omega = 30 * np.tan(np.linspace(-np.pi / 2, np.pi / 2, 20002)[1:-1])
    s = 1j * omega
    rows = np.vstack([np.ones_like(s), factor(s) * basis.all()(s)[:, 0]]) * signal(s)
    weight = np.gradient(np.arctan(omega / 30)) * (omega**2 + 900) / 30 / (2 * np.pi)
    assert np.allclose(total, ((rows * weight) @ rows.conj().T).real, rtol=1e-5, atol=1e-8)


def test_infinite_variance_is_refused():
    with pytest.raises(rt.InputError, match="infinite"):
        moments(control.ss([[-1.0]], [[1.0]], [[1.0]], [[1.0]]), control.ss([], [], [], [[1.0]]),
                make_basis("laguerre", 2, -1.0, 0.0), 1)


def test_square_root_of_a_singular_matrix():
    v = rng().normal(size=(5, 2))
    R = square_root(v @ v.T)
    assert len(R) == 2 and np.allclose(R.T @ R, v @ v.T)


# The program


def test_radius_is_the_spectral_radius():
    R, ab = rng(1).uniform(0, 2, (2, 2, 200)), rng(2).uniform(0, 2, (2, 200))
    blocks = np.zeros((200, 2, 2))
    blocks[:, 0, 1], blocks[:, 1, 0] = ab
    brute = np.abs(np.linalg.eigvals(blocks @ R.transpose(2, 0, 1))).max(axis=1)
    assert np.allclose(radius(R, *ab), brute, rtol=1e-12)


@pytest.mark.parametrize("diagonal", [True, False])
def test_ellipses_lie_inside_the_robust_set_and_touch_it(diagonal):
    R, sizes = rng(3).uniform(0, 2, (2, 2, 300)), rng(4).uniform(0.05, 2, (2, 300))
    if diagonal:
        R[0, 1] = R[1, 0] = 0
    weights = _ellipse(R, 0.9, sizes)
    for angle in np.linspace(0, np.pi / 2, 19):
        edge = np.array([np.cos(angle), np.sin(angle)])[:, None] / np.sqrt(weights)
        assert np.all(radius(R, *edge) <= 0.9 * (1 + 1e-9))
    touching = sizes / np.sqrt((weights * sizes**2).sum(axis=0))
    convex = R[0, 0] * R[1, 1] >= R[0, 1] * R[1, 0]
    assert np.allclose(radius(R, *touching)[convex], 0.9, rtol=1e-9) and convex.sum() > 50


def test_cone_program_against_one_written_constraint_by_constraint():
    n, n_f = 6, 40
    M, m = rng(5).normal(size=(n_f, 4, n)), rng(6).normal(size=(n_f, 4))
    inside = rng(7).normal(size=(n_f, 2, n))
    bounds = [NormBounds(M, m, np.zeros(n_f), 1.0), NormBounds(inside, np.zeros((n_f, 2)), np.full(n_f, 0.4))]
    found = smallest_bound(bounds, n)
    x, t = cvxpy.Variable(n), cvxpy.Variable()
    rules = [cvxpy.norm(M[k] @ x + m[k]) <= t for k in range(n_f)]
    rules += [cvxpy.norm(inside[k] @ x) <= 0.4 for k in range(n_f)]
    exact = cvxpy.Problem(cvxpy.Minimize(t), rules).solve(solver="CLARABEL")
    assert found.solved and found.value == pytest.approx(exact, rel=1e-6)
    assert np.linalg.norm(M @ found.x + m, axis=1).max() == pytest.approx(exact, rel=1e-6)


def test_impossible_cone_program_says_so():
    bounds = [NormBounds(np.eye(2)[None], np.array([[k, 0.0]]), np.ones(1)) for k in (-3.0, 3.0)]
    found = smallest_bound([*bounds, NormBounds(np.eye(2)[None], np.zeros((1, 2)), np.zeros(1), 1.0)], 2)
    assert not found.solved and np.isnan(found.value) and not found.x.any()


# Synthesis on plants with known answers


def one_delay(gain: float) -> tuple[control.StateSpace, control.StateSpace]:
    """P = 1/z, C = gain: S = z/(z + gain)."""
    return control.ss([[0.0]], [[1.0]], [[1.0]], [[0.0]], DT), control.ss([], [], [], [[gain]], DT)


def simple(**options) -> rt.coupling.Filters:
    (P1, C1), (P2, C2) = one_delay(0.3), one_delay(-0.2)
    noise = control.tf([1, 0], [1, -0.6], DT), control.tf([1, 0.3], [1, -0.5], DT)
    return rt.coupling.synthesize(P1, P2, C1, C2, **{"disturbances": noise, **options})


@pytest.mark.parametrize("basis", [{"basis": "laguerre", "order": 10}, {"basis": "laguerre", "order": 10, "pole": 0.4},
                                   {"basis": "fir", "order": 16}, {"basis": "poles", "pole": [0.0, 0.6, -0.3, 0.5]}])
def test_least_variance_is_that_of_the_one_step_prediction_error(basis):
    # Behind a delay of one sample the best that can be done is to leave the innovations: variance 1 + 1.
    filters = simple(**basis)
    assert filters.holds and filters.norms["h2"] == pytest.approx(np.sqrt(2), rel=1e-4)
    assert filters.requested["h2"] == pytest.approx(filters.norms["h2"], rel=1e-9)


def test_least_peak_is_the_flat_prediction_error():
    # The mean of the squared spectrum is at least 2 (above), so its peak is; white innovations reach it.
    filters = simple(objective="hinf", basis="fir", order=14)
    assert filters.holds and np.sqrt(2) <= filters.norms["hinf"] <= np.sqrt(2) * 1.01


def test_mixed_objective_keeps_the_peak_and_pays_in_variance():
    colored = control.tf([1, 0.9], [1, 0], DT)
    free = simple(weight=colored, order=8)
    limit = 0.9 * free.norms["hinf"]
    bound = simple(weight=colored, order=8, objective="mixed", hinf_limit=limit)
    assert bound.holds and bound.norms["hinf"] <= limit
    assert free.norms["h2"] <= bound.norms["h2"] <= bound.norms["h2_uncoupled"]


def test_improvement_limit_is_kept():
    filters = simple(improvement_limit=1.5, order=8)
    assert filters.holds and max(filters.norms["improvement_1"], filters.norms["improvement_2"]) <= 1.5
    assert max(simple(order=8).norms[f"improvement_{k}"] for k in (1, 2)) > 1.5


def test_master_slave_leaves_the_other_filter_zero():
    filters = simple(couple=("X",), order=10)
    assert filters.holds and filters.norms["Y"] == 0 and not filters.Y.nstates and filters.norms["X"] > 0
    # Its share of the variance is the innovation, the other's is untouched.
    alone = control.tf([1, 0], [1, 0.3], DT) * control.tf([1, 0], [1, -0.6], DT)
    h = impulse(control.ss(alone), 2000)
    assert filters.norms["h2"] ** 2 == pytest.approx(1 + (h**2).sum(), rel=1e-4)


def test_continuous_time():
    P, C = control.tf([1.0], [1, 1, 0]), control.tf([4.0, 2.0], [0.02, 1])
    noise = control.tf([1.0], [1, 0.5])
    filters = rt.coupling.synthesize(P, P, C, C, disturbances=(noise, noise), weight=control.tf([1], [1, 1]), order=8,
                                     cutoff=200.0)
    assert filters.holds and filters.X.dt == 0
    assert filters.norms["h2"] < 0.5 * filters.norms["h2_uncoupled"]
    assert np.all(np.linalg.eigvals(filters.X_hat.A).real < 0)


@pytest.mark.parametrize("extra", [[], [2.0]])
def test_least_peak_in_continuous_time_is_what_the_wrong_side_zero_leaves(extra):
    """X vanishes at the zero of P1 at 2 rad/s, so the peak of (1+X) S2 W2 is at least |S2 W2| there; 5 % above it."""
    s, noise, C = control.tf("s"), control.tf([1.0], [1.0, 1.0]), control.tf([0.5], [1.0, 1.0])
    P = (2 - s) / (s + 3) / (s + 1)
    for pole in extra:
        P = P / (s + pole)
    least = abs((noise / (1 + P * C))(2.0))
    filters = rt.coupling.synthesize(P, P, C, C, disturbances=(0, noise), objective="hinf", couple=("X",))
    assert filters.holds and least < filters.norms["hinf"] <= 1.05 * least
    assert abs(filters.X(2.0)) < 1e-9


def test_limits_that_cannot_be_met_are_a_result_with_the_smallest_possible_value():
    filters = simple(objective="mixed", hinf_limit=1.0, order=10)
    assert not filters.holds and filters.outcome.code == "infeasible"
    assert "hinf_limit = 1 is below" in filters.outcome.text and "1.4" in filters.outcome.text
    assert filters.norms["X"] == filters.norms["Y"] == 0
    beyond = simple(improvement_limit=0.9, order=6)
    assert not beyond.holds and "improvement_limit = 0.9 is below" in beyond.outcome.text


@pytest.mark.parametrize(("options", "word"), [
    ({"objective": "h1"}, "objective"), ({"basis": "kautz"}, "basis"), ({"order": 0}, "order"),
    ({"order": 2.5}, "order"), ({"margin": 1.0}, "margin"), ({"margin": -0.1}, "margin"),
    ({"margin": np.nan}, "margin"),
    ({"objective": "mixed"}, "hinf_limit"), ({"hinf_limit": 1.0}, "hinf_limit"), ({"msd_limit": 1.2}, "window"),
    ({"objective": "hinf", "window": 0.01}, "window"), ({"couple": ("Z",)}, "couple"), ({"couple": ()}, "couple"),
    ({"improvement_limit": 0.0}, "improvement_limit"), ({"improvement_limit": np.inf}, "improvement_limit"),
    ({"pole": 1.2}, "not stable"), ({"window": 0.01, "weight": control.tf([1], [1, 0], DT)}, "weight")])
def test_options_that_make_no_sense(options, word):
    with pytest.raises(rt.InputError, match=word):
        simple(**options)


# The demo scanner


@pytest.fixture(scope="module")
def machine() -> rt.systems.Scanner:
    return rt.systems.scanner()


def design(machine: rt.systems.Scanner, **options) -> rt.coupling.Filters:
    return rt.coupling.synthesize(machine.P1, machine.P2, machine.C1, machine.C2, window=0.01, msd_limit=1.2,
                                  disturbances=machine.disturbances, **options)


@pytest.fixture(scope="module")
def nominal(machine) -> rt.coupling.Filters:
    return design(machine, order=12)


@pytest.fixture(scope="module")
def robust(machine) -> rt.coupling.Filters:
    return design(machine, uncertainty=list(machine.frf), order=14)


def improvement(filters: rt.coupling.Filters) -> tuple[float, float]:
    p = filters.performance
    return p.ma_before / p.ma_after, p.msd_after / p.msd_before


def test_scanner_is_what_it_says(machine):
    outside = [abs(z) > 1 for z in machine.P2.zeros()]
    assert sum(outside) == 2  # one of the half sample of delay, one in the right half plane of the machine
    assert sum(abs(z) > 1 for z in machine.P1.zeros()) == 1
    for P1, P2 in [(machine.P1, machine.P2), *machine.plants]:
        for P, C in ((P1, machine.C1), (P2, machine.C2)):
            assert np.abs(control.feedback(1, P * C).poles()).max() < 1 - 1e-3


def test_scanner_delay_is_one_and_a_half_samples(machine):
    # At low frequency: rigid body, hold and delay, together a phase of two samples (half of it the hold).
    omega = 2 * np.pi * 2.0
    phase = np.angle(-machine.P1(np.exp(1j * omega * machine.sample_time)))
    assert -phase == pytest.approx(omega * 2.0 * machine.sample_time, rel=1e-2)


def test_nominal_reach(nominal):
    better, spread = improvement(nominal)
    assert nominal.holds and better >= 3.5 and spread <= 1.2
    assert 400e-12 < nominal.performance.ma_before < 800e-12 and 2e-9 < nominal.performance.msd_before < 4e-9
    assert nominal.requested["ma"] == pytest.approx(nominal.performance.ma_after, rel=1e-6)


def test_robust_reach(robust):
    better, spread = improvement(robust)
    assert robust.holds and robust.robustly_stable and better >= 2.8 and spread <= 1.2
    assert robust.norms["robust"] <= 0.9


def test_certificates_verify(robust):
    kinds = [certificate.kind for certificate in robust.certificates]
    assert {"stability", "hinf", "frequency"} <= set(kinds)
    assert all(rt.verify(certificate).valid for certificate in robust.certificates)


def test_controller_that_is_stable_as_well(machine):
    filters = design(machine, uncertainty=list(machine.frf), stable_controller=True, order=10)
    better, spread = improvement(filters)
    assert filters.holds and filters.controller_stable and filters.norms["XY"] < 1
    assert better >= 2.8 and spread <= 1.2 and filters.norms["robust"] <= 0.9
    own = np.concatenate([machine.C1.poles(), machine.C2.poles()])
    assert np.sum(np.abs(filters.controller.poles()) >= 1 - 1e-9) == np.sum(np.abs(own) >= 1 - 1e-9)


def closed_loop(P1: control.StateSpace, P2: control.StateSpace, K: control.StateSpace) -> np.ndarray:
    """Poles of the loop with e = -P K e."""
    loop = control.append(P1, P2) * K
    return np.linalg.eigvals(loop.A - loop.B @ np.linalg.solve(np.eye(2) + loop.D, loop.C))


def test_robust_filters_stabilize_every_pair_of_measured_plants(machine, robust):
    # Reticle at one position and wafer at another are under the envelope too.
    assert len(machine.plants) > 1
    for P1, _ in machine.plants:
        for _, P2 in machine.plants:
            assert np.abs(closed_loop(P1, P2, robust.controller)).max() < 1


def test_nominal_filters_do_not(machine, nominal):
    radii = [np.abs(closed_loop(P1, P2, nominal.controller)).max() for P1, P2 in machine.plants]
    assert np.abs(closed_loop(machine.P1, machine.P2, nominal.controller)).max() < 1 < max(radii)


def test_an_uncertainty_too_large_for_two_ways_leaves_one(machine):
    measured = rt.coupling.dual_youla(list(machine.frf), (machine.P1, machine.P2), (machine.C1, machine.C2))
    huge = replace(measured, samples=1e4 * measured.samples, envelope=1e4 * measured.envelope)
    filters = design(machine, uncertainty=huge, order=6)
    assert filters.holds and filters.norms["robust"] < 1e-6 and improvement(filters)[0] > 1.3
    assert [filters.norms["X"] > 0, filters.norms["Y"] > 0] == [True, False]


def test_spread_limit_that_cannot_be_met(machine):
    filters = rt.coupling.synthesize(machine.P1, machine.P2, machine.C1, machine.C2, window=0.01, msd_limit=0.2,
                                     disturbances=machine.disturbances, order=6)
    assert not filters.holds and filters.outcome.code == "infeasible"
    assert "msd_limit = 0.2 is below" in filters.outcome.text
    assert filters.performance.ma_after == filters.performance.ma_before


# Worst case


def test_worst_case_is_that_of_the_perturbed_loop_itself(machine, robust):
    found = rt.coupling.worst_case(robust)
    picked = [np.argmin(abs(found.omega - 2 * np.pi * f)) for f in (20, 100, 400, 580, 648, 1152, 2000)]
    assert np.all(np.isin(found.omega[picked], machine.frf[0].omega))
    z = np.exp(1j * found.omega[picked] * machine.sample_time)
    noise = np.array([W(z) for W in machine.disturbances])
    for k, (P1, P2) in enumerate(machine.plants):
        P = np.zeros((len(z), 2, 2), complex)
        P[:, 0, 0], P[:, 1, 1] = P1(z), P2(z)
        K = np.moveaxis(robust.controller(z), -1, 0)
        e12 = np.array([[-1.0, 1.0]]) @ np.linalg.inv(np.eye(2) + P @ K)
        assert np.allclose(found.after[k, picked], np.linalg.norm(e12[:, 0] * noise.T, axis=1), rtol=1e-6)
    assert np.all(found.after <= found.bound_after * (1 + 1e-9)) and np.all(np.isfinite(found.bound_after))
    assert np.all(found.before <= found.bound_before * (1 + 1e-9))
    assert found.ma_before[0] / found.ma_after[0] > 2 and "plant 5" in str(found)
    assert found.plot() is not None


def test_a_wider_margin_keeps_the_performance_on_every_measured_plant(machine):
    filters = design(machine, uncertainty=list(machine.frf), margin=0.8, order=12)
    found = rt.coupling.worst_case(filters)
    assert filters.holds and filters.norms["robust"] <= 0.2
    assert np.all(found.ma_before / found.ma_after >= 2.8)
    assert np.all(found.msd_after[:-1] <= 1.2 * found.msd_before[:-1])


def test_bound_of_worst_case_holds_for_every_phase_and_is_not_far_off(robust):
    problem = robust.problem
    omega = 2 * np.pi * np.array([50.0, 200.0, 400.0, 700.0])
    maps, envelope = _Maps.at(problem, robust, omega), problem.envelope(omega)
    bound, largest = maps.bound(envelope), np.zeros(4)
    for phases in rng(8).uniform(0, 2 * np.pi, (3000, 2, 2, 4)):
        largest = np.maximum(largest, maps.perturbed(np.moveaxis(envelope * np.exp(1j * phases), -1, 0)))
    assert np.all(largest <= bound) and np.all(largest > 0.75 * bound)


def test_a_perturbation_of_the_size_of_the_bound_destabilizes(machine, robust):
    found = rt.coupling.destabilizing(robust)
    assert found.scale == pytest.approx(1 / robust.norms["robust"], rel=0.05) and found.scale > 1
    problem, omega = robust.problem, np.array([found.omega])
    envelope = problem.envelope(omega)[:, :, 0]
    assert np.all(np.abs(found.delta) <= found.scale * envelope * (1 + 1e-9))
    delta_k = youla_parameter(problem, robust.X_hat, robust.Y_hat)
    z = np.exp(1j * found.omega * machine.sample_time)
    assert abs(np.linalg.det(np.eye(2) + found.delta @ delta_k(z))) < 1e-9
    # The same as a system: just stable when a little smaller, unstable when a little larger.
    for factor, stable in ((0.99, True), (1.01, False)):
        loop = factor * found.system * delta_k
        poles = np.linalg.eigvals(loop.A - loop.B @ np.linalg.solve(np.eye(2) + loop.D, loop.C))
        assert (np.abs(poles).max() < 1) == stable


def test_filters_that_are_not_robust_have_a_destabilizing_perturbation_inside_the_envelope(machine):
    bold = rt.coupling.evaluate(machine.P1, machine.P2, machine.C1, machine.C2, X_hat=-1, Y_hat=0.5,
                                uncertainty=list(machine.frf))
    assert not bold.robustly_stable and rt.coupling.destabilizing(bold).scale < 1


def test_worst_case_needs_an_uncertainty(nominal):
    with pytest.raises(rt.InputError, match="without an uncertainty"):
        rt.coupling.worst_case(nominal)
    with pytest.raises(rt.InputError, match="no perturbation"):
        rt.coupling.destabilizing(nominal)
