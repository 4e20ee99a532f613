"""V = eᵀPe by matrix inequalities, and uncertain parameters, against frozen eigenvalues and sampled Jacobians."""

import numpy as np
import pytest
from module_systems import constant, same

import robthermal as rt
from robthermal.conic import Form, largest_margin, strictly

BOX = (278.15, 358.15)


# errata, "Largest |I| certified", full-P LMI: symmetric 2.72; constant S, R 4.92 / 17.03 / 4.92
@pytest.mark.exhaustive
@pytest.mark.parametrize(("direction", "reference", "frozen"),
                         [("symmetric", 4.92, 4.93243), ("cooling", 17.03, 17.0433), ("heating", 4.92, 4.93243)])
def test_limits_of_the_errata_for_constant_modules(two, direction, reference, frozen):
    limit = rt.certify.largest_current(constant(two), temperature=BOX, direction=direction, method="lyapunov")
    assert limit.current == pytest.approx(reference, rel=0.01)
    assert limit.current <= frozen * 1.0001
    assert limit.certificate.evidence["method"] == "lyapunov"
    assert limit.certificate.holds and rt.verify(limit.certificate).valid


@pytest.mark.exhaustive
@pytest.mark.parametrize("structure", ["full", "block"])
def test_a_box_close_to_the_limit_of_the_errata(two, structure):
    cert = rt.certify.contraction(two, current=same(two, -2.69, 2.69), temperature=BOX, method="lyapunov",
                                  structure=structure)
    assert cert.holds and rt.verify(cert).valid and "given up" in cert.made_by["status"]
    beyond = rt.certify.contraction(two, current=same(two, -2.75, 2.75), temperature=BOX, method="lyapunov",
                                    structure=structure)
    assert beyond.holds is False and "no matrix P" in beyond.reason  # frozen eigenvalues: 2.73 A


def test_block_structure_is_the_one_of_the_thesis(two):
    cert = rt.certify.contraction(two, current=same(two, 0, 3), temperature=BOX, method="lyapunov", structure="block")
    P = np.array(cert.evidence["matrix"])
    hot, cold = range(8), range(12, 18)
    for face in range(8, 12):
        assert np.count_nonzero(P[face]) == 1
    assert not P[np.ix_(hot, cold)].any()


def sheared():
    """Two lumps, one module whose Seebeck slope makes J far from symmetric: V = eᵀEe fails before eigenvalues do."""
    module = {"hot": "h", "cold": "c", "reference_temperature": 300.0, "seebeck": {"value": 0.05, "slope": 3e-4},
              "resistance": {"value": 3.0, "slope": 0.0}, "conductance": {"value": 0.3, "slope": 0.0}}
    return rt.System(ambients={"room": {"temperature": 298.0}}, modules={"m": module},
                     lumps={"h": {"capacity": 2.0}, "c": {"capacity": 40.0}},
                     links=[{"between": ("h", "room"), "conductance": 1.0},
                            {"between": ("c", "room"), "conductance": 0.02}])


def test_a_matrix_reaches_where_stored_energy_does_not():
    system = sheared()
    limits = {method: rt.certify.largest_current(system, temperature=BOX, direction="cooling", method=method)
              for method in ("energy", "lyapunov")}
    assert limits["lyapunov"].current > 1.02 * limits["energy"].current
    assert limits["lyapunov"].certificate.holds
    assert max(growths(system, same(system, 0.0, limits["lyapunov"].current), {}, 4)) < 0


def growths(system, current, parameters, samples):
    """Largest frozen eigenvalues over box vertices, and parameter vertices and samples."""
    rng = np.random.default_rng(0)
    for _ in range(samples):
        chosen = {name: float(rng.choice(pair)) if rng.random() < 0.8 else float(rng.uniform(*pair))
                  for name, pair in parameters.items()}
        eq = rt.thermal.Equations(system.with_parameters(chosen))
        for _ in range(24):
            x = rng.choice(BOX, len(system.lumps))
            u = eq.nominal()
            first = len(system.inputs)
            u[first:first + len(system.modules)] = [rng.choice(pair) for pair in current.values()]
            yield np.linalg.eigvals(eq.jacobian(x, u).toarray() / eq.capacity[:, None]).real.max()


UNCERTAIN = {"modules.m1.conductance.value": (0.267, 0.327), "modules.m2.seebeck.value": (0.05, 0.058),
             "links.x1-room.conductance": (0.6, 0.8), "lumps.x9.capacity": (4.0, 5.5)}


@pytest.mark.exhaustive
@pytest.mark.parametrize("method", ["energy", "sum", "max", "lyapunov"])
def test_every_machine_in_the_ranges_decays_as_claimed(two, method):
    ranges = {name: pair for name, pair in UNCERTAIN.items() if method != "lyapunov" or "capacity" not in name}
    current = same(two, 0.0, 2.0)
    cert = rt.certify.contraction(two, current=current, temperature=BOX, method=method, parameters=ranges)
    sharp = rt.certify.contraction(two, current=current, temperature=BOX, method=method)
    assert cert.holds and rt.verify(cert).valid
    assert 0 < float(cert.evidence["rate"]) < float(sharp.evidence["rate"])
    assert all(name in cert.claim for name in ranges)
    assert max(growths(two, current, ranges, 20)) <= -float(cert.evidence["rate"])


