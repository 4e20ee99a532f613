"""C source of predictive, scheduled, saturating and hybrid controllers: compiled, against other solvers."""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess

import control
import numpy as np
import pytest
from scipy.optimize import minimize

import robthermal as rt
from robthermal.errors import InputError
from robthermal.synthesis._schedule import read_schedule

GCC = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
pytestmark = pytest.mark.skipif(GCC is None, reason="no C compiler on this machine")
FLAGS = ["-std=c99", "-O1", "-Wall", "-Wextra", "-pedantic", "-Werror", "-ffp-contract=off"]
CART = control.ss([[0, 1], [0, 0]], [[0], [1]], [[1, 0]], 0)
MODULE = control.ss([[-0.02, 0.015], [0.08, -0.1]], [[0.0], [-0.18]], np.eye(2), 0)
ROWS = ([[0.0, -0.02], [0.0, 0.0]], [[1.0], [-1.0]], [0.6, 0.8])
POINTER = ctypes.POINTER(ctypes.c_double)


def own_test(path):
    """What the test vector of a C file says: the largest difference."""
    program = path.with_suffix(".out")
    subprocess.run([str(GCC), *FLAGS, "-DCONTROLLER_TEST", "-x", "c", str(path), "-o", str(program), "-lm"], check=True)
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    return float(done.stdout), done.returncode


DRIVER = """
static law_memory memory;
void start(void);
int step(const double *x, double *u);
void planned(double *c);
void rounds(int most);
void start(void) { law_start(&memory); }
int step(const double *x, double *u) { return law_step(&memory, x, u); }
void rounds(int most) { law_rounds = most; }
void planned(double *c)
{
    for (int k = 0; k < law_horizon; k++)
        for (int i = 0; i < law_m; i++) *c++ = law_unit[i] * memory.plan[k][i];
}
"""


class Predictive:
    """The compiled source of a predictive controller; how many rounds its solver has may be changed."""

    def __init__(self, d, folder):
        d.export(folder / "law.h", "law")
        text = (folder / "law.h").read_text()
        assert text.count(", law_rounds = 60 };") == 1
        (folder / "law.c").write_text(text.replace(", law_rounds = 60 };", " };\nstatic int law_rounds = 60;") + DRIVER)
        subprocess.run([str(GCC), *FLAGS, "-shared", "-fPIC", str(folder / "law.c"), "-o", str(folder / "law.so"),
                        "-lm"], check=True)
        self.library, self.shape = ctypes.CDLL(str(folder / "law.so")), (d.horizon, len(d.terminal.K))
        self.start()

    def start(self, rounds=60):
        self.library.rounds(rounds)
        self.library.start()

    def step(self, x):
        x, u = np.ascontiguousarray(x, float), np.zeros(self.shape[1])
        status = self.library.step(x.ctypes.data_as(POINTER), u.ctypes.data_as(POINTER))
        return status, u

    def planned(self):
        """c of u = K x + c."""
        c = np.zeros(self.shape)
        self.library.planned(c.ctypes.data_as(POINTER))
        return c


@pytest.fixture(scope="module")
def cart():
    return rt.design.mpc(CART, horizon=10, Q=[1.0, 0.1], R=0.1, sample_time=0.2,
                         limits={"control": (-1.0, 1.0), "state": ([-5.0, -1.2], [5.0, 1.2])})


@pytest.fixture(scope="module")
def compiled(cart, tmp_path_factory):
    return Predictive(cart, tmp_path_factory.mktemp("cart"))


def starts(d, count, sizes, seed=0):
    """States by their distance in terminal sets."""
    rng = np.random.default_rng(seed)
    root = np.sqrt(d.terminal.level) * np.linalg.inv(np.linalg.cholesky(d.terminal.P)).T
    directions = rng.standard_normal((count, len(root)))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return [size * root @ one for size, one in zip(np.resize(sizes, count), directions, strict=True)]


def cost_and_room(d, x, u):
    """Cost of controls from a state, and the room of limits that a control can change, by simulation."""
    A, B, limits, P = d.plant.A, d.plant.B2, d.program.limits, d.terminal.P
    cost, room = 0.0, []
    for k, one in enumerate(u):
        cost += x @ d.program.Q @ x + one @ d.program.R @ one
        counted = slice(None) if k else np.flatnonzero(limits.H.any(axis=1))
        room.append((limits.g - limits.G @ x - limits.H @ one)[counted])
        x = A @ x + B @ one
    return cost + x @ P @ x, np.append(np.concatenate(room), d.terminal.level - x @ P @ x)


