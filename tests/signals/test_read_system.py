"""Reading for a system: order of channels, units, and the traps of units."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import robthermal as rt
from robthermal import InputError

if TYPE_CHECKING:
    from conftest import Plant

Write = Callable[..., Path]
HEADER = "T1,room,time,m1,heater,T6"
ROWS = "21.5,20.1,0,0.5,1,25.1\n21.6,20.2,1,1.5,2,25.2\n21.7,20.3,2,-1.5,3,25.3\n"


def text(header: str = HEADER, rows: str = ROWS) -> str:
    return f"{header}\n{rows}"


@pytest.mark.usefixtures("quiet")
@pytest.mark.parametrize("header", [HEADER, "T1 [degC],room [°C],Time [s],m1 [A],heater [W],T6 [C]"])
def test_channels_come_in_the_order_of_the_system_in_kelvin(plant: Plant, write: Write, header: str) -> None:
    record = rt.read_record(write(text(header)), plant)
    assert record.input_names == ("heater", "m1", "room")
    assert record.output_names == ("T6", "T1")
    np.testing.assert_array_equal(record.inputs, [[1, 0.5, 293.25], [2, 1.5, 293.35], [3, -1.5, 293.45]])
    np.testing.assert_array_equal(record.outputs, [[298.25, 294.65], [298.35, 294.75], [298.45, 294.85]])
    assert {name: record.units[name] for name in ("m1", "room", "T6", "T1")} == {
        "m1": "A", "room": "K", "T6": "K", "T1": "K",
    }  # fmt: skip
    assert record.notes == ()


def test_sensors_and_ambients_may_be_missing(plant: Plant, write: Write) -> None:
    record = rt.read_record(write("time,heater,m1\n0,0,0\n1,0,0\n"), plant)
    assert record.input_names == ("heater", "m1")
    assert record.outputs.shape == (2, 0)


def test_kelvin_files_are_taken_as_they_are(plant: Plant, write: Write) -> None:
    plant.temperature_unit = "K"
    path = write("time,heater,m1,T6\n0,0,0,298.2\n1,0,0,298.3\n")
    np.testing.assert_array_equal(rt.read_record(path, plant)["T6"], [298.2, 298.3])


def test_the_argument_overrules_the_unit_of_the_system(plant: Plant, write: Write) -> None:
    path = write("time,heater,m1,T6 [K]\n0,0,0,298.2\n1,0,0,298.3\n")
    np.testing.assert_array_equal(rt.read_record(path, plant, temperature_unit="K")["T6"], [298.2, 298.3])
    np.testing.assert_array_equal(rt.read_record(path, plant)["T6"], [298.2, 298.3])  # the header says K


FAULTS: dict[str, tuple[str, str]] = {
    "heater missing": (text(HEADER.replace("heater", "pump")), "no column 'heater'.*--column 'heater=pump'.*Zeros if"),
    "no unit of a heater": (text(HEADER.replace("heater", "I [mA]")), "--column 'heater=HEADER' .* one of: 'I .mA.'"),
    "a unit of a heater": (
        text(HEADER.replace("heater", "I [mA],fan,P [W]"), ROWS.replace("\n", ",0,0\n")),
        "--column 'heater=P .W.' .* with one of: 'P .W.', 'fan', 'I .mA.'",
    ),
    "module missing": (text(HEADER.replace("m1", "valve")), r"no column 'm1' \(module current\)"),
    "blank": (text(HEADER.replace("T6", "T 6")), "no column 'T6' \\(sensor\\), but 'T 6'.*--column 'T6=T 6'"),
    "typing error": (text(HEADER.replace("heater", "haeter")), "no column 'heater' \\(heater\\), but 'haeter'"),
    "one letter of an ambient": (text(HEADER.replace("room", "rom")), "no column 'room' \\(ambient\\), but 'rom'"),
    "watt of a current": (text(HEADER.replace("m1", "m1 [W]")), r"the current 'm1' is in \[W\]"),
    "milliampere": (text(rows=ROWS.replace(",1.5,", ",1500,")), "'m1' reaches 1500 A, 455 times.*looks like mA.*1000"),
    "milliwatt": (
        text(rows=ROWS.replace(",1,25", ",1000,25").replace(",2,25", ",2000,25").replace(",3,25", ",3000,25")),
        "the heater 'heater' reaches 3000 W, 300 times its declared limit of 10 W: this looks like mW.*unit = .mW.",
    ),
    "per cent": (text(HEADER.replace("heater", "heater [%]")), r"'heater' is in %.*unit = \"%\" in \[inputs.heater\]"),
    "unknown unit": (text(HEADER.replace("T6", "T6 [furlong]")), "unit 'furlong' is not known"),
    "kelvin declared Celsius": (
        text(rows=ROWS.replace("25.2", "298.35")),
        r"'T6' holds 298.35 in line 3, time 1 s, declared degC.*looks like kelvin",
    ),
    "ambient in kelvin": (text(rows=ROWS.replace("20.1", "293.25")), "'room' holds 293.25 in line 2.*like kelvin"),
}


@pytest.mark.parametrize("case", FAULTS)
def test_faults_are_named(plant: Plant, write: Write, case: str) -> None:
    content, message = FAULTS[case]
    with pytest.raises(InputError, match=message):
        rt.read_record(write(content), plant)


def test_celsius_declared_kelvin(plant: Plant, write: Write) -> None:
    plant.temperature_unit = "K"
    with pytest.raises(InputError, match=r"'room' holds 20.1 in line 2.*below 150 K, this looks like Celsius"):
        rt.read_record(write(text()), plant)


def test_unknown_columns_are_reported(plant: Plant, write: Write) -> None:
    path = write(text(HEADER + ",fan,T7", ROWS.replace("\n", ",on,1\n")))
    with pytest.warns(UserWarning, match="unknown columns, not read: 'fan', 'T7'") as caught:
        record = rt.read_record(path, plant)
    assert caught[0].filename == __file__
    assert record.notes == ("unknown columns, not read: 'fan', 'T7'",)


def test_another_number_is_not_a_misspelling(plant: Plant, write: Write) -> None:
    with pytest.warns(UserWarning, match="unknown columns, not read: 'T5'"):
        rt.read_record(write(text(HEADER.replace("T6", "T5"))), plant)


def test_values_outside_the_declared_limits_are_said(plant: Plant, write: Write) -> None:
    path = write(text(rows=ROWS.replace("1.5,2", "4.5,2").replace("-1.5", "-4.5").replace(",3,", ",30,")))
    with pytest.warns(UserWarning) as caught:
        record = rt.read_record(path, plant)
    said = " ".join(record.notes)
    assert "'m1' lies outside its declared limits -3.3 ... 3.3 A in 2 of 3 rows" in said
    assert "'heater' lies outside its declared limits 0 ... 10 in 1 of 3 rows" in said
    assert len(caught) == 2
    np.testing.assert_array_equal(record["m1"], [0.5, 4.5, -4.5])
    plant.current_limits, plant.input_limits = {"m1": None}, {"heater": None}
    assert rt.read_record(path, plant).notes == ()


def test_a_system_and_names_exclude_each_other(plant: Plant, write: Write) -> None:
    with pytest.raises(InputError, match="one of the two.*record.select"):
        rt.read_record(write(text()), plant, outputs=["T6"])


def test_jitter_holds_currents_and_interpolates_ambients(plant: Plant, write: Write) -> None:
    stamps = [0.0, 1.02, 1.99, 3.0]
    rows = "".join(f"{t},0,{k},{20 + t}\n" for k, t in enumerate(stamps))
    with pytest.warns(UserWarning, match="resampled"):
        record = rt.read_record(write("time,heater,m1,room\n" + rows), plant)
    np.testing.assert_array_equal(record["m1"], [0.0, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(record["room"], 293.15 + np.arange(4.0), rtol=1e-14)


def test_a_real_system_is_enough(write: Write) -> None:
    system: Any = rt.System(
        temperature_unit="degC",
        ambients={"room": {"temperature": 298.15}},
        lumps={"bar": {"capacity": 100.0}},
        links=[{"between": ("bar", "room"), "conductance": 0.5}],
        inputs={"heater": {"lump": "bar", "limits": (0.0, 10.0)}},
        sensors={"T": {"lump": "bar"}},
    )
    record = rt.read_record(write("time,heater,T,room\n0,1,25.1,20\n1,1,25.2,20\n"), system)
    assert (record.input_names, record.output_names) == (("heater", "room"), ("T",))
    np.testing.assert_array_equal(record["T"], [298.25, 298.35])


FLOW = """[system]
temperature_unit = "degC"
[ambients.room]
temperature = 20.0
[lumps.plate]
capacity = 100.0
[[links]]
between = ["plate", "room"]
conductance = 1.0
[inputs.flow]
lump = "plate"
gain = 0.0
[sensors.T]
lump = "plate"
"""
FLOW_ROWS = "time,Flow [l/min],T [°C]\n" + "".join(f"{k},{k % 3},2{k % 4}.5\n" for k in range(30))


@pytest.mark.parametrize(("lines", "header", "unit"), [
    ("", "Flow [l/min]", "l/min"), ('unit = "l/min"\n', "Flow [l/min]", "l/min"), ("", "Flow [V]", "V"),
    ("", "Flow [%]", "%")])
def test_a_column_that_heats_nothing_has_any_unit(tmp_path: Path, lines: str, header: str, unit: str) -> None:
    """The speed of a fan, a flow, a force: an input of gain 0, whose numbers stay as they are."""
    system = rt.thermal.parse_system(FLOW.replace("gain = 0.0\n", f"gain = 0.0\n{lines}"))
    path = tmp_path / "run.csv"
    path.write_text(FLOW_ROWS.replace("Flow [l/min]", header), encoding="utf-8")
    record = rt.read_record(path, system, columns={"flow": header})
    assert record["flow"].tolist() == [k % 3 for k in range(30)] and record.units["flow"] == unit


@pytest.mark.parametrize(("lines", "words"), [('unit = "rpm"\n', "'l/min' is not known"), ("gain = 0.1\n", (
    'unit = "l/min" in [inputs.flow]'))])
def test_a_unit_that_nobody_says_is_refused_with_where_to_say_it(tmp_path: Path, lines: str, words: str) -> None:
    text = FLOW.replace("gain = 0.0\n", lines if "gain" in lines else f"gain = 0.0\n{lines}")
    path = tmp_path / "run.csv"
    path.write_text(FLOW_ROWS, encoding="utf-8")
    with pytest.raises(rt.InputError) as refused:
        rt.read_record(path, rt.thermal.parse_system(text), columns={"flow": "Flow [l/min]"})
    assert words in str(refused.value)


def test_a_unit_that_the_system_says_is_enough_for_a_heater(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(FLOW_ROWS, encoding="utf-8")
    system = rt.thermal.parse_system(FLOW.replace("gain = 0.0\n", 'gain = 3.0\nunit = "l/min"\n'))
    assert rt.read_record(path, system, columns={"flow": "Flow [l/min]"})["flow"].tolist() == [k % 3 for k in range(30)]
