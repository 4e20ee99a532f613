"""The main job on a machine without modules, against closed forms, and on measured data."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from example_files import example
from heated_bar import CAPACITY, CONDUCTANCE, NOISE, POWER, PROJECT, ROOM, SYSTEM, closed_form, write_project

import robthermal as rt

BOX = """
[certify]
temperature = [0.0, 100.0]
ambient = { room = [15.0, 25.0] }
"""


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    noise, time = np.random.default_rng(1), np.arange(600.0)
    records = {name: (np.full(time.size, 100 * share), ROOM + closed_form(time, share) + noise.normal(0, NOISE, 600))
               for name, share in (("train", 1.0), ("validation", 0.3))}
    return write_project(tmp_path_factory.mktemp("bar"), records, project=PROJECT.partition("[certify]")[0] + BOX)


@pytest.fixture(scope="module")
def result(project: Path) -> rt.jobs.run.JobResult:
    return rt.jobs.run_job(rt.jobs.read_project(project))


def test_it_finds_the_parameters_of_the_closed_form(result: rt.jobs.run.JobResult) -> None:
    assert result.system.parameter("lumps.bar.capacity") == pytest.approx(CAPACITY, rel=2e-3)
    assert result.system.parameter("links.bar-room.conductance") == pytest.approx(CONDUCTANCE, rel=2e-3)


def test_validation_record_is_free_run_to_its_noise(result: rt.jobs.run.JobResult) -> None:
    train, validation = result.comparisons
    assert (train.kind, validation.kind) == ("train", "validation")
    assert validation.rmse(validation.calibrated)["T"] == pytest.approx(0.02, rel=0.1)
    assert validation.rmse(validation.nominal)["T"] > 0.5


def test_box_that_is_never_left_holds_every_steady_state_and_little_more(result: rt.jobs.run.JobResult) -> None:
    assert result.holds
    ((low, high),) = result.certification.safe.temperature.values()
    g = result.system.parameter("links.bar-room.conductance")
    lowest, highest = 288.15, 298.15 + POWER / g
    assert lowest - 1.0 < low <= lowest and highest <= high < highest + 1.0
    assert result.certification.safe.invariance.region["heat"]["bar"][1] == pytest.approx(POWER)


def test_contraction_rate_is_the_pole_of_the_bar(result: rt.jobs.run.JobResult) -> None:
    box = next(c for c in result.certification.checked if c.key == "contraction")
    pole = result.system.parameter("links.bar-room.conductance") / result.system.parameter("lumps.bar.capacity")
    assert 0.8 * pole < float(box.certificate.evidence["rate"]) <= 0.9 * pole  # two digits, a tenth kept in reserve


def test_report_of_a_machine_without_modules_does_not_speak_of_them(result: rt.jobs.run.JobResult,
                                                                    tmp_path: Path) -> None:
    report = rt.jobs.write_job(result, tmp_path / "out")
    assert report.holds
    assert "1 lump, 1 heater, 1 sensor" in report.subtitle
    said = " ".join([*(claim.sentence for claim in report.claims), *report.assumptions])
    assert "module" not in said.lower() and "Joule" not in said
    assert sorted(path.stem for path in (tmp_path / "out" / "certificates").iterdir()) == [
        "box", "box_contraction", "box_contraction_ranges", "box_ranges", "contraction", "contraction_ranges"]
    for file in (tmp_path / "out" / "certificates").iterdir():
        assert rt.verify(rt.Certificate.load(file)).valid
    assert rt.read_system(tmp_path / "out" / "calibrated.toml").parameter(
        "lumps.bar.capacity") == result.system.parameter("lumps.bar.capacity")
    assert "SHA-256 of train.csv" in report.provenance


def test_a_heater_without_limits_needs_a_range(tmp_path: Path) -> None:
    (tmp_path / "bar.toml").write_text(SYSTEM.replace("limits = [0.0, 100.0]", ""))
    text = PROJECT.partition("[certify]")[0].replace('train = ["train.csv"]\nvalidation = ["validation.csv"]\n', "")
    text += BOX
    (tmp_path / "project.toml").write_text(text)
    with pytest.raises(rt.InputError, match="Q"):
        rt.jobs.run_job(rt.jobs.read_project(tmp_path / "project.toml"))
    (tmp_path / "project.toml").write_text(text + "heat = { bar = [0.0, 4.0] }\n")
    done = rt.jobs.run_job(rt.jobs.read_project(tmp_path / "project.toml"))
    assert done.holds
    ((_, high),) = done.certification.safe.temperature.values()
    assert 298.15 + 4.0 / 0.5 <= high < 298.15 + 4.0 / 0.5 + 1.0


def test_a_module_without_limits_needs_a_range() -> None:
    system = rt.systems.two_module()
    modules = {name: module.model_copy(update={"current_limits": None}) for name, module in system.modules.items()}
    with pytest.raises(rt.InputError, match=r"m1.*no current range.*current_limits"):
        rt.jobs.certify_system(rt.System(**{**dict(system), "modules": modules}), rt.jobs.Boxes())


# Measured data


@pytest.fixture(scope="module")
def measured(tclab: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return example("tclab", "main_job").write_project(tclab, tmp_path_factory.mktemp("tclab") / "project.toml")


@pytest.mark.filterwarnings("ignore:.*:UserWarning")
def test_main_job_on_measured_data(measured: Path, tmp_path: Path) -> None:
    result = rt.jobs.run_job(rt.jobs.read_project(measured))
    assert result.fit is not None
    assert result.fit.rmse["T1"] <= 0.15  # the step, start temperatures free
    train, validation = result.comparisons
    assert train.rmse(train.calibrated)["T1"] < 0.35 < train.rmse(train.nominal)["T1"]  # from the first reading
    assert validation.rmse(validation.calibrated)["T1"] < 2.5  # another day
    rt.jobs.write_job(result, tmp_path / "out")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    nominal = [claim["valid"] for claim in summary["claims"] if claim["parameters"] == "nominal"]
    assert nominal == [True, True, True] and summary["verdict"] == "FAIL"
    # Another day, another room temperature, and one step alone does not determine five parameters
    assert {one["code"] for one in summary["reasons"]} >= {"validation_misfit", "not_robust", "undetermined_parameter"}
    assert "SHA-256 of step_50_run_2.csv" in summary["provenance"]
    # No lump above the steady state at full power in the warmest room, within a kelvin: T = room + α 100 / U_a
    hottest = max(high for _, high in result.certification.safe.temperature.values())
    full_power = 30 + 273.15 + 3.2 / result.system.parameter("links.heater-room.conductance")
    assert full_power <= hottest < full_power + 1.0


@pytest.mark.filterwarnings("ignore:.*:UserWarning")
def test_no_measured_temperature_leaves_the_certified_box(measured: Path) -> None:
    project = rt.jobs.read_project(measured)
    done = rt.jobs.run_job(project)
    low, high = done.certification.safe.temperature["sensor"]
    for path in (*project.train, *project.validation):
        readings = rt.read_record(path, project.system)["T1"]
        assert low < readings.min() and readings.max() < high


def test_no_record_is_drawn_twice(result: rt.jobs.run.JobResult, tmp_path: Path) -> None:
    report = rt.jobs.write_job(result, tmp_path / "once")
    captions = [figure.caption for section in (*report.first, *report.sections) for figure in section.figures]
    assert captions and len(captions) == len(set(captions))
    assert "validation record" in report.first[0].figures[0].caption
    text = next(" ".join(section.paragraphs) for section in report.sections if section.anchor == "model")
    assert "The validation record" in text and "is drawn at the top of this report." in text
