"""Long logs made short by means: against pandas, exact means of the model, and finer samples."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pandas as pd
import pytest

import robthermal as rt

BAR = rt.System(ambients={"room": {"temperature": 295.0}},
                lumps={"a": {"capacity": 50.0}, "b": {"capacity": 120.0}},
                links=[{"between": ("a", "b"), "conductance": 0.8}, {"between": ("b", "room"), "conductance": 0.4}],
                inputs={"q": {"lump": "a"}},
                sensors={"T": {"lump": "a", "noise": 0.02}, "S": {"lump": "b", "noise": 0.02}})


def drive(u: np.ndarray, h: float, **changes: object) -> rt.Record:
    return rt.Record(sample_time=h, inputs=u, outputs=np.zeros((len(u), 0)), input_names=["q"], output_names=[],
                     **changes)


def test_means_of_means_are_those_of_longer_steps() -> None:
    """Inputs that hold over a block: the model of the long steps is that of the short ones, exactly."""
    u = np.repeat(np.random.default_rng(0).uniform(0.0, 10.0, 30), 8)
    fine = rt.thermal.simulate(BAR, drive(u, 3.0, averaged=True), initial=300.0)
    short = rt.signals.block_means(fine, 8)
    coarse = rt.thermal.simulate(BAR, drive(u[::8], 24.0, averaged=True), initial=300.0)
    assert short.averaged and short.sample_time == 24.0 and short.time.tolist() == coarse.time[1:].tolist()
    assert np.array_equal(short.inputs, coarse.inputs[1:]) and not short.ripple
    assert np.abs(short.outputs[1:] - coarse.outputs[2:]).max() < 1e-9  # the first step of a run holds no mean


def test_samples_become_what_pandas_says() -> None:
    rng = np.random.default_rng(1)
    log = rt.Record(sample_time=1.0, inputs=rng.uniform(size=(61, 2)), outputs=rng.uniform(size=(61, 3)),
                    input_names=["q", "m"], output_names=["T", "S", "R"], start_time=100.0, units={"T": "K"})
    short = rt.signals.block_means(log, 10)
    frame = pd.DataFrame(np.hstack([log.inputs[:60], log.outputs[1:]]))  # a reading at the end of every sample
    means = frame.groupby(frame.index // 10).mean().to_numpy()
    assert np.allclose(short.inputs, means[1:, :2]) and np.allclose(short.outputs, means[:-1, 2:])
    assert short.start_time == 110.0 and len(short) == 5 and short.units["T"] == "K"
    assert short.notes[-1] == "means over 10 samples each"
    off = frame.groupby(frame.index // 10).std(ddof=0).to_numpy()
    assert np.allclose(short.ripple["q"], off[1:, 0]) and np.allclose(short.ripple["m"], off[1:, 1])


def test_blocks_of_blocks_are_blocks() -> None:
    """Blocks of 12, and of 3 and 4: the second way starts 3 samples later, so that its record begins 3 earlier."""
    rng = np.random.default_rng(2)
    u, y = rng.uniform(size=120), rng.uniform(size=120)
    log = rt.Record(sample_time=1.0, inputs=u, outputs=y, input_names=["m"], output_names=["T"], averaged=True)
    once = rt.signals.block_means(log[3:], 12)
    twice = rt.signals.block_means(rt.signals.block_means(log, 3), 4)
    n = min(len(once), len(twice))
    assert n >= 7 and once.time[:n].tolist() == twice.time[:n].tolist()
    assert np.allclose(once.inputs[:n], twice.inputs[:n]) and np.allclose(once.outputs[:n], twice.outputs[:n])
    assert np.allclose(once.ripple["m"][:n], twice.ripple["m"][:n])


def test_a_pulsed_current_heats_by_its_ripple() -> None:
    """2 A for every other second: twice the Joule heat of 1 A. Without ripple the means are a kelvin off."""
    system = rt.systems.two_module()
    names = list(system.modules)
    u = np.zeros((3600, 2))
    u[::2, 0] = 2.0
    log = rt.Record(sample_time=1.0, inputs=u, outputs=np.zeros((3600, 0)), input_names=names, output_names=[])
    short = rt.signals.block_means(rt.thermal.simulate(system, log), 60)
    assert np.allclose(short["m1"], 1.0) and np.allclose(short.ripple["m1"], 1.0) and "m2" not in short.ripple
    run = rt.thermal.simulate(system, short.select(outputs=[]))
    bare = rt.thermal.simulate(system, short.select(outputs=[]).changed(ripple={}))
    late = slice(30, None)  # the start is forgotten
    off, without = (np.abs(one.outputs - short.outputs)[late].max() for one in (run, bare))
    assert off < 0.1 and without > 0.5


def test_equal_values_have_no_ripple() -> None:
    """The mean of three times 0.1 is not 0.1 in binary numbers."""
    u = np.repeat([0.1, 0.7, 0.3], 30)
    assert not rt.signals.block_means(drive(u, 1.0), 3).ripple and not rt.signals.block_means(drive(u, 1.0), 10).ripple


def test_records_without_inputs_or_outputs_stay_so() -> None:
    readings = rt.Record(sample_time=1.0, inputs=np.zeros((30, 0)), outputs=np.arange(30.0), input_names=[],
                         output_names=["T"])
    assert rt.signals.block_means(readings, 5)["T"].tolist() == [3.0, 8.0, 13.0, 18.0, 23.0]
    assert rt.signals.block_means(drive(np.ones(30), 1.0), 5).outputs.shape == (5, 0)


@pytest.mark.parametrize(("samples", "word"), [(1, "2 or more"), (2.5, "whole"), (True, "whole"), (40, "three blocks")])
def test_blocks_that_are_none_are_refused(samples: object, word: str) -> None:
    with pytest.raises(rt.InputError, match=word):
        rt.signals.block_means(drive(np.ones(100), 1.0), samples)


def test_a_file_says_how_many_samples_become_one() -> None:
    rng = np.random.default_rng(3)
    log = pd.DataFrame({"time": np.arange(100.0), "q": rng.uniform(size=100), "T1 [K]": 300.0 + rng.uniform(size=100)})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        plain = rt.read_record(log, inputs=["q"], outputs=["T1"])
        short = rt.read_record(log, inputs=["q"], outputs=["T1"], means_of=5)
        after = rt.read_record(log, inputs=["q"], outputs=["T1"], means_of=5, averaged="after")
    own = rt.signals.block_means(plain, 5)
    assert np.array_equal(short.inputs, own.inputs) and np.array_equal(short.outputs, own.outputs) and short.averaged
    assert np.array_equal(after.outputs, rt.signals.block_means(rt.signals.as_means(plain, "after"), 5).outputs)
    assert short.imported is not None
    assert [one["text"] for one in short.imported.actions if "5 samples" in one["text"]]


def test_parts_of_less_than_three_blocks_are_left_out() -> None:
    time = np.concatenate([np.arange(14.0), 1000.0 + np.arange(40.0)])
    log = pd.DataFrame({"time": time, "q": 1.0 + time % 3.0, "T1 [K]": 300.0 + time % 7.0})
    with pytest.warns(UserWarning, match="shorter than 15 samples"):
        records = rt.read_records(log, inputs=["q"], outputs=["T1"], means_of=5)
    assert [len(one) for one in records] == [7]


def test_too_long_a_log_is_refused_with_the_line_that_makes_it_short() -> None:
    week = rt.Record(sample_time=1.0, inputs=np.ones(604_800), outputs=np.full((604_800, 2), 295.0), input_names=["q"],
                     output_names=["T", "S"])
    with pytest.raises(rt.InputError, match="1209600 readings") as refused:
        rt.diagnose(BAR, week)
    assert "means_of = 25 in [record]" in refused.value.remedy and "block_means(record, 25)" in refused.value.remedy
    with pytest.raises(rt.InputError, match="1209600 readings") as refused:
        rt.diagnose(BAR, week[:100], reference=week)
    assert refused.value.where == "argument reference"


def day(of: int) -> rt.diagnosis.Diagnosis:
    """Answer to 86 400 samples, one a second, whose heater changes at times that are no multiples of a block."""
    rng = np.random.default_rng(4)
    late = BAR.with_parameters({"sensors.T.time_constant": 40.0})
    u = np.concatenate([np.full(n, q) for n, q in zip(rng.integers(300, 1500, 150), rng.uniform(0.0, 10.0, 150),
                                                      strict=True)])[:86_400]
    run = rt.thermal.simulate(late, drive(u, 1.0))
    log = run.with_outputs(run.outputs + 0.02 * rng.standard_normal(run.outputs.shape))
    return rt.diagnose(BAR, rt.signals.block_means(log, of))


@pytest.mark.parametrize(("of", "says"), [(6, False), (7, True)])
def test_a_calibration_says_that_inputs_change_within_steps(of: int, says: bool) -> None:
    """Levels of 60 s in steps of 6 s hold over them, in steps of 7 s they do not."""
    rng = np.random.default_rng(5)
    run = rt.thermal.simulate(BAR, drive(np.repeat(rng.uniform(0.0, 10.0, 20), 60), 1.0))
    log = run.with_outputs(run.outputs + 0.02 * rng.standard_normal(run.outputs.shape))
    fit = rt.calibrate(BAR, rt.signals.block_means(log, of), parameters={"lumps.a.capacity": (20.0, 100.0)})
    said = " ".join(fit.remarks)
    assert ("q changes within" in said and f"within about {5 * of} s are off by more" in said) is says


def test_inputs_that_change_within_steps_are_said_once_for_a_file() -> None:
    """Two heaters in two parts of one log, and another log: a sentence for each log, not six."""
    system = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"a": {"capacity": 50.0}},
                       links=[{"between": ("a", "room"), "conductance": 0.5}],
                       inputs={"q": {"lump": "a"}, "p": {"lump": "a"}}, sensors={"T": {"lump": "a", "noise": 0.02}})
    rng = np.random.default_rng(5)

    def log(name: str) -> rt.Record:
        u = np.repeat(rng.uniform(0.0, 10.0, (20, 2)), 60, axis=0)
        driven = rt.Record(sample_time=1.0, inputs=u, outputs=np.zeros((len(u), 0)), input_names=["q", "p"],
                           output_names=[])
        T = rt.thermal.simulate(system, driven)["T"]
        return rt.signals.block_means(rt.Record(
            sample_time=1.0, inputs=u, outputs=T + 0.02 * rng.standard_normal(len(u)), input_names=["q", "p"],
            output_names=["T"], name=name), 7)

    logs = [log("mon.csv part 1"), log("mon.csv part 2"), log("tue.csv")]
    fit = rt.calibrate(system, logs, parameters={"lumps.a.capacity": (20.0, 100.0)})
    found = [one for one in fit.remarks if "within" in one and "steps of record" in one]
    told = [re.match(r"q and p change within up to (\d+) of the (\d+) steps of record '(.*?)' and act there", one)
            for one in found]
    assert [one[3] for one in told if one] == ["mon.csv", "tue.csv"] and len(found) == 2
    (most, steps), (one_most, one_steps) = [(int(one[1]), int(one[2])) for one in told if one]
    assert steps == 2 * one_steps and 12 <= one_most <= 17 and 24 <= most <= 34  # 19 changes, 2 of them between steps


@pytest.mark.exhaustive
def test_a_lag_is_found_in_a_day_of_seconds_and_inputs_that_change_within_steps_are_said() -> None:
    found = day(10)
    assert [one.label for one in found.effects] == ["sensor_lag(T)"]
    value, std, _ = found.effects[0].values["time_constant"]
    assert abs(value - 40.0) < 3.0 * std < 1.0
    assert "q changes within" in found.outcome.text and "within about 50 s" in found.outcome.text


@pytest.mark.exhaustive
def test_blocks_of_half_the_lag_are_too_long_and_the_answer_says_which_times_are_off() -> None:
    """Measured 38.6 ± 0.25 s for 40 s: the standard deviation does not hold, and 40 s is among the times named."""
    found = day(20)
    assert [one.label for one in found.effects] == ["sensor_lag(T)"] and found.verdict == "named_with_remainder"
    assert "within about 100 s are off by more than is said" in found.outcome.text
