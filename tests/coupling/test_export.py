"""MATLAB and C files against the filters themselves; the step function in the loop; sections that cannot overflow."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import control
import numpy as np
import pytest
from scipy.io import loadmat
from scipy.signal import sosfilt, sosfreqz

import robthermal as rt
from robthermal.coupling.implementation import Recursion

from .conftest import DT, Array, Pair, at, make_random_pair

GCC = shutil.which("gcc") or shutil.which("cc") or shutil.which("clang")
needs_compiler = pytest.mark.skipif(GCC is None, reason="no C compiler on this machine")
FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Werror", "-ffp-contract=off"]


@pytest.fixture(scope="module")
def filters() -> rt.coupling.Filters:
    """A random pair, filters with direct feedthrough."""
    pair = make_random_pair(0)
    return rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=control.tf([-0.5, 0.2], [1, -0.6], 0.01),
                                Y_hat=control.tf([0.4, -0.3, 0.2], [1, -1.2, 0.61], 0.01), window=0.1)


@pytest.fixture(scope="module")
def stages(pair: Pair) -> rt.coupling.Filters:
    """Rigid bodies, integrators, delay."""
    return rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=control.tf([-0.09], [1, -0.9], DT),
                                Y_hat=control.tf([-0.04], [1, -0.9], DT))


def test_mat_holds_the_same_numbers(filters: rt.coupling.Filters, tmp_path: Path) -> None:
    filters.export(tmp_path / "c.mat", "pair")
    found = loadmat(tmp_path / "c.mat", simplify_cells=True)
    assert found["sample_time"] == 0.01 and found["verdict"] == "nominal" and found["name"] == "pair"
    for name in ("X", "Y", "X_hat", "Y_hat", "Z1", "Z2", "X_input", "Y_input", "controller"):
        system = getattr(filters, name)
        for part in "ABCD":
            np.testing.assert_array_equal(np.asarray(found[name][part]).reshape(getattr(system, part).shape),
                                          getattr(system, part))
    for name, rows in filters.sections().items():
        np.testing.assert_array_equal(np.reshape(found["sections"][name], rows.shape), rows)
    assert found["norms"]["XY"] == filters.norms["XY"]
    assert found["performance"]["ma_after"] == filters.performance.ma_after


@needs_compiler
@pytest.mark.parametrize("which", ["filters", "stages"])
def test_c_gives_python_to_the_last_bit(which: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    request.getfixturevalue(which).export(tmp_path / "c.c", "my pair")
    assert compiled(tmp_path / "c.c", "-DCOUPLING_TEST").stdout.strip() == "0"


@needs_compiler
def test_c_with_another_number_fails_its_test(filters: rt.coupling.Filters, tmp_path: Path) -> None:
    filters.export(tmp_path / "c.c")
    text = (tmp_path / "c.c").read_text()
    tables = text[: text.index("typedef")]
    numbers = [m for m in re.finditer(r"-?0x1\.[0-9a-f]+p[+-]\d+", tables)]
    assert len(numbers) > 15
    for number in numbers[:: len(numbers) // 4]:
        changed = float.fromhex(number.group()) * (1 + 1e-5)
        (tmp_path / "m.c").write_text(text[: number.start()] + changed.hex() + text[number.end() :])
        assert compiled(tmp_path / "m.c", "-DCOUPLING_TEST").returncode == 1, number.group()


@needs_compiler
def test_c_is_also_a_header(filters: rt.coupling.Filters, tmp_path: Path) -> None:
    filters.export(tmp_path / "pair.h", "pair")
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "pair.h"\n#include "pair.h"\n'
        "int main(void)\n{\n    pair_state s = {0};\n    double e[2] = {1.0, 0.0}, plus[2], add[2];\n"
        '    for (int t = 0; t < 3; t++, e[0] = 0.0) {\n        pair_step(&s, e, 1, plus, add);\n'
        '        printf("%.17g %.17g\\n", plus[0], add[1]);\n    }\n    return 0;\n}\n')
    printed = compiled(tmp_path / "main.c").stdout.split()
    recursion = Recursion(filters)
    steps = [recursion.step(float(t == 0), 0.0, True) for t in range(3)]
    assert [float(word) for word in printed] == [value for step in steps for value in (step[0], step[3])]


def compiled(path: Path, *more: str) -> subprocess.CompletedProcess[str]:
    """Compile and run."""
    program = path.with_suffix(".out")
    subprocess.run([str(GCC), *FLAGS, *more, str(path), "-o", str(program), "-lm"], check=True)
    return subprocess.run([str(program)], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("which", ["filters", "stages"])
def test_the_step_in_the_loop_is_the_simulated_coupling(which: str, request: pytest.FixtureRequest, pair: Pair
                                                        ) -> None:
    filters = request.getfixturevalue(which)
    machine = pair if which == "stages" else make_random_pair(0)
    v = np.random.default_rng(0).standard_normal((2, 600)).cumsum(axis=1)
    run = rt.coupling.simulate(filters, disturbances=v, on=(50, 400))
    recursion = Recursion(filters)
    plants, laws = control.append(machine.P1, machine.P2), control.append(machine.C1, machine.C2)
    x, k = np.zeros(plants.nstates), np.zeros(laws.nstates)
    for t in range(600):
        e = -(v[:, t] + plants.C @ x)
        *plus, add1, add2 = recursion.step(float(e[0]), float(e[1]), 50 <= t < 400)
        size = np.abs(run.before).max()
        np.testing.assert_allclose([*e, *plus], [run.e1[t], run.e2[t], run.e1_seen[t], run.e2_seen[t]],
                                   atol=1e-6 * size)
        u = laws.C @ k + laws.D @ plus + [add1, add2]
        x, k = plants.A @ x + plants.B @ u, laws.A @ k + laws.B @ plus


def test_refusals(filters: rt.coupling.Filters, tmp_path: Path) -> None:
    with pytest.raises(rt.InputError, match=r'file type ".json".*save'):
        filters.export(tmp_path / "c.json")
    with pytest.raises(rt.InputError, match="cannot be written"):
        filters.export(tmp_path / "none" / "c.c")
    P, C = control.tf([1], [1, 1, 0], 0), control.tf([1.0], [1], 0)
    continuous = rt.coupling.evaluate(P, P, C, C, X_hat=-0.1)
    continuous.export(tmp_path / "c.mat")
    assert loadmat(tmp_path / "c.mat", simplify_cells=True)["sample_time"] == 0
    for call in (lambda: continuous.export(tmp_path / "c.c"), lambda: continuous.fixed_point(1.0)):
        with pytest.raises(rt.InputError, match="continuous-time filters have no sections"):
            call()
    with pytest.raises(rt.InputError, match="largest = 0"):
        filters.fixed_point(0)
    assert not (tmp_path / "c.c").exists()


@pytest.mark.parametrize("which", ["filters", "stages"])
def test_scaled_sections_are_the_same_filters(which: str, request: pytest.FixtureRequest) -> None:
    filters = request.getfixturevalue(which)
    ready = filters.fixed_point(3e-6)
    assert ready.input_scale == 2.0**-18
    omega = np.geomspace(1e-2, 0.99, 50) * np.pi
    for name, path in ready.paths.items():
        exact = at(getattr(filters, name), omega / float(filters.X.dt))
        np.testing.assert_allclose(path.gain * sosfreqz(path.sections, omega)[1], exact,
                                   atol=1e-6 * np.abs(exact).max())
        assert np.log2(path.gain) % 1 == 0
        assert np.all(np.abs(path.sections) <= 2.0 ** path.coefficient_bits[:, None])
    assert "X_input" in str(ready)


@pytest.mark.parametrize("which", ["filters", "stages"])
def test_no_bounded_input_overflows(which: str, request: pytest.FixtureRequest) -> None:
    """The worst input of every node brings it to its peak, which is at most 1; noise and square waves stay below."""
    paths = request.getfixturevalue(which).fixed_point(1.0).paths
    assert len(paths) >= 2  # of every filter and axis
    for path in paths.values():
        assert path.peak.max() <= 1 and np.all(path.peak.max(axis=1) > 0.5)
        pulse = np.eye(1, 3000)[0]
        responses = nodes(path.sections, pulse)
        for response, peak in zip(responses.reshape(-1, 3000), path.peak.ravel(), strict=True):
            worst = nodes(path.sections, np.sign(response[::-1]))
            assert np.abs(worst).max() <= 1.0
            assert np.abs(worst.reshape(-1, 3000)[:, -1]).max() >= (1 - 1e-3) * peak
        rng = np.random.default_rng(0)
        square = np.sign(np.sin(np.arange(3000) * 0.05))
        for signal in (rng.uniform(-1, 1, 3000), np.sign(rng.standard_normal(3000)), square, np.ones(3000)):
            assert np.all(np.abs(nodes(path.sections, signal)).max(axis=2) <= path.peak)


def nodes(rows: Array, x: Array) -> Array:
    """Output and states of every section, the recursion written out, (n, 3, length)."""
    found = []
    for row in rows:
        z = np.zeros((2, len(x) + 1))
        y = sosfilt(row[None], x)
        for t in range(len(x)):
            z[0, t + 1] = row[1] * x[t] - row[4] * y[t] + z[1, t]
            z[1, t + 1] = row[2] * x[t] - row[5] * y[t]
        found.append([y, z[0, :-1], z[1, :-1]])
        x = y
    return np.array(found)
