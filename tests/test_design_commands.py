"""The commands design and map: exit status, files, refusals, and a design.json from which the controller runs."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from commands import Run, without_progress

import robthermal as rt
from robthermal.errors import InputError
from robthermal.jobs.design._corners import corners
from robthermal.jobs.design._file import design_numbers
from robthermal.jobs.design._limits import check_given, contain, worst_runaway

pytestmark = pytest.mark.usefixtures("sketched")
ROOT = Path(__file__).resolve().parents[1]

BENCH = """
[system]
name = "bench"
temperature_unit = "degC"

[ambients.room]
temperature = 22.0

[lumps.sink]
capacity = 120.0

[lumps.stage]
capacity = 35.0

[lumps.part]
capacity = 20.0

[lumps.box]
capacity = 50.0

[[links]]
between = ["sink", "room"]
conductance = 0.9

[[links]]
between = ["stage", "part"]
conductance = 1.5

[[links]]
between = ["part", "box"]
conductance = 0.05

[[links]]
between = ["box", "room"]
conductance = 0.3

[inputs.heater]
lump = "part"
gain = 2.0
limits = [0.0, 0.5]

[modules.m1]
hot = "sink"
cold = "stage"
seebeck = { value = 0.0537, slope = 7.4e-5 }
resistance = { value = 4.63, slope = 0.0228 }
conductance = { value = 0.297, slope = 0.0005 }
reference_temperature = 35.0
current_limits = [-3.3, 3.3]

[sensors.T_sink]
lump = "sink"
noise = 0.01
offset = 0.3
gain = 1.02

[sensors.T_part]
lump = "part"
noise = 0.01

