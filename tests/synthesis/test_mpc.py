"""Predictive control: scipy's minimizer on the same problem, the promises of the terminal set by sampling, refusals."""

from __future__ import annotations

import copy
import json

import control
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.io import loadmat
from scipy.linalg import expm, solve_discrete_are
from scipy.optimize import fsolve, minimize

import recheck
import robthermal as rt
from robthermal.errors import InputError
from robthermal.verification import establish

CART = control.ss([[0, 1], [0, 0]], [[0], [1]], [[1, 0]], 0)
BOX = {"control": (-1.0, 1.0), "state": ([-5.0, -1.2], [5.0, 1.2])}
T, HORIZON = 0.2, 10
# a plate (0) cooled by a current through a face (1), in deviations; the current may be at most 0.9 S/R of the face
MODULE = control.ss([[-0.02, 0.015], [0.08, -0.1]], [[0.0], [-0.18]], np.eye(2), 0)
ROWS = (np.array([[0.0, -0.02], [0.0, 0.0]]), np.array([[1.0], [-1.0]]), np.array([0.6, 0.8]))


def sampled(plant, T):
    n = plant.nstates
    both = expm(np.block([[plant.A, plant.B], [np.zeros((plant.ninputs, n + plant.ninputs))]]) * T)
    return both[:n, :n], both[:n, n:]


@pytest.fixture(scope="module")
def cart():
    return rt.design.mpc(CART, horizon=HORIZON, Q=[1.0, 0.1], R=0.1, limits=BOX, sample_time=T)


@pytest.fixture(scope="module")
def module():
    return rt.design.mpc(MODULE, horizon=20, Q=np.eye(2), R=[[0.5]], limits={"rows": ROWS}, sample_time=2.0)


def brute_force(d, plant, Q, R, G, H, g, x):
    """Least cost by scipy over the controls themselves: limits at every sample, the end in the terminal set."""
    A, B = sampled(plant, d.controller.dt)

    def path(u):
        states = [x]
        for one in u.reshape(d.horizon, -1):
            states.append(A @ states[-1] + B @ one)
        return np.array(states)

    def cost(u):
        states, own = path(u), u.reshape(d.horizon, -1)
        return (np.einsum("ki,ij,kj->", states[:-1], Q, states[:-1]) + np.einsum("ki,ij,kj->", own, R, own)
                + states[-1] @ d.terminal.P @ states[-1])

    def room(u):
        states = path(u)
        inside = g - states[:-1] @ G.T - u.reshape(d.horizon, -1) @ H.T
        return np.append(inside.ravel(), d.terminal.level - states[-1] @ d.terminal.P @ states[-1])

    start = d.step(x).controls.ravel() * 0.9
    found = minimize(cost, start, constraints={"type": "ineq", "fun": room}, method="SLSQP",
                     options={"ftol": 1e-12, "maxiter": 300})
    return found.x.reshape(d.horizon, -1), found.fun, room(found.x).min()


@pytest.mark.parametrize("x", [[0.3, 0.1], [0.9, 0.6], [-0.5, -0.8]])
def test_a_step_is_the_minimum_that_scipy_finds(cart, x):
    G = np.vstack([np.zeros((2, 2)), np.eye(2), -np.eye(2)])
    H, g = np.array([[1.0], [-1], [0], [0], [0], [0]]), np.array([1, 1, 5, 1.2, 5, 1.2])
    move = cart.step(x)
    u, cost, room = brute_force(cart, CART, np.diag([1.0, 0.1]), 0.1 * np.eye(1), G, H, g, np.array(x))
    assert move.holds and room > -1e-7 and move.cost == pytest.approx(cost, rel=1e-4)
    assert move.controls == pytest.approx(u, abs=3e-3) and move.control == pytest.approx(move.controls[0])


def test_limits_of_states_and_controls_together(module):
    """The bound of the current moves with the face: the same minimum as scipy's, and the row is met with equality."""
    x = np.array([4.0, 4.0])
    move = module.step(x)
    _, cost, room = brute_force(module, MODULE, np.eye(2), 0.5 * np.eye(1), *ROWS, x)
    assert move.holds and room > -1e-6 and move.cost == pytest.approx(cost, rel=1e-4)
    assert move.control[0] == pytest.approx(0.6 + 0.02 * 4.0, abs=1e-4) and move.control[0] > 0.6