@pytest.mark.parametrize("x", [[0.9, 0.6], pytest.param([-1.0, -0.3], marks=pytest.mark.exhaustive)])
def test_the_compiled_step_is_the_minimum_that_scipy_finds(cart, compiled, x):
    x = np.array(x)
    compiled.start()
    status, u = compiled.step(x)
    start = cart.step(x).controls.ravel() * 0.9
    found = minimize(lambda c: cost_and_room(cart, x, c[:, None])[0], start, method="SLSQP",
                     constraints={"type": "ineq", "fun": lambda c: cost_and_room(cart, x, c[:, None])[1]},
                     options={"ftol": 1e-11, "maxiter": 300})
    assert status == 0 and u == pytest.approx(found.x[:1], abs=2e-3)


def machine(seed):
    """A random plant, unstable for some seeds, with limits of controls, of states, and of both together."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 6))
    m = int(rng.integers(1, min(n, 3)))
    A = rng.standard_normal((n, n))
    A *= rng.uniform(0.6, 1.15) / np.abs(np.linalg.eigvals(A)).max()
    B = rng.standard_normal((n, m)) * 10 ** rng.uniform(-3, 2)
    size = np.linalg.norm(B)
    limits = {"control": (-rng.uniform(0.5, 2, m), rng.uniform(0.5, 2, m)),
              "rows": (0.1 * rng.standard_normal((2, n)) / size, rng.standard_normal((2, m)), rng.uniform(0.5, 1, 2))}
    if seed % 2:
        limits["state"] = (-rng.uniform(1, 4, n) * size, rng.uniform(1, 4, n) * size)
    return rt.design.mpc(control.ss(A, B, np.eye(n), 0, 1.0), horizon=int(rng.integers(3, 20)), Q=np.ones(n) / size**2,
                         R=10 ** rng.uniform(-3, 0), limits=limits)


@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.exhaustive) for k in (0, *range(2, 12)))])
def test_random_machines_inside_and_outside_of_what_is_feasible(tmp_path, seed):
    """Clarabel's control where there is a plan, status 2 and the stated law where there is none; none in between."""
    d = machine(seed)
    c, seen = Predictive(d, tmp_path), [0, 0]
    for x in starts(d, 18, [0.5, 1.0, 1.5, 2.5, 4.0, 8.0]):
        c.start()
        status, u = c.step(x)
        short = d.program.missed(x)
        if short <= 1e-9:
            expected = d.step(x).control
            assert status == 0 and np.abs(u - expected).max() <= 1e-5 * np.abs(d.program.limits.g).max()
            seen[0] += 1
        elif short > 1e-3:
            assert status == 2 and u == pytest.approx(d.fallback(x), rel=1e-9, abs=1e-12)
            assert (d.program.limits.H @ u <= d.program.limits.g + 1e-9)[~d.program.limits.G.any(axis=1)].all()
            seen[1] += 1
    assert seen[0] >= 5 and sum(seen) >= 14


def test_the_loop_closed_by_the_source_is_that_of_python(cart, compiled):
    compiled.start()
    x = np.array([0.9, 0.6])
    for _ in range(30):
        status, u = compiled.step(x)
        assert status == 0 and u == pytest.approx(cart.step(x).control, abs=1e-6)
        x = cart.plant.A @ x + cart.plant.B2 @ u
    assert np.abs(x).max() < 0.2


@pytest.mark.parametrize("rounds", [0, 3, 6])
def test_a_solver_that_is_cut_short_keeps_the_limits_and_lets_the_cost_fall(cart, compiled, rounds):
    """Status 1: the rest of the plan before, unless a new one is feasible and no dearer; by simulation of the plans."""
    compiled.start()
    x, most, codes = np.array([0.9, 0.6]), np.inf, []
    for _ in range(25):
        status, u = compiled.step(x)
        codes.append(status)
        ahead, plan = x, []
        for c in compiled.planned():
            plan.append(cart.terminal.K @ ahead + c)
            ahead = cart.plant.A @ ahead + cart.plant.B2 @ plan[-1]
        cost, room = cost_and_room(cart, x, plan)
        assert u == pytest.approx(plan[0], abs=1e-12) and room.min() >= -1e-5 and cost <= most + 1e-9
        most = cost - x @ cart.program.Q @ x - u @ cart.program.R @ u
        x = cart.plant.A @ x + cart.plant.B2 @ u
        compiled.library.rounds(rounds)
    assert codes[0] == 0 and set(codes) <= {0, 1} and 1 in codes and np.abs(x).max() < 0.3