[sensors.T_slow]
lump = "part"
noise = 0.01
time_constant = 20.0
"""


@pytest.fixture
def bench() -> rt.System:
    return rt.thermal.parse_system(BENCH, "bench.toml")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "bench.toml").write_text(BENCH, encoding="utf-8")
    return tmp_path / "bench.toml"


@pytest.fixture
def without_linearity(monkeypatch: pytest.MonkeyPatch) -> None:
    """The steps that show how linear a loop is take half of a small design: computed where they are looked at."""
    monkeypatch.setattr("robthermal.jobs.design._design._collapse", lambda *given: None)


@pytest.fixture
def nonlinear(without_linearity: None) -> rt.jobs.design.ControllerDesign:
    """With natural convection, heater, offset and gain of a sensor: everything that design.json can hold."""
    text = BENCH.replace('between = ["stage", "part"]',
                         'between = ["stage", "part"]\nnatural = { gain = 0.01, exponent = 0.25 }\nradiation = 1e-10')
    system = rt.thermal.parse_system(text, "nonlinear.toml")
    return rt.jobs.design_system(system, rt.jobs.design.design_from_text(system, setpoint=["m1=12"], bandwidth=0.05,
                                                                         sample_time=2.0))


FAST = ("--setpoint", "m1=12", "--bandwidth", "0.05", "--sample-time", "2")


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the command design leaves behind, called as a program."""
    folder = tmp_path_factory.mktemp("design")
    (folder / "bench.toml").write_text(BENCH, encoding="utf-8")
    done = subprocess.run([sys.executable, "-m", "robthermal", "design", "bench.toml", *FAST, "--out", "out", "--json"],
                          cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"},
                          capture_output=True, text=True)
    assert (done.returncode, without_progress(done.stderr)) == (0, "")
    (folder / "said.json").write_text(done.stdout, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def fold() -> rt.thermal.LoadCurve:
    """The way to the fold with the stage at 12 °C, from the room that computes it."""
    return rt.thermal.fold(rt.thermal.parse_system(BENCH, "bench.toml"), {"m1": 285.15})


@pytest.fixture(scope="module")
def two() -> rt.jobs.design.ControllerDesign:
    """The two-module set-up, read by the sensors of the thesis."""
    system = rt.systems.two_module()
    request = rt.jobs.design.design_from_text(system, setpoint=["m1=8", "m2=10"], sensors="T6,T7,T15,T16")
    return rt.jobs.design_system(system, request)


def test_design_writes_a_complete_folder_and_says_yes(written: Path, run: Run) -> None:
    out, summary = written / "out", json.loads((written / "said.json").read_text(encoding="utf-8"))
    assert summary["holds"] and summary["controller"] == "out/design.json"
    assert {path.name for path in out.iterdir()} == {"certificates", "design.json", "junit.xml", "report.html",
                                                     "report.json", "summary.json"}
    titles = [claim["title"] for claim in summary["claims"]]
    assert titles == ["Contraction at the current limits", "The box is never left",
                      "Contraction in the box that is never left", "The observer's error shrinks"]
    cases = ElementTree.parse(out / "junit.xml").findall(".//testcase")
    gates = ["not_certified", "not_verified", "current_beyond_invariance", "not_robust", "margin_missed",
             "loop_not_robust", "setpoint_not_held", "nominal_only"]  # looked for, none failed
    assert [case.get("name") for case in cases] == titles + gates
    assert not [case for case in cases if case.find("failure") is not None]
    assert run("verify", out).status == 0
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("<svg") >= 4 and "How linear the loop is" in page


@pytest.mark.exhaustive
@pytest.mark.usefixtures("without_linearity")
def test_a_distant_sensor_is_regulated(run: Run, file: Path, tmp_path: Path) -> None:
    """The set-point is what the lagging sensor on the part reads; the report and the file say what is regulated."""
    said = run("design", file, "--setpoint", "m1=12", "--regulate", "m1=T_slow", "--bandwidth", "0.01", "--sample-time",
               "2", "--out", tmp_path / "out")
    assert said.status == 0
    numbers = json.loads((tmp_path / "out" / "design.json").read_text(encoding="utf-8"))
    point = numbers["controller"]["modules"]["m1"]["regulates"]
    assert (point["kind"], point["name"], point["lump"], point["time_constant"]["value"]) == ("sensor", "T_slow",
                                                                                              "part", 20.0)
    assert "T_slow" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert numbers["setpoint"]["value"]["m1"] == pytest.approx(285.15)


def test_numbers_of_the_file_agree_with_the_certificates(written: Path, fold: rt.thermal.LoadCurve) -> None:
    numbers = json.loads((written / "out" / "design.json").read_text(encoding="utf-8"))
    module = numbers["law"]["modules"]["m1"]
    low, high = module["current_limits"]["value"]
    assert numbers["format"] == "robthermal-design/1" and numbers["holds"] and numbers["not_certified"] == {}
    for name in ("contraction", "box", "box_contraction", "observer"):
        certificate = rt.Certificate.load(written / "out" / "certificates" / f"{name}.json")
        assert [float(value) for value in certificate.region["current"]["m1"]] == [low, high]
        assert f"certificates/{name}.json" in numbers["certificates"]
    assert module["runaway_current"]["value"] == pytest.approx(fold.current[-1, 0])
    assert module["runaway_load"]["value"] == pytest.approx(fold.load[-1, 0])
    assert 0.9 * fold.current[-1, 0] < high < fold.current[-1, 0]
    # the lagging sensor, and the second one on its lump, are left out unless asked for
    assert [sensor["name"] for sensor in numbers["observer"]["sensors"]] == ["T_sink", "T_part"]


class FromFile:
    """Controller and observer programmed from design.json alone, scalar by scalar, as its equations say."""

    def __init__(self, numbers: dict[str, Any], inputs: list[float]):
        self.n, self.inputs, self.h = numbers, np.array(inputs), numbers["sample_time"]["value"]
        self.lumps: list[str] = numbers["observer"]["lumps"]
        self.matrix = {key: np.array(numbers["observer"][key]["value"]) for key in ("A_d", "Gamma", "B", "L")}
        self.z: dict[str, float] = {}

    def properties(self, name: str, x: np.ndarray) -> tuple[float, float, float, float, float]:
        m = self.n["law"]["modules"][name]
        hot, cold = x[self.lumps.index(m["hot"])], x[self.lumps.index(m["cold"])]
        T = 0.5 * (hot + cold) - m["reference_temperature"]["value"]
        S, R, K = (m[key]["value"] + m[key]["slope"] * T for key in ("seebeck", "resistance", "conductance"))
        return S, R, K, hot, cold

    def current(self, name: str, x: np.ndarray) -> float:
        S, R, K, hot, cold = self.properties(name, x)
        gains = self.n["controller"]["modules"][name]
        r = self.n["setpoint"]["value"][name]
        z = self.z.setdefault(name, K * (hot - cold))  # no current flows at the start
        v = gains["proportional"]["value"] * (r - cold) + z
        a, q = S * cold / R, v - K * (hot - cold)
        s = max(2 * q / R, -a * a)
        low, high = self.n["law"]["modules"][name]["current_limits"]["value"]
        current = min(max(-s / (a + np.sqrt(a * a + s)), low), high)
        achieved = K * (hot - cold) + R * current**2 / 2 - S * cold * current
        keep = np.exp(-self.h / gains["tracking_time"]["value"])
        self.z[name] = z + self.h * gains["integral"]["value"] * (r - cold) + (1 - keep) * (achieved - v)
        return float(current)

    def observe(self, x: np.ndarray, currents: dict[str, float], readings: np.ndarray) -> np.ndarray:
        obs = self.n["observer"]
        f = self.matrix["B"] @ self.inputs
        for name, current in currents.items():
            S, R, K, hot, cold = self.properties(name, x)
            m = self.n["law"]["modules"][name]
            leak = (K - m["conductance"]["value"]) * (hot - cold)
            f[self.lumps.index(m["hot"])] += S * hot * current + R * current**2 / 2 - leak
            f[self.lumps.index(m["cold"])] += -S * cold * current + R * current**2 / 2 + leak
        for link in obs["bent_links"]:
            a, b = (self.lumps.index(end) for end in link["between"])
            dT = x[a] - x[b]
            flow = link["gain"] * abs(dT) ** link["exponent"] * dT + link["radiation"] * (x[a]**4 - x[b]**4)
            f[a] -= flow
            f[b] += flow
        reference = obs["reference"]["value"]
        y = [reference + (reading - s["offset"]["value"] - reference) / s["gain"]
             for reading, s in zip(readings, obs["sensors"], strict=True)]
        seen = [x[self.lumps.index(s["lump"])] for s in obs["sensors"]]
        return self.matrix["A_d"] @ x + self.matrix["Gamma"] @ f + self.matrix["L"] @ (np.array(y) - np.array(seen))


def closed_loop(numbers: dict[str, Any], system: rt.System, inputs: list[float], samples: int) -> np.ndarray:
    """Currents when the plant is driven by what design.json says."""
    made = FromFile(numbers, inputs)
    plant = rt.thermal.Stepper(system, made.h)
    order = [system.sensor_names.index(s["name"]) for s in numbers["observer"]["sensors"]]
    x, rows = plant.lumps, []
    for _ in range(samples):
        currents = {name: made.current(name, x) for name in numbers["law"]["modules"]}
        x = made.observe(x, currents, plant.readings[order])
        plant.step(currents, {})
        rows.append(list(currents.values()))
    return np.array(rows)


@pytest.mark.exhaustive
@pytest.mark.parametrize("which", ["bench", "two"])
def test_a_controller_programmed_from_the_file_is_the_one_that_was_simulated(
        which: str, bench: rt.System, two: rt.jobs.design.ControllerDesign, request: pytest.FixtureRequest) -> None:
    done = two if which == "two" else request.getfixturevalue("nonlinear")
    numbers = json.loads(json.dumps(design_numbers(done)))
    system = done.certification.system
    inputs = [0.0] * len(system.inputs) + [part.temperature for part in system.ambients.values()]
    found = closed_loop(numbers, system, inputs, 100)
    duration = 100.0 * done.controller.sample_time
    expected = rt.design.simulate_loop(system, done.controller, list(done.request.setpoint.values()), law=done.law,
                                       duration=duration, observer=done.observer).current
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert np.abs(found).max() > 0.05


@pytest.mark.exhaustive
def test_limits_are_below_the_fold_and_the_box_is_never_left(two: rt.jobs.design.ControllerDesign) -> None:
    fold = two.certification.runaway
    assert two.holds and fold is not None
    for name, high in zip(two.law.names, two.law.current_high, strict=True):
        assert 0.9 * fold.current[name] < high < fold.current[name]
    assert two.certification.safe.holds
    assert max(high for _, high in two.certification.safe.temperature.values()) <= 358.15
    assert two.loop.outcome.code == "settled" and two.observer is not None
    assert two.collapse is not None and two.collapse.outcome and two.collapse.ratio > 20


@pytest.mark.exhaustive
def test_limits_beyond_the_certified_ones_are_refused_with_these(two: rt.jobs.design.ControllerDesign) -> None:
    asked = replace(two.request, current={"m1": (-3.3, 0.5)})
    done = two.certification
    assert done.runaway is not None
    with pytest.raises(InputError, match=r"m1=-3.3:0.5: the range is not certified.*-2.72:2.72 \(symmetric\)"):
        check_given(done.system, asked, done.runaway, (done.limits[0], done.limits[1]))


def test_the_worst_ambient_counts(bench: rt.System) -> None:
    request = rt.jobs.design.design_from_text(bench, setpoint=["m1=12"], ambient=["room=15:35"])
    worst = worst_runaway(bench, request).current["m1"]
    assert worst == pytest.approx(rt.thermal.fold(bench, {"m1": 285.15}, ambient={"room": 308.15}).current[-1, 0])
    ambient = contain(bench, request, {"m1": (0.0, 1.0)}).invariance.region["ambient"]["room"]
    assert [float(value) for value in ambient] == [288.15, 308.15]


def coldest(system: rt.System, heat: float, room: float, most: float) -> float:
    """Coldest stage in steady state with this heat into the part, over a fine grid of currents [K]."""
    found = [rt.thermal.steady_state(system, {"m1": current, "room": room}, heat={"part": heat}).equilibria[0]
             for current in np.linspace(0.0, most, 201)]
    return min(one.temperatures["stage"] for one in found)


@pytest.mark.usefixtures("without_linearity")
def test_a_heater_that_is_too_strong_for_a_set_point_is_said(bench: rt.System) -> None:
    """Within its limits it warms the stage beyond what any allowed current takes away: that passed without a word."""
    strong = bench.with_parameters({"inputs.heater.gain": 12.0})
    done = rt.jobs.design_system(strong, rt.jobs.design.design_from_text(
        strong, setpoint=["m1=12"], bandwidth=0.05, sample_time=2.0, ambient=["room=15:30"]))
    (reason,) = [one for one in rt.jobs.design.design_report(done, ()).reasons if one.code == "setpoint_not_held"]
    reached = float(re.search(r"m1 reaches ([0-9.]+) °C instead of 12 °C", reason.text)[1])  # type: ignore[index]
    assert "With room at 30 °C, 6 W into part" in reason.text and reason.level == "remark"
    assert reached == pytest.approx(coldest(strong, 6.0, 303.15, done.law.current_high[0]) - 273.15, abs=0.05)
    assert [(one.ambient["room"], one.heat, one.held) for one in done.corners][:3] == [
        (303.15, {}, True), (288.15, {}, True), (303.15, {"part": 6.0}, False)]


@pytest.mark.usefixtures("without_linearity")
def test_a_heater_whose_power_follows_temperature_counts_at_its_limits(bench: rt.System) -> None:
    text = BENCH.replace("gain = 2.0\nlimits = [0.0, 0.5]", "gain = 2.0\nlimits = [0.0, 0.5]\npower_slope = 0.004")
    system = rt.thermal.parse_system(text, "following.toml")
    wanted = rt.jobs.design.design_from_text(system, setpoint=["m1=12"], bandwidth=0.05, sample_time=2.0)
    found = corners(rt.design.feedback_linearization(system, current_limits={"m1": (0.0, 2.0)}), wanted)
    assert [(one.heat, one.heaters, one.held) for one in found] == [({}, {}, True), ({}, {"heater": 0.5}, True)]
    assert str(found[1]) == "heater at 0.5" and not found[0].heated and found[1].heated
    plain = corners(rt.design.feedback_linearization(bench, current_limits={"m1": (0.0, 2.0)}), wanted)
    needed = [one.reach.current["m1"] for one in (found[0], found[1], plain[1]) if one.reach is not None]
    assert plain[1].heat == {"part": 1.0} and needed[0] < needed[1] == pytest.approx(needed[2], rel=0.05)


@pytest.mark.usefixtures("without_linearity")
def test_heat_that_is_stated_is_certified_and_must_be_held(bench: rt.System) -> None:
    wanted = rt.jobs.design.design_from_text(bench, setpoint=["m1=12"], bandwidth=0.05, sample_time=2.0)
    done = rt.jobs.design_system(bench, replace(wanted, heat={"part": (0.0, 1.5), "box": (0.0, 1.0)}))
    box = next(one.certificate for one in done.certification.checked if one.key == "box")
    assert {name: [float(end) for end in pair] for name, pair in box.region["heat"].items()} == {
        "part": [0.0, 1.5], "box": [0.0, 1.0]}
    most = done.corners[-1]
    assert most.heat == {"part": 1.5, "box": 1.0} and most.held and most.reach is not None
    assert most.reach.current["m1"] > done.reach.current["m1"] + 0.05
    with pytest.raises(InputError, match=r"m1 at 12 °C cannot be held: .*with 12 W into part"):
        rt.jobs.design_system(bench, replace(wanted, heat={"part": (0.0, 12.0)}))


@pytest.mark.exhaustive
@pytest.mark.usefixtures("without_linearity")
def test_a_set_point_that_needs_more_than_the_usable_current_is_not_certified(bench: rt.System, tmp_path: Path) -> None:
    """60 °C needs more heating than the box that is never left allows: the design is written, its claim fails."""
    request = rt.jobs.design.design_from_text(bench, setpoint=["m1=60"], bandwidth=0.05, sample_time=2.0)
    done = rt.jobs.design_system(bench, request)
    assert not done.holds and done.loop.current.min() < -0.3 and not done.certification.safe.holds
    report = rt.jobs.write_design(done, (), tmp_path / "out")
    assert not report.holds
    assert "No box that is never left" in [section.title for section in report.sections]
    assert "box" in [Path(claim.file).stem for claim in report.claims]  # a claim that fails is never left out


def test_currents_beyond_the_usable_one_are_refused_with_it(bench: rt.System) -> None:
    request = rt.jobs.design.design_from_text(bench, setpoint=["m1=12"], current=["m1=-3:0.5"])
    with pytest.raises(InputError, match=r"m1=-3:0.5: .*(never to be left.*usable current|not certified)"):
        rt.jobs.design_system(bench, request)


@pytest.mark.usefixtures("without_linearity")
def test_not_certified_is_an_answer(run: Run, tmp_path: Path) -> None:
    """A conductance that would be negative at -20 °C: nothing contracts there. Status 1, and a folder that says why."""
    (tmp_path / "steep.toml").write_text(BENCH.replace("slope = 0.0005", "slope = 0.01"), encoding="utf-8")
    said = run("design", tmp_path / "steep.toml", *FAST, "--temperature", "-20", "120", "--out", tmp_path / "out")
    assert said.status == 1 and "NOT CERTIFIED" in said.out
    numbers = json.loads((tmp_path / "out" / "design.json").read_text(encoding="utf-8"))
    assert not numbers["holds"] and "Contraction at the current limits" in numbers["not_certified"]
    assert "certificates/contraction.json" not in numbers["certificates"]
    assert run("verify", tmp_path / "out" / "certificates" / "contraction.json").status == 1


@pytest.mark.parametrize(("options", "words"), [
    (["--setpoint", "m9=5"], ["m9", "one of m1", "--setpoint"]),
    (["--setpoint", "m1=cold"], ["m1=cold", "NAME=VALUE"]),
    (["--setpoint", "m1=-60"], ["outside of the box", "--temperature"]),
    (["--setpoint", "m1=-60", "--temperature", "-80", "85"], ["cannot be held", "reachable range, m1", "°C to"]),
    (["--setpoint", "m1=285"], ["looks like kelvin"]),
    (["--current", "m9=0:1"], ["m9", "--current"]),
    (["--current", "m1=0:9"], ["beyond the current_limits", "-3.3:3.3"]),
    (["--current", "m1=0:3"], ["runaway limit I*", "at most"]),
    (["--current", "m1=0.2:1"], ["leaves zero out"]),
    (["--current", "m1=0:0.01"], ["cannot be held", "the current limit is reached, m1 0.01 A by the system file or",
                                  "reachable range, m1"]),
    (["--regulate", "T_part"], ["'T_part'", "--regulate", "MODULE=NAME"]),
    (["--regulate", "m1=T_sink"], ["does not influence sensor 'T_sink'", "stage, part, box"]),
    (["--regulate", "m1=T_nowhere"], ["no sensor or lump 'T_nowhere'", "T_part"]),
    (["--sensors", "T_nowhere"], ["T_nowhere", "T_sink, T_part"]),
    (["--sensors", "T_slow"], ["T_slow", "lags"]),
    (["--sensors", "T_part,T_part"], ["one lump"]),
    (["--bandwidth", "0"], ["bandwidth", "a positive number"]),
    (["--sample-time", "200", "--bandwidth", "0.2"], ["sample_time", "unstable"]),
    (["--method", "guess"], ["--method"]),
])
def test_design_refuses(run: Run, file: Path, tmp_path: Path, options: list[str], words: list[str]) -> None:
    given = options if "--setpoint" in options else ["--setpoint", "m1=12", *options]
    said = run("design", file, *given, "--out", tmp_path / "out")
    assert (said.status, said.out) == (2, "")
    assert said.err.startswith("robthermal: ") and all(word in said.err for word in words), said.err
    assert [path.name for path in tmp_path.iterdir()] == ["bench.toml"]


def test_sensors_that_see_too_little_are_refused_with_the_lumps(run: Run, tmp_path: Path) -> None:
    apart = BENCH.replace('between = ["part", "box"]', 'between = ["box", "room"]\nname = "second"')
    (tmp_path / "apart.toml").write_text(apart, encoding="utf-8")
    said = run("design", tmp_path / "apart.toml", "--setpoint", "m1=12", "--out", tmp_path / "out")
    assert said.status == 2 and "do not see lumps box" in said.err and not (tmp_path / "out").exists()


def test_design_needs_modules(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "lab.toml"
    rt.thermal.write_system(rt.systems.tclab(), file)
    for command in ("design", "map"):
        said = run(command, file, "--out", tmp_path / "out")
        assert said.status == 2 and "no thermoelectric module" in said.err


@pytest.mark.usefixtures("drawn")
def test_map_writes_data_plot_and_certificate(run: Run, file: Path, bench: rt.System, tmp_path: Path,
                                              fold: rt.thermal.LoadCurve) -> None:
    said = run("map", file, "--ambient", "22", "--load", "0,9,2", "--setpoint", "12", "--json", "--out",
               tmp_path / "out")
    assert said.status == 0 and said.err == ""
    assert json.loads(said.out)["data"].endswith("map.csv")
    data = pd.read_csv(tmp_path / "out" / "map.csv")
    assert list(data.columns[:3]) == ["ambient [degC]", "setpoint [degC]", "load [W]"]
    assert data["load [W]"].tolist() == [0.0, 9.0]
    assert data["runaway [A]"].to_numpy() == pytest.approx(fold.current[-1, 0])
    assert fold.load[-1, 0] < 9.0  # so the second condition has no equilibrium
    law = rt.design.feedback_linearization(bench)
    needed = rt.design.reachable(law, 285.15).current["m1"]
    assert data["needed [A]"][0] == pytest.approx(needed, abs=1e-6) and np.isnan(data["needed [A]"][1])
    assert data["allowed"].tolist() == [True, False]
    assert "<svg" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert run("verify", tmp_path / "out").status == 0


def test_heating_conditions_are_not_allowed_by_a_cooling_certificate(bench: rt.System) -> None:
    told: list[tuple[int, int]] = []
    found = rt.certify.limit_map(bench, ambient=[283.15], setpoint=[303.15], load=[0.0],
                                 temperature=(273.15, 358.15), jobs=1,
                                 progress=lambda done, total: told.append((done, total)))
    assert found.data["direction"].tolist() == ["symmetric"] and told == [(0, 1), (1, 1)]
    needed, usable = found.data["needed [A]"][0], found.boxes[283.15, 0.0, "symmetric"]
    assert needed < -0.1
    for certificate in (usable.invariance, usable.contraction):
        assert certificate.holds and float(certificate.region["current"]["m1"][0]) == -usable.current
    assert found.data["allowed"].tolist() == [bool(-needed <= usable.current)]


@pytest.mark.parametrize(("options", "words"), [
    (["--ambient", "15,35"], ["'15,35'", "LO,HI,N"]),
    (["--ambient", "35,15,3"], ["LO < HI"]),
    (["--ambient", "nan"], ["--ambient"]),
    (["--load", "0,5,six"], ["--load"]),
    (["--setpoint", "0,10,1e9"], ["--setpoint"]),
    (["--setpoint", "278"], ["looks like kelvin"]),
    (["--ambient", "0,40,100", "--load", "0,5,100"], ["at most 2000"]),
    (["--method", "guess"], ["--method"]),
])
def test_map_refuses(run: Run, file: Path, tmp_path: Path, options: list[str], words: list[str]) -> None:
    said = run("map", file, *options, "--out", tmp_path / "out")
    assert (said.status, said.out) == (2, "")
    assert all(word in said.err for word in words), said.err
    assert [path.name for path in tmp_path.iterdir()] == ["bench.toml"]


def test_request_refuses_a_module_without_set_point() -> None:
    with pytest.raises(InputError, match="'m2' has no set-point"):
        rt.jobs.design.design_from_text(rt.systems.two_module(), setpoint=["m1=5"])


@pytest.mark.exhaustive
@pytest.mark.usefixtures("without_linearity")
def test_margins_over_parameter_ranges_are_reported(run: Run, file: Path, tmp_path: Path) -> None:
    """Tuned by margins for all corners: design.json, summary.json and report; nominal and robust side by side."""
    said = run("design", file, "--setpoint", "m1=12", "--regulate", "m1=T_slow", "--margin", "phase=50", "--margin",
               "modulus=0.5", "--sample-time", "2", "--parameters", "links.stage-part.conductance=1.4:1.6", "--export",
               "json,matlab", "--out", tmp_path / "out")
    assert said.status == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["design"]
    numbers = json.loads((tmp_path / "out" / "design.json").read_text(encoding="utf-8"))
    assert numbers["margins"] == summary["margins"] and numbers["holds"] and summary["margins_missed"] == []
    worst = summary["margins"]["m1"]["worst"]
    assert set(worst) == {"gain", "phase", "modulus", "delay", "crossover", "stable"}
    assert 50.0 <= worst["phase"] <= summary["margins"]["m1"]["phase"] and worst["modulus"] >= 0.5
    assert min(worst["phase"] / 50.0, worst["modulus"] / 0.5) == pytest.approx(1.0, abs=0.02)
    assert "T_slow" in summary["tuning"] and numbers["controller"]["bandwidth"]["value"] == summary["bandwidth"]
    assert summary["nominal"]["The box is never left"] and summary["robust"]["The box is never left"]
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Margins of the loops" in page and "worst of 2 corners" in page
    assert {path.name for path in (tmp_path / "out").glob("*.mat")} == {"law.mat", "controller.mat", "observer.mat"}
    assert run("verify", tmp_path / "out").status == 0


@pytest.mark.exhaustive
@pytest.mark.usefixtures("without_linearity")
def test_a_missed_margin_fails_with_the_best_bandwidth(run: Run, file: Path, tmp_path: Path) -> None:
    said = run("design", file, "--setpoint", "m1=12", "--regulate", "m1=T_slow", "--margin", "phase=60", "--bandwidth",
               "0.04", "--sample-time", "2", "--out", tmp_path / "out")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert said.status == 1 and summary["verdict"] == "FAIL" and not summary["design"]["holds"]
    reason = next(one for one in summary["reasons"] if one["code"] == "margin_missed")
    assert "phase margin of m1" in reason["text"] and "is the largest that keeps phase 60 deg" in reason["text"]


def test_map_keeps_the_sign_of_heating_currents(run: Run, file: Path, tmp_path: Path) -> None:
    said = run("map", file, "--ambient", "10", "--load", "0", "--setpoint", "10,30,2", "--temperature", "0", "85",
               "--out", tmp_path / "out")
    data = pd.read_csv(tmp_path / "out" / "map.csv")
    assert said.status == 0 and data["setpoint [degC]"].tolist() == [10.0, 30.0]
    assert data["needed [A]"][1] < -0.1 and data["direction"][1] == "symmetric"