def test_the_terminal_set_keeps_what_it_promises(cart, module):
    rng = np.random.default_rng(0)
    box = np.vstack([np.eye(2), -np.eye(2)]), np.zeros((4, 1)), np.array([5, 1.2, 5, 1.2])
    for d, plant, Q, R, G, H, g in ((cart, CART, np.diag([1.0, 0.1]), 0.1, *box),
                                    (module, MODULE, np.eye(2), 0.5, *ROWS)):
        A, B = sampled(plant, d.controller.dt)
        end = d.terminal
        assert d.holds and rt.verify(d.certificates[0]).valid and d.value == end.level > 0
        document = {"format": "robthermal-certificate/1", "kind": "ellipsoid", "claim": d.certificates[0].claim,
                    **{key: getattr(d.certificates[0], key) for key in ("system", "region", "evidence", "margin",
                                                                        "made_by")}}
        assert recheck.check(json.loads(json.dumps(document, default=dict))).status == "valid"
        root = np.sqrt(end.level) * np.linalg.inv(np.linalg.cholesky(end.P)).T
        for direction in rng.standard_normal((300, 2)):
            x = root @ direction / np.linalg.norm(direction) * rng.uniform(0.1, 1)
            u = end.K @ x
            then = A @ x + B @ u
            assert then @ end.P @ then <= x @ end.P @ x - x @ Q @ x - R * u @ u
            assert (G @ x + H @ u <= g).all()
        assert len(set(np.round(np.abs(end.K).ravel(), 12))) == 2 and "cost" in d.certificates[0].region


def test_the_terminal_set_is_no_smaller_than_that_of_the_quadratic_law(cart):
    """P <= 2 P of the optimal law, and the largest ball of its coordinates is at least as large."""
    A, B = sampled(CART, T)
    P = solve_discrete_are(A, B, np.diag([1.0, 0.1]), 0.1 * np.eye(1))
    K = -np.linalg.solve(0.1 + B.T @ P @ B, B.T @ P @ A)
    W = np.linalg.inv(P)
    level = min(1 / (K @ W @ K.T)[0, 0], 25 / W[0, 0], 1.44 / W[1, 1])
    shares = np.linalg.eigvals(np.linalg.solve(cart.terminal.P, P)).real  # of P-unit balls in the set
    assert shares.max() <= 1.001 and shares.min() >= 1 / 2.001
    assert cart.terminal.level * shares.min() >= 0.999 * level
    assert cart.lower == pytest.approx(cart.terminal.level * shares.max())


def test_what_is_feasible_stays_feasible_and_the_cost_falls(cart, module):
    for d, plant, Q, R, x in ((cart, CART, np.diag([1.0, 0.1]), 0.1, [0.9, 0.6]),
                              (module, MODULE, np.eye(2), 0.5, [4, 4])):
        A, B = sampled(plant, d.controller.dt)
        x, before = np.array(x, float), np.inf
        for _ in range(60):
            move = d.step(x)
            assert move.holds and move.cost <= before * (1 + 1e-6) + 1e-9
            before = move.cost - x @ Q @ x - R * move.control @ move.control
            x = A @ x + B @ move.control
        assert np.abs(x).max() < (0.1 if d is cart else 0.8)  # the plate is slow


def test_near_the_origin_it_is_the_optimal_law():
    d = rt.design.mpc(CART, horizon=60, Q=[1.0, 0.1], R=0.1, limits=BOX, sample_time=T)
    A, B = sampled(CART, T)
    P = solve_discrete_are(A, B, np.diag([1.0, 0.1]), 0.1 * np.eye(1))
    K = -np.linalg.solve(0.1 + B.T @ P @ B, B.T @ P @ A)
    x = np.array([0.05, 0.02])
    assert d.step(x).control == pytest.approx(K @ x, rel=1e-3)


