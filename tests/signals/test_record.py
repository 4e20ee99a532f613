"""Record: what it holds, how it is cut, what it refuses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import robthermal as rt
from robthermal import InputError, Record


def make(**changes: Any) -> Record:
    rng = np.random.default_rng(1)
    fields: dict[str, Any] = {
        "sample_time": 0.5,
        "inputs": rng.normal(size=(20, 2)),
        "outputs": 300.0 + rng.normal(size=(20, 3)),
        "input_names": ["u1", "u2"],
        "output_names": ["T1", "T2", "T3"],
        "start_time": 10.0,
        "units": {"T1": "K", "u1": "W"},
        "notes": ["made up"],
    }
    return Record(**{**fields, **changes})


def test_holds_read_only_copies_in_row_order() -> None:
    inputs = np.asfortranarray(np.arange(8.0).reshape(4, 2))
    record = make(inputs=inputs, outputs=np.arange(4), input_names=("a", "b"), output_names=["y"], units=None)
    inputs[0, 0] = 99.0
    assert record.inputs[0, 0] == 0.0
    assert record.inputs.flags.c_contiguous and record.inputs.dtype == np.float64
    assert record.outputs.shape == (4, 1) and record.outputs.dtype == np.float64
    for array in (record.inputs, record.outputs, record["a"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(AttributeError):
        record.sample_time = 2.0  # type: ignore[misc]


def test_time_length_and_names() -> None:
    record = make()
    assert len(record) == record.n_samples == 20
    assert record.duration == 10.0
    assert record.names == ("u1", "u2", "T1", "T2", "T3")
    np.testing.assert_array_equal(record.time, 10.0 + 0.5 * np.arange(20))
    np.testing.assert_array_equal(record["T2"], record.outputs[:, 1])
    assert "T2" in record and "T9" not in record


def test_no_inputs_or_no_outputs() -> None:
    assert make(inputs=np.zeros((20, 0)), input_names=[], units=None).inputs.shape == (20, 0)
    assert make(outputs=np.zeros((20, 0)), output_names=[], units=None).outputs.shape == (20, 0)
    with pytest.raises(InputError, match="neither inputs nor outputs"):
        make(inputs=np.zeros((20, 0)), input_names=[], outputs=np.zeros((20, 0)), output_names=[], units=None)


def test_slice_moves_the_start_and_keeps_the_rest() -> None:
    record = make(name="run")
    part = record[4:10]
    np.testing.assert_array_equal(part.inputs, record.inputs[4:10])
    np.testing.assert_array_equal(part.time, record.time[4:10])
    assert (part.units, part.notes, part.name) == (record.units, record.notes, "run")
    np.testing.assert_array_equal(record[-3:].time, record.time[-3:])


def test_between_and_split_agree_with_a_mask_over_time() -> None:
    record = make(sample_time=0.1, start_time=0.0)
    for start, stop in [(0.3, 0.9), (-5.0, 0.7), (0.25, math.inf), (-math.inf, math.inf)]:
        inside = (record.time >= start - 1e-12) & (record.time < stop - 1e-12)
        np.testing.assert_array_equal(record.between(start, stop)["T1"], record["T1"][inside])
    before, after = record.split(0.3)  # 3 * 0.1 is not 0.3 in floating point
    assert (before.n_samples, after.n_samples) == (3, 17)
    np.testing.assert_array_equal(np.concatenate([before["u1"], after["u1"]]), record["u1"])


def test_select_and_with_outputs() -> None:
    record = make()
    part = record.select(inputs=["u2"], outputs=["T3", "T1"])
    np.testing.assert_array_equal(part.outputs, record.outputs[:, [2, 0]])
    assert part.input_names == ("u2",) and part.units == {"T1": "K"}
    swapped = record.select(inputs=["T1"], outputs=[])
    np.testing.assert_array_equal(swapped["T1"], record["T1"])
    new = record.with_outputs(np.ones(20), ["T9"])
    assert new.output_names == ("T9",) and new.units == {"u1": "W"}
    np.testing.assert_array_equal(new.inputs, record.inputs)
    with pytest.raises(InputError, match="output_names has 3 names"):
        record.with_outputs(np.ones(20))


def test_table_frame_and_plot() -> None:
    record = make(name="bench run")
    shown = str(record)
    for text in ("bench run", "20 samples", "0.5 s", "T3", f"{record['T1'].max():.6g}", "made up"):
        assert text in shown
    table = record.to_frame()
    assert list(table.columns) == ["time", *record.names]
    np.testing.assert_array_equal(table["T1"], record["T1"])
    axes = record.plot()
    assert axes.shape == (4,)  # inputs in W and without unit, outputs in K and without unit
    np.testing.assert_array_equal(axes[3].lines[1].get_ydata(), record["T3"])
    assert axes[0].lines[0].get_drawstyle() == "steps-post"


def test_amperes_and_kelvin_have_axes_of_their_own() -> None:
    record = rt.Record(sample_time=1.0, inputs=np.tile([0.5, 298.0], (20, 1)), outputs=np.full((20, 3), 300.0),
                       input_names=["m1", "room"], output_names=["T1", "U1", "T2"],
                       units={"m1": "A", "room": "K", "T1": "K", "U1": "V", "T2": "K"})
    axes = record.plot()
    assert [axis.get_ylabel() for axis in axes] == ["current [A]", "temperature [K]", "temperature [K]", "voltage [V]"]
    low, high = axes[0].get_ylim()
    assert 0.4 < low < 0.5 < high < 0.6  # not a flat line below 298 K
    colors = [line.get_color() for axis in axes[2:] for line in axis.lines]
    assert len(set(colors)) == 3


def hole(value: Any, row: int = 3, column: int = 1) -> np.ndarray:
    array = np.ones((20, 3))
    array[row, column] = value
    return array


BAD = {
    "nan": ({"outputs": hole(np.nan)}, r"outputs.*'T2' is nan.*row 3, time 11.5 s"),
    "infinite": ({"outputs": hole(-np.inf)}, r"'T2' is -inf.*finite"),
    "complex": ({"outputs": np.ones((20, 3), complex)}, "outputs holds complex numbers"),
    "text": ({"outputs": np.full((20, 3), "x")}, "outputs holds text"),
    "text in a list": ({"outputs": [[1.0, "a", 2.0]] * 20}, "outputs holds text"),
    "bool": ({"inputs": np.ones((20, 2), bool)}, "inputs holds booleans"),
    "bool among objects": ({"inputs": np.array([[1.0, True]] * 20, dtype=object)}, "row 0 holds True"),
    "none": ({"inputs": np.array([[1.0, None]] * 20, dtype=object)}, "row 0 holds None"),
    "dates": ({"inputs": np.full((20, 2), np.datetime64("2020-01-01"))}, "inputs holds dates"),
    "integer overflow": ({"inputs": [[1, 10**400]] * 20}, "inputs.*overflow"),
    "long double overflow": ({"outputs": hole(1, 2).astype(np.longdouble) * np.longdouble("1e4000")}, "finite"),
    "masked": ({"inputs": np.ma.masked_equal(np.arange(40.0).reshape(20, 2), 7)}, "masked.*row 3"),
    "ragged": ({"inputs": [[1.0, 2.0], [1.0]]}, "inputs is not a rectangular array"),
    "three dimensions": ({"inputs": np.ones((20, 2, 1))}, r"inputs has shape \(20, 2, 1\)"),
    "lengths differ": ({"inputs": np.ones((19, 2))}, "inputs have 19 rows and outputs have 20.*lengths differ"),
    "transposed": ({"outputs": np.ones((3, 20))}, "outputs has 20 columns.*Transpose"),
    "empty": ({"inputs": np.ones((0, 2)), "outputs": np.ones((0, 3))}, "0 samples.*empty"),
    "one sample": ({"inputs": np.ones((1, 2)), "outputs": np.ones((1, 3))}, "single sample"),
    "sample time zero": ({"sample_time": 0.0}, "sample_time is 0.0"),
    "sample time negative": ({"sample_time": -1.0}, "sample_time is -1.0.*positive"),
    "sample time nan": ({"sample_time": math.nan}, "sample_time is nan"),
    "sample time text": ({"sample_time": "1 s"}, "sample_time is '1 s'"),
    "sample time bool": ({"sample_time": True}, "sample_time is True"),
    "sample time complex": ({"sample_time": 1 + 0j}, "sample_time is"),
    "sample time huge integer": ({"sample_time": 10**400}, "sample_time is inf"),
    "start time": ({"start_time": math.inf}, "start_time is inf"),
    "name count": ({"input_names": ["u1"]}, "inputs has 2 columns and input_names has 1 names"),
    "names missing": ({"input_names": None}, "input_names is None"),
    "names are one text": ({"input_names": "u1"}, "input_names is 'u1'"),
    "name not text": ({"input_names": ["u1", 2]}, "input_names: name 1 is 2"),
    "name empty": ({"input_names": ["u1", " "]}, "input_names: name 1 is ' '"),
    "name twice": ({"input_names": ["u1", "u1"]}, "'u1' is used twice"),
    "name in both": (
        {"output_names": ["T1", "u2", "T3"], "units": None},
        "'u2' is used twice, for an input and for an",
    ),
    "unit of nothing": ({"units": {"T9": "K"}}, "units: there is no channel 'T9'"),
    "unit no text": ({"units": {"T1": 1}}, "unit of 'T1' is 1"),
    "units no mapping": ({"units": ["K"]}, r"units is \['K'\]"),
    "title": ({"name": 3}, "name is 3"),
    "notes": ({"notes": "one text"}, "notes is 'one text'"),
}


@pytest.mark.parametrize("case", BAD)
def test_refuses(case: str) -> None:
    changes, message = BAD[case]
    with pytest.raises(InputError, match=message):
        make(**changes)


def test_integers_of_any_length_are_numbers() -> None:
    record = make(inputs=[[10**30, 1]] * 20)
    assert record.inputs[0, 0] == 1e30


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda r: r["t1"], "no channel 't1'. Did you mean 'T1'"),
        (lambda r: r["nonsense"], "no channel 'nonsense'. Known: u1, u2"),
        (lambda r: r[3], "no item 3"),
        (lambda r: r[::2], "the step is 2"),
        (lambda r: r[5:6], "at least two"),
        (lambda r: r[50:], "hold 0 samples"),
        (lambda r: r.between(0.0, 1.0), "at least two"),
        (lambda r: r.between("a", 1.0), "start is 'a'"),
        (lambda r: r.split(10.0), "argument time.*10 s ... 19.5 s"),
        (lambda r: r.split(math.nan), "time is nan"),
        (lambda r: r.select(outputs=["T9"]), "no channel 'T9'"),
        (lambda r: r.select(inputs=["T1"]), "'T1' is used twice"),
    ],
)
def test_refuses_wrong_parts(act: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        act(make())


def test_top_level_name_is_this_record() -> None:
    assert rt.Record is Record
