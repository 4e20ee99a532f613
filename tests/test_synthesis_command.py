"""`robthermal design PLANT.toml --method ...`: what is written, exit statuses, refusals."""

from __future__ import annotations

import json
import re

import control
import numpy as np
import pytest

import robthermal as rt

PLANT = """
[plant]
A = [[0.0, 10.0, 2.0], [-1.0, 1.0, 0.0], [0.0, 2.0, -5.0]]
B = [[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]]
C = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
D = [[0.0, 0.0], [0.0, 1.0], [2.0, 0.0]]
n_meas = 1
n_ctrl = 1
"""


def design_by(run, folder, content, method):
    (folder / "plant.toml").write_text(content)
    return run("design", str(folder / "plant.toml"), "--method", method, "--out", str(folder / "out"))


@pytest.mark.parametrize(("method", "bound"), [("hinf", 9.508085 * 1.005), ("h2", 1e9)])
def test_plant_of_matrices(run, tmp_path, method, bound):
    done = design_by(run, tmp_path, PLANT, method)
    assert done.status == 0, done.out + done.err
    design = json.loads((tmp_path / "out" / "design.json").read_text())
    assert design["format"] == "robthermal-design/1" and 0 < design["value"] < bound and design["outcome"]["ok"]
    saved = rt.Certificate.load(tmp_path / "out" / "certificates" / f"1_{method}.json")
    assert rt.verify(saved).valid and saved.region["bound"] == design["value"]
    assert {"report.html", "junit.xml", "summary.json"} <= {path.name for path in (tmp_path / "out").iterdir()}
    assert run("verify", str(tmp_path / "out" / "certificates" / f"1_{method}.json")).status == 0


def test_sampled_plant_from_a_file_has_c_source(run, tmp_path):
    matrices = {"A": [[0.9]], "B": [[1, 0, 1]], "C": [[1], [0], [1]], "D": [[0, 0, 0], [0, 0, 1], [0, 1, 0]]}
    (tmp_path / "plant.json").write_text(json.dumps(matrices))
    done = design_by(run, tmp_path, '[plant]\nfile = "plant.json"\nn_meas = 1\nn_ctrl = 1\ndt = 0.5\n', "h2")
    assert done.status == 0 and (tmp_path / "out" / "controller.c").exists()


def test_gamma_that_is_not_reached_is_an_honest_no(run, tmp_path):
    done = design_by(run, tmp_path, PLANT + "[design]\ngamma = 9.0\n", "hinf")
    assert done.status == 1 and "best achievable is about 9.5" in done.out + done.err
    assert not list((tmp_path / "out" / "certificates").glob("*"))


def test_pid_of_a_measured_response(run, tmp_path):
    f = np.geomspace(1e-4, 0.1, 120)
    lag = control.tf([2.0], np.polymul([60, 1], [8, 1]))
    G = rt.identify.FrequencyResponse(
        frequencies=f, response=np.array([complex(lag(2j * np.pi * x)) for x in f])[None, None],
        noise_covariance=np.full((1, 1, 120), 1e-4), gram=np.ones((1, 1, 120)), degrees_of_freedom=np.full(120, 50),
        input_names=["q"], output_names=["T"], sample_time=1.0, n_samples=1000, method="made for a test")
    G.save(tmp_path / "frf.json")
    done = design_by(run, tmp_path, '[frf]\nfile = "frf.json"\n[design]\nmodulus_margin = 0.6\n', "frf-pid")
    assert done.status == 0, done.out + done.err
    design = json.loads((tmp_path / "out" / "design.json").read_text())
    assert design["outcome"]["code"] == "at_the_bins" and design["value"] <= 1 / 0.6
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert [reason["code"] for reason in summary["reasons"]] == ["at_the_bins"]
    assert summary["verdict"] == "PASS WITH REMARKS"
    page = (tmp_path / "out" / "report.html").read_text()
    assert "not proven: 1." in page and "tested on data; nothing here is proven" in page
    assert "below is proven" not in page and not re.search("stability certification", page, re.IGNORECASE)


@pytest.mark.parametrize(("content", "method", "words"), [
    (PLANT.replace("n_ctrl = 1", "n_ctrl = 5"), "hinf", "n_ctrl = 5"),
    (PLANT.replace("D = ", "E = "), "hinf", "'plant.E'"), (PLANT + "[design]\nspeed = 3\n", "h2", "'speed'"),
    (PLANT.replace("[2.0, 0.0]]", "[2.0]]"), "hinf", "fit together"), ("[design]\n", "hinf", "or neither"),
    (PLANT.replace("[0.0, 1.0], [1.0, 0.0]]", "[0.0, 0.0], [1.0, 0.0]]"), "hinf", "not stabilisable"),
    ('[frf]\nfile = "none.json"\n', "frf-pid", "none.json")])