def test_states_without_a_feasible_path_get_the_reason_and_a_control_within_its_limits(cart):
    for x, word in (([4.9, 1.1], "terminal set"), ([7.0, 0.0], "upper limit of state 0 at sample 0")):
        move = cart.step(x)
        assert not move.holds and move.outcome.code == "no_step" and abs(move.control[0]) <= 1 + 1e-6
        assert word in move.outcome.text or "missed by" in move.outcome.text
    with pytest.raises(InputError, match="argument x"):
        cart.step([1.0])
    with pytest.raises(InputError, match="argument x"):
        cart.step([np.nan, 0.0])


def test_limits_by_a_function_are_followed_and_not_called_proven(module):
    def bounds(x):
        return -0.8, 0.6 + 0.02 * x[1]
    d = rt.design.mpc(MODULE, horizon=40, Q=np.eye(2), R=0.5, limits=bounds, sample_time=2.0)
    assert not d.holds and d.outcome.code == "not_certified" and "not proven" in d.outcome.text and np.isinf(d.value)
    x = np.array([4.0, 4.0])
    move = d.step(x)
    assert move.holds and move.control[0] == pytest.approx(0.68, abs=1e-4)
    for state, u in zip(move.states, move.controls, strict=False):
        assert bounds(state)[0] - 1e-5 <= u[0] <= bounds(state)[1] + 1e-5
    assert move.control == pytest.approx(module.step(x).control, abs=1e-3)  # both at the bound of the moment
    held = d.certificates[0].region["limits"]["bound"]
    assert max(held) < 0.8  # constants that the function allows in the whole set, as far as was looked


def test_sets_that_break_a_limit_are_never_certified(cart):
    """A larger level, a dearer weight, a weaker law: the same certificate no longer holds."""
    own = cart.certificates[0]
    parts = {key: copy.deepcopy(dict(getattr(own, key))) for key in ("system", "region", "evidence")}
    assert establish("ellipsoid", **parts, made_by={}, margin={}).holds
    for change in (lambda p: p["region"].update(level=1.01 * p["region"]["level"]),
                   lambda p: p["region"]["cost"].update(state=[[1.1, 0], [0, 0.1]]),
                   lambda p: p["system"]["controller"].update(D=[[0.7 * one for one in cart.terminal.K[0]]]),
                   lambda p: p["system"].update(vertices=[{"A": [[1, 0.3], [0, 1]], "B": [[0.02], [0.2]]}])):
        changed = copy.deepcopy(parts)
        change(changed)
        assert not establish("ellipsoid", **changed, made_by={}, margin={}).holds


def test_the_picture_is_the_boundary_of_the_terminal_set(cart):
    line, = cart.plot().lines
    points = np.stack(line.get_data())
    assert np.einsum("ik,ij,jk->k", points, cart.terminal.P, points) == pytest.approx(cart.terminal.level)


def test_files_hold_the_terminal_set_the_numbers_of_the_program_and_steps_of_it(cart, tmp_path):
    cart.export(tmp_path / "out")
    facts = json.loads((tmp_path / "out" / "design.json").read_text())
    assert facts["terminal"]["level"] == cart.terminal.level and facts["horizon"] == HORIZON
    assert rt.Certificate.load(tmp_path / "out" / "certificates" / "1_ellipsoid.json").holds
    assert (tmp_path / "out" / "controller.c").read_text() == (tmp_path / "out" / "controller.h").read_text()
    program, (A, B) = facts["program"], sampled(CART, T)
    assert np.allclose(program["A"], A) and np.allclose(program["B"], B)
    G, H, g = (np.array(program[key]) for key in "GHg")
    steps = facts["reference"]
    assert np.shape(steps["x"]) == (4, 2) and len(steps["cost"]) == 4 and all(steps["feasible"][:2])
    for k in (0, 1):  # on the boundary of the terminal set: from the file alone, by scipy
        x = np.array(steps["x"][k])
        assert x @ np.array(facts["terminal"]["P"]) @ x == pytest.approx(facts["terminal"]["level"])
        u, cost, _ = brute_force(cart, CART, np.array(program["Q"]), np.array(program["R"]), G, H, g, x)
        assert steps["cost"][k] == pytest.approx(cost, rel=1e-4)
        assert steps["control"][k] == pytest.approx(u[0], abs=3e-3)
    cart.export(tmp_path / "law.mat")
    assert np.allclose(loadmat(tmp_path / "law.mat")["reference"]["x"][0, 0], steps["x"])


