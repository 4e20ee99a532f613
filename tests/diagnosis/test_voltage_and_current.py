"""When a voltage is read, and when its current is set: before, after, or while; logs made by hand in plain scipy."""

import re

import numpy as np
import pytest
from voltage_rig import FILE, FIT, TRUE, H, currents, log, logged, machine, system

import robthermal as rt

SAID = "V1 stands apart in 20 rows in which the current of m1 changes, as if read meanwhile: left out."


def test_a_voltage_read_before_is_that_of_the_rig() -> None:
    run = rt.thermal.simulate(machine("before"), logged(1, 1.0), initial=295.15)
    left = logged(1, 1.0).outputs - run.outputs
    assert left.std(axis=0) == pytest.approx([0.02, 0.002], rel=0.2)
    assert left[0, 1] == 0.0  # the current before the record is not known: its own reading stands
    alone = rt.Record(sample_time=H, inputs=currents(1), outputs=np.zeros((200, 0)), input_names=["m1"],
                      output_names=[])
    at_rest = rt.thermal.simulate(machine("before"), alone, initial=295.15)
    assert np.allclose(at_rest.outputs[1:], run.outputs[1:], atol=1e-9)


def test_slopes_of_a_voltage_read_before_are_differences() -> None:
    record, names = logged(1, 1.0), [*FIT, "links.hot-room.conductance", "sensors.V1.gain"]
    made = machine("before")
    found = rt.thermal.trajectory(made, record, sensitivities=names).sensitivity
    for i, name in enumerate(names):
        step = 1e-4 * made.parameter(name)
        more, less = (rt.thermal.trajectory(made.with_parameters({name: made.parameter(name) + sign * step}), record,
                                            tolerance=1e-8).readings for sign in (1.0, -1.0))
        assert np.allclose(found[..., i], (more - less) / (2.0 * step), atol=2e-3 * np.abs(found[..., i]).max() + 1e-6)


def test_only_voltages_are_read_before() -> None:
    with pytest.raises(rt.InputError, match="read does not belong to a temperature"):
        rt.thermal.parse_system(FILE.replace('lump = "cold"\nnoise', 'lump = "cold"\nread = "before"\nnoise'))


@pytest.mark.parametrize(("share", "read", "said"), [
    (1.0, "after", 'm1\' one row later.* say read = "before" in .sensors.V1.'),
    (0.0, "before", 'm1\' in the same row.* leave out read = "before"')])
def test_a_voltage_of_another_row_is_refused_by_name(share: float, read: str, said: str) -> None:
    for asked in (rt.diagnose, rt.calibrate):
        with pytest.raises(rt.InputError, match=f"(?s)the voltage 'V1' follows a step of the current '{said}"):
            asked(machine(read), logged(1, share))


def replaced(record: rt.Record, inputs: np.ndarray) -> rt.Record:
    return rt.Record(sample_time=H, inputs=inputs, outputs=record.outputs, input_names=["m1"],
                     output_names=["T_cold", "V1"])


@pytest.mark.parametrize(("share", "read"), [(0.0, "after"), (0.6, "after"), (1.0, "before")])
def test_what_does_not_tell_is_not_refused(share: float, read: str) -> None:
    """Short logs, a current that moves slowly or never, or a voltage that is read while the current changes."""
    record = logged(1, share)
    slow = replaced(record, np.linspace(0.0, 1.5, 200))
    for one in (record[:3], record[:12], record, slow, replaced(record, np.full(200, 1.5))):
        assert rt.fitting.as_data(machine(read), one, "data")[0].sensors == ("T_cold", "V1")


def test_a_measured_current_has_noise() -> None:
    """Steps count, and not what the meter of the current adds to every row."""
    noise = 0.002 * np.random.default_rng(9).standard_normal((200, 1))
    late, between = logged(1, 1.0), logged(1, 0.5)
    with pytest.raises(rt.InputError, match="one row later"):
        rt.fitting.as_data(machine(), replaced(late, late.inputs + noise), "data")
    found = rt.diagnose(machine(), replaced(between, between.inputs + noise), noise={"V1": 0.005})
    assert re.search(r"V1 stands apart in (1\d|20) rows", found.outcome.text)


