"""Logs of means with an effect hidden: undeclared no name and a word, declared the right name; samples stay samples."""

from __future__ import annotations

import numpy as np
import pytest
from averaged_logs import NOISE, log, true_name

import robthermal as rt

FEW = ["sensor_lag", "input_lag", "input_delay", "hidden_mass", "missing_link", "missing_ambient_link"]


@pytest.mark.parametrize(("kind", "effect", "h", "how", "word", "verdict"), [
    ("two", "none", 10, "readings", "readings", "unexplained"),
    ("two", "sensor_lag", 60, "after", "after", "unexplained"),
    ("two", "input_delay", 30, "readings", "readings", "ambiguous"),  # a late input, or two
    ("three", "missing_link", 30, "held", "after", "unexplained"),
    ("module", "hidden_mass", 30, "held", "after", "named_with_remainder")])  # the same is chosen beside means
def test_undeclared_means_are_said_and_get_no_wrong_name(kind, effect, h, how, word, verdict):
    """Taken for samples, two late inputs explained the first of these down to the noise, and were named."""
    system, record = log(kind, effect, 10, h, how)
    found = rt.diagnose(system, record, effects=FEW)
    assert found.verdict == verdict
    if verdict == "named_with_remainder":
        assert [(one.effect, frozenset(one.where)) for one in found.effects] == [true_name(kind, effect)]
        assert "with the same effects of other sizes" in found.means
    assert found.means.startswith("The log may" if effect == "input_delay" else "The log ")
    assert f'averaged = "{word}"' in found.means and found.means in found.outcome.text


@pytest.mark.parametrize(("kind", "effect", "h", "how"), [
    ("two", "none", 10, "held"), ("two", "missing_link", 10, "readings"), ("three", "sensor_lag", 30, "readings")])
def test_declared_means_of_samples_are_means_though_they_are_late(kind, effect, h, how):
    """Ten samples at the beginnings of a step of 10 s are 0.5 s early: that is the logger, not a lag."""
    system, record = log(kind, effect, 10, h, how)
    found = rt.diagnose(system, rt.signals.as_means(record, "readings" if how == "readings" else "after"), effects=FEW)
    keys = [(one.effect, frozenset(one.where)) for one in found.effects]
    assert keys == ([] if effect == "none" else [true_name(kind, effect)])
    assert found.verdict == ("consistent" if effect == "none" else "named") and found.means == ""
    fit = found.fit
    assert fit.structure.sessions.late(fit.structure.gains(fit.v)[0]) == pytest.approx(0.5 / h, abs=0.2 / h)
    assert fit.rms < 1.1 * NOISE


def test_a_lag_of_half_a_step_is_a_lag():
    system, record = log("two", "sensor_lag", 10, 60, "sampled")
    found = rt.diagnose(system, record, effects=FEW)
    assert [one.label for one in found.effects] == ["sensor_lag(Ta)"] and found.means == ""


def test_half_a_step_of_delay_at_the_only_input_may_be_means():
    """Then the records cannot tell: both are said."""
    bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"q": {"lump": "bar"}},
                    sensors={"T": {"lump": "bar", "noise": 0.02}})
    rng = np.random.default_rng(1)
    drive = rt.Record(sample_time=20.0, inputs=np.repeat(rng.uniform(0.0, 9.0, 50), 6), outputs=np.zeros((300, 0)),
                      input_names=["q"], output_names=[])
    run = rt.thermal.simulate(bar.with_parameters({"inputs.q.drive.delay": 10.0}), drive)
    found = rt.diagnose(bar, run.with_outputs(run.outputs + 0.02 * rng.standard_normal((300, 1))), effects=FEW)
    assert found.verdict == "ambiguous" and found.effects[0].label in ("input_delay(q)", "sensor_lag(T)")
    assert found.means.startswith("The log may hold means")


def test_late_means_are_those_of_samples():
    """The column of the unknown, against means of ten samples of a simulation that is ten times finer."""
    system, record = log("two", "none", 11, 10, "held")
    fine = rt.Record(sample_time=1.0, inputs=record.inputs.repeat(10, axis=0), outputs=np.zeros((2400, 0)),
                     input_names=record.input_names, output_names=[])
    y = rt.thermal.simulate(system, fine).outputs
    samples = y[:2390].reshape(239, 10, -1).mean(axis=1)
    means = (0.5 * (y[1:] + y[:-1]))[:2390].reshape(239, 10, -1).mean(axis=1)
    log_of_means = record.changed(outputs=np.concatenate([samples[:1], samples]), averaged=True)
    path = rt.diagnosis.refit(system, log_of_means).records[0]
    assert np.abs(0.05 * path.late_columns[1:] - (samples - means)).max() < 0.02 * np.abs(samples - means).max()