@pytest.mark.parametrize(("arguments", "words"), [
    ({"horizon": 0}, "horizon"), ({"horizon": 501}, "500"), ({"Q": [[1, 2], [0, 1]]}, "argument Q"), ({"Q": 0}, "Q"),
    ({"R": -1.0}, "argument R"), ({"R": [1, 2]}, "argument R"), ({"limits": {}}, "limits"),
    ({"limits": {"x": 1}}, "limits"),
    ({"limits": 0.0}, "strictly inside"), ({"limits": {"control": (0.1, 1.0)}}, "lower limit of control 0"),
    ({"limits": {"state": (-np.inf, np.inf)}}, "no finite limit"),
    ({"limits": {"rows": ([[1, 0]], [[1]], [1, 2])}}, "rows"),
    ({"limits": {"control": 1.0}}, "pair"), ({"sample_time": None}, "sample_time"),
    ({"plant": control.ss([[2.0]], [[0.0]], [[1.0]], 0)}, "not stabilisable: the mode"),
    ({"plant": control.ss(np.eye(2), [[0], [1]], np.eye(2), 0, 0.5)}, "sampled at 0.5"),
    ({"limits": lambda x: (0.0, 1.0)}, "strictly inside"), ({"limits": lambda x: 1.0}, "pair"),
    ({"Q": [0.0, 1.0]}, "no stable optimum")])
def test_bad_input(arguments, words):
    given = {"horizon": 5, "Q": 1.0, "R": 1.0, "limits": 1.0, "sample_time": T} | arguments
    with pytest.raises(InputError, match=words):
        rt.design.mpc(given.pop("plant", CART), **given)


def test_a_module_is_kept_at_a_current_that_depends_on_its_temperature():
    """Plate, module and sink by scipy, from their own equations: 20 % of S x_c/R binds, and is never passed."""
    S, resistance, K, share, capacities = 0.052, 2.1, 0.5, 0.2, np.array([60.0, 12.0, 90.0])

    def flow(_, x, current):
        plate, face, sink = x
        cooled = S * face * current - resistance * current**2 / 2 - K * (sink - face)
        given = S * sink * current + resistance * current**2 / 2 - K * (sink - face)
        return np.array([5 * (face - plate) + 0.15 * (298 - plate), 5 * (plate - face) - cooled,
                         4 * (298 - sink) + given]) / capacities

    rest = fsolve(lambda x: flow(0, x, 1.0), [285.0, 284.0, 305.0])
    h = 1e-4
    A = np.stack([(flow(0, rest + h * e, 1.0) - flow(0, rest - h * e, 1.0)) / (2 * h) for e in np.eye(3)], axis=1)
    B = (flow(0, rest, 1 + h) - flow(0, rest, 1 - h)) / (2 * h)
    slope = share * S / resistance
    rows = ([[0.0, -slope, 0.0], [0.0, 0.0, 0.0]], [[1.0], [-1.0]], [slope * rest[1] - 1.0, 1.0])
    d = rt.design.mpc(control.ss(A, B[:, None], np.eye(3), 0), horizon=40, Q=[1.0, 0.01, 0.01], R=0.1,
                      limits={"rows": rows}, sample_time=5.0)
    assert d.holds
    x, used = rest + np.array([5.0, 5.0, 0.0]), []
    for _ in range(40):
        move = d.step(x - rest)
        assert move.holds
        current = 1.0 + move.control[0]
        used.append(current / (slope * x[1]))
        x = solve_ivp(flow, (0, 5.0), x, args=(current,), rtol=1e-8).y[:, -1]
    assert 0.999 < max(used) < 1.0001 and abs(x - rest).max() < 0.5