@pytest.mark.parametrize("method", ["energy", "sum", "max", "lyapunov"])
def test_uncertain_machines_that_may_run_away_are_not_certified(method):
    system = sheared()
    current = {"m": (0.0, 0.9 * rt.certify.largest_current(system, temperature=BOX, direction="cooling").current)}
    ranges = {"links.h-room.conductance": (0.3, 1.0), "modules.m.seebeck.value": (0.05, 0.06)}
    assert max(growths(system, current, ranges, 20)) > 0  # one of the machines does
    cert = rt.certify.contraction(system, current=current, temperature=BOX, method=method, parameters=ranges)
    assert not cert.holds and not rt.verify(cert).valid


@pytest.mark.exhaustive
def test_random_uncertain_machines():
    """Never certified when a sampled machine of the ranges is unstable, for any method."""
    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(40):
        module = {"hot": "x0", "cold": "x1", "reference_temperature": 300.0,
                  "seebeck": {"value": 0.05, "slope": rng.uniform(-2e-4, 2e-4)},
                  "resistance": {"value": 3.0, "slope": rng.uniform(-0.02, 0.03)},
                  "conductance": {"value": 0.3, "slope": rng.uniform(-1e-3, 1e-3)}}
        system = rt.System(
            ambients={"room": {"temperature": 298.0}}, modules={"m": module},
            lumps={f"x{i}": {"capacity": rng.uniform(1, 50)} for i in range(3)},
            links=[{"between": ("x0", "x2"), "conductance": rng.uniform(0.5, 3)},
                   {"between": ("x2", "room"), "conductance": rng.uniform(0.3, 2)},
                   {"between": ("x1", "room"), "conductance": rng.uniform(0.02, 0.3)}])
        names = ["links.x0-x2.conductance", "links.x2-room.conductance", "modules.m.seebeck.value",
                 "modules.m.resistance.slope", "modules.m.conductance.value", "modules.m.seebeck.slope"]
        ranges = {}
        for name in rng.choice(names, 3, replace=False):
            value = system.parameter(str(name))
            ranges[str(name)] = tuple(sorted((value * rng.uniform(0.5, 1), value * rng.uniform(1, 1.5))))
        top = rng.uniform(1, 10)
        method = ("energy", "sum", "max", "lyapunov")[rng.integers(4)]
        current = {"m": (0.0, top)}
        cert = rt.certify.contraction(system, current=current, temperature=BOX, method=method, parameters=ranges)
        unstable = max(growths(system, current, ranges, 5)) >= 0
        assert not (cert.holds and unstable), cert.claim
        seen.add((cert.holds, unstable))
    assert {(True, False), (False, True)} <= seen


def test_solver_margin_is_an_identity_and_not_a_constant_matrix():
    n = 3
    column = strictly(np.zeros((6, 1)), 2.0)[:, -1]
    assert np.count_nonzero(column) == n and set(column) == {0.0, -2.0}
    A = np.array([[-1.0, 5.0], [0.0, -0.1]])
    found = largest_margin([Form(((np.eye(2), -A),))], np.ones((2, 2), bool))
    assert np.linalg.eigvalsh(-(found.matrix @ A + A.T @ found.matrix)).min() == pytest.approx(found.margin, rel=1e-3)


def test_unstable_matrices_leave_no_margin():
    found = largest_margin([Form(((np.eye(2), np.eye(2)),)), Form(((np.eye(2), -np.eye(2)),))], np.ones((2, 2), bool))
    assert found.margin < 0


def big(n=41):
    return rt.System(ambients={"room": {"temperature": 298.0}}, lumps={f"x{i}": {"capacity": 1.0} for i in range(n)},
                     links=[{"between": (f"x{i}", "room"), "conductance": 1.0} for i in range(n)])


@pytest.mark.parametrize(("arguments", "message"), [
    ({"structure": "diagonal"}, "argument structure"),
    ({"parameters": {"modules.m1.reference_temperature": (300, 310)}}, "argument parameters"),
    ({"parameters": {"modules.m1.conductance.value": (0.3, 0.4)}}, "excludes the system's own value"),
    ({"parameters": {"links.x1-x3.conductance": (-1.0, 9.0)}}, "positive"),
    ({"parameters": {"links.x1-x3.conductance": (9.0, 1.0)}}, "lower <= upper")])
def test_bad_choices_are_refused(two, arguments, message):
    with pytest.raises(rt.InputError, match=message):
        rt.certify.contraction(two, current=same(two, 0, 1), temperature=BOX, method="lyapunov", **arguments)


def test_a_dense_inequality_beyond_forty_lumps_is_a_choice():
    with pytest.raises(rt.InputError, match="large=True"):
        rt.certify.contraction(big(), current={}, temperature=BOX, method="lyapunov")
    assert rt.certify.contraction(big(), current={}, temperature=BOX, method="lyapunov", large=True).holds


def test_uncertain_capacities_are_not_for_a_full_matrix(two):
    cert = rt.certify.contraction(two, current=same(two, 0, 1), temperature=BOX, method="lyapunov",
                                  parameters={"lumps.x9.capacity": (4.0, 5.0)})
    assert not cert.holds and "needs method" in cert.reason
