"""Logs with a sign turned, two columns exchanged or times in another unit, of a board in numpy: said, of no others."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from voltage_rig import logged, machine

import robthermal as rt
from robthermal.fitting import misread

FILE = """
[system]
name = "board"
temperature_unit = "degC"
[ambients.room]
temperature = 22.0
[lumps.a]
capacity = 9.0
[lumps.b]
capacity = 16.0
[lumps.c]
capacity = 30.0
[[links]]
between = ["a", "room"]
conductance = 0.06
[[links]]
between = ["b", "room"]
conductance = 0.03
[[links]]
between = ["c", "room"]
conductance = 0.1
[[links]]
between = ["a", "c"]
conductance = 0.12
[[links]]
between = ["b", "c"]
conductance = 0.2
[inputs.qa]
lump = "a"
[inputs.qb]
lump = "b"
[sensors.Ta]
lump = "a"
noise = 0.05
[sensors.Tb]
lump = "b"
noise = 0.05
[fit]
"links.a-room.conductance" = { lower = 0.01, upper = 0.5 }
"links.b-room.conductance" = { lower = 0.01, upper = 0.5 }
"links.c-room.conductance" = { lower = 0.01, upper = 0.5 }
"lumps.a.capacity" = { lower = 2.0, upper = 50.0 }
"lumps.b.capacity" = { lower = 2.0, upper = 50.0 }
"""
BOARD = rt.thermal.parse_system(FILE)


def board(seed: int, between: float = 0.0) -> rt.Record:
    """Euler steps of a quarter of a second; conductances 20 % off the file, and a path from a to b [W/K]."""
    rng = np.random.default_rng(seed)
    q = np.column_stack([np.repeat(rng.uniform(0.0, 4.0, 20), 15), np.repeat(rng.uniform(0.0, 6.0, 30), 10)])
    T, out = np.full(3, 295.15), []
    for row in q:
        out.append(T[:2].copy())
        for _ in range(16):
            path, left = between * (T[0] - T[1]), T - 295.15
            heat = [row[0] - 0.075 * left[0] - 0.12 * (T[0] - T[2]) - path,
                    row[1] - 0.024 * left[1] - 0.2 * (T[1] - T[2]) + path,
                    0.12 * (T[0] - T[2]) + 0.2 * (T[1] - T[2]) - 0.12 * left[2]]
            T = T + 0.25 * np.array(heat) / [8.0, 18.0, 30.0]
    readings = np.array(out) + 0.05 * rng.standard_normal((len(q), 2))
    return rt.Record(sample_time=4.0, inputs=q, outputs=readings, input_names=["qa", "qb"], output_names=["Ta", "Tb"])


def read(record: rt.Record, inputs: np.ndarray, outputs: np.ndarray | None = None) -> rt.Record:
    return record.changed(inputs=inputs, outputs=record.outputs if outputs is None else outputs)


def timed(record: rt.Record, factor: float) -> rt.Record:
    return record.changed(sample_time=factor * record.sample_time)


def said_of(system: rt.System, records: list[rt.Record]) -> list[str]:
    """What calibration and diagnosis say of the columns; the diagnosis then names nothing."""
    fit = rt.calibrate(system, records)
    found = rt.diagnose(system, records, effects=["missing_link", "input_gain", "input_saturation", "sensor_offset"])
    assert found.verdict == "unexplained" and found.effects == () and found.outcome.text.startswith("No name")
    assert found.means in found.caveats and found.means.endswith("Then diagnose again.")
    return [str(fit), found.means]


@pytest.mark.parametrize(("wrongly", "wrong", "remedy"), [
    (lambda one: read(one, one.inputs * [-1.0, 1.0]), "The heat of 'qa' seems to have the other sign",
     "give it scale = -1 in [columns]"),
    (lambda one: read(one, one.inputs[:, ::-1]), "The columns of the heaters 'qa' and 'qb' seem to be exchanged",
     "exchange qa and qb in [columns]"),
    (lambda one: read(one, one.inputs, one.outputs[:, ::-1]),
     "The columns of the thermometers 'Ta' and 'Tb' seem to be exchanged", "exchange Ta and Tb in [columns]"),
    (lambda one: timed(one, 1e3), "The time column seems to be in another unit, its times 1000 times too long",
     'time_format = "ms" in [record]'),
    (lambda one: timed(one, 1.0 / 60.0), "another unit, its times 60 times too short", 'time_format = "min" in'),
    (lambda one: timed(one, 60.0), "another unit, its times 60 times too long", 'time_format = "s" in [record]')])
def test_a_wrong_column_is_said_by_name(wrongly: Callable[[rt.Record], rt.Record], wrong: str, remedy: str) -> None:
    fit, found = said_of(BOARD, [wrongly(board(1)), wrongly(board(2))])
    falls = r"so read, the fit leaves 0\.0[45]\d* K of the records instead of [0-9.]+ K"
    assert wrong in fit and remedy in fit and re.search(falls, fit)
    assert wrong in found and remedy in found and re.search(falls, found)


@pytest.mark.parametrize("asked", [rt.calibrate, rt.diagnose])
@pytest.mark.parametrize(("current", "voltage"), [(-1.0, 1.0), (1.0, -1.0)])
def test_a_voltage_that_falls_where_the_current_rises_is_refused(asked: Callable[..., object], current: float,
                                                                 voltage: float) -> None:
    """A current of the other sign had been called a current that saturates (`input_saturation`)."""
    record = logged(1, 0.0)
    with pytest.raises(rt.InputError, match="the voltage 'V1' falls where the current 'm1' rises") as caught:
        asked(machine(), read(record, current * record.inputs, record.outputs * [1.0, voltage]))
    assert "scale = -1" in str(caught.value)


def test_a_module_the_other_way_round() -> None:
    record = logged(1, 0.0)
    turned = read(record, -record.inputs, record.outputs * [1.0, -1.0])
    wrong = "The current of 'm1' and its voltage seem to have the other sign"
    remedy = "give m1 and V1 scale = -1 in [columns], or exchange hot and cold in [modules.m1]"
    fit, found = said_of(machine(), [turned])
    assert wrong in fit and remedy in fit
    assert wrong in found and remedy in found
    alone = turned.changed(outputs=turned.outputs[:, :1], output_names=["T_cold"], units={})
    assert "The current of 'm1' seems to have the other sign" in str(rt.calibrate(machine(), alone))


def test_exchanging_the_faces_is_as_good_as_the_message_says() -> None:
    record, made = logged(1, 0.0), machine()
    turned = read(record, -record.inputs, record.outputs * [1.0, -1.0])
    module = rt.thermal.Module(**{**made.modules["m1"].model_dump(exclude_unset=True), "hot": "cold", "cold": "hot"})
    fit = rt.calibrate(rt.System(**{**dict(made), "modules": {"m1": module}}), turned)
    assert fit.parameters["modules.m1.conductance.value"] == pytest.approx(0.45, rel=0.01)
    assert fit.train[0].rmse["V1"] == pytest.approx(0.002, rel=0.2) and "other sign" not in str(fit)


@pytest.mark.parametrize("between", [0.0, 0.3])
def test_nothing_more_is_fitted_to_a_right_log(between: float) -> None:
    """Neither where the file is right, nor where a path is missing that leaves eighteen times the noise."""
    records = [board(1, between), board(2, between)]
    found = rt.diagnose(BOARD, records[0], validation=records[1], effects=["missing_link", "input_lag"])
    assert found.verdict == ("named" if between else "consistent")
    assert found.gap["train"].before > 0.8 or not between

    def fitted(_: list[rt.Record]) -> float:
        raise AssertionError("a reading was fitted")

    data = rt.fitting.as_data(BOARD, records, "data")
    assert misread(BOARD, data, 3.5, 3.5, {"Ta": 0.05, "Tb": 0.05}, fitted) == ""
