"""Logs whose commands stand a row from where they act."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import robthermal as rt

LOG = pd.DataFrame({"time": [0.0, 5.0, 10.0, 15.0], "q": [1.0, 2.0, 3.0, 4.0], "room [K]": [290.0, 291.0, 292.0, 293.0],
                    "T1 [K]": [300.0, 301.0, 302.0, 303.0]})
SYSTEM = rt.System(ambients={"room": {"temperature": 290.0}}, lumps={"a": {"capacity": 10.0}},
                   links=[{"between": ("a", "room"), "conductance": 0.1}], inputs={"q": {"lump": "a"}},
                   sensors={"T1": {"lump": "a", "noise": 0.1}})


@pytest.mark.parametrize(("steps", "start", "q", "room", "T1"), [
    (1, 5.0, [1.0, 2.0, 3.0], [291.0, 292.0, 293.0], [301.0, 302.0, 303.0]),
    (-1, 0.0, [2.0, 3.0, 4.0], [290.0, 291.0, 292.0], [300.0, 301.0, 302.0]),
    (2, 10.0, [1.0, 2.0], [292.0, 293.0], [302.0, 303.0])])
def test_commands_move_and_ambients_stay_with_the_readings(steps, start, q, room, T1):
    record = rt.read_record(LOG, SYSTEM, input_shift=steps)
    assert record.start_time == start and record["q"].tolist() == q
    assert record["room"].tolist() == room and record["T1"].tolist() == T1
    said = [one["text"] for one in record.imported.actions if one["what"] == "shifted"]
    assert len(said) == 1 and ("later" if steps > 0 else "earlier") in said[0]
    plain = rt.read_record(LOG, SYSTEM)
    again = rt.signals.shift_inputs(plain, steps, ["q"])
    np.testing.assert_array_equal(again.inputs, record.inputs)
    np.testing.assert_array_equal(again.outputs, record.outputs)


def test_a_shift_there_and_back_leaves_the_rows_in_the_middle() -> None:
    plain = rt.read_record(LOG, SYSTEM)
    back = rt.signals.shift_inputs(rt.signals.shift_inputs(plain, 1, ["q"]), -1, ["q"])
    np.testing.assert_array_equal(back.inputs, plain[1:3].inputs)
    assert back.start_time == 5.0 and rt.signals.shift_inputs(plain, 0).inputs.tolist() == plain.inputs.tolist()


def test_the_ripple_of_an_input_moves_with_it() -> None:
    record = rt.Record(sample_time=1.0, inputs=[1.0, 2.0, 3.0, 4.0], outputs=[0.0, 1.0, 2.0, 3.0], input_names=["i"],
                       output_names=["T"], ripple={"i": [0.1, 0.2, 0.3, 0.4]})
    assert rt.signals.shift_inputs(record, 1).ripple["i"].tolist() == [0.1, 0.2, 0.3]
    assert rt.signals.shift_inputs(record, -2).ripple["i"].tolist() == [0.3, 0.4]


@pytest.mark.parametrize("steps", [3, -3, 0.5, "1", True])
def test_no_rows_left_and_no_whole_number_are_refused(steps) -> None:
    with pytest.raises(rt.InputError, match="argument steps"):
        rt.signals.shift_inputs(rt.read_record(LOG, SYSTEM), steps)


def test_an_unknown_input_is_refused() -> None:
    with pytest.raises(rt.InputError, match="'heater' is no input"):
        rt.signals.shift_inputs(rt.read_record(LOG, SYSTEM), 1, ["heater"])


def test_parts_too_short_for_a_shift_are_left_out() -> None:
    gaps = pd.concat([LOG.iloc[:2], LOG.assign(time=LOG["time"] + 1000.0)])
    with pytest.warns(UserWarning, match="shorter than 3 samples"):
        records = rt.read_records(gaps, SYSTEM, input_shift=-1)
    assert [one.n_samples for one in records] == [3]


def test_a_shift_that_is_no_whole_number_of_rows_is_refused_in_a_declaration() -> None:
    with pytest.raises(rt.InputError, match="input_shift"):
        rt.read_record(LOG, SYSTEM, input_shift=0.5)
