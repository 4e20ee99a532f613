"""A furnace in degrees Celsius is no machine in kelvin, and the other way round."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import robthermal as rt

RISE = [21.0, 60.0, 110.0, 160.0, 205.0, 255.0, 330.0, 420.0, 520.0, 600.0, 606.5, 604.0]


@pytest.fixture
def furnace() -> rt.System:
    return rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"muffle": {"capacity": 400.0}},
                     links=[{"between": ("muffle", "room"), "conductance": 0.5}],
                     inputs={"duty": {"lump": "muffle", "gain": 12.0, "unit": "%"}},
                     sensors={"T": {"lump": "muffle", "noise": 0.5}}, name="furnace")


def written(path: Path, readings: list[float], duty: list[float] | None = None, header: str = "T [°C]") -> Path:
    duty = [100.0] * len(readings) if duty is None else duty
    rows = "".join(f"{10 * i},{T},{u}\n" for i, (T, u) in enumerate(zip(readings, duty, strict=True)))
    path.write_text(f"time [s],{header},duty [%]\n{rows}", encoding="utf-8")
    return path


def test_a_furnace_that_heats_up_is_in_celsius(tmp_path: Path, furnace: rt.System) -> None:
    record = rt.read_record(written(tmp_path / "run.csv", RISE), furnace)
    np.testing.assert_allclose(record["T"], np.array(RISE) + 273.15)
    cooling = rt.read_record(written(tmp_path / "down.csv", RISE[::-1]), furnace)
    assert cooling["T"].max() == pytest.approx(606.5 + 273.15)


@pytest.mark.parametrize("readings", [
    [293.1, 295.0, 310.0, 355.0],                    # kelvin
    [233.0, 245.0, 249.0, 251.0, 270.0],             # kelvin of a cooled stage, which passes 250
    [0.0, 233.0, 240.0, 251.0, 0.0, 280.0],          # the same with zeros of a fault
    [293.0, 260.0, 220.0, 170.0, 140.0, 95.0, 80.0],  # kelvin of a cryostat, which is cooled
    [293.0, 240.0, 0.0, 170.0, 140.0, 95.0, 80.0],   # the same with a zero
    [20.0, 25.0, 60.0, 333.2, 335.0],                # a logger that changes its unit
    [20.0, 25.0, 430.0, 26.0, 27.0],                 # a spike
    [120.0, 130.0, 405.0, 260.0, 240.0, 405.0],      # the same, from where a step is smaller
])
def test_what_does_not_heat_up_row_by_row_looks_like_kelvin(tmp_path: Path, furnace: rt.System,
                                                            readings: list[float]) -> None:
    with pytest.raises(rt.InputError, match=r"above 250 °C, this looks like kelvin.*hottest = … in \[record\]"):
        rt.read_record(written(tmp_path / "run.csv", readings), furnace)


def test_a_machine_that_stays_hot_is_declared(tmp_path: Path, furnace: rt.System) -> None:
    hot = [352.5 + 0.5 * i for i in range(20)]
    path = written(tmp_path / "run.csv", hot)
    with pytest.raises(rt.InputError, match="looks like kelvin"):
        rt.read_record(path, furnace)
    assert rt.read_record(path, furnace, hottest=400.0)["T"][0] == pytest.approx(625.65)
    with pytest.raises(rt.InputError, match="above 355 °C, this looks like kelvin"):
        rt.read_record(path, furnace, hottest=355.0)
    with pytest.raises(rt.InputError, match="hottest"):
        rt.read_record(path, furnace, hottest=-5.0)


def test_colder_than_is_modelled_is_said_so(tmp_path: Path, furnace: rt.System) -> None:
    path = written(tmp_path / "run.csv", [78.0, 80.0, 95.0], header="T [K]")
    with pytest.raises(rt.InputError, match="looks like Celsius.*colder than 150 K are not modelled"):
        rt.read_record(path, furnace)


def test_a_duty_of_85_per_cent_is_no_thermometer_after_power_up(tmp_path: Path, furnace: rt.System) -> None:
    steady = [40.0 + 0.1 * i for i in range(12)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rt.read_record(written(tmp_path / "run.csv", steady, duty=[20.0] * 5 + [85.0] + [20.0] * 6), furnace)
    with pytest.warns(UserWarning, match="DS18B20 after power-up"):
        rt.read_record(written(tmp_path / "bad.csv", [*steady[:5], 85.0, *steady[6:]]), furnace)


def test_hottest_stands_in_the_record_table(tmp_path: Path) -> None:
    (tmp_path / "furnace.toml").write_text("""[system]
temperature_unit = "degC"
[record]
hottest = 700.0
[ambients.room]
temperature = 22.0
[lumps.muffle]
capacity = 400.0
[[links]]
between = ["muffle", "room"]
conductance = 0.5
[inputs.duty]
lump = "muffle"
gain = 12.0
unit = "%"
[sensors.T]
lump = "muffle"
""", encoding="utf-8")
    system = rt.read_system(tmp_path / "furnace.toml")
    assert rt.read_record(written(tmp_path / "run.csv", [500.0, 510.0, 505.0]), system)["T"].max() > 780.0
