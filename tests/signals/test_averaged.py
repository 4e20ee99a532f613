"""Loggers that record means over a step: what the stamps of such a file say, and what cannot take it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import robthermal as rt
from robthermal.cli.app import app

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


def averaged_record() -> rt.Record:
    rows = np.arange(12.0)
    return rt.Record(sample_time=60.0, inputs=np.repeat([1.0, 4.0, 2.0], 4), outputs=300.0 + rows, input_names=["q"],
                     output_names=["T1"], units={"T1": "K"}, start_time=60.0, averaged=True)


@pytest.mark.parametrize("suffix", ["csv", "parquet", "mat"])
def test_a_saved_record_of_means_is_one_when_it_is_read(tmp_path: Path, suffix: str) -> None:
    record = averaged_record()
    record.save(tmp_path / f"log.{suffix}")
    read = rt.read_record(tmp_path / f"log.{suffix}", inputs=["q"], outputs=["T1"])
    assert read.averaged and read.imported is not None and read.start_time == record.start_time
    assert np.array_equal(read.inputs, record.inputs) and np.array_equal(read.outputs, record.outputs)
    assert [one["text"] for one in read.imported.actions if one["what"] == "averaged"] == [
        "readings are means over the step before their stamp, as the file says"]
    record.changed(averaged=False).save(tmp_path / f"log.{suffix}")
    assert not rt.read_record(tmp_path / f"log.{suffix}", inputs=["q"], outputs=["T1"]).averaged


def test_other_tools_read_a_saved_record_of_means(tmp_path: Path) -> None:
    """Only records of means have the line; the key is the one that is declared."""
    path, record = tmp_path / "log.csv", averaged_record()
    record.save(path)
    assert path.read_text().splitlines()[:2] == ['# averaged = "readings"', "time,q,T1"]
    assert pd.read_csv(path, comment="#")["T1"].tolist() == record["T1"].tolist()
    assert np.genfromtxt(path, delimiter=",", names=True, skip_header=1)["q"].tolist() == record["q"].tolist()
    record.changed(averaged=False).save(path)
    assert path.read_text().startswith("time,q,T1\n")


def test_parts_and_tables_of_means_keep_it(tmp_path: Path) -> None:
    record = averaged_record()
    rt.signals.save_records([record[:5], record[7:]], tmp_path / "parts.csv")
    assert [one.averaged for one in rt.read_records(tmp_path / "parts.csv", inputs=["q"], outputs=["T1"],
                                                    gaps="split")] == [True, True]
    assert rt.read_record(record.to_frame(), inputs=["q"], outputs=["T1"]).averaged
    with pytest.raises(rt.InputError, match="some parts hold means"):
        rt.signals.save_records([record[:5], record[7:].changed(averaged=False)], tmp_path / "parts.csv")


def test_the_file_knows_better_than_the_description_of_the_machine(tmp_path: Path) -> None:
    """A system file tells of its logger, not of files that are saved here; what is asked of the file must agree."""
    path, record = tmp_path / "log.csv", averaged_record()
    record.save(path)
    machine = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"a": {"capacity": 100.0}},
                        links=[{"between": ("a", "room"), "conductance": 1.0}], inputs={"q": {"lump": "a"}},
                        sensors={"T1": {"lump": "a"}}, record={"averaged": "after"})
    read = rt.read_record(path, machine)
    assert np.array_equal(read.outputs, record.outputs) and read.averaged
    assert rt.read_record(path, machine, averaged="readings").averaged
    with pytest.raises(rt.InputError, match='states averaged = "readings"'):
        rt.read_record(path, machine, averaged="after")


def test_words_that_are_none_are_no_statement(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    for line in ("# averaged = 5 samples", "# averaged", '# averaged = "yes"'):
        path.write_text(f"{line}\ntime,q,T1\n" + "".join(f"{k},1.0,{300 + k}.5\n" for k in range(8)))
        assert not rt.read_record(path, inputs=["q"], outputs=["T1"]).averaged
    path.write_text(path.read_text().replace('"yes"', '"after"'))
    read = rt.read_record(path, inputs=["q"], outputs=["T1"])
    assert read.averaged and read.start_time == 1.0 and len(read) == 7


def test_commands_read_and_write_means(tmp_path: Path) -> None:
    """What `simulate` writes of a record of means is one; `frf` refuses it; `check` says it."""
    record, run = averaged_record(), CliRunner()
    path, system, out = tmp_path / "log.csv", tmp_path / "a.toml", tmp_path / "out.csv"
    machine = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"a": {"capacity": 100.0}},
                        links=[{"between": ("a", "room"), "conductance": 1.0}], inputs={"q": {"lump": "a"}},
                        sensors={"T1": {"lump": "a"}}, fit={"lumps.a.capacity": {"lower": 10.0, "upper": 1000.0}})
    rt.thermal.write_system(machine, system)
    record.save(path)
    assert run.invoke(app, ["simulate", str(system), str(path), "--out", str(out)]).exit_code == 0
    simulated = rt.thermal.simulate(machine, record)
    read = rt.read_record(out, machine)
    assert read.averaged and np.array_equal(read.outputs, simulated.outputs)
    assert not np.allclose(read.outputs, rt.thermal.simulate(machine, record.changed(averaged=False)).outputs, atol=0.1)
    refused = run.invoke(app, ["frf", str(out), "--input", "q", "--output", "T1", "--out", str(tmp_path / "G.json")])
    assert isinstance(refused.exception, rt.InputError) and "means over every sample" in str(refused.exception)
    said = run.invoke(app, ["check", str(out)])
    assert said.exit_code == 0 and "readings are means over the step before" in said.output
    fitted = run.invoke(app, ["calibrate", str(system), str(out), "--out", str(tmp_path / "fit.toml")])
    assert fitted.exit_code in (0, 1), fitted.output
    assert rt.read_system(tmp_path / "fit.toml").lumps["a"].capacity == pytest.approx(100.0, rel=1e-4)


def test_means_with_jitter_are_said_to_be_means_only_nearly() -> None:
    table = pd.DataFrame({"time": 60.0 * np.arange(30) + np.tile([0.0, 4.0, -5.0], 10), "q": 1.0,
                          "T1 [K]": 300.0 + np.sqrt(np.arange(30.0))})
    with pytest.warns(UserWarning, match="resampled"):
        record = rt.read_record(table, inputs=["q"], outputs=["T1"], averaged="after")
    assert record.imported is not None
    said = [one["text"] for one in record.imported.actions if one["what"] == "averaged"]
    assert said[0].endswith("so they are means only nearly")


def test_an_observer_along_means_is_refused() -> None:
    machine = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"a": {"capacity": 100.0}},
                        links=[{"between": ("a", "room"), "conductance": 1.0}], inputs={"q": {"lump": "a"}},
                        sensors={"T1": {"lump": "a", "noise": 0.01}})
    watch = rt.design.observer(machine, ["T1"], sample_time=60.0)
    assert np.isfinite(watch.run(averaged_record().changed(averaged=False)).lumps).all()
    with pytest.raises(rt.InputError, match="means over every sample"):
        watch.run(averaged_record())
