"""robthermal couple: exit status, files, refusals, and a coupling.json that is the coupling."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import control
import numpy as np
import pytest

import robthermal as rt

ROOT = Path(__file__).resolve().parents[1]
DT = 0.01
P1, P2 = control.tf([0.01], [1, -0.99], DT), control.tf([0.02], [1, -0.98], DT)
FREQUENCIES = np.arange(0.5, 50.0, 0.5)  # Hz
Done = tuple[Path, rt.jobs.couple.Coupling]
KEYS = {"format", "name", "sample_time", "verdict", "filters", "sections", "norms", "performance", "remarks", "robust",
        "robust_without_circles", "left_out"}
SPEC = """
[coupling]
name = "pair"
sample_time = 0.01

[subsystems.1]
name = "left"
plant = { num = [0.01], den = [1.0, -0.99] }
controller = 20.0
disturbance = 1e-9

[subsystems.2]
name = "right"
plant = { A = [[0.98]], B = [[1.0]], C = [[0.02]], D = [[0.0]] }
controller = { num = [15.0], den = [1.0] }
disturbance = { file = "noise.json" }

[uncertainty]
frf_1 = ["l1.csv", "l2.csv"]
frf_2 = ["r1.csv", "r2.csv"]

[design]
window = 0.1
msd_limit = 1.5
order = 4
"""
MANUAL = SPEC[:SPEC.index("[design]")] + "[design]\nwindow = 0.1\nX_hat = -0.5\n"
NOMINAL = SPEC.replace(SPEC[SPEC.index("[uncertainty]"):SPEC.index("[design]")], "")


def frf_text(plant: Any, factor: float, header: str = "frequency [Hz],real,imag") -> str:
    response = factor * plant(np.exp(2j * np.pi * DT * FREQUENCIES))
    rows = (f"{f:.6g},{value.real:.12e},{value.imag:.12e}" for f, value in zip(FREQUENCIES, response, strict=True))
    return "\n".join(["# measured at night", header, *rows]) + "\n"


def write(folder: Path, text: str = SPEC) -> Path:
    (folder / "noise.json").write_text('{"num": [1e-9], "den": [1.0, -0.5], "sample_time": 0.01}', encoding="utf-8")
    for k, factor in enumerate((0.9, 1.1), 1):
        (folder / f"l{k}.csv").write_text(frf_text(P1, factor), encoding="utf-8")
        (folder / f"r{k}.csv").write_text(frf_text(P2, factor), encoding="utf-8")
    (folder / "SPEC.toml").write_text(text, encoding="utf-8")
    return folder / "SPEC.toml"


@pytest.fixture(scope="module")
def robust(tmp_path_factory: pytest.TempPathFactory) -> Done:
    folder = tmp_path_factory.mktemp("couple")
    result = rt.jobs.couple_subsystems(rt.jobs.read_coupling(write(folder)))
    rt.jobs.write_coupling(result, folder / "out")
    return folder / "out", result


def state_space(table: dict[str, Any], dt: float = DT) -> control.StateSpace:
    n = len(table["A"])
    shapes = {"A": (n, n), "B": (n, -1), "C": (-1, n), "D": np.shape(table["D"])}
    return control.ss(*(np.reshape(table[key], shape) for key, shape in shapes.items()), dt)


class TestYes:
    def test_files_and_status(self, run: Any, tmp_path: Path) -> None:
        out = tmp_path / "out"
        status, said, warned = run("couple", write(tmp_path, MANUAL), "--out", out, "--json")
        assert (status, warned) == (0, "")
        summary = json.loads(said)
        assert summary["holds"] and summary["verdict"] == "robust" and summary["filters"] == str(out / "coupling.json")
        assert sorted(path.name for path in out.iterdir()) == [
            "certificates", "coupling.json", "junit.xml", "report.html", "report.json", "summary.json"]
        assert run("verify", out)[0] == 0

    def test_coupling_json_has_the_keys_of_its_contract(self, robust: Done) -> None:
        found = json.loads((robust[0] / "coupling.json").read_text(encoding="utf-8"))
        assert set(found) == KEYS and found["format"] == "robthermal-coupling/1"
        assert (found["name"], found["sample_time"], found["verdict"]) == ("pair", DT, "robust")
        assert set(found["filters"]) == {"X", "Y", "X_hat", "Y_hat", "Z1", "Z2", "X_input", "Y_input", "controller"}
        assert set(found["performance"]) == {"ma_before", "ma_after", "msd_before", "msd_after"}
        assert found["norms"]["robust"] <= 0.9 and found["performance"]["msd_after"] > 0

    def test_what_the_file_holds_stabilizes_every_measured_plant(self, robust: Done) -> None:
        """From coupling.json alone: the controller, with the plants that the responses came from."""
        found = json.loads((robust[0] / "coupling.json").read_text(encoding="utf-8"))
        K = state_space(found["filters"]["controller"])
        for one in (0.9, 1.0, 1.1):
            for two in (0.9, 1.0, 1.1):
                P = control.append(control.ss(one * P1), control.ss(two * P2))
                poles = control.feedback(P, K).poles()
                assert np.all(np.abs(poles) < 1 - 1e-9)

    def test_e12_of_the_file_is_smaller_by_what_the_file_says(self, robust: Done) -> None:
        """The moving average by a second way: impulse responses of loops closed with python-control."""
        found = json.loads((robust[0] / "coupling.json").read_text(encoding="utf-8"))
        P = control.append(control.ss(P1), control.ss(P2))
        noise = control.append(control.ss([], [], [], [[1e-9]], DT), control.ss(control.tf([1e-9], [1, -0.5], DT)))
        alone = control.ss([], [], [], np.diag([20.0, 15.0]), DT)
        for K, key in ((alone, "ma_before"), (state_space(found["filters"]["controller"]), "ma_after")):
            S = control.feedback(control.ss([], [], [], np.eye(2), DT), P * K)
            impulse = control.impulse_response(S * noise, T=DT * np.arange(4000)).outputs * DT
            e12 = impulse[1] - impulse[0]  # (input, time)
            mean = np.array([np.convolve(row, np.ones(10) / 10) for row in e12])
            assert 3 * np.sqrt(np.sum(mean**2)) == pytest.approx(found["performance"][key], rel=1e-6)

    def test_every_certificate_verifies_and_the_claims_name_them(self, robust: Done) -> None:
        files = sorted((robust[0] / "certificates").glob("*.json"))
        assert {"stability", "robust", "norm_X", "norm_1_plus_X"} <= {file.stem for file in files}
        assert all(rt.verify(rt.Certificate.load(file)).valid for file in files)
        cases = ElementTree.parse(robust[0] / "junit.xml").getroot().findall(".//testcase")
        assert [case.get("name") for case in cases] == ["Internal stability", "Robust number"]

    def test_the_report_shows_before_and_after(self, robust: Done) -> None:
        page = (robust[0] / "report.html").read_text(encoding="utf-8")
        for words in ("Coupling of left and right", "Internal stability", "moving average", "ρ(|Δk| R)",
                      "l1.csv, r1.csv", "Evers (6.22)", "On the measured plants", "SHA-256 of l2.csv",
                      "SHA-256 of noise.json"):
            assert words in page
        assert page.count("<svg") >= 7

    def test_synthesis_is_that_of_the_python_function(self, robust: Done) -> None:
        frf = [control.FRD(np.eye(2)[:, :, None] * [[P(np.exp(2j * np.pi * DT * FREQUENCIES)) * k] for P in (P1, P2)],
                           2 * np.pi * FREQUENCIES, dt=DT) for k in (0.9, 1.1)]
        expected = rt.coupling.synthesize(
            P1, P2, control.tf([20.0], [1], DT), control.tf([15.0], [1], DT), uncertainty=frf, window=0.1,
            msd_limit=1.5, order=4, disturbances=(1e-9, control.tf([1e-9], [1, -0.5], DT)))
        found = robust[1].filters
        assert found.performance.ma_after == pytest.approx(expected.performance.ma_after, rel=1e-4)
        assert found.performance.ma_after < 0.95 * found.performance.ma_before

    def test_continuous_time_and_a_cutoff_in_hertz(self, tmp_path: Path) -> None:
        loop = "plant = { num = [1.0], den = [1.0, 1.0] }\ncontroller = 9.0\n"
        text = (f'[coupling]\nname = "slow"\nsample_time = 0\n[subsystems.1]\n{loop}[subsystems.2]\n{loop}'
                "[design]\nX_hat = -0.5\ncutoff = 100.0\n")
        result = rt.jobs.couple_subsystems(rt.jobs.read_coupling(write(tmp_path, text)))
        result.filters.save(tmp_path / "coupling.json")
        found = json.loads((tmp_path / "coupling.json").read_text(encoding="utf-8"))
        assert result.holds and result.simulation is None
        assert found["sections"] == {} and found["verdict"] == "nominal" and found["performance"]["ma_after"] is None
        assert np.ravel(found["filters"]["Z1"]["A"]) == pytest.approx([-2 * np.pi * 100.0])

    def test_whole_plants(self, tmp_path: Path) -> None:
        columns = [f"{part}{entry}" for entry in ("11", "12", "21", "22") for part in ("re", "im")]
        values = np.arange(8.0)[:, None] + 100.0 * np.arange(3.0)
        lines = [["frequency", *columns], *((10.0 * k, *values[:, k]) for k in (1, 2))]
        (tmp_path / "p.csv").write_text("\n".join(",".join(map(str, line)) for line in lines), encoding="utf-8")
        text = re.sub(r"frf_1 .*\nfrf_2 .*\n", 'frf = ["p.csv"]\n', SPEC)
        frf = rt.jobs.read_coupling(write(tmp_path, text)).measured[0]
        assert frf.frequencies == pytest.approx(np.array([10.0, 20.0]))
        assert frf.response[0, 1, 0] == 102 + 103j and frf.response[1, 0, 1] == 204 + 205j


@pytest.mark.usefixtures("sketched")
def test_measured_in_closed_loop_is_said_to_be_a_statement(tmp_path: Path) -> None:
    """Without the statement nothing of it is said."""
    said = {}
    for value in ("true", "false"):
        text = MANUAL.replace('frf_2 = ["r1.csv"', f'measured_in_closed_loop = {value}\nfrf_2 = ["r1.csv"')
        result = rt.jobs.couple_subsystems(rt.jobs.read_coupling(write(tmp_path, text)))
        said[value] = " ".join(rt.jobs.couple.coupling_report(result).assumptions)
    assert "The file states it (measured_in_closed_loop = true); no encirclement was counted" in said["true"]
    assert "measured_in_closed_loop" not in said["false"]


@pytest.mark.usefixtures("sketched")
class TestNo:
    def test_a_limit_that_cannot_be_met(self, run: Any, tmp_path: Path) -> None:
        out = tmp_path / "out"
        spec = write(tmp_path, NOMINAL.replace("msd_limit = 1.5", "msd_limit = 0.001"))
        status, said, _ = run("couple", spec, "--out", out, "--json")
        assert status == 1 and not json.loads(said)["holds"] and len(json.loads(said)["claims"]) == 1
        assert json.loads((out / "coupling.json").read_text(encoding="utf-8"))["verdict"] == "none"
        assert json.loads(said)["claims"][0]["reason"].startswith("No coupling filter: msd_limit = 0.001 is below")
        suite = ElementTree.parse(out / "junit.xml").getroot()
        assert suite.get("failures") == "1"
        assert "msd_limit" in (out / "report.html").read_text(encoding="utf-8")

    def test_given_filters_that_are_not_robust(self, run: Any, tmp_path: Path) -> None:
        text = MANUAL.replace("X_hat = -0.5", "X_hat = -9.0\nY_hat = 9.0")
        status, said, _ = run("couple", write(tmp_path, text), "--out", tmp_path / "out", "--json")
        found = json.loads((tmp_path / "out" / "coupling.json").read_text(encoding="utf-8"))
        assert status == 1 and found["verdict"] == "nominal" and found["norms"]["robust"] > 1
        claims = {claim["title"]: claim for claim in json.loads(said)["claims"]}
        assert not claims["What was asked for"]["holds"] and claims["Internal stability"]["verified"]
        assert "Robust number" not in claims


@pytest.mark.parametrize(("old", "new", "words"), [
    ("msd_limit", "msd_limt", ["design.msd_limt", "unknown key"]),
    ("[subsystems.2]", "[subsystems.3]", ["subsystems.3", "unknown key"]),
    ('name = "pair"\n', "", ["coupling.name", "missing"]),
    ("sample_time = 0.01", "sample_time = -1", ["coupling.sample_time", "-1"]),
    ("sample_time = 0.01", "sample_time = nan", ["coupling.sample_time", "finite"]),
    ("A = [[0.98]]", "A = [[nan]]", ["subsystems.2.plant.A", "finite"]),
    ("B = [[1.0]]", "B = [[1.0, 0.0]]", ["[subsystems.2] plant", "B has 1 rows of 2", "1x1"]),
    ("B = [[1.0]], ", "", ["[subsystems.2] plant", "has A, C, D", "A, B, C and D"]),
    ("den = [1.0, -0.99]", "den = [0.0]", ["[subsystems.1] plant", "den is zero"]),
    ("num = [0.01], den", "num = [1.0, 2.0, 3.0], den", ["[subsystems.1] plant", "improper"]),
    ("controller = 20.0", "controller = -20.0", ["[subsystems.1] plant, [subsystems.1] controller", "unstable"]),
    ("disturbance = 1e-9\n", "", ["[subsystems.1]", "no disturbance", "disturbance = 0"]),
    ("noise.json", "lost.json", ["lost.json", "cannot be read"]),
    ('frf_2 = ["r1.csv", "r2.csv"]', 'frf_2 = ["r1.csv"]', ["[uncertainty]", "2 files in frf_1, 1 in frf_2"]),
    ('frf_2 = ["r1.csv", "r2.csv"]', "", ["[uncertainty]", "2 files in frf_1, 0 in frf_2"]),
    ('frf_2 = ["r1.csv", "r2.csv"]', 'frf = ["r1.csv"]', ["[uncertainty]", "frf_1 and frf_2, or frf"]),
    ('"l2.csv"', '"lost.csv"', ["lost.csv", "no such file"]),
    ("window = 0.1", "window = 0.001", ["[design] window", "at least one sample"]),
    ("order = 4", 'objective = "h7"', ["[design]", "h7", "hinf"]),
    ("order = 4", 'basis = "wavelets"', ["[design]", "wavelets", "laguerre"]),
    ("order = 4", 'couple = ["Z"]', ["[design]", "couple"]),
    ("order = 4", 'pole = "fast"', ["[design]", "pole = 'fast'"]),
    ("order = 4", "order = 4\npole = 1.5", ["[design]", "1.5", "not stable"]),
    ("order = 4", "order = 0", ["design.order"]),
    ("order = 4", "cutoff = -3.0", ["design.cutoff", "-3"]),
    ("order = 4", "Z1 = 1.0", ["Z1 without X_hat"]),
    ("order = 4", "X_hat = 0.1", ["msd_limit beside given filters"]),
    ("msd_limit = 1.5\norder = 4", "X_hat = { num = [1.0], den = [1.0, -1.5] }", ["[design] X_hat", "unstable"]),
    ("[coupling]", "[coupling", ["TOML", "line 2"]),
])
def test_bad_input(run: Any, tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    assert old in SPEC
    spec, out = write(tmp_path, SPEC.replace(old, new, 1)), tmp_path / "out"
    status, said, warned = run("couple", spec, "--out", out)
    assert (status, said) == (2, "") and not out.exists()
    assert warned.count("\n") == 1 or "TOML" in warned
    for word in words:
        assert word in warned


@pytest.mark.parametrize(("file", "text", "words"), [
    ("r2.csv", "", ["r2.csv", "is empty"]),
    ("r2.csv", "frequency,real\n1,2\n", ["r2.csv", "columns are frequency, real", "imag"]),
    ("r2.csv", "1.0,2.0,3.0\n2.0,2.0,3.0\n", ["r2.csv", "header row"]),
    ("r2.csv", frf_text(P2, 1.0, "frequency [rad/s],real,imag"), ["r2.csv", "frequency [rad/s]", "hertz"]),
    ("r2.csv", "frequency,real,imag\n1.0,2.0,3.0\n", ["r2.csv", "1 frequencies", "at least two"]),
    ("r2.csv", "frequency,real,imag\n1.0,2.0,nan\n2.0,2.0,3.0\n", ["r2.csv, line 2", "imag", "finite"]),
    ("r2.csv", "frequency,real,imag\n1.0,2.0,3.0\n2.0,x,3.0\n", ["r2.csv, line 3", "'x'"]),
    ("r2.csv", "frequency,real,imag\n1.0,2.0\n", ["r2.csv, line 2", "2 values"]),
    ("r2.csv", "frequency,real,imag\n1.0,2.0,3.0\n2.0,2.0,3.0\n", ["r2.csv", "differ from those of 'l2.csv'"]),
    ("r2.csv", frf_text(P2, -30.0), ["[uncertainty] l2.csv, r2.csv", "do not stabilize"]),
    ("noise.json", "[1, 2]", ["noise.json", "not a JSON object"]),
    ("noise.json", "{", ["noise.json", "not valid JSON"]),
    ("noise.json", '{"num": [1.0], "den": [1.0], "sample_time": 0.02}', ["noise.json", "0.02", "sample time"]),
    ("noise.json", '{"file": "noise.json"}', ["noise.json", "another file"]),
    ("noise.json", '{"num": [1.0], "dem": [1.0]}', ["noise.json", "unknown key 'dem'"]),
])
def test_bad_files(run: Any, tmp_path: Path, file: str, text: str, words: list[str]) -> None:
    spec, out = write(tmp_path), tmp_path / "out"
    (tmp_path / file).write_text(text, encoding="utf-8")
    status, said, warned = run("couple", spec, "--out", out)
    assert (status, said) == (2, "") and not out.exists()
    for word in words:
        assert word in warned


def test_a_folder_with_other_things_is_refused_before_the_work(run: Any, tmp_path: Path) -> None:
    spec = write(tmp_path)
    status, _, warned = run("couple", spec, "--out", tmp_path)
    assert status == 2 and "other things" in warned


def test_the_example_files_are_read(tmp_path: Path) -> None:
    """examples/scanner writes what the command reads: the demo machine, number for number."""
    source = (ROOT / "examples" / "scanner" / "make_files.py").read_text(encoding="utf-8")
    names: dict[str, Any] = {"__name__": "make_files"}
    exec(compile(source, "make_files.py", "exec"), names)
    names["main"](tmp_path)
    job, machine = rt.jobs.read_coupling(tmp_path / "SPEC.toml"), rt.systems.scanner()
    assert job.names == machine.names and len(job.measured) == len(machine.frf)
    assert np.array_equal(np.asarray(job.plants[1].A), machine.P2.A)
    assert 2 * np.pi * job.measured[4].frequencies == pytest.approx(machine.frf[4].omega)
    assert np.allclose(job.measured[4].response, machine.frf[4].frdata, rtol=1e-8, atol=0)
    assert job.options == {"window": 0.01, "msd_limit": 1.2, "margin": 0.1, "stable_controller": True}
