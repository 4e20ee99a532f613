"""Readings noisier than declared: white noise of any size passes the tests of what is left, and the answer says so."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt

DECLARED = 0.02  # K


def diagnosed(noise: float, lag: float) -> rt.Diagnosis:
    """A bar with noise of that size, and a thermometer that is late or not."""
    bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
                    sensors={"T": {"lump": "bar", "noise": DECLARED}},
                    fit={"lumps.bar.capacity": {"lower": 50.0, "upper": 200.0},
                         "links.bar-room.conductance": {"lower": 0.1, "upper": 2.0}})
    rng = np.random.default_rng(8)
    heater = np.repeat(rng.uniform(0.0, 6.0, 20), 30)
    drive = rt.Record(sample_time=5.0, inputs=np.column_stack([heater, np.full(600, 295.0)]),
                      outputs=np.zeros((600, 0)), input_names=["heater", "room"], output_names=[])
    run = rt.thermal.simulate(bar.with_parameters({"sensors.T.time_constant": lag}), drive)
    readings = run.outputs + noise * rng.standard_normal((600, 1))
    return rt.diagnose(bar, run.with_outputs(readings), effects=["sensor_lag", "missing_link", "heat_source"])


@pytest.mark.parametrize(("lag", "verdict"), [(0.0, "consistent"), (20.0, "named")])
def test_four_times_the_declared_noise_is_said(lag: float, verdict: str) -> None:
    answer = diagnosed(4.0 * DECLARED, lag)
    assert answer.verdict == verdict
    said, = (one for one in answer.caveats if "where 0.02 K are declared" in one)
    assert float(said.split()[0]) == pytest.approx(4.0 * DECLARED, rel=0.1) and said in answer.outcome.text


@pytest.mark.parametrize("times", [1.0, 1.3])
def test_what_is_allowed_for_is_not_said(times: float) -> None:
    answer = diagnosed(times * DECLARED, 0.0)
    assert answer.verdict == "consistent" and not any("are declared" in one for one in answer.caveats)
