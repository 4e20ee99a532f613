"""One current law for a box: known numbers, Monte Carlo with an own integrator, what must not be certified."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace

import certificate_truth as truth
import cvxpy as cp
import numpy as np
import pytest
from scipy.optimize import nnls

import recheck
import robthermal as rt
from robthermal.design._tem_hull import control_points
from robthermal.errors import InputError
from robthermal.verification import Certificate, establish, verify

GCC = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
BOX = {"temperature": (265.0, 335.0), "current": (0.2, 1.8)}


def stage(slope=0.0, **changes):
    """Plate, module and sink: lumps 60, 12 and 90 J/K; links 5, 4 and 0.15 W/K."""
    module = {"hot": "sink", "cold": "module", "seebeck": {"value": 0.052, "slope": 1e-4 * slope},
              "resistance": {"value": 2.1, "slope": 8e-3 * slope}, "conductance": {"value": 0.5, "slope": 1e-3 * slope},
              "reference_temperature": 298.0}
    links = [{"between": ("plate", "module"), "conductance": 5.0}, {"between": ("sink", "room"), "conductance": 4.0},
             {"between": ("plate", "room"), "conductance": 0.15, **changes}]
    return rt.System(ambients={"room": {"temperature": 298.0}}, links=links, modules={"m": module},
                     lumps={"plate": {"capacity": 60.0}, "module": {"capacity": 12.0}, "sink": {"capacity": 90.0}})


@pytest.fixture(scope="module")
def designed():
    return rt.design.tem_feedback(stage(), **BOX, operating=1.0, rate=0.012)


def second(certificate):
    keys = ("format", "kind", "claim", "system", "region", "evidence", "margin", "made_by")
    return recheck.check({key: getattr(certificate, key) for key in keys}).status


def boundary(d, rng, count):
    """Starts on the boundary of the ellipsoid."""
    root = np.linalg.cholesky(np.linalg.inv(d.matrix))
    u = rng.standard_normal((count, len(d.matrix)))
    x0 = np.array(list(d.operating_temperatures.values()))
    return x0 + np.sqrt(d.level) * (u / np.linalg.norm(u, axis=1)[:, None]) @ root.T


def run(d, x, disturbance, seconds, steps):
    """Temperatures (steps + 1, n_lumps) of the nonlinear network under the law, classical Runge-Kutta."""
    section = d.certificates[0].system
    E = np.array([lump["capacity"] for lump in section["lumps"].values()])
    h, found = seconds / steps, [x]

    def slope(t, x):
        currents = dict(zip(section["modules"], d.current(x), strict=True))
        room, load = disturbance(t)
        return truth.heat(section, x, currents, {"room": room}, load) / E

    for k in range(steps):
        t = k * h
        a = slope(t, x)
        b = slope(t + h / 2, x + h / 2 * a)
        c = slope(t + h / 2, x + h / 2 * b)
        x = x + h / 6 * (a + 2 * b + 2 * c + slope(t + h, x + h * c))
        found.append(x)
    return np.array(found)


def test_a_form_that_varies_with_the_temperatures_cannot_give_more(designed):
    """The corner of 1.8 A alone, written in cvxpy as one linear plant, allows no larger ball: why none is designed."""
    system, rate = stage(), 0.012
    x0 = np.array(list(designed.operating_temperatures.values()))
    room = np.minimum(x0 - 265.0, 335.0 - x0)
    balls = []
    for corner in rt.design.tem_polytope(system, **BOX):
        W, Y, ball = cp.Variable((3, 3), symmetric=True), cp.Variable((1, 3)), cp.Variable()
        moved = corner.A @ W + corner.B @ Y
        kept = [W >> ball * np.eye(3), cp.diag(W) <= room**2, moved + moved.T + 2 * rate * W << 0,
                cp.bmat([[0.64 * np.eye(1), Y], [Y.T, W]]) >> 0]
        cp.Problem(cp.Maximize(ball), kept).solve(solver="CLARABEL")
        balls.append(float(np.sqrt(ball.value)))
    assert designed.semi_axes[0] <= min(balls) <= 1.001 * designed.semi_axes[0]
    assert max(balls) > 1.1 * min(balls)  # it is one corner, not all of them
    varying = rt.design.tem_feedback(system, operating=1.0, rate=rate, method="parameter_dependent", **BOX)
    stated = re.search(r"keeps at most ([\d.]+) K", varying.outcome.text)
    assert stated is not None and float(stated[1]) == pytest.approx(min(balls), rel=1e-3)
    assert varying.holds and np.allclose(varying.gain, designed.gain)


def test_numbers_of_the_contract(designed):
    """Smallest semi-axis 9.7 K at 0.012 1/s, where the loop without feedback has 0.0086 1/s."""
    free = max(np.linalg.eigvals(designed.plants[0].A).real)
    assert free == pytest.approx(-0.0086, abs=3e-4) and designed.rate == 0.012 and designed.value == -0.012
    assert designed.holds and designed.semi_axes[0] >= 9.7 and designed.level == 1.0
    certificate = designed.certificates[0]
    assert verify(certificate).valid and second(certificate) == "valid"
    assert np.array_equal(certificate.system["gain"], designed.gain)
    assert certificate.region["temperature"] == [265.0, 335.0] and certificate.region["offset"] <= 1e-6
    assert designed.controller.input_labels == ["plate", "module", "sink"]
    assert designed.margins["m"]["gain"] > 2 and "semi-axes" in str(designed)


def test_every_start_on_the_boundary_stays_and_decays(designed):
    rest = np.array(list(designed.operating_temperatures.values()))
    starts = boundary(designed, np.random.default_rng(0), 12)
    assert len(starts) == 12
    for x in starts:
        path = run(designed, x, lambda t: (298.0, {}), 150.0, 150) - rest
        V = np.einsum("ti,ij,tj->t", path, designed.matrix, path)
        assert V[0] == pytest.approx(designed.level)
        assert (V <= V[0] * np.exp(-2 * designed.rate * np.arange(151)) * (1 + 1e-6)).all()
        assert np.abs(path + rest - 300).max() < 35
        wanted = 1 + path @ designed.gain[0]
        assert 0.2 <= wanted.min() and wanted.max() <= 1.8


def test_disturbances_in_their_ranges_do_not_push_it_out():
    d = rt.design.tem_feedback(stage(), **BOX, operating=1.0, rate=0.012, ambient={"room": (296.5, 299.5)},
                               heat={"plate": (-0.3, 0.3)})
    assert d.holds and "constant or not" in d.certificates[0].claim and second(d.certificates[0]) == "valid"
    rng, rest = np.random.default_rng(1), np.array(list(d.operating_temperatures.values()))
    for x in boundary(d, rng, 8):
        signs = rng.choice([-1.0, 1.0], (20, 2))

        def outside(t, signs=signs):
            room, load = signs[int(t // 20) % 20]
            return 298 + 1.5 * room, {"plate": 0.3 * load}

        path = run(d, x, outside, 300.0, 100) - rest
        assert np.einsum("ti,ij,tj->t", path, d.matrix, path).max() <= d.level * (1 + 1e-6)


def test_uncertain_parameters_are_covered():
    ranges = {"modules.m.seebeck.value": (0.0505, 0.0535), "links.sink-room.conductance": (3.8, 4.2)}
    d = rt.design.tem_feedback(stage(), **BOX, operating=1.0, rate=0.012, covariance=ranges)
    assert d.holds and "for all values of 2 parameters" in d.certificates[0].claim
    assert second(d.certificates[0]) == "valid" and 0.5 < d.certificates[0].region["offset"] <= 10
    rest = np.array(list(d.operating_temperatures.values()))
    for S, g in ((0.0505, 3.8), (0.0535, 4.2), (0.0505, 4.2), (0.0535, 3.8)):
        other = stage().with_parameters({"modules.m.seebeck.value": S, "links.sink-room.conductance": g})
        here = rt.thermal.steady_state(other, {"m": 1.0}).equilibria[0]
        assert here.stable
        changed = replace(d.certificates[0], system={**d.certificates[0].system, **{
            "modules": {"m": {**d.certificates[0].system["modules"]["m"], "seebeck": {"value": S, "slope": 0.0}}},
            "links": [{**link, "conductance": g} if link["name"] == "sink-room" else link
                      for link in d.certificates[0].system["links"]]}})
        for x in boundary(d, np.random.default_rng(2), 1):
            path = run(replace(d, certificates=[changed]), x, lambda t: (298.0, {}), 300.0, 80)
            e = path - rest
            assert np.einsum("ti,ij,tj->t", e, d.matrix, e).max() <= d.level * (1 + 1e-6)
            assert np.abs(e[-1]).max() <= d.certificates[0].region["offset"]


@pytest.mark.parametrize(("slope", "link"), [(1.0, {}), (1.0, {"natural": {"gain": 0.05, "exponent": 0.25}}),
                                             (0.0, {"radiation": 3e-9})])
def test_slopes_convection_and_radiation(slope, link):
    d = rt.design.tem_feedback(stage(slope, **link), **BOX, operating=1.0, rate=0.01)
    assert d.holds and second(d.certificates[0]) == "valid"
    rest = np.array(list(d.operating_temperatures.values()))
    for x in boundary(d, np.random.default_rng(3), 3):
        path = run(d, x, lambda t: (298.0, {}), 150.0, 75) - rest
        V = np.einsum("ti,ij,tj->t", path, d.matrix, path)
        assert (V <= V[0] * np.exp(-2 * d.rate * 2 * np.arange(76)) * (1 + 1e-6)).all()


def test_control_points_hold_every_slope():
    """Support functions in random directions, of sampled slopes by complex differences and of the points."""
    system = stage(1.0)
    points = control_points(system.modules["m"], (280.0, 330.0), (260.0, 300.0), (-0.5, 1.5))
    section = rt.certify.contraction(system, current={"m": (0, 0)}, temperature=(300, 301)).system
    bare, rng = {**section, "links": []}, np.random.default_rng(4)
    drawn = []
    for hot, cold, current in zip(rng.uniform(280, 330, 300), rng.uniform(260, 300, 300), rng.uniform(-0.5, 1.5, 300),
                                  strict=True):
        J = truth.jacobian(bare, np.array([290.0, cold, hot]), {"m": current})
        b = truth.heat(bare, np.array([290, cold, hot], complex), {"m": current + 1e-30j}, {"room": 298.0}).imag / 1e-30
        drawn.append([J[2, 2], J[2, 1], J[1, 2], J[1, 1], b[2], b[1]])
    for direction in rng.standard_normal((200, 6)):
        assert (np.array(drawn) @ direction).max() <= (points @ direction).max() + 1e-12
    plants = rt.design.tem_polytope(system, **BOX)
    assert len(plants) == 27 and plants[0].output_labels == ["plate", "module", "sink"]


def test_polytope_of_a_stage_designs_a_feedback():
    plants = rt.design.tem_polytope(stage(), **BOX)
    d = rt.design.polytopic_feedback(plants, 1, rate=0.012)
    assert len(plants) == 8 and d.holds and d.rate >= 0.012


def test_ranges_of_capacities_make_more_vertices_and_hold_every_plant_of_them():
    """Slopes of the network by differences, at drawn points and capacities: averages of the vertices."""
    ranges = {"lumps.module.capacity": (10.0, 15.0), "lumps.plate.capacity": (55.0, 70.0)}
    plants = rt.design.tem_polytope(stage(), **BOX, covariance=ranges)
    assert len(plants) == 32
    vertices = np.array([np.r_[one.A.ravel(), one.B.ravel()] for one in plants])
    section = rt.design.tem_feedback(stage(), **BOX, operating=1.0, rate=0.009).certificates[0].system
    rng, h = np.random.default_rng(4), 1e-4
    for _ in range(8):
        x, current = rng.uniform(265.0, 335.0, 3), rng.uniform(0.2, 1.8)
        E = np.array([rng.uniform(55, 70), rng.uniform(10, 15), 90.0])

        def flow(x, current, E=E):
            return truth.heat(section, x, {"m": current}, {"room": 298.0}, {}) / E

        A = np.stack([(flow(x + h * e, current) - flow(x - h * e, current)) / (2 * h) for e in np.eye(3)], axis=1)
        B = (flow(x, current + h) - flow(x, current - h)) / (2 * h)
        near = nnls(np.vstack([vertices.T, np.ones(32)]), np.r_[A.ravel(), B, 1.0])[1]
        assert near < 1e-6
    outside = nnls(np.vstack([vertices.T, np.ones(32)]), np.r_[(0.5 * A).ravel(), B, 1.0])[1]
    assert outside > 1e-3
    d = rt.design.polytopic_feedback(plants, 1, rate=0.009)
    assert d.holds and rt.verify(d.certificates[0]).valid
    with pytest.raises(InputError, match="tem_polytope takes ranges of capacities"):
        rt.design.tem_feedback(stage(), **BOX, operating=1.0, rate=0.009, covariance=ranges)


def forged(certificate, part, key, value):
    """The same with one number of a section changed, its sentence again the one its data give."""
    parts = {name: getattr(certificate, name) for name in ("system", "region", "evidence")}
    parts[part] = {**parts[part], key: value}
    return establish("scheduled", **parts, made_by={}, margin={})


@pytest.mark.parametrize(("part", "key", "change", "words"), [
    ("region", "level", lambda x: 1.01 * x, "leaves"), ("region", "rate", lambda x: 1.3 * x, "V|rate|P E"),
    ("region", "current", lambda x: {"m": [0.2, 1.7]}, "currents"),
    ("region", "current", lambda x: {"m": [0.2, 9.0]}, "P E"),
    ("region", "temperature", lambda x: [266.0, 335.0], "temperatures"),
    ("region", "temperature", lambda x: [150.0, 600.0], "P E"),
    ("region", "ambient", lambda x: {"room": [280, 316]}, "heat"),
    ("region", "heat", lambda x: {"plate": [0, 20]}, "heat"), ("region", "offset", lambda x: 1e-12, "equilibrium"),
    ("system", "gain", lambda x: [[-5 * a for a in x[0]]], "P E|currents"),
    ("system", "operating", lambda x: {**x, "current": {"m": 1.1}}, "heat|currents"),
    ("evidence", "matrix", lambda x: np.diag([1.0, -1.0, 1.0]).tolist(), "P > 0")])
def test_claims_that_are_not_true_are_not_certified(designed, part, key, change, words):
    certificate = designed.certificates[0]
    before = getattr(certificate, part).get(key)
    found = forged(certificate, part, key, change(before))
    assert not found.holds and re.search(words, found.reason), found.reason


def test_a_sentence_of_other_numbers_is_rejected(designed):
    certificate = designed.certificates[0]
    other = Certificate(**{**vars(certificate), "claim": certificate.claim.replace("0.012 1/s", "0.02 1/s")})
    assert not verify(other).valid and "0.012" in certificate.claim
    assert rt.verification.same_system(certificate, {key: value for key, value in certificate.system.items()
                                                     if key not in ("gain", "operating")})


def test_a_rate_out_of_reach_names_the_best():
    d = rt.design.tem_feedback(stage(), **BOX, operating=1.0, rate=5.0)
    assert not d.holds and "best achievable" in d.outcome.text and not d.certificates and d.value == np.inf
    assert not d.gain.any() and d.level == 0.0 and d.rate == 0.0


def test_the_law_is_limited_and_takes_names(designed):
    names = designed.operating_temperatures
    assert designed.current(names) == pytest.approx([1.0])
    assert designed.current({**names, "plate": 400.0})[0] == 1.8 and designed.current([[200.0] * 3] * 2).shape == (2, 1)
    for wrong in ({"plate": 300.0}, [300.0], "warm"):
        with pytest.raises(InputError, match="temperatures"):
            designed.current(wrong)


@pytest.mark.skipif(GCC is None, reason="no C compiler on this machine")
def test_the_law_in_c_is_limited_too_and_only_there_for_samples(designed, tmp_path):
    d = rt.design.tem_feedback(stage(), **BOX, operating=1.0, rate=0.009, sample_time=2.0)
    d.export(tmp_path / "out", "law")
    source = tmp_path / "out" / "controller.c"
    subprocess.run([str(GCC), "-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-ffp-contract=off",
                    "-DCONTROLLER_TEST", str(source), "-o", str(tmp_path / "run"), "-lm"], check=True)
    assert subprocess.run([tmp_path / "run"], capture_output=True, text=True, check=True).stdout.strip() == "0"
    d.export(tmp_path / "law.json")
    rows = np.array(json.loads((tmp_path / "law.json").read_text())["test_vector"]["rows"])
    assert rows[:, 3] == pytest.approx(d.current(rows[:, :3])[:, 0], rel=1e-12) and {0.2, 1.8} <= set(rows[:, 3])
    assert "Certified for the nonlinear network" in " ".join(source.read_text().split(" * ")).replace("\n", "")
    driver = tmp_path / "driver.c"
    driver.write_text(source.read_text() + "int main(void) { double x[] = {NAN, 290.0, 300.0}, i[1];\n"
                                           "return law_step(x, i) == 1 && i[0] == 1.0 ? 0 : 1; }\n")
    subprocess.run([str(GCC), "-std=c99", str(driver), "-o", str(tmp_path / "run"), "-lm"], check=True)
    assert subprocess.run([tmp_path / "run"], check=False).returncode == 0
    with pytest.raises(InputError, match="samples, which this proof does not cover"):
        designed.export(tmp_path / "law.c")


@pytest.mark.parametrize(("arguments", "words"), [
    ({"temperature": (0.0, 60.0)}, "Celsius"), ({"operating": 2.0}, "not inside of its range"),
    ({"operating": {"n": 1.0}}, "operating"), ({"rate": 0.0}, "rate"), ({"method": "magic"}, "quadratic"),
    ({"temperature": (290.0, 335.0)}, "outside of the box"), ({"current": {"x": (0, 1)}}, "there is no module 'x'"),
    ({"covariance": {"lumps.sink.capacity": (80.0, 100.0)}}, "lumps.sink.capacity"),
    ({"covariance": 3.0}, "covariance is a float"), ({"ambient": {"hall": (290, 300)}}, "hall")])
def test_bad_arguments_are_named(arguments, words):
    with pytest.raises(InputError, match=words):
        rt.design.tem_feedback(stage(), **{**BOX, "operating": 1.0, "rate": 0.012, **arguments})


def test_systems_without_modules_are_refused():
    bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 50.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.5}])
    with pytest.raises(InputError, match="without modules"):
        rt.design.tem_polytope(bar, temperature=(280, 300), current={})


def test_two_modules_that_share_a_sink():
    """Each with its own range; the corners of both are combined, as if their sinks were different lumps."""
    one = {"hot": "sink", "seebeck": {"value": 0.052, "slope": 1e-4}, "resistance": {"value": 2.1, "slope": 5e-3},
           "conductance": {"value": 0.5}, "reference_temperature": 298.0}
    system = rt.System(ambients={"room": {"temperature": 298.0}}, modules={"a": {**one, "cold": "left"},
                                                                          "b": {**one, "cold": "right"}},
                       lumps={"left": {"capacity": 30.0}, "right": {"capacity": 40.0}, "sink": {"capacity": 200.0}},
                       links=[{"between": ("sink", "room"), "conductance": 8.0},
                              {"between": ("left", "right"), "conductance": 0.2}])
    d = rt.design.tem_feedback(system, temperature=(255.0, 340.0), current={"a": (0.0, 1.4), "b": (0.2, 1.2)},
                               operating={"a": 0.7, "b": 0.6}, rate=0.008)
    assert d.holds and d.semi_axes[0] > 5 and second(d.certificates[0]) == "valid"
    rest = np.array(list(d.operating_temperatures.values()))
    for x in boundary(d, np.random.default_rng(5), 4):
        path = run(d, x, lambda t: (298.0, {}), 200.0, 100) - rest
        V = np.einsum("ti,ij,tj->t", path, d.matrix, path)
        assert (V <= V[0] * np.exp(-4 * d.rate * np.arange(101)) * (1 + 1e-6)).all()


@pytest.mark.parametrize(("effect", "where", "values"), [
    ("conductance_exponent", ["plate-module"], {"exponent": 1.0}), ("thomson", ["m"], {"coefficient": 1e-3}),
    ("driven_conductance", ["plate-module", "m"], {"relative": 0.5}),
    ("lead_heating", ["sink", "m"], {"resistance": 0.1}),
    ("ambient_gradient", ["plate"], {"difference": 2.0}), ("hysteresis", ["m"], {"heat": 0.2, "time_constant": 9.0})])
def test_a_polytope_refuses_effects_whose_slopes_it_does_not_hold(effect, where, values):
    """It had left them out: its plants were those of another machine."""
    added = rt.thermal.add_effect(stage(), effect, where, values)
    name = next(iter(added.system.effects))
    with pytest.raises(InputError, match=re.escape(name) + r" = .* has slopes that this hull does not hold"):
        rt.design.tem_polytope(added.system, temperature=(280.0, 320.0), current=(0.0, 1.0))


def test_a_constant_heat_is_no_slope_of_a_polytope():
    plain, heated = (rt.design.tem_polytope(one, temperature=(280.0, 320.0), current=(0.0, 1.0)) for one in (
        stage(), rt.thermal.add_effect(stage(), "heat_source", ["plate"], {"heat": 0.5}).system))
    assert len(plain) == len(heated)
    assert all(np.array_equal(a.A, b.A) and np.array_equal(a.B, b.B) for a, b in zip(plain, heated, strict=True))
