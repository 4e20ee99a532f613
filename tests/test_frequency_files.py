"""One frequency-response file from frf to calibrate, diagnose and couple, covariance included."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import Run, Said

import robthermal as rt

pytestmark = pytest.mark.usefixtures("sketched")


@pytest.fixture
def run(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Run:
    """A command in the folder of the test."""
    monkeypatch.chdir(tmp_path)
    return run


def shown(done: Said) -> Any:
    """What a command that is content printed as JSON."""
    assert done[0] == 0, done[2]
    return json.loads(done[1])


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A heated bar of 40 J/K and 2 W/K: system files with the true and a wrong capacity, a record, its response."""
    folder = tmp_path_factory.mktemp("bar")
    system = rt.System(name="bar", ambients={"room": {"temperature": 298.15}}, lumps={"bar": {"capacity": 40.0}},
                       links=[{"between": ("bar", "room"), "conductance": 2.0}], sensors={"T": {"lump": "bar"}},
                       inputs={"q": {"lump": "bar"}})
    rng = np.random.default_rng(0)
    q = 5.0 + rt.signals.multisine(1000, sample_time=1.0, seed=0, band=(0.001, 0.2), rms=1.5, periods=2)
    T, pole = np.full(2000, 300.0), np.exp(-2.0 / 40.0)
    for k in range(1999):
        T[k + 1] = 298.15 + pole * (T[k] - 298.15) + (1 - pole) / 2.0 * q[k]
    rt.Record(sample_time=1.0, inputs=q, outputs=T + 0.01 * rng.normal(size=2000), input_names=["q"],
              output_names=["T"]).save(folder / "run.csv")
    rt.thermal.write_system(system, folder / "bar.toml")
    text = (folder / "bar.toml").read_text(encoding="utf-8").replace("capacity = 40.0", "capacity = 55.0")
    (folder / "start.toml").write_text(text + '\n[fit]\n"lumps.bar.capacity" = { lower = 10.0, upper = 100.0 }\n',
                                       encoding="utf-8")
    rt.jobs.measured.estimate_response([folder / "run.csv"], system=system, method="lrmp", band=(0.002, 0.2)).save(
        folder / "G.json")
    (folder / "G.csv").write_text("frequency,real,imag\n0.1,1,0\n0.2,1,0\n", encoding="utf-8")
    (folder / "huge.json").write_text(json.dumps({"format": [0.5] * 100_000}), encoding="utf-8")
    return folder


@pytest.mark.parametrize("kind", ["json", "npz", "mat"])
def test_to_calibrate(run: Run, bar: Path, tmp_path: Path, kind: str) -> None:
    rt.identify.read_response(bar / "G.json").save(tmp_path / f"G.{kind}")
    (tmp_path / f"G.{kind}").rename(tmp_path / "G.measured")  # the content tells, not the ending
    fit = shown(run("calibrate", bar / "start.toml", "G.measured", "--operating-point", "q=5", "--out", "done.toml",
                    "--json"))
    assert fit["responses"][0]["n_frequencies"] > 10
    assert rt.read_system(tmp_path / "done.toml").lumps["bar"].capacity == pytest.approx(40.0, rel=0.02)


def test_records_and_responses_are_calibrated_together(run: Run, bar: Path, tmp_path: Path) -> None:
    """In any order; the operating point is in the file; validation by either kind."""
    done = run("calibrate", bar / "start.toml", bar / "G.json", bar / "run.csv", "--out", "done.toml", "--json")
    fit = shown(done)
    assert len(fit["train"]) == len(fit["responses"]) == 1
    assert fit["responses"][0]["operating_point"] == {"q": pytest.approx(5.0, abs=0.01)}
    assert rt.read_system(tmp_path / "done.toml").lumps["bar"].capacity == pytest.approx(40.0, rel=0.02)
    stored = json.loads((tmp_path / "done.json").read_text(encoding="utf-8"))
    assert set(stored["data"]) == {"start.toml", "run.csv", "G.json"}
    beside = shown(run("calibrate", bar / "start.toml", bar / "run.csv", "--validation", bar / "G.json", "--out",
                       "beside.toml", "--json"))
    assert beside["responses"] == [] and 0.5 < beside["validation_responses"][0]["misfit"] < 2.0
    other = shown(run("calibrate", bar / "start.toml", bar / "G.json", "--validation", bar / "run.csv", "--out",
                      "other.toml", "--json"))
    assert other["train"] == [] and other["validation"][0]["rmse"]["T"] < 0.1


@pytest.mark.parametrize("kind", ["npz", "mat"])
def test_to_diagnose(bar: Path, tmp_path: Path, kind: str) -> None:
    """Responses and records are told apart by their content, in any order."""
    rt.identify.read_response(bar / "G.json").save(tmp_path / f"G.{kind}")
    (tmp_path / f"G.{kind}").rename(tmp_path / "G.measured")
    found = rt.jobs.measured.read_measured([bar / "run.csv", tmp_path / "G.measured"], rt.read_system(bar / "bar.toml"))
    assert [type(one) for one in found] == [rt.Record, rt.identify.FrequencyResponse]
    assert found[1].has_covariance


