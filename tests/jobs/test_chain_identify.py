"""Stage identify on records of a closed loop: the plant by way of its reference, and what is left out."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from commands import Run
from heated_bar import CAPACITY, CONDUCTANCE, POWER, ROOM, SYSTEM

import robthermal as rt
from robthermal.jobs.measured._reference import beside_reference

pytestmark = pytest.mark.usefixtures("sketched")
PROJECT = """
[project]
name = "bar"
system = "bar.toml"
[identify.loop]
records = ["loop.csv"]
inputs = ["Q"]
outputs = ["T"]
use = "none"
{reference}
[certify]
temperature = [15.0, 45.0]
"""
H, N, NOISE, GAIN = 20.0, 1500, 0.5, 12.0  # s, samples, K of the sensor, %/K of the controller
DECAY = np.exp(-CONDUCTANCE / CAPACITY * H)
DC = POWER / 100.0 / CONDUCTANCE  # K/%


def plant(frequencies: np.ndarray) -> np.ndarray:
    """Exact response of the bar [K/%] to a held input."""
    return DC * (1 - DECAY) / (np.exp(2j * np.pi * frequencies * H) - DECAY)


def write_loop(folder: Path, excitation: np.ndarray, extra: str = "", reference: str = 'reference = "dither"') -> Path:
    """A P controller holds the bar at 30 °C on noisy readings; `dither` is added to its output."""
    noise, rise, rows = NOISE * np.random.default_rng(7).standard_normal(N), 10.0, []
    for k in range(N):
        reading = rise + noise[k]
        share = 50.0 + GAIN * (10.0 - reading) + excitation[k]
        cell = "" if 900 <= k < 905 else f"{excitation[k]:.9g}"
        rows.append(f"{H * k:g},{share:.9g},{ROOM + reading:.9g},20.0,{cell}{extra and ',' + extra}")
        rise = DECAY * rise + DC * (1 - DECAY) * share
    header = "time [s],Q [%],T [°C],room [°C],dither [%]" + (extra and ",x")
    (folder / "loop.csv").write_text("\n".join([header, *rows]))
    (folder / "bar.toml").write_text(SYSTEM.replace("limits = [0.0, 100.0]\n", "limits = [-1000.0, 1000.0]\n"
                                                    'unit = "%"\n'))
    (folder / "project.toml").write_text(PROJECT.replace("{reference}", reference))
    return folder / "project.toml"


@pytest.mark.filterwarnings("ignore:.*split")
def test_the_import_report_says_that_the_reference_is_read(tmp_path: Path) -> None:
    project = rt.jobs.read_project(write_loop(tmp_path, 4.0 * np.random.default_rng(8).standard_normal(N)))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        report = rt.jobs.run_project(project, tmp_path / "out", only=["identify"])
    assert not [one for one in said if "not read" in str(one.message)]
    (imported,) = report.data["imports"]
    roles = {column["column"]: (column["role"], column["name"]) for column in imported["columns"]}
    assert roles["dither [%]"] == ("input", "dither") and roles["T [°C]"] == ("sensor", "T")


def identified(project: Path) -> rt.identify.FrequencyResponse:
    rt.jobs.run_project(rt.jobs.read_project(project), project.parent / "out", only=["identify"])
    return rt.identify.read_response(project.parent / "out" / "responses" / "loop.json")


def covered(found: rt.identify.FrequencyResponse) -> float:
    """Share of the bins whose 95 % circle holds the truth."""
    error = np.abs(found.response[0, 0] - plant(found.frequencies))
    return float(np.mean(error < found.confidence_radius(0.95)[0, 0]))


@pytest.mark.filterwarnings("ignore:.*split")
def test_a_closed_loop_is_estimated_by_way_of_its_reference(tmp_path: Path) -> None:
    dither = 4.0 * np.random.default_rng(8).standard_normal(N)
    found = identified(write_loop(tmp_path, dither))
    assert found.input_names == ("Q",) and found.output_names == ("T",) and "closed_loop" in found.method
    assert covered(found) > 0.9  # two parts of the record
    direct = rt.jobs.measured.estimate_response([tmp_path / "loop.csv"], inputs=["Q"], outputs=["T"])
    assert covered(direct) < 0.6  # the noise comes back through the controller: biased


@pytest.mark.filterwarnings("ignore:.*split")
def test_bins_without_excitation_are_a_remark(tmp_path: Path) -> None:
    time = H * np.arange(N)
    slow = sum(2.0 * np.cos(2 * np.pi * k / (H * N) * time + k**2) for k in range(1, 200))
    project = write_loop(tmp_path, slow)
    rt.jobs.run_project(rt.jobs.read_project(project), tmp_path / "out")
    reasons = json.loads((tmp_path / "out" / "summary.json").read_text())["reasons"]
    (reason,) = [one for one in reasons if one["code"] == "bins_left_out"]
    assert reason["level"] == "remark" and reason["stage"] == "identify" and reason["about"] == "loop"
    assert reason["value"] > 100 and "not determined by the data" in reason["text"]
    assert "Excite these frequencies" in reason["remedy"]


@pytest.mark.parametrize(("reference", "extra", "what"), [
    ('reference = "dihter"', "", "dihter"), ('reference = ["dither", "room"]', "", "2 reference(s)"),
    ('reference = "x"', "7.5", "never changes: x"),
    ('reference = "dither"\nmethod = "lrmp"', "", "[identify.loop] method"),
    ('method = "lrmp"\nbasis = ["sqrt"]', "", "[identify.loop] basis[0]"),
    ("band = [10.0, 20.0]", "", "[identify.loop] band"), ("half_width = 5000", "", "[identify.loop] half_width")])
@pytest.mark.filterwarnings("ignore:.*split")
def test_bad_references(reference: str, extra: str, what: str, tmp_path: Path, run: Run) -> None:
    write_loop(tmp_path, np.random.default_rng(8).standard_normal(N), extra, reference)
    done = run("run", tmp_path / "project.toml", "--out", tmp_path / "out")
    assert done.status == 2
    assert what in done.err and len(done.err) < 700
    assert "[identify.loop]" in done.err or "loop.csv" in done.err
    assert not (tmp_path / "out").exists()


@pytest.mark.filterwarnings("ignore:.*split")
def test_the_command_takes_a_reference(tmp_path: Path, run: Run) -> None:
    write_loop(tmp_path, 4.0 * np.random.default_rng(8).standard_normal(N))
    done = run("frf", tmp_path / "loop.csv", "--system", tmp_path / "bar.toml", "--input", "Q", "--output", "T",
               "--reference", "dither", "--out", tmp_path / "loop.json")
    assert done.status == 0
    assert "not read" not in done.err, "the column dither is read: as the reference"
    assert covered(rt.identify.read_response(tmp_path / "loop.json")) > 0.9


def test_only_the_columns_of_the_reference_are_left_out_of_the_note() -> None:
    with pytest.warns(UserWarning) as said, beside_reference(["dither"]):  # noqa: PT031  (all of it is the subject)
        for text in ("a.csv: unknown columns, not read: 'dither [A]', 'fan'", "a.csv: unknown columns, not read: "
                     "'dither'", "a.csv: 2 rows with the same time"):
            warnings.warn(text, UserWarning, stacklevel=1)
    assert [str(one.message) for one in said] == ["a.csv: unknown columns, not read: 'fan'",
                                                  "a.csv: 2 rows with the same time"]
