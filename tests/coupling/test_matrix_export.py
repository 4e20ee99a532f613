"""C source and MATLAB file of a coupling of several channels, against the controller and the simulated loop."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import control
import numpy as np
import pytest
from scipy.io import loadmat

import robthermal as rt
from robthermal.coupling.implementation import MatrixRecursion

GCC = shutil.which("gcc") or shutil.which("cc") or shutil.which("clang")
needs_compiler = pytest.mark.skipif(GCC is None, reason="no C compiler on this machine")
FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Werror", "-ffp-contract=off", "-DCOUPLING_TEST"]
DT = 0.01
P1 = control.ss([[0.9, 0.1], [0.0, 0.8]], np.eye(2), [[1.0, 0.5], [0.0, 1.0]], np.zeros((2, 2)), DT)
P2 = control.ss([[0.7, 0.2], [0.0, 0.85]], [[1.0], [0.5]], np.eye(2), np.zeros((2, 1)), DT)  # one input, two outputs
C1 = control.ss([[0.6]], [[0.1, 0.2]], [[0.3], [0.1]], 0.2 * np.eye(2), DT)
C2 = control.ss([], [], [], [[0.2, 0.1]], DT)
X_HAT = control.ss([[0.5]], [[1.0, -0.4]], [[-0.3], [0.2]], [[-0.3, 0.1], [0.0, -0.2]], DT)


@pytest.fixture(scope="module", params=["both", "only X", "only Y", "none"])
def filters(request: pytest.FixtureRequest) -> rt.coupling.MatrixFilters:
    X_hat = X_HAT if request.param in ("both", "only X") else 0
    Y_hat = [[-0.2, 0.1]] if request.param in ("both", "only Y") else 0
    return rt.coupling.evaluate_matrix(P1, P2, C1, C2, X_hat=X_hat, Y_hat=Y_hat)


@needs_compiler
def test_c_gives_python_to_the_last_bit(filters: rt.coupling.MatrixFilters, tmp_path: Path) -> None:
    filters.export(tmp_path / "c.c", "my pair")
    subprocess.run([str(GCC), *FLAGS, str(tmp_path / "c.c"), "-o", str(tmp_path / "c.out"), "-lm"], check=True)
    done = subprocess.run([str(tmp_path / "c.out")], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "0")


@needs_compiler
def test_c_with_another_number_fails_its_test(tmp_path: Path) -> None:
    rt.coupling.evaluate_matrix(P1, P2, C1, C2, X_hat=X_HAT).export(tmp_path / "c.c")
    text = (tmp_path / "c.c").read_text()
    for table in ("X_A", "X_input_D", "direct"):
        start = text.index("0x1.", text.index(f"coupling_{table}["))
        stop = start + min(text[start:].index(end) for end in (",", "}"))
        changed = float.fromhex(text[start:stop]) * (1 + 1e-5)
        (tmp_path / "m.c").write_text(text[:start] + changed.hex() + text[stop:])
        subprocess.run([str(GCC), *FLAGS, str(tmp_path / "m.c"), "-o", str(tmp_path / "m.out"), "-lm"], check=True)
        assert subprocess.run([str(tmp_path / "m.out")], capture_output=True, check=False).returncode == 1, table


def test_the_step_and_the_own_controllers_are_the_coupling_controller(filters: rt.coupling.MatrixFilters) -> None:
    e, recursion = np.random.default_rng(1).normal(size=(200, 4)), MatrixRecursion(filters)
    steps = [recursion.step(one.tolist(), True) for one in e]
    plus, add = (np.array([step[k] for step in steps]).T for k in (0, 1))
    own = control.forced_response(control.append(C1, C2), DT * np.arange(200), plus).outputs
    u = control.forced_response(filters.controller, DT * np.arange(200), e.T).outputs
    np.testing.assert_allclose(own + add, u, atol=1e-9 * np.abs(u).max())


def test_the_step_in_the_loop_is_the_simulated_coupling(filters: rt.coupling.MatrixFilters) -> None:
    v = np.random.default_rng(2).normal(size=(2, 300, 2))
    run = rt.coupling.simulate(filters, disturbances=v, on=(50, 200))
    recursion, plants, laws = MatrixRecursion(filters), control.append(P1, P2), control.append(C1, C2)
    x, k, seen = np.zeros(plants.nstates), np.zeros(laws.nstates), []
    for t in range(300):
        e = -(np.concatenate([v[0, t], v[1, t]]) + plants.C @ x)
        plus, add = recursion.step(e.tolist(), 50 <= t < 200)
        seen.append(np.concatenate([e, plus]))
        u = laws.C @ k + laws.D @ plus + add
        x, k = plants.A @ x + plants.B @ u, laws.A @ k + laws.B @ plus
    wanted = np.hstack([run.e1, run.e2, run.e1_seen, run.e2_seen])
    np.testing.assert_allclose(np.array(seen), wanted, atol=1e-8)


def test_mat_holds_the_same_numbers(tmp_path: Path) -> None:
    filters = rt.coupling.evaluate_matrix(P1, P2, C1, C2, X_hat=X_HAT)
    filters.export(tmp_path / "c.mat", "pair")
    found = loadmat(tmp_path / "c.mat", simplify_cells=True)
    np.testing.assert_array_equal(found["controller"]["A"], filters.controller.A)
    np.testing.assert_array_equal(np.reshape(found["Y"]["D"], (2, 2)), np.zeros((2, 2)))
    assert found["verdict"] == "nominal" and found["norms"]["X"] == filters.norms["X"]


def test_subsystems_of_one_channel_given_as_matrices_are_written_too(tmp_path: Path) -> None:
    P, C = control.ss([[0.9]], [[1.0]], [[1.0]], [[0.0]], DT), control.ss([], [], [], [[0.3]], DT)
    filters = rt.coupling.evaluate_matrix(P, P, C, C, X_hat=-0.5)
    for ending in ("c", "mat"):
        filters.export(tmp_path / f"pair.{ending}")
    filters.save(tmp_path / "pair.json")
    assert "1 channels each" in (tmp_path / "pair.c").read_text()


def test_refusals(tmp_path: Path) -> None:
    plant, law = (control.ss(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2))), control.ss([], [], [], np.eye(2)))
    slow = rt.coupling.evaluate_matrix(plant, plant, law, law, X_hat=-0.1)
    slow.export(tmp_path / "c.mat")
    with pytest.raises(rt.InputError, match="continuous-time"):
        slow.export(tmp_path / "c.c")
    with pytest.raises(rt.InputError, match="continuous-time"):
        rt.coupling.simulate(slow)
    with pytest.raises(rt.InputError, match=r'file type ".txt"'):
        slow.export(tmp_path / "c.txt")