def test_bad_files_name_what_is_wrong(run, tmp_path, content, method, words):
    done = design_by(run, tmp_path, content, method)
    assert done.status == 2 and words in " ".join((done.out + done.err).split()), done.out + done.err
    assert not (tmp_path / "out").exists()


SMALL = """
[plant]
A = [[{A}]]
B = [[1.0, {B2}]]
C = [[{C1}], [1.0]]
D = [[0.0, {D12}], [{D21}, {D22}]]
n_meas = 1
n_ctrl = 1
"""


@pytest.mark.parametrize(("changes", "method", "status", "words"), [
    ({"A": 0.7, "B2": 0.0}, "hinf", 2, "[plant]: not stabilisable: the mode at +0.7 1/s"),
    ({"A": 0.0, "B2": 0.0}, "h2", 2, "the mode at 0 rad/s (an integrator)"),
    ({"A": 0.0, "B2": 0.0}, "h2", 2, "Of a weight: take a stable one"),
    ({"B2": -1.0}, "hinf", 0, "not every control shows in the performance outputs at 0 rad/s"),  # 1 - 1/(s + 1)
    ({"D12": 0.0}, "hinf", 0, "not every control shows in the performance outputs at infinite frequency"),
    ({"D21": 0.0}, "h2", 0, "not every measurement is disturbed at infinite frequency"),
    ({"D22": 0.5}, "hinf", 0, ""),
    ({"n": "[design]\ngamma = -1.0"}, "hinf", 2, "plant.toml [design] gamma: gamma is -1")])
def test_plants_with_a_flaw_get_the_mode_the_frequency_or_the_best(run, tmp_path, changes, method, status, words):
    values = {"A": -1.0, "B2": 1.0, "C1": 1.0, "D12": 1.0, "D21": 1.0, "D22": 0.0, "n": ""} | changes
    done = design_by(run, tmp_path, SMALL.format(**values) + values["n"] + "\n", method)
    said = " ".join((done.out + done.err).split())
    if status == 0:
        facts = json.loads((tmp_path / "out" / "design.json").read_text())
        said, lacking = facts["outcome"]["text"], "Weights are missing" in facts["outcome"]["text"]
        assert facts["outcome"]["ok"] and lacking == bool(words)
    assert done.status == status and words in said


@pytest.mark.parametrize(("method", "more", "kinds"), [
    ("mixed", "[design]\nhinf_limit = 12.0\n", ["closed_loop", "closed_loop"]),
    ("output-feedback", "[design]\norder = 1\n", ["closed_loop"])])
def test_methods_with_arguments(run, tmp_path, method, more, kinds):
    done = design_by(run, tmp_path, PLANT + more, method)
    assert done.status == 0, done.out + done.err
    files = sorted((tmp_path / "out" / "certificates").glob("*"))
    assert [rt.Certificate.load(path).kind for path in files] == kinds


def test_robust_performance_from_a_file(run, tmp_path):
    content = ("[plant]\nA = [[-1.0]]\nB = [[0.2, 1.0, 0.0, 1.0]]\nC = [[0.0], [1.0], [0.0], [1.0]]\n"
               "D = [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.5], [0.0, 0.0, 0.1, 0.0]]\n"
               'n_meas = 1\nn_ctrl = 1\n[design]\norder = 1\nblocks = [["full", 1, 1], ["full", 2, 2]]\n')
    done = design_by(run, tmp_path, content, "mu")
    assert done.status == 0, done.out + done.err
    assert (tmp_path / "out" / "certificates" / "1_frequency.json").exists()
    assert "matrices in floating-point numbers" in (tmp_path / "out" / "report.html").read_text().replace("&#39;", "'")


def test_a_missing_argument_is_named(run, tmp_path):
    done = design_by(run, tmp_path, PLANT, "mixed")
    assert done.status == 2 and "design.hinf_limit is missing" in " ".join((done.out + done.err).split())


VERTICES = """
[plant]
n_ctrl = 1
vertices = [{ A = [[0.0, 1.0], [-1, -0.1]], B = [[0.0], [1.0]] }, { A = [[0.0, 1.0], [2, -0.1]], B = [[0.0], [1.0]] }]
[design]
rate = 0.5
"""
SETUP = """
[system]
name = "stage"
temperature_unit = "K"
[ambients.room]
temperature = 298.0
[lumps.plate]
capacity = 60.0
[lumps.module]
capacity = 12.0
[lumps.sink]
capacity = 90.0
[[links]]
between = ["plate", "module"]
conductance = 5.0
[[links]]
between = ["sink", "room"]
conductance = 4.0
[[links]]
between = ["plate", "room"]
conductance = 0.15
[modules.m]
hot = "sink"
cold = "module"
seebeck = { value = 0.052, slope = 0.0 }
resistance = { value = 2.1, slope = 0.0 }
conductance = { value = 0.5, slope = 0.0 }
reference_temperature = 298.0
"""
SCHEDULED = """
[system]
file = "setup.toml"
box = { temperature = [265.0, 335.0], current = [0.2, 1.8] }
[design]
operating = 1.0
rate = 0.012
"""


