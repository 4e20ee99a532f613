"""Columns of voltages: read in V and mV, kept in V, and no check of temperatures touches them."""

from pathlib import Path

import numpy as np
import pytest
from voltage_rig import drive, log, system

import robthermal as rt

CURRENTS = np.repeat([0.0, 1.5, -0.7, 2.0], 10)


@pytest.fixture
def rig() -> rt.System:
    return system()


def written(tmp_path: Path, header: str, scale: float = 1.0, kelvin: float = 273.15) -> Path:
    readings, _ = log(CURRENTS, 4.0)
    rows = [f"{4 * k},{current:.6f},{cold - kelvin:.6f},{volt * scale:.9f}"
            for k, (current, (cold, volt)) in enumerate(zip(CURRENTS, readings, strict=True))]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(("header", "scale"), [
    ("time,m1,T_cold,V1", 1.0), ("time,m1 [A],T_cold [°C],V1 [V]", 1.0), ("time,m1,T_cold,V1/mV", 1e3),
    ("time,m1,T_cold,V1_mV", 1e3), ("time,m1,T_cold,V1 (mV)", 1e3)])
def test_volts_and_millivolts(rig: rt.System, tmp_path: Path, header: str, scale: float) -> None:
    record = rt.read_record(written(tmp_path, header, scale), rig)
    expected, _ = log(CURRENTS, 4.0)
    assert record.output_names == ("T_cold", "V1") and record.units["V1"] == "V" and record.units["T_cold"] == "K"
    assert np.abs(record["V1"] - expected[:, 1]).max() < 1e-8
    column = next(one for one in record.imported.columns if one.name == "V1")
    assert (column.role, column.unit) == ("sensor", "V")
    said = "mV" if scale > 1 else "V" if "[V]" in header else ""
    assert record.imported.to_dict()["columns"][3]["unit_read"] == said
    assert "glitch" not in str(record.imported.actions)


@pytest.mark.parametrize(("header", "message"), [
    ("time,m1,T_cold,V1 [degC]", r"column 'V1 \[degC\]'.*voltage 'V1' is in \[degC\].*V or mV"),
    ("time,m1,T_cold,V1 [mA]", r"voltage 'V1' is in \[mA\]"),
    ("time,m1,T_cold [mV],V1", r"'T_cold' is a temperature and the column is in mV"),
])
def test_other_quantities_are_refused(rig: rt.System, tmp_path: Path, header: str, message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        rt.read_record(written(tmp_path, header), rig)


def test_kelvin_in_a_celsius_file_is_still_refused(rig: rt.System, tmp_path: Path) -> None:
    with pytest.raises(rt.InputError, match="'T_cold'.*looks like kelvin"):
        rt.read_record(written(tmp_path, "time,m1,T_cold,V1", kelvin=0.0), rig)


@pytest.mark.parametrize("suffix", [".csv", ".mat"])
def test_written_and_read_again(rig: rt.System, tmp_path: Path, suffix: str) -> None:
    run = rt.thermal.simulate(rig, drive(CURRENTS, 4.0))
    run.save(tmp_path / f"run{suffix}", temperature_unit="degC", temperatures=["T_cold"])
    again = rt.read_record(tmp_path / f"run{suffix}", rig)
    assert np.array_equal(again["V1"], run["V1"]) and again["T_cold"] == pytest.approx(run["T_cold"], abs=1e-10)


def test_a_switched_voltage_is_no_glitch_and_no_filter_smears_it(rig: rt.System) -> None:
    single = np.zeros(60)
    single[30] = 2.0  # one sample of current: the voltage leaves and comes back
    run = rt.thermal.simulate(rig, drive(single, 4.0))
    assert rt.signals.find_glitches(run) == {}
    assert np.array_equal(rt.signals.median_filter(run, 20.0)["V1"], run["V1"])


def test_resampled_voltages_stay_with_their_current(rig: rt.System, tmp_path: Path) -> None:
    """Stamps that jitter: a voltage between two currents never existed."""
    rng, readings = np.random.default_rng(3), log(CURRENTS, 4.0)[0]
    stamps = 4.0 * np.arange(len(CURRENTS)) + rng.uniform(-0.5, 0.5, len(CURRENTS))
    rows = [f"{t:.4f},{current},{cold - 273.15:.6f},{volt:.9f}"
            for t, current, (cold, volt) in zip(stamps, CURRENTS, readings, strict=True)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time,m1,T_cold,V1", *rows]) + "\n", encoding="utf-8")
    with pytest.warns(UserWarning, match="resampled"):
        record = rt.read_record(path, rig, jitter=0.4)
    ohmic = record["V1"] - 2.1 * record["m1"]  # what is left is the Seebeck voltage, some tenths of a volt
    assert np.abs(ohmic).max() < 1.05 * np.abs(readings[:, 1] - 2.1 * CURRENTS).max()


def test_check_prints_the_unit(rig: rt.System, tmp_path: Path) -> None:
    text = str(rt.read_record(written(tmp_path, "time,m1,T_cold,V1/mV", 1e3), rig).imported)
    line = next(line for line in text.splitlines() if "V1" in line)
    assert "mV" in line and "V" in line.split()
