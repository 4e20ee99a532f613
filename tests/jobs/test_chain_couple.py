"""From two records of a scanner-like pair to a verified coupling, through the project file."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from commands import Run
from heated_bar import PROJECT, write_bar
from numpy.typing import NDArray
from scanner_pair import DT, RETICLE, WAFER, padded, response, spec, true_plants, write_records
from scipy.linalg import block_diag
from scipy.signal import dlsim, lfilter, tf2ss

import robthermal as rt

pytestmark = pytest.mark.usefixtures("sketched")
Array = NDArray[Any]
GCC = shutil.which("gcc") or shutil.which("cc") or shutil.which("clang")
FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Werror", "-ffp-contract=off"]
IDENTIFY = '[identify.{0}]\nrecords = ["{0}.csv"]\ninputs = ["F"]\noutputs = ["y"]\nuse = "none"\n'
COUPLE = "".join(IDENTIFY.format(name) for name in ("reticle", "wafer")) + """
[couple]
spec = "couple.toml"
frf_1 = ["identify.reticle"]
frf_2 = ["identify.wafer"]
export = ["c"]
"""
MAIN = """
#include <stdio.h>
#include "coupling.c"
int main(void)
{
    pair_of_stages_state s = {0};
    double e[2], plus[2], add[2];
    while (scanf("%lf %lf", &e[0], &e[1]) == 2) {
        pair_of_stages_step(&s, e, 1, plus, add);
        printf("%.17g %.17g %.17g %.17g\\n", plus[0], plus[1], add[0], add[1]);
    }
    return 0;
}
"""


def write(folder: Path, sign: float = 1.0) -> Path:
    write_records(folder, sign)
    (folder / "couple.toml").write_text(spec())
    return write_bar(folder, project=PROJECT + COUPLE)


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the project, run once into `out`."""
    folder = tmp_path_factory.mktemp("pair")
    rt.jobs.run_project(rt.jobs.read_project(write(folder)), folder / "out")
    return folder


def summary_of(folder: Path) -> Any:
    return json.loads((folder / "out" / "summary.json").read_text())


def system(table: Any) -> tuple[Array, Array, Array, Array]:
    """A, B, C, D of coupling.json, the shapes of empty ones too."""
    n = len(table["A"])
    D = np.asarray(table["D"], dtype=float)
    return (np.reshape(table["A"], (n, n)), np.reshape(table["B"], (n, D.shape[1])),
            np.reshape(table["C"], (D.shape[0], n)), D)


def test_summary_junit_and_certificates(pair: Path, run: Run) -> None:
    summary, out = summary_of(pair), pair / "out"
    assert summary["stages"]["couple"]["status"] == "done" and summary["holds"]
    numbers = summary["couple"]
    assert 0 < numbers["robust_without_circles"] < numbers["robust"] <= 0.9
    assert numbers["confidence"] == 0.95 and numbers["left_out"] == []
    written = json.loads((out / "coupling" / "coupling.json").read_text())
    assert written["verdict"] == "robust" and written["robust"] == numbers["robust"]
    suites = {suite.get("name"): suite for suite in ElementTree.parse(out / "junit.xml").iter("testsuite")}
    cases = [case for name, suite in suites.items() if name and "couple" in name for case in suite.iter("testcase")]
    assert {"Internal stability (couple)", "Robust number (couple)"} <= {case.get("name") for case in cases}
    assert not [case for case in cases if case.find("failure") is not None]
    files = {path.stem for path in (out / "coupling" / "certificates").glob("*.json")}
    assert {"stability", "robust"} <= files and run("verify", out).status == 0


def test_the_machine_is_stable_with_what_was_written(pair: Path) -> None:
    """The true plants of scipy with the controller of coupling.json: poles of the loop closed by hand."""
    written = json.loads((pair / "out" / "coupling" / "coupling.json").read_text())
    A, B, C, D = system(written["filters"]["controller"])
    first, second = (tf2ss(*plant) for plant in true_plants())
    F, G, H = (block_diag(one, two) for one, two in zip(first[:3], second[:3], strict=True))
    assert not np.any(first[3]) and not np.any(second[3])
    loop = np.block([[F - G @ D @ H, G @ C], [-B @ H, A]])  # u = K e, e = -y
    assert np.abs(np.linalg.eigvals(loop)).max() < 1 - 1e-4


def test_the_measured_responses_are_those_of_the_machine(pair: Path) -> None:
    for name, plant in zip(("reticle", "wafer"), true_plants(), strict=True):
        found = rt.identify.read_response(pair / "out" / "responses" / f"{name}.json")
        error = np.abs(found.response[0, 0] - response(plant, found.frequencies))
        assert np.mean(error <= found.confidence_radius(0.95)[0, 0]) > 0.9
        assert np.all(error <= found.confidence_radius(1 - 0.05 / (2 * len(found)))[0, 0])  # joint, as the envelope


@pytest.mark.skipif(GCC is None, reason="no C compiler on this machine")
def test_the_exported_c_is_the_coupling(pair: Path, tmp_path: Path) -> None:
    """Its own test vector, and its step function against the state space of coupling.json run by scipy."""
    source = pair / "out" / "coupling" / "coupling.c"
    shutil.copy(source, tmp_path)
    (tmp_path / "main.c").write_text(MAIN)
    e = np.random.default_rng(3).standard_normal((400, 2))
    given = "\n".join(f"{a:.17g} {b:.17g}" for a, b in e)
    assert build(tmp_path / "coupling.c", "-DCOUPLING_TEST").strip() == "0"
    printed = np.array(build(tmp_path / "main.c", given=given).split(), dtype=float).reshape(-1, 4)
    written = json.loads((source.parent / "coupling.json").read_text())["filters"]
    laws = [lfilter(*padded(stage.controller()), printed[:, k]) for k, stage in enumerate((RETICLE, WAFER))]
    u = np.array(laws).T + printed[:, 2:]  # K of e, as one system in coupling.json
    expected = dlsim((*system(written["controller"]), DT), e)[1]
    np.testing.assert_allclose(u, expected, atol=1e-6 * np.abs(expected).max())


def build(path: Path, *more: str, given: str = "") -> str:
    """Compile, run, and what it printed."""
    program = path.with_suffix(".out")
    subprocess.run([str(GCC), *FLAGS, *more, str(path), "-o", str(program), "-lm"], check=True)
    return subprocess.run([str(program)], input=given, capture_output=True, text=True, check=False).stdout


def test_run_again(pair: Path, run: Run) -> None:
    """Nothing changed: cached. Another design: the coupling alone."""
    again = json.loads(run("run", pair / "project.toml", "--out", pair / "out", "--json").out)
    assert {again["stages"][name] for name in ("identify", "calibrate", "certify", "couple")} == {"cached"}
    text = (pair / "couple.toml").read_text()
    (pair / "couple.toml").write_text(text.replace("order = 8", "order = 6"))
    again = json.loads(run("run", pair / "project.toml", "--out", pair / "out", "--json").out)
    assert again["stages"]["couple"] == "done" and again["stages"]["identify"] == "cached"


def test_a_turned_sensor_is_refused(tmp_path: Path, run: Run) -> None:
    """The measured wafer stage with the other sign is one that its controller does not stabilize."""
    said = run("run", write(tmp_path, sign=-1.0), "--out", tmp_path / "out")
    assert said.status == 2 and "do not stabilize this measured plant" in said.err
    assert "wafer.json" in said.err and not (tmp_path / "out" / "coupling").exists()
    assert (tmp_path / "out" / "responses" / "wafer.json").is_file()  # the stages before stay
