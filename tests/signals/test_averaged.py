"""Loggers that record means over a step: what the stamps of such a file say, and what cannot take it."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import robthermal as rt

LOG = pd.DataFrame({"time": [0.0, 60.0, 120.0, 180.0], "q": [1.0, 2.0, 3.0, 4.0],
                    "T1 [K]": [300.0, 301.0, 302.0, 303.0]})


@pytest.mark.parametrize(("averaged", "start"), [("after", 60.0), ("before", 0.0)])
def test_readings_stand_where_their_step_ends_and_inputs_where_theirs_begins(averaged: str, start: float) -> None:
    """Stamped at its start, the step after 60 s has the input 2 and ends, with the reading 301, at 120 s."""
    record = rt.read_record(LOG, inputs=["q"], outputs=["T1"], averaged=averaged)
    assert record.averaged and record.start_time == start
    assert record["q"].tolist() == [2.0, 3.0, 4.0] and record["T1"].tolist() == [300.0, 301.0, 302.0]
    assert record.imported is not None
    said = [one["text"] for one in record.imported.actions if one["what"] == "averaged"]
    assert len(said) == 1 and averaged in said[0]


def test_readings_alone_may_be_means() -> None:
    record = rt.read_record(LOG, inputs=["q"], outputs=["T1"], averaged="readings")
    assert record.averaged and record["q"].tolist() == [1.0, 2.0, 3.0, 4.0] and record["T1"].tolist()[0] == 300.0


def test_without_a_word_values_are_readings_at_the_stamp() -> None:
    record = rt.read_record(LOG, inputs=["q"], outputs=["T1"])
    assert not record.averaged and record["T1"].size == 4


def test_it_stays_with_parts_and_choices_of_a_record() -> None:
    record = rt.read_record(LOG, inputs=["q"], outputs=["T1"], averaged="after")
    assert record[1:].averaged and record.select(outputs=["T1"]).averaged and "means over the sample" in str(record)
    assert record.with_outputs(record.outputs + 1.0).averaged


def test_parts_too_short_for_a_mean_are_left_out() -> None:
    gaps = pd.concat([LOG.iloc[:2], LOG.assign(time=LOG["time"] + 1000.0)])
    with pytest.warns(UserWarning, match="shorter than 3 samples"):
        records = rt.read_records(gaps, inputs=["q"], outputs=["T1"], averaged="before")
    assert [one.n_samples for one in records] == [3]


def test_means_of_means_are_refused() -> None:
    record = rt.read_record(LOG, inputs=["q"], outputs=["T1"], averaged="after")
    with pytest.raises(rt.InputError, match="means already"):
        rt.signals.as_means(record, "after")


@pytest.mark.parametrize("wrong", ["yes", "end"])
def test_another_word_is_refused(wrong: str) -> None:
    with pytest.raises(rt.InputError, match="averaged"):
        rt.read_record(LOG, inputs=["q"], outputs=["T1"], averaged=wrong)


def test_a_frequency_response_of_means_is_refused() -> None:
    rng = np.random.default_rng(0)
    record = rt.Record(sample_time=1.0, inputs=rng.normal(size=200), outputs=rng.normal(size=200), input_names=["u"],
                       output_names=["y"], averaged=True)
    with pytest.raises(rt.InputError, match="means over every sample"):
        rt.identify.lpm(record)
