"""The thermoelectric chamber: measured logs of a machine that nobody described, through the example's own functions."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest
from example_files import example

import robthermal as rt


@pytest.mark.filterwarnings("ignore:.*unknown columns:UserWarning")
def test_from_raw_logs_to_a_report_that_says_what_is_unknown(
        shared: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, out = shared / "data" / "tec_chamber", tmp_path / "results"
    if not folder.is_dir():
        pytest.skip("no folder 'tec_chamber' among the measured data")
    example("tec_chamber", "chamber").main(folder, out)
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["verdict"] == "PASS WITH REMARKS" and "PASS WITH REMARKS" in capsys.readouterr().out
    assert {one["code"] for one in summary["reasons"]} >= {"training_misfit", "validation_misfit", "outside_data"}
    assert summary["imports"][0]["rows"] == {"file": 120, "used": 120}
    report = (out / "report.html").read_text(encoding="utf-8")
    assert "whether the PWM is filtered" in report and "up to one common factor" in report
    assert rt.jobs.read_project(out.with_suffix(".toml")).name.startswith("Thermoelectric chamber")
    parameters = summary["calibrate"]["parameters"]
    low, high = parameters["links.air-ambient.conductance"]["range"]
    log = pd.read_csv(folder / "run06.csv").tail(15)  # nearly in steady state: the heat of the counts over the rise
    conductance = 0.185 * log["output"].mean() / (log["oven"] - log["ambient"]).mean()
    assert low < conductance < high
