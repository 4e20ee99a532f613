"""A job with a voltage among its readings: its numbers are volts in the gate, the tables and the figures."""

import numpy as np
from voltage_rig import drive, system

import robthermal as rt
from robthermal.jobs.run import Misfit
from robthermal.jobs.run._gate import _misfits
from robthermal.report import measured_against_model


def test_reasons_say_volts() -> None:
    one = Misfit("train", "r", "V1", 0.0, 0.02, 0.002, 0.02, 0.006, 1e-9, "V")
    (reason,) = _misfits([one])
    assert "0.02 V rms off the model at 0.002 V of noise" in reason.text and "tolerance 0.006 V" in reason.text
    assert " K" not in reason.text


def test_figures_of_voltages_have_volts_on_their_axes() -> None:
    run = rt.thermal.simulate(system(), drive(np.repeat([1.0, -0.5], 20), 4.0))
    figure = measured_against_model(run.time, {"V1": run["V1"]}, {"V1": run["V1"] + 0.01}, unit="V")
    assert [axes.get_ylabel() for axes in figure.axes] == ["voltage [V]", "measured −\nmodel [V]"]
    lines = [line for line in figure.axes[0].get_lines() if len(line.get_ydata()) == len(run)]
    assert np.allclose(lines[0].get_ydata(), run["V1"] + 0.01)  # nothing is taken off as if it were kelvin
