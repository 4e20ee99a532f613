"""A job with a voltage among its readings: its numbers are volts in the gate, the tables and the figures."""

from typing import Any

import numpy as np
import pytest
from voltage_rig import drive, system

import robthermal as rt
from robthermal.jobs.run import Misfit
from robthermal.jobs.run._gate import _misfits
from robthermal.report import measured_against_model, residuals_before_after


def test_reasons_say_volts() -> None:
    one = Misfit("train", "r", "V1", 0.0, 0.02, 0.002, 0.02, 0.006, 1e-9, "V")
    (reason,) = _misfits([one], diagnosed=False)
    assert "0.02 V rms off the model at 0.002 V of noise" in reason.text and "tolerance 0.006 V" in reason.text
    assert " K" not in reason.text


def test_figures_of_voltages_have_volts_on_their_axes() -> None:
    run = rt.thermal.simulate(system(), drive(np.repeat([1.0, -0.5], 20), 4.0))
    figure = measured_against_model(run.time, {"V1": run["V1"]}, {"V1": run["V1"] + 0.01}, unit="V")
    assert [axes.get_ylabel() for axes in figure.axes] == ["voltage [V]", "measured −\nmodel [V]"]
    lines = [line for line in figure.axes[0].get_lines() if len(line.get_ydata()) == len(run)]
    assert np.allclose(lines[0].get_ydata(), run["V1"] + 0.01)  # nothing is taken off as if it were kelvin


def test_report_of_a_diagnosis_has_volts_apart_from_kelvin(monkeypatch: pytest.MonkeyPatch) -> None:
    axes: list[str] = []

    def noted(cls: type[rt.report.Figure], figure: Any, *, alt: str, caption: str) -> rt.report.Figure:
        axes.extend(ax.get_ylabel().replace("\n", " ") for ax in figure.axes)
        return cls('<svg viewBox="0 0 1 1"></svg>', alt, caption)

    monkeypatch.setattr(rt.report.Figure, "draw", classmethod(noted))
    run = rt.thermal.simulate(system(), drive(np.repeat(np.random.default_rng(3).uniform(-1.0, 1.5, 20), 4), 4.0))
    noisy = run.with_outputs(run.outputs + np.random.default_rng(1).standard_normal((80, 2)) * [0.02, 0.002])
    result = rt.jobs.diagnose_records(system(), (), [noisy])
    assert [(one.unit, list(one.before)) for one in result.residuals] == [("K", ["T_cold"]), ("V", ["V1"])]
    report = rt.jobs.diagnose.diagnosis_report(result)
    listed = [claim.box for claim in report.claims if "train: " in claim.box]
    assert listed and all(text.count("train: ") == 1 for text in listed)  # once, not for kelvin and for volts
    (gap,) = [section for section in report.sections if section.anchor == "gap"]
    rows = {row["records"].rpartition(" ")[2]: row["unit"] for row in gap.tables[0].frame.to_dict("records")}
    assert rows["T_cold"] == "K" and rows["V1"] == "V"
    assert {"measured − model [K]", "measured − model [V]", "|measured − model| [K/√Hz]",
            "|measured − model| [V/√Hz]"} <= set(axes)


def test_residuals_before_and_after_in_volts() -> None:
    figure = residuals_before_after([0.0, 1.0], {"V1": [1.0, 2.0]}, {"V1": [0.1, -0.1]}, unit="V")
    assert [axes.get_ylabel() for axes in figure.axes] == ["measured −\nmodel [V]"] * 2