def test_readings_that_are_no_numbers_are_replaced_by_the_prediction(cart, compiled):
    compiled.start()
    x = np.array([0.9, 0.6])
    _, first = compiled.step(x)
    status, u = compiled.step([np.nan, 0.6])
    then = cart.plant.A @ x + cart.plant.B2 @ first
    assert status == 3 and u == pytest.approx(cart.step(then).control, abs=1e-5)
    compiled.start()
    assert compiled.step([np.inf, 0.0]) == (3, pytest.approx([0.0], abs=1e-9))  # nothing was predicted: at rest


def test_a_state_beyond_its_own_limit_is_still_planned_for(cart, compiled):
    """The measured velocity is above its limit: python says so, and both plan for what is still to be changed."""
    x = np.array([-0.5, 1.25])
    move = cart.step(x)
    compiled.start()
    status, u = compiled.step(x)
    assert not move.holds and "upper limit of state 1 at sample 0 by 4.17 %" in move.outcome.text
    assert status == 0 and u == pytest.approx(move.control, abs=1e-5) and move.control[0] < 0
    assert cost_and_room(cart, x, move.controls)[1].min() > -1e-5


def test_files_of_a_predictive_controller(cart, tmp_path):
    module = rt.design.mpc(MODULE, horizon=8, Q=np.eye(2), R=0.5, limits={"rows": ROWS}, sample_time=2.0)
    module.export(tmp_path / "out", "module")
    worst, status = own_test(tmp_path / "out" / "controller.c")
    assert status == 0 and worst < 1e-6
    text = (tmp_path / "out" / "controller.c").read_text()
    assert "Certified: the terminal set" in text and "Exit status 1 above 1e-05" in text
    (tmp_path / "wrong.c").write_text(text.replace("module_rounds = 60", "module_rounds = 2"))
    assert own_test(tmp_path / "wrong.c")[1] == 1
    free = rt.design.mpc(MODULE, horizon=20, Q=np.eye(2), R=0.5, limits=lambda x: (-0.8, 0.6), sample_time=2.0)
    with pytest.raises(InputError, match=r'state them as "rows"'):
        free.export(tmp_path / "free.c")
    with pytest.raises(InputError, match="are a function"):
        free.fallback([0.0, 0.0])


def lag(a):
    return control.ss([[a]], [[1, 0, 1]], [[1], [0], [1]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]], 0.1)


@pytest.mark.parametrize(("poles", "scheduling"), [
    pytest.param((0.9, 1.0, 1.1), {"a": [0.9, 1.0, 1.1]}, marks=pytest.mark.exhaustive),
    ((0.9, 1.0, 1.0, 1.1), {"a": [0.0, 1.0], "b": [0.0, 1.0]}),
    ((0.9, 1.1, 1.0), {"a": [0.0, 1.0, 0.0], "b": [0.0, 0.0, 1.0]})])
def test_a_scheduled_controller_in_c_is_the_average_of_its_vertices(tmp_path, poles, scheduling):
    d = rt.design.lpv([lag(a) for a in poles], scheduling, 1, 1)
    assert d.holds and d.has_source
    d.export(tmp_path / "law.c", "law")
    assert own_test(tmp_path / "law.c") == (0.0, 0)
    d.export(tmp_path / "law.json")
    vector = json.loads((tmp_path / "law.json").read_text())["test_vector"]
    x, inside = np.zeros(d.controller.nstates), 0
    names = list(d.scheduling)
    for row in np.array(vector["rows"]):  # by the controller that `gain` gives, while the points are inside
        if row[-1]:
            break
        K = d.gain(dict(zip(names, row, strict=False)))
        y = row[len(names):len(names) + 1]
        assert row[-2] == pytest.approx((K.C @ x + K.D @ y)[0], abs=1e-12)
        x, inside = K.A @ x + K.B @ y, inside + 1
    assert inside >= 1 and {0.0, 1.0} == {row[-1] for row in vector["rows"]}


