"""Certificates against the errata's reference table, frozen eigenvalues, and systems that must not be certified."""

from itertools import product

import numpy as np
import pytest
from module_systems import constant
from scipy.sparse import csr_array, diags_array

import robthermal as rt

BOX = (278.15, 358.15)
# errata, "Largest |I| certified on the 18-lump setup": symmetric, cooling, heating
TABLE = {
    ("varying", "energy"): (2.72, 5.51, 2.72), ("varying", "sum"): (2.54, 5.54, 2.72),
    ("varying", "max"): (2.18, 5.22, 2.62),
    ("constant", "energy"): (4.93, 17.04, 4.93), ("constant", "sum"): (4.10, 13.5, 4.58),
    ("constant", "max"): (4.10, 13.5, 4.58)}
FROZEN = {"varying": (2.73, 5.55, 2.73), "constant": (4.94, 17.05, 4.94)}
DIRECTIONS = ("symmetric", "cooling", "heating")


@pytest.fixture(scope="module")
def systems():
    two = rt.systems.two_module()
    return {"varying": two, "constant": constant(two)}


@pytest.mark.parametrize(("kind", "method"), TABLE)
@pytest.mark.parametrize("column", range(3))
def test_reference_table_within_one_percent(systems, kind, method, column):
    limit = rt.certify.largest_current(systems[kind], temperature=BOX, direction=DIRECTIONS[column], method=method)
    assert limit.current == pytest.approx(TABLE[kind, method][column], rel=0.01)
    assert limit.current <= FROZEN[kind][column]
    assert limit.certificate.holds is True and limit.outcome.ok
    assert rt.verify(limit.certificate).valid


@pytest.mark.parametrize("method", rt.certify._contraction.METHODS)
def test_beyond_the_limit_nothing_is_certified(systems, method):
    cert = rt.certify.contraction(systems["varying"], current={"m1": (0, 6.0), "m2": (0, 6.0)}, temperature=BOX,
                                  method=method)
    assert cert.holds is False and cert.reason and cert.claim.startswith("Not certified")
    assert not rt.verify(cert).valid


def random_system(rng):
    n = int(rng.integers(2, 7))
    links = [{"between": (f"x{i}", f"x{i + 1}"), "conductance": rng.uniform(0.1, 5)} for i in range(n - 1)]
    links += [{"between": (f"x{i}", "room"), "conductance": rng.uniform(0.01, 1)}
              for i in range(n) if rng.random() < 0.6]
    links.append({"between": ("x0", "room"), "conductance": rng.uniform(0.05, 1), "name": "sure"})
    a, b = (int(i) for i in rng.choice(n, 2, replace=False))
    module = {"hot": f"x{a}", "cold": f"x{b}", "reference_temperature": 300.0,
              "seebeck": {"value": 0.05, "slope": rng.uniform(-3e-4, 3e-4)},
              "resistance": {"value": 3.0, "slope": rng.uniform(-0.03, 0.03)},
              "conductance": {"value": 0.3, "slope": rng.uniform(-2e-3, 2e-3)}}
    return rt.System(ambients={"room": {"temperature": 298.0}}, links=links, modules={"m": module},
                     lumps={f"x{i}": {"capacity": rng.uniform(1, 50)} for i in range(n)})


def frozen_growth(system, current):
    """Largest eigenvalue of frozen Jacobians over a sample of the box: a lower bound of the truth."""
    eq = rt.thermal.Equations(system)
    module = system.modules["m"]
    h, c = (system.lump_names.index(x) for x in (module.hot, module.cold))
    worst = -np.inf
    for Th, Tc, amps in product(np.linspace(*BOX, 4), np.linspace(*BOX, 4), np.linspace(*current, 7)):
        x = np.full(len(system.lumps), 300.0)
        x[h], x[c] = Th, Tc
        J = eq.jacobian(x, np.array([amps, 298.0])).toarray() / eq.capacity[:, None]
        worst = max(worst, np.linalg.eigvals(J).real.max())
    return worst


@pytest.fixture(scope="module")
def population():
    """60 random systems, a range of currents for each, and the largest growth rate of its frozen Jacobians [1/s]."""
    rng, found = np.random.default_rng(5), []
    for _ in range(60):
        system = random_system(rng)
        limit = rng.uniform(2, 40)
        current = ((-limit, limit), (0, limit), (-limit, 0))[rng.integers(3)]
        found.append((system, current, frozen_growth(system, current)))
    return found