def test_state_feedback_for_vertices(run, tmp_path):
    done = design_by(run, tmp_path, VERTICES, "polytope")
    assert done.status == 0, done.out + done.err
    design = json.loads((tmp_path / "out" / "design.json").read_text())
    saved = rt.Certificate.load(tmp_path / "out" / "certificates" / "1_stability.json")
    assert rt.verify(saved).valid and saved.system["gain"] == design["gain"] and design["rate"] >= 0.5
    assert "constant or varying" in (tmp_path / "out" / "report.html").read_text()
    assert run("verify", "--second", str(tmp_path / "out" / "certificates" / "1_stability.json")).status == 0
    refused = tmp_path / "no"
    refused.mkdir()
    far = design_by(run, refused, VERTICES.replace("[[0.0], [1.0]] }]", "[[0.0], [-1.0]] }]"), "polytope")
    assert far.status == 1 and "at the mean of vertices 1 and 2" in " ".join((far.out + far.err).split())


LPV = """
[plant]
n_meas = 1
n_ctrl = 1
vertices = [
    { A = [[-1.0]], B = [[1, 0, 1]], C = [[1], [0], [1]], D = [[0, 0, 0], [0, 0, 1], [0, 1, 0]] },
    { A = [[1.0]], B = [[1, 0, 1]], C = [[1], [0], [1]], D = [[0, 0, 0], [0, 0, 1], [0, 1, 0]] },
]
[design]
scheduling = { a = [-1.0, 1.0] }
"""


def test_a_scheduled_controller_for_vertices(run, tmp_path):
    done = design_by(run, tmp_path, LPV, "lpv")
    assert done.status == 0, done.out + done.err
    design = json.loads((tmp_path / "out" / "design.json").read_text())
    saved = rt.Certificate.load(tmp_path / "out" / "certificates" / "1_hinf.json")
    assert rt.verify(saved).valid and len(design["controllers"]) == 2 and 2.73 < design["value"] < 2.77
    assert saved.system["controller"][1]["A"] == design["controllers"][1]["A"]
    assert "averaged with the weights of the plant" in (tmp_path / "out" / "report.html").read_text()
    assert run("verify", "--second", str(tmp_path / "out" / "certificates" / "1_hinf.json")).status == 0
    (tmp_path / "low").mkdir()
    low = design_by(run, tmp_path / "low", LPV + "gamma = 2.5\n", "lpv")
    assert low.status == 1 and "best achievable with one quadratic form" in " ".join((low.out + low.err).split())


PREDICTIVE = """
[plant]
A = [[0.0, 1.0], [0.0, 0.0]]
B = [[0.0], [1.0]]
n_ctrl = 1
[design]
horizon = 15
Q = [1.0, 0.1]
R = 0.1
sample_time = 0.2
limits = { control = [-1.0, 1.0], state = [[-5.0, -1.2], [5.0, 1.2]] }
"""
WINDUP = """
[plant]
A = [[-0.1]]
B = [[0.1, 1.0]]
C = [[1.0], [-1.0]]
D = [[0.0, 0.0], [0.0, 0.0]]
n_ctrl = 1
[controller]
A = [[-1e-3]]
B = [[1.0]]
C = [[0.1]]
D = [[0.5]]
[design]
limits = 1.0
"""


def test_predictive_control_writes_its_terminal_set(run, tmp_path):
    done = design_by(run, tmp_path, PREDICTIVE, "mpc")
    assert done.status == 0, done.out + done.err
    design = json.loads((tmp_path / "out" / "design.json").read_text())
    saved = rt.Certificate.load(tmp_path / "out" / "certificates" / "1_ellipsoid.json")
    assert rt.verify(saved).valid and saved.region["level"] == design["terminal"]["level"] == design["value"]
    assert saved.system["controller"]["D"] == design["terminal"]["K"]
    assert "Predictive controller: 2 states" in (tmp_path / "out" / "controller.c").read_text()
    assert "quadratic program of every sample" in (tmp_path / "out" / "report.html").read_text()
    assert run("verify", "--second", str(tmp_path / "out" / "certificates" / "1_ellipsoid.json")).status == 0


