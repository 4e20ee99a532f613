"""robthermal couple with subsystems of several inputs and outputs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest

DT = 0.01
A, C = np.array([[0.9, 0.05], [0.0, 0.8]]), np.array([[1.0, 0.4], [-0.2, 1.0]])
PLANT = control.ss(A, np.eye(2), C, np.zeros((2, 2)), DT)
LAW = "{ A = [], B = [], C = [], D = [[0.2, 0.0], [0.0, 0.2]] }"
SPEC = f"""
[coupling]
name = "two by two"
sample_time = 0.01
export = ["c"]

[subsystems.1]
plant = {{ A = {A.tolist()}, B = [[1.0, 0.0], [0.0, 1.0]], C = {C.tolist()}, D = [[0.0, 0.0], [0.0, 0.0]] }}
controller = {LAW}
disturbance = {{ num = [0.2], den = [1.0, -0.9] }}

[subsystems.2]
plant = {{ A = {A.tolist()}, B = [[1.0, 0.0], [0.0, 1.0]], C = {C.tolist()}, D = [[0.0, 0.0], [0.0, 0.0]] }}
controller = {LAW}
disturbance = {{ num = [0.2], den = [1.0, -0.9] }}

[uncertainty]
frf = ["machine.json"]

[design]
order = 3
"""


def measured(path: Path) -> None:
    """A machine with interaction between the subsystems, as `robthermal frf` writes responses."""
    import robthermal as rt

    omega = np.linspace(0.5, np.pi / DT, 300)
    z = np.exp(1j * omega * DT)
    P = np.asarray(control.append(PLANT, 1.05 * PLANT)(z)) + 0.02 / (z - 0.5)
    noise = 1e-9 * np.eye(16)[:, :, None] * np.ones(300)
    rt.identify.FrequencyResponse(
        frequencies=omega / (2 * np.pi), response=P, noise_covariance=1e-9 * np.eye(4)[:, :, None] * np.ones(300),
        covariance=noise, degrees_of_freedom=np.full(300, 20.0), input_names=list("abcd"),
        output_names=list("efgh"), sample_time=DT, n_samples=600, method="by hand", notes=()).save(path)


def write(folder: Path, text: str = SPEC) -> Path:
    measured(folder / "machine.json")
    (folder / "SPEC.toml").write_text(text, encoding="utf-8")
    return folder / "SPEC.toml"


def test_from_a_file_to_a_controller_that_stabilizes_the_measured_machine(run: Any, tmp_path: Path, sketched: Any
                                                                          ) -> None:
    out = tmp_path / "out"
    status, said, warned = run("couple", write(tmp_path), "--out", out, "--json")
    assert (status, warned) == (0, "") and json.loads(said)["verdict"] == "robust"
    found = json.loads((out / "coupling.json").read_text(encoding="utf-8"))
    K = control.ss(*(np.array(found["filters"]["controller"][key]) for key in "ABCD"), DT)
    extra = control.ss([[0.5]], np.ones((1, 4)), 0.02 * np.ones((4, 1)), np.zeros((4, 4)), DT)
    loop = control.feedback(control.append(PLANT, 1.05 * PLANT) + extra, K)
    assert np.abs(loop.poles()).max() < 1
    assert found["norms"]["robust"] <= 0.9 and found["norms"]["h2"] < 0.95 * found["norms"]["h2_uncoupled"]
    assert found["sections"] == {} and np.shape(found["filters"]["X"]["D"]) == (2, 2)
    assert run("verify", out)[0] == 0
    assert "two_by_two_step" in (out / "coupling.c").read_text() and "Over time" in (out / "report.html").read_text()


@pytest.mark.parametrize(("old", "new", "words"), [
    ("order = 3", "window = 0.1", ["[design]", "window beside subsystems of several inputs and outputs"]),
    ("order = 3", "X_hat = [[1.0]]", ["design.X_hat"]),
    ("order = 3", "X_hat = { A = [], B = [], C = [], D = [[0.5, 0.0]] }", ["X_hat", "1 outputs and 2 inputs"]),
    ('export = ["c"]', 'export = ["pdf"]', ["export"]),
    ('frf = ["machine.json"]', 'frf_1 = ["machine.json"]\nfrf_2 = ["machine.json"]', ["all 4 outputs and 4 inputs"]),
    (f"controller = {LAW}", "controller = 0.2", ["C1 has 1 outputs and 1 inputs", "2 outputs and 2 inputs"]),
])
def test_bad_input(run: Any, tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    assert old in SPEC
    status, said, warned = run("couple", write(tmp_path, SPEC.replace(old, new, 1)), "--out", tmp_path / "out")
    assert (status, said) == (2, "") and not (tmp_path / "out").exists()
    for word in words:
        assert word in warned