@pytest.mark.exhaustive
@pytest.mark.parametrize("method", rt.certify._contraction.METHODS)
def test_no_random_system_with_an_unstable_frozen_jacobian_is_certified(method, population):
    unstable = certified = 0
    for system, current, growth in population:
        cert = rt.certify.contraction(system, current={"m": current}, temperature=BOX, method=method)
        assert not (cert.holds and growth >= 0), (growth, cert.claim)
        unstable += growth >= 0
        certified += cert.holds
        assert rt.verify(cert).valid == cert.holds
    assert unstable > 10 and certified > 10  # both kinds occurred


def test_runaway_of_the_errata(systems):
    for celsius, current, load in ((5, 1.51, 3.75), (15, 1.54, 6.45), (25, 1.56, 9.18)):
        limit = rt.certify.runaway(systems["varying"], setpoint={"m1": celsius + 273.15, "m2": celsius + 273.15})
        assert np.mean(list(limit.current.values())) == pytest.approx(current, rel=0.01)
        assert list(limit.load.values()) == pytest.approx([load, load], rel=0.01)
        for cert in limit.certificates.values():
            assert cert.holds and rt.verify(cert).valid


def test_runaway_of_a_cascade_whose_stages_both_hold_their_cold_faces():
    """The lower stage holds the hot face of the upper one: its heat S x I - R I²/2 - K dT peaks at S x / R."""
    stage = {"seebeck": 0.03, "resistance": 1.5, "conductance": 0.25}
    modules = {"top": {"hot": "b", "cold": "a", **stage}, "bottom": {"hot": "c", "cold": "b", **stage}}
    cascade = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={name: {"capacity": 20.0} for name in "abc"},
                        links=[{"between": ("c", "room"), "conductance": 6.0}], modules=modules)
    limit = rt.certify.runaway(cascade, setpoint={"top": 270.0, "bottom": 283.0})
    assert limit.closed_form["top"] == pytest.approx(0.03 * 270.0 / 1.5)
    currents = np.linspace(0.0, 20.0, 200001)
    hot = (6.0 * 295.0 + 0.75 * currents**2 + 0.25 * 283.0) / (6.25 - 0.03 * currents)  # of the lower stage
    taken = np.where(hot > 0.0, 0.03 * 283.0 * currents - 0.75 * currents**2 - 0.25 * (hot - 283.0), -np.inf)
    assert limit.current["bottom"] == pytest.approx(currents[taken.argmax()], abs=1e-3)
    assert limit.load["bottom"] == pytest.approx(taken.max(), rel=1e-6)
    assert list(limit.certificates) == ["bottom"] and rt.verify(limit.certificates["bottom"]).valid


def test_invariance_is_refused_where_the_simulation_leaves_the_box(systems):
    ranges = {"m1": (0.0, 1.5), "m2": (0.0, 1.5)}
    refused = rt.certify.invariance(systems["varying"], current=ranges, temperature=BOX)
    assert not refused.holds and "x" in refused.reason
    n = 2000
    record = rt.Record(sample_time=1.0, inputs=np.tile([1.5, 1.5, 298.15], (n, 1)), outputs=np.zeros((n, 0)),
                       input_names=["m1", "m2", "room"], output_names=[])
    assert rt.thermal.trajectory(systems["varying"], record).lumps.min() < BOX[0]  # it was right to refuse


def test_a_box_that_would_reach_below_150_K_is_not_certified_and_says_so():
    """No certificate is made below 150 K; the claim fails, the input is not bad."""
    weak = rt.System(ambients={"room": {"temperature": 295.0}},
                     lumps={"c": {"capacity": 20.0}, "h": {"capacity": 90.0}},
                     links=[{"between": ("h", "room"), "conductance": 9.0},
                            {"between": ("c", "room"), "conductance": 0.1}],
                     modules={"m": {"hot": "h", "cold": "c", "seebeck": 0.05, "resistance": 0.2, "conductance": 0.05}})
    found = [rt.certify.runaway_free(weak, current={"m": (0.0, top)}) for top in (0.1, 4.0)]
    assert [one.holds for one in found] == [True, False]
    assert "below 150 K" in found[1].invariance.reason and rt.verify(found[0].invariance).valid


