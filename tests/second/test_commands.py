"""`python -m recheck` and `robthermal verify --second`: what they print, and the exit status."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import recheck
import robthermal as rt
from robthermal.cli import app
from robthermal.jobs.verify import _second
from robthermal.verification import Certificate, establish

ROD = {"lumps": {"rod": {"capacity": 10.0}}, "ambients": ["room"], "modules": {},
       "links": [{"between": ["rod", "room"], "conductance": 0.5}]}
BOX = {"temperature": [250.0, 400.0], "current": {}}
LAG = {"A": [[-2]], "B": [[1]], "C": [[1]], "D": [[0]], "sample_time": 0}


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> dict[str, Path]:
    """Return a valid certificate, one that is not, and one of a kind that only the first checker knows."""
    folder = tmp_path_factory.mktemp("certificates")
    made = {"good": establish("contraction", system=ROD, region=BOX, evidence={"method": "energy", "rate": 0.04},
                              made_by={}),
            "other": establish("hinf", system=LAG, region={"bound": 1}, evidence={"method": "polynomial"}, made_by={})}
    found = {name: folder / f"{name}.json" for name in (*made, "bad")}
    for name, certificate in made.items():
        assert certificate.holds
        certificate.save(found[name])
    found["bad"].write_text(found["good"].read_text().replace("0.04", "0.06"))
    return found


def module(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run python -m recheck."""
    return subprocess.run([sys.executable, "-m", "recheck", *map(str, arguments)], capture_output=True, text=True,
                          check=False, cwd=Path(recheck.__file__).parents[1])


def test_exit_status_of_the_module(files, tmp_path):
    good = module(files["good"])
    assert good.returncode == 0 and "valid" in good.stdout and "contracts for all" in good.stdout
    assert module(files["good"], files["bad"]).returncode == 1
    assert module(files["good"], files["other"]).returncode == 2
    assert module(tmp_path / "none.json").returncode == 2 and "unreadable" in module(tmp_path / "none.json").stderr
    assert module().returncode == 2 and module("--help").returncode == 0


def test_verify_runs_both(files):
    run = CliRunner().invoke(app, ["verify", "--second", str(files["good"]), str(files["other"])])
    assert run.exit_code == 0, run.output
    assert "second checker: valid" in run.output and "second checker: not covered" in run.output
    run = CliRunner().invoke(app, ["verify", "--second", "--json", str(files["good"])])
    row = json.loads(run.stdout)[0]
    assert row["valid"] and row["second"]["status"] == "valid"
    assert "second" not in json.loads(CliRunner().invoke(app, ["verify", "--json", str(files["good"])]).stdout)[0]


def test_where_the_second_checker_rejects_the_file_is_not_verified(files, monkeypatch):
    monkeypatch.setattr(_second, "_checker", lambda: type("Checker", (), {
        "Unreadable": recheck.Unreadable, "check": lambda path: recheck.Result("not valid", "for the test")}))
    assert CliRunner().invoke(app, ["verify", "--second", str(files["good"])]).exit_code == 1
    assert CliRunner().invoke(app, ["verify", str(files["good"])]).exit_code == 0


def test_without_the_second_checker_one_message_says_how_to_get_it(files, monkeypatch):
    monkeypatch.setattr(_second, "_checker", lambda: None)
    assert rt.jobs.verify.second_verdicts([files["good"]])[0].status == "absent"
    with pytest.raises(rt.errors.InputError, match="pip install ./recheck"):
        rt.jobs.verify_files([files["good"]], second=True)


def test_certificates_in_memory_and_files_are_judged_alike(files):
    certificate = Certificate.load(files["good"])
    by_file, in_memory = rt.jobs.verify.second_verdicts([files["good"], certificate])
    assert by_file and in_memory and by_file == in_memory
    assert not rt.jobs.verify.second_verdicts([files["bad"]])[0]