def test_anti_windup_from_a_file(run, tmp_path):
    done = design_by(run, tmp_path, WINDUP, "anti-windup")
    assert done.status == 0, done.out + done.err
    report = (tmp_path / "out" / "report.html").read_text()
    assert "no actuator saturates" not in report and "actuators that saturate" in report
    (tmp_path / "region").mkdir()
    region = design_by(run, tmp_path / "region", WINDUP.replace("[[-0.1]]", "[[0.3]]"), "anti-windup")
    made = json.loads((tmp_path / "region" / "out" / "design.json").read_text())
    assert region.status == 0 and made["outcome"]["code"] == "certified_region" and made["level"] == 1.0
    assert "in a region only" in (tmp_path / "region" / "out" / "report.html").read_text()
    files = sorted((tmp_path / "region" / "out" / "certificates").glob("*"))
    assert len(files) == 2 and run("verify", "--second", *map(str, files)).status == 0
    (tmp_path / "no").mkdir()
    missing = design_by(run, tmp_path / "no", WINDUP.replace("controller]", "other]"), "anti-windup")
    assert missing.status == 2
    (tmp_path / "none").mkdir()
    none = design_by(run, tmp_path / "none", PREDICTIVE, "anti-windup")
    assert none.status == 2 and "[controller]" in none.out + none.err


def test_scheduled_currents_of_a_system(run, tmp_path):
    (tmp_path / "setup.toml").write_text(SETUP)
    done = design_by(run, tmp_path, SCHEDULED, "tem")
    assert done.status == 0, done.out + done.err
    design = json.loads((tmp_path / "out" / "design.json").read_text())
    assert design["operating_current"] == {"m": 1.0} and design["level"] == 1.0 and design["rate"] == 0.012
    saved = rt.Certificate.load(tmp_path / "out" / "certificates" / "1_scheduled.json")
    assert rt.verify(saved).valid and saved.system["gain"] == design["gain"]
    report = (tmp_path / "out" / "report.html").read_text()
    assert "do not vary with time" not in report and "lumped network" in report
    (tmp_path / "fast").mkdir()
    (tmp_path / "fast" / "setup.toml").write_text(SETUP)
    fast = design_by(run, tmp_path / "fast", SCHEDULED.replace("0.012", "5.0"), "tem")
    assert fast.status == 1 and "best achievable" in " ".join((fast.out + fast.err).split())


@pytest.mark.parametrize(("content", "method", "words"), [
    (VERTICES.replace("rate", "speed"), "polytope", "'speed'"), (VERTICES, "hinf", "needs a plant"),
    (VERTICES.replace("[[0.0], [1.0]] }, {", "[[0.0]] }, {"), "polytope", "vertices[0]"),
    (LPV.replace("scheduling", "schedule"), "lpv", "'schedule'"),
    (LPV.split("[design]")[0], "lpv", "design.scheduling"), (PLANT, "lpv", "vertices"),
    (LPV.replace("[-1.0, 1.0]", "[1.0]"), "lpv", "values for 2 plants"),
    (VERTICES.replace("n_ctrl = 1", "n_ctrl = 3"), "polytope", "n_ctrl = 3"), (VERTICES, "tem", "thermal system"),
    (SCHEDULED, "tem", "setup.toml"), (SCHEDULED.replace("current =", "currents ="), "tem", "currents"),
    (SCHEDULED.replace("file =", "path ="), "tem", "path"), (PLANT.replace("n_meas = 1", ""), "hinf", "n_meas")])
def test_bad_files_of_state_feedback_name_what_is_wrong(run, tmp_path, content, method, words):
    done = design_by(run, tmp_path, content, method)
    assert done.status == 2 and words in " ".join((done.out + done.err).split()), done.out + done.err
    assert not (tmp_path / "out").exists()


def test_the_page_built_again_says_the_same(run, tmp_path):
    """Titles, sentences and margins are made from the certificates alone; bounds of six digits are never below them."""
    done = design_by(run, tmp_path, PLANT + "[design]\nhinf_limit = 12.0\n", "mixed")
    assert done.status == 0, done.out + done.err
    out = tmp_path / "out"
    said = json.loads((out / "summary.json").read_text())["claims"]
    saved = [rt.Certificate.load(out / claim["file"]) for claim in said]
    assert [claim["title"] for claim in said] == ["H2 norm", "H-infinity norm"]
    for claim, one in zip(said, saved, strict=True):
        shown = float(claim["margin"].removeprefix("below "))
        assert one.region["bound"] <= shown <= one.region["bound"] * (1 + 1e-5)
        assert claim["sentence"].endswith(f"is {claim['margin']}.") and one.claim in (out / "report.html").read_text()
    assert run("report", str(out)).status == 0
    assert json.loads((out / "summary.json").read_text())["claims"] == said
    page = (out / "report.html").read_text()
    assert "Controller design report" in page and "All 2 claims below are proven" in page