def test_no_simulation_leaves_a_certified_box(systems):
    ranges = {"m1": (-0.5, 1.5), "m2": (-0.5, 1.5)}
    safe = rt.certify.runaway_free(systems["varying"], current=ranges, ambient={"room": (293.15, 303.15)})
    assert safe.holds
    low, high = (np.array([pair[side] for pair in safe.temperature.values()]) for side in (0, 1))
    rng = np.random.default_rng(0)
    for _ in range(6):
        dwell = int(rng.integers(20, 900))
        n = 3600
        levels = rng.uniform([-0.5, -0.5, 293.15], [1.5, 1.5, 303.15], (n // dwell + 1, 3))
        extreme = rng.random(levels.shape) < 0.5
        levels[extreme] = np.where(rng.random(levels.shape) < 0.5, [-0.5, -0.5, 293.15], [1.5, 1.5, 303.15])[extreme]
        record = rt.Record(sample_time=1.0, inputs=np.repeat(levels, dwell, axis=0)[:n], outputs=np.zeros((n, 0)),
                           input_names=["m1", "m2", "room"], output_names=[])
        lumps = rt.thermal.trajectory(systems["varying"], record, initial=rng.uniform(low, high)).lumps
        assert (lumps >= low).all() and (lumps <= high).all()


def test_currents_without_a_box_are_an_honest_no(systems):
    safe = rt.certify.runaway_free(systems["varying"], current={"m1": (-3.3, 3.3), "m2": (-3.3, 3.3)})
    assert not safe.holds and safe.outcome.code == "not_certified" and not safe.temperature


def chain(n=50, loss=0.1):
    A = diags_array([np.ones(n - 1), -2 * np.ones(n), np.ones(n - 1)], offsets=[-1, 0, 1]).tolil()
    A[0, 0], A[-1, -1] = -1 - loss, -1
    return np.linspace(1, 3, n), csr_array(A)


@pytest.mark.parametrize("method", ["max", "sum"])
def test_network_rate_is_below_the_slowest_pole(method):
    E, A = chain()
    cert = rt.certify.network(E, A, method=method)
    slowest = np.linalg.eigvals(A.toarray() / E[:, None]).real.max()
    assert cert.holds and rt.verify(cert).valid
    assert 0 < cert.evidence["rate"] <= -slowest


def test_network_names_the_lumps_that_float():
    E, A = chain(6)
    A = A.tolil()
    A[2, 3] = A[3, 2] = 0.0
    A[2, 2], A[3, 3], A[5, 5] = -1.0, -1.0, -1.0
    with pytest.raises(rt.InputError, match="3, 4, 5"):
        rt.certify.network(E, csr_array(A))


def test_unstable_network_is_not_certified():
    E, A = chain(6)
    A = A.tolil()
    A[0, 0] = 0.5
    cert = rt.certify.network(E, csr_array(A))
    assert cert.holds is False and cert.reason


def test_networks_agree_with_eigenvalues_on_random_metzler_matrices():
    rng = np.random.default_rng(1)
    seen = set()
    for _ in range(200):
        n = int(rng.integers(2, 8))
        A = rng.uniform(0, 1, (n, n)) * (rng.random((n, n)) < 0.6)
        np.fill_diagonal(A, -rng.uniform(0.2, 3, n))
        E = rng.uniform(0.5, 5, n)
        stable = bool(np.linalg.eigvals(A / E[:, None]).real.max() < 0)
        assert rt.certify.network(E, csr_array(A)).holds == stable
        seen.add(stable)
    assert seen == {True, False}


@pytest.mark.parametrize(("arguments", "message"), [
    ({"current": {"m1": (0, 1)}}, "'m2' has no range"), ({"current": {"m1": (0, 1), "m2": (1, 0)}}, "lower <= upper"),
    ({"temperature": (5.0, 85.0)}, "degrees Celsius"), ({"method": "lmi"}, "argument method"),
    ({"current": {"m1": (0, 1), "m2": (0, 1), "m3": (0, 1)}}, "no module 'm3'"),
    ({"temperature": {"x1": (280, 300)}}, "has no range"), ({"current": 3.0}, "argument current")])
def test_bad_boxes_are_refused(arguments, message):
    good = {"current": {"m1": (0, 1), "m2": (0, 1)}, "temperature": BOX, "method": "energy"}
    with pytest.raises(rt.InputError, match=message):
        rt.certify.contraction(rt.systems.two_module(), **{**good, **arguments})


@pytest.mark.parametrize(("E", "A", "message"), [
    ([1.0, 1.0], [[-1.0, -0.1], [0.0, -1.0]], "Metzler"), ([1.0, -1.0], [[-1.0, 0.0], [0.0, -1.0]], "positive finite"),
    ([1.0], [[-1.0, 0.0], [0.0, -1.0]], "like E"), ([1.0, 1.0], [[-1.0, np.nan], [0.0, -1.0]], "finite numbers")])
def test_bad_networks_are_refused(E, A, message):
    with pytest.raises(rt.InputError, match=message):
        rt.certify.network(E, csr_array(np.array(A)))