def test_simplices_and_linear_programs_give_the_same_weights():
    """Vertices in general position: Delaunay's simplex is where the sum of w |vertex|² is least."""
    rng = np.random.default_rng(3)
    points = rng.uniform(0, 1, (7, 2)) * [1.0, 50.0]
    schedule = read_schedule({"x": points[:, 0], "y": points[:, 1]}, 7)
    flat = read_schedule({"x": [0.0, 1.0, 2.0], "y": [0.0, 1.0, 2.0]}, 3)
    assert len(schedule.simplices[0]) and not len(flat.simplices[0])
    assert flat.weights({"x": 0.5, "y": 0.5}) == pytest.approx([0.5, 0.5, 0.0], abs=1e-9)
    scaled = (points - points.min(axis=0)) / np.ptp(points, axis=0) - 0.5
    for share in rng.dirichlet(np.ones(7), 20):
        at = share @ points
        w = schedule.weights({"x": at[0], "y": at[1]})
        assert w @ points == pytest.approx(at) and w.sum() == pytest.approx(1.0)
        assert w @ (scaled**2).sum(axis=1) <= share @ (scaled**2).sum(axis=1) + 1e-12


def test_vertices_on_a_line_have_no_source(tmp_path):
    d = rt.design.lpv([lag(a) for a in (0.9, 1.1)], {"a": [0.9, 1.1], "b": [1.0, 2.0]}, 1, 1)
    assert not d.has_source
    with pytest.raises(InputError, match="leave out quantities that depend"):
        d.export(tmp_path / "law.c")
    d.export(tmp_path / "out")
    assert not (tmp_path / "out" / "controller.c").exists()


def test_anti_windup_in_c_saturates_and_feeds_back_what_it_cut_off(tmp_path):
    """The file alone against the loop of python: y in, limited control out; the same numbers as its test vector."""
    P = control.sample_system(control.ss([[-0.1]], [[0.1, 1.0]], [[1.0], [-1.0]], [[0, 0], [0, 0]]), 0.1)
    K = control.sample_system(control.ss([[-1e-3]], [[1.0]], [[0.1]], [[0.5]]), 0.1)
    d = rt.design.anti_windup(P, K, limits=0.3)
    assert d.holds and d.limits == (0.3,)
    d.export(tmp_path / "law.c", "law")
    assert own_test(tmp_path / "law.c") == (0.0, 0)
    d.export(tmp_path / "law.json")
    vector = np.array(json.loads((tmp_path / "law.json").read_text())["test_vector"]["rows"])
    x = np.zeros(1)
    for y, u in vector:
        v = (d.controller.C @ x + d.controller.D[:, :1] @ [y])[0]
        assert u == pytest.approx(np.clip(v, -0.3, 0.3), abs=1e-12)
        x = d.controller.A @ x + d.controller.B @ [y, v - u]
    assert vector.shape == (64, 2) and (np.abs(vector[:, 1]) == 0.3).any()


def test_a_hybrid_element_in_c_runs_as_it_is_simulated(tmp_path):
    stage = control.tf([2.0], [3000.0, 160.0, 1.0])
    for linear in (control.tf([4.0, 0.01], [1, 0]), 4.0):
        d = rt.design.hybrid_integrator_gain(stage, linear, gain=4.0, rate=0.1, sample_time=1.0)
        d.export(tmp_path / "law.c", "law")
        assert own_test(tmp_path / "law.c") == (0.0, 0)
    d.export(tmp_path / "out")
    facts = json.loads((tmp_path / "out" / "design.json").read_text())
    assert facts["element"] == {"gain": 4.0, "rate": 0.1} and facts["outcome"]["ok"]
    assert rt.Certificate.load(tmp_path / "out" / "certificates" / "1_hinf.json").holds
    run = d.simulate(1.0, samples=30)
    driver = tmp_path / "driver.c"
    errors = ", ".join(f"{one:.17g}" for one in run["error"])
    driver.write_text((tmp_path / "law.c").read_text() + "#include <stdio.h>\nint main(void) {\n"
                      " law_state s = {{0}, 0};\n"
                      f"const double e[] = {{{errors}}};\n"
                      'for (int k = 0; k < 30; k++) printf("%.17g\\n", law_step(&s, e[k]));\nreturn 0; }\n')
    subprocess.run([str(GCC), *FLAGS, str(driver), "-o", str(tmp_path / "driver"), "-lm"], check=True)
    done = subprocess.run([tmp_path / "driver"], capture_output=True, text=True, check=True)
    assert [float(one) for one in done.stdout.split()] == pytest.approx(run["control"].tolist(), rel=1e-12)