@pytest.mark.parametrize(("arguments", "words"), [
    (["calibrate", "run.csv", "--operating-point", "q=5"], "--operating-point"),
    (["calibrate", "G.csv"], "without covariance"), (["diagnose", "G.csv"], "without covariance"),
    (["diagnose", "huge.json"], "huge.json"), (["calibrate", "huge.json"], "huge.json")])
def test_what_a_command_cannot_take(run: Run, bar: Path, arguments: list[str], words: str) -> None:
    command, *rest = [bar / word if "." in word else word for word in arguments]
    status, _, warned = run(command, bar / "start.toml", *rest)
    assert status == 2 and words in warned and len(warned.splitlines()) == 1 and len(warned) < 600


def loop_record(pole: float, gain: float, seed: int, n: int = 4000) -> rt.Record:
    """A sampled first-order plant, measured with noise: y(k+1) = pole y(k) + gain u(k)."""
    rng = np.random.default_rng(seed)
    u, y = rng.normal(size=n), np.zeros(n)
    for k in range(n - 1):
        y[k + 1] = pole * y[k] + gain * u[k]
    return rt.Record(sample_time=0.01, inputs=u, outputs=y + 0.002 * rng.normal(size=n), input_names=["u"],
                     output_names=["y"])


SPEC = """
[coupling]
name = "pair"
sample_time = 0.01
[subsystems.1]
plant = { num = [0.01], den = [1.0, -0.99] }
controller = 20.0
[subsystems.2]
plant = { num = [0.02], den = [1.0, -0.98] }
controller = 15.0
[uncertainty]
frf_1 = ["one"]
frf_2 = ["two"]
[design]
X_hat = -0.1
Y_hat = -0.1
"""


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Measured responses of two plants, neither of them the model of the coupling file."""
    folder = tmp_path_factory.mktemp("pair")
    for name, pole, gain, seed in (("one", 0.99, 0.011, 1), ("two", 0.98, 0.018, 2)):
        loop_record(pole, gain, seed).save(folder / f"{name}.csv")
        G = rt.jobs.measured.estimate_response([folder / f"{name}.csv"], inputs=["u"], outputs=["y"], band=(0.5, 50.0))
        G.save(folder / f"{name}.json")
    return folder


@pytest.mark.parametrize("kind", ["json", "npz", "mat"])
def test_to_couple_with_its_covariance(pair: Path, tmp_path: Path, kind: str) -> None:
    (tmp_path / "SPEC.toml").write_text(SPEC, encoding="utf-8")
    measured = [rt.identify.read_response(pair / f"{name}.json") for name in ("one", "two")]
    for name, G in zip(("one", "two"), measured, strict=True):
        G.save(tmp_path / f"G.{kind}")
        (tmp_path / f"G.{kind}").rename(tmp_path / name)
    plant, = rt.jobs.read_coupling(tmp_path / "SPEC.toml").measured
    for k, G in enumerate(measured):
        np.testing.assert_allclose(plant.response[k, k], G.response[0, 0], rtol=1e-15)
        assert (plant.confidence_radius()[k, k] >= G.confidence_radius()[0, 0] * (1 - 1e-12)).all()
        assert (plant.confidence_radius()[k, k] < 1.5 * G.confidence_radius()[0, 0]).all()
    assert not plant.response[0, 1].any() and not plant.confidence_radius()[0, 1].any()


@pytest.mark.exhaustive
def test_the_circles_are_in_the_envelope_unless_the_file_says_otherwise(run: Run, pair: Path, tmp_path: Path) -> None:
    (tmp_path / "SPEC.toml").write_text(SPEC, encoding="utf-8")
    (tmp_path / "without.toml").write_text(SPEC.replace("[design]", "circles = false\n[design]"), encoding="utf-8")
    for name in ("one", "two"):
        (tmp_path / name).write_bytes((pair / f"{name}.json").read_bytes())
    robust = {}
    for spec, codes in (("SPEC.toml", []), ("without.toml", ["circles_left_out"])):
        out = spec.removesuffix(".toml")
        said = shown(run("couple", spec, "--out", out, "--json"))
        found = json.loads((tmp_path / out / "coupling.json").read_text(encoding="utf-8"))
        assert [remark["code"] for remark in found["remarks"]] == codes == [r["code"] for r in said["remarks"]]
        robust[spec] = found["norms"]["robust"]
    assert robust["SPEC.toml"] > 1.02 * robust["without.toml"] > 0


def test_csv_in_couple_is_a_remark(run: Run, pair: Path, tmp_path: Path) -> None:
    (tmp_path / "SPEC.toml").write_text(SPEC, encoding="utf-8")
    for name in ("one", "two"):
        G = rt.identify.read_response(pair / f"{name}.json")
        rows = [f"{f},{g.real},{g.imag}" for f, g in zip(G.frequencies, G.response[0, 0], strict=True)]
        (tmp_path / name).write_text("\n".join(["frequency [Hz],real,imag", *rows]), encoding="utf-8")
    said = shown(run("couple", "SPEC.toml", "--out", "out", "--json"))
    assert [remark["code"] for remark in said["remarks"]] == ["frf_without_covariance"]
    assert "one, two" in said["remarks"][0]["text"]
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Responses without covariance: one, two" in page


@pytest.mark.parametrize("content", ["{}", "[0.5]", json.dumps({"format": "else", "data": [0.5] * 200_000}),
                                     "time,u,y\n0,1,2\n", "x" * 200_000, ""])
def test_a_wrong_file_in_couple_is_one_short_line(run: Run, pair: Path, tmp_path: Path, content: str) -> None:
    """The coupling command printed 10.9 MB when it was given a JSON file of that size."""
    (tmp_path / "SPEC.toml").write_text(SPEC, encoding="utf-8")
    (tmp_path / "one").write_text(content, encoding="utf-8")
    (tmp_path / "two").write_bytes((pair / "two.json").read_bytes())
    status, _, warned = run("couple", "SPEC.toml", "--out", "out")
    assert status == 2 and len(warned.splitlines()) == 1 and len(warned) < 600
    assert "one" in warned and not (tmp_path / "out").exists()


def spoiled(pair: Path, folder: Path, *bins: int) -> None:
    """The two responses, with no degrees of freedom in some bins: infinite circles."""
    for name in ("one", "two"):
        content = json.loads((pair / f"{name}.json").read_text(encoding="utf-8"))
        for k in bins:
            content["degrees_of_freedom"]["values"][k] = 0
        (folder / name).write_text(json.dumps(content), encoding="utf-8")


def test_infinite_circles_in_the_lowest_bins_are_left_out_and_said(run: Run, pair: Path, tmp_path: Path) -> None:
    (tmp_path / "SPEC.toml").write_text(SPEC, encoding="utf-8")
    spoiled(pair, tmp_path, 0, 1)
    frequencies = rt.identify.read_response(pair / "one.json").frequencies
    said = shown(run("couple", "SPEC.toml", "--out", "out", "--json"))
    found = json.loads((tmp_path / "out" / "coupling.json").read_text(encoding="utf-8"))
    assert found["left_out"] == pytest.approx(frequencies[:2].tolist(), rel=1e-9)
    assert [remark["code"] for remark in said["remarks"]] == ["bins_left_out"] == [r["code"] for r in found["remarks"]]
    assert f"assumed below {frequencies[2]:.4g} Hz" in found["remarks"][0]["text"]
    assert found["robust"] == found["norms"]["robust"] > found["robust_without_circles"] > 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["couple"]["left_out"] == found["left_out"] and summary["couple"]["robust"] == found["robust"]
    assert summary["verdict"] == "PASS WITH REMARKS"


def test_infinite_circles_between_decided_bins_are_refused(run: Run, pair: Path, tmp_path: Path) -> None:
    (tmp_path / "SPEC.toml").write_text(SPEC, encoding="utf-8")
    spoiled(pair, tmp_path, 7, 9)
    frequencies = rt.identify.read_response(pair / "one.json").frequencies
    status, _, warned = run("couple", "SPEC.toml", "--out", "out")
    assert status == 2 and len(warned.splitlines()) == 1 and not (tmp_path / "out").exists()
    assert f"cannot be decided from bins {frequencies[7]:.4g} … {frequencies[9]:.4g} Hz" in warned
    assert "not stabilize" not in warned and f"Measure {frequencies[7]:.4g}" in warned


@pytest.mark.exhaustive
def test_confidence_is_a_key_and_wider_with_more(run: Run, pair: Path, tmp_path: Path) -> None:
    spoiled(pair, tmp_path)
    robust = []
    for number, confidence in enumerate((0.5, 0.95, 0.999)):
        (tmp_path / "SPEC.toml").write_text(SPEC.replace("[design]", f"confidence = {confidence}\n[design]"),
                                            encoding="utf-8")
        shown(run("couple", "SPEC.toml", "--out", f"out{number}", "--json"))
        robust.append(json.loads((tmp_path / f"out{number}" / "coupling.json").read_text(encoding="utf-8")))
    assert robust[0]["robust"] < robust[1]["robust"] < robust[2]["robust"]
    assert len({one["robust_without_circles"] for one in robust}) == 1
    (tmp_path / "SPEC.toml").write_text(SPEC.replace("[design]", "confidence = 95\n[design]"), encoding="utf-8")
    status, _, warned = run("couple", "SPEC.toml", "--out", "never")
    assert status == 2 and "confidence" in warned