@pytest.mark.parametrize("share", [0.5, 0.1])
def test_readings_while_the_current_changes_are_left_out(share: float) -> None:
    """Of a right model nothing is missing; of one without the slope of the resistance that is."""
    train, held_out = logged(1, share), logged(2, share)
    right = rt.diagnose(machine(), train, validation=held_out)
    assert right.verdict == "consistent"
    assert SAID in right.outcome.text
    lacking = rt.diagnose(machine(**{"modules.m1.resistance.slope": 0.0}), train, validation=held_out)
    assert lacking.verdict == "named" and [one.label for one in lacking.effects] == ["resistance_slope(m1)"]
    slope, std, _ = lacking.effects[0].values["slope"]
    assert abs(slope - TRUE["dR"]) < 4 * std


def test_where_voltages_are_read_after_nothing_is_left_out() -> None:
    found = rt.calibrate(machine(**{"modules.m1.resistance.slope": 0.0}), logged(1, 0.0))
    assert "stands apart" not in str(found)


def test_what_is_left_out_is_in_no_mean() -> None:
    """Readings that count for nothing have no residual: counted as zeros they had made the noise 5 % too small."""
    made = machine()
    silent = {name: {**sensor.model_dump(exclude_unset=True), "noise": 0.0} for name, sensor in made.sensors.items()}
    fit = rt.calibrate(rt.System(**{**dict(made), "sensors": silent}), logged(1, 0.5))
    left = fit.residuals[0]["V1"]
    assert np.count_nonzero(left == 0.0) == 20
    of_the_others = np.sqrt(np.mean(left[left != 0.0] ** 2))
    assert fit.train[0].rmse["V1"] == pytest.approx(of_the_others)
    assert fit.noise["V1"] == pytest.approx(of_the_others, rel=1e-3)


@pytest.mark.parametrize("h", [20.0, 60.0, 300.0])
def test_a_module_that_follows_within_a_row_is_no_late_voltmeter(h: float) -> None:
    """Rows as long as the module takes, and a model that is wrong by half."""
    current = currents(1)
    readings, _ = log(current, h)
    record = rt.Record(sample_time=h, inputs=current, outputs=readings + 0.002, input_names=["m1"],
                       output_names=["T_cold", "V1"])
    wrong = {"lumps.hot.capacity": 100.0, "lumps.cold.capacity": 25.0, "modules.m1.resistance.value": 1.8}
    found = rt.calibrate(machine(**wrong), record)
    assert "stands apart" not in str(found)


@pytest.mark.parametrize("period", [6.0, 11.3, 40.0])
def test_a_sine_does_not_tell_when_voltages_are_read(period: float) -> None:
    """Its differences follow from one another: whatever is fitted to them, nothing is refused."""
    current = np.sin(2.0 * np.pi * np.arange(200) / period)
    readings, _ = log(current, H)
    record = rt.Record(sample_time=H, inputs=current, outputs=readings, input_names=["m1"],
                       output_names=["T_cold", "V1"])
    for read in ("after", "before"):
        assert rt.fitting.as_data(machine(read), record, "data")[0].sensors == ("T_cold", "V1")


def test_a_calibration_counts_no_voltage_between_two_currents() -> None:
    start = machine(**{"modules.m1.resistance.value": 1.7, "modules.m1.seebeck.value": 0.055})
    found = rt.calibrate(start, logged(1, 0.5), validation=logged(2, 0.5))
    assert SAID in str(found)
    for name, key in (("seebeck.value", "S"), ("resistance.value", "R"), ("conductance.value", "K")):
        at = list(found.parameters).index(f"modules.m1.{name}")
        assert abs(found.parameters[f"modules.m1.{name}"] - TRUE[key]) < 4.0 * found.covariance[at, at]**0.5
    assert found.train[0].rmse["V1"] == pytest.approx(0.002, rel=0.2)
    assert found.validation[0].rmse["V1"] == pytest.approx(0.002, rel=0.2)


def test_the_rig_reads_after() -> None:
    assert system().sensors["V1"].read == "after"
