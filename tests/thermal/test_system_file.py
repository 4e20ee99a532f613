"""System files: exact round trips, and one clear message for every kind of bad file."""

from __future__ import annotations

import math
import re
from pathlib import Path

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings

import robthermal as rt
from robthermal.thermal import System, format_system, parse_system, read_system, write_system

BENCH = """
[system]
name = "bench"
temperature_unit = "degC"

[ambients.room]
temperature = 22.0

[lumps.hot]
capacity = 50.0
initial = 25.1

[lumps.cold]
capacity = 5
disturbance = 0.01

[[links]]
between = ["hot", "room"]
conductance = 0.8
natural = { gain = 0.05, exponent = 0.25 }
radiation = 2.0e-10

[[links]]
name = "foot"
between = ["cold", "room"]
conductance = 0.02

[inputs.heater]
lump = "cold"
gain = 2.0
limits = [0.0, 10.0]

[modules.m1]
hot = "hot"
cold = "cold"
seebeck = { value = 0.05, slope = 7e-5 }
resistance = 2.0
conductance = { value = 0.5 }
reference_temperature = 35.0
current_limits = [-3.3, 3.3]

[sensors.T]
lump = "cold"
noise = 0.01
time_constant = 2.0
offset = 0.1
gain = 1.01
delay = 0.5

[fit]
"modules.m1.seebeck.slope" = { lower = 0.0, upper = 3e-4 }
"links.foot.conductance" = { lower = 0.001, upper = 1.0, sigma = 0.01 }
"ambients.room.temperature" = { lower = 15.0, upper = 30.0, sigma = 2.0 }
"""


def test_every_key_of_the_contract_is_read() -> None:
    system = parse_system(BENCH)
    assert (system.name, system.temperature_unit) == ("bench", "degC")
    expected = {
        "ambients.room.temperature": 295.15, "lumps.hot.capacity": 50.0, "lumps.hot.initial": 298.25,
        "lumps.cold.capacity": 5.0, "lumps.cold.disturbance": 0.01, "links.hot-room.conductance": 0.8,
        "links.hot-room.natural.gain": 0.05, "links.hot-room.natural.exponent": 0.25, "links.hot-room.radiation": 2e-10,
        "links.foot.conductance": 0.02, "inputs.heater.gain": 2.0, "modules.m1.seebeck.value": 0.05,
        "modules.m1.seebeck.slope": 7e-5, "modules.m1.resistance.value": 2.0, "modules.m1.conductance.value": 0.5,
        "modules.m1.reference_temperature": 308.15, "sensors.T.noise": 0.01, "sensors.T.time_constant": 2.0,
        "sensors.T.offset": 0.1, "sensors.T.gain": 1.01, "sensors.T.delay": 0.5}
    for name, value in expected.items():
        assert system.parameter(name) == value, name
    assert system.input_limits == {"heater": (0.0, 10.0)} and system.current_limits == {"m1": (-3.3, 3.3)}
    foot, room = system.fit["links.foot.conductance"], system.fit["ambients.room.temperature"]
    assert (foot.lower, foot.upper, foot.sigma) == (0.001, 1.0, 0.01)
    assert (room.lower, room.upper, room.sigma) == (288.15, 303.15, 2.0)  # a standard deviation is not shifted


def test_kelvin_and_celsius_describe_one_system() -> None:
    kelvin = BENCH.replace('"degC"', '"K"').replace("temperature = 22.0", "temperature = 295.15")
    kelvin = kelvin.replace("initial = 25.1", "initial = 298.25").replace("temperature = 35.0", "temperature = 308.15")
    kelvin = kelvin.replace("lower = 15.0, upper = 30.0", "lower = 288.15, upper = 303.15")
    assert parse_system(kelvin).model_copy(update={"temperature_unit": "degC"}) == parse_system(BENCH)


def test_round_trip_is_exact_and_stable(tmp_path: Path) -> None:
    system = parse_system(BENCH)
    write_system(system, tmp_path / "a.toml")
    again = read_system(tmp_path / "a.toml")
    assert again == system
    assert format_system(again) == (tmp_path / "a.toml").read_text(encoding="utf-8")


positive = st.floats(1e-9, 1e9)
names = st.text(st.characters(exclude_categories=("Cs",)), min_size=1, max_size=12).filter(
    lambda name: name.lower() != "time")


@st.composite
def systems(draw: st.DrawFn) -> System:
    """Chains of lumps with awkward names and awkward numbers."""
    unit = draw(st.sampled_from(["K", "degC"]))
    temperature = st.floats(150.0, 523.0)  # kelvin, every bit of them, whatever the unit of the file
    ambient, heater, sensor, *lumps = draw(st.lists(names, min_size=5, max_size=9, unique=True))
    chain = [ambient, *lumps]
    links = [{"between": (a, b), "conductance": draw(positive), "name": f"{i} {a}",
              **({"radiation": draw(positive)} if draw(st.booleans()) else {}),
              **({"natural": {"gain": draw(positive)}} if draw(st.booleans()) else {})}
             for i, (a, b) in enumerate(zip(chain, chain[1:], strict=False))]
    value = draw(positive)
    return System(
        name=draw(st.text(st.characters(exclude_categories=("Cs",)), max_size=20)), temperature_unit=unit,
        ambients={ambient: {"temperature": draw(temperature)}},
        lumps={one: {"capacity": draw(positive), **({"initial": draw(temperature)} if draw(st.booleans()) else {})}
               for one in lumps},
        links=links, inputs={heater: {"lump": lumps[0], "gain": value}}, sensors={sensor: {"lump": lumps[-1]}},
        fit={f"inputs.{heater}.gain": {"lower": value / 2, "upper": value * 2}})


@settings(max_examples=150, deadline=None, derandomize=True)
@given(systems())
def test_any_system_survives_a_round_trip(system: System) -> None:
    assert parse_system(format_system(system)) == system


def test_a_byte_order_mark_and_windows_lines_are_read(tmp_path: Path) -> None:
    (tmp_path / "w.toml").write_bytes(b"\xef\xbb\xbf" + BENCH.replace("\n", "\r\n").encode())
    assert read_system(tmp_path / "w.toml") == parse_system(BENCH)


def changed(old: str, new: str) -> str:
    assert BENCH.count(old) == 1, old
    return BENCH.replace(old, new)


BAD = {
    # unknown and missing keys
    "unknown key": (changed("capacity = 50.0", "capacity = 50.0\ncapasity = 1.0"),
                    r"\[lumps\.hot\].*'capasity'.*Did you mean 'capacity'"),
    "unknown inner key": (changed("exponent = 0.25", "power = 0.25"), r"\[\[links\]\] number 1.*power.*gain, exponent"),
    "unknown table": (BENCH + "[sensor.T2]\nlump = 'hot'\n", r"'sensor'.*Did you mean 'sensors'"),
    "unknown system key": (changed('name = "bench"', 'nam = "bench"'), r"\[system\].*'nam'.*spelling"),
    "no unit": (changed('temperature_unit = "degC"', ""), r"\[system\].*'temperature_unit' is missing.*Add"),
    "unit": (changed('"degC"', '"celsius"'), r"\[system\].*'celsius'.*degC.*K"),
    "no capacity": (changed("capacity = 50.0", ""), r"\[lumps\.hot\].*'capacity' is missing.*Add capacity"),
    "no conductance of a module": (changed("conductance = { value = 0.5 }", ""),
                                   r"\[modules\.m1\].*'conductance' is missing"),
    "no between": (changed('between = ["cold", "room"]', ""), r"\[\[links\]\] number 2.*'between' is missing"),
    "a link without heat": (changed('between = ["cold", "room"]\nconductance = 0.02', 'between = ["cold", "room"]'),
                            r"\[\[links\]\] number 2.*carries no heat"),
    "outside a table": ('name = "x"\n' + BENCH, r"'name' stands outside a table.*\[system\]"),
    # names
    "unknown end": (changed('["cold", "room"]', '["cold", "rooom"]'),
                    r"\[\[links\]\] number 2.*'rooom' does not exist.*'room'"),
    "unknown lump of a sensor": (changed('[sensors.T]\nlump = "cold"', '[sensors.T]\nlump = "clod"'),
                                 r"\[sensors\.T\].*'clod' does not exist.*'cold'"),
    "unknown face": (changed('hot = "hot"', 'hot = "room"'), r"\[modules\.m1\] hot.*'room' does not exist.*a lump"),
    "heater in an ambient": (changed('[inputs.heater]\nlump = "cold"', '[inputs.heater]\nlump = "room"'),
                             r"\[inputs\.heater\].*'room' does not exist"),
    "sensor named like a lump": (changed("[sensors.T]", "[sensors.cold]"), r"'cold' is used twice.*rename"),
    "heater named like an ambient": (changed("[inputs.heater]", "[inputs.room]"), r"'room' is used twice.*rename"),
    "module named like a heater": (changed("[modules.m1]", "[modules.heater]").replace("modules.m1", "modules.heater"),
                                   r"'heater' is used twice"),
    "sensor named like a module": (changed("[sensors.T]", "[sensors.m1]"), r"'m1' is used twice"),
    "lump named like an ambient": (BENCH + "[lumps.room]\ncapacity = 1.0\n", r"'room' is used twice"),
    "sensor named time": (changed("[sensors.T]", "[sensors.Time]"), r"'Time' is the time column"),
    "same name twice": (BENCH + "[lumps.hot]\ncapacity = 1.0\n", r"not valid TOML.*(overwrite|declare).*(line|at)"),
    "link twice": (BENCH + '[[links]]\nbetween = ["hot", "room"]\nconductance = 1.0\n', r"'hot-room' is used twice"),
    "both ends": (changed('["cold", "room"]', '["cold", "cold"]'), r"\[\[links\]\] number 2.*both ends are 'cold'"),
    "one end": (changed('["cold", "room"]', '["cold"]'), r"\[\[links\]\] number 2.*between"),
    "three ends": (changed('["cold", "room"]', '["cold", "room", "hot"]'), r"\[\[links\]\] number 2.*between"),
    "faces": (changed('hot = "hot"', 'hot = "cold"'), r"hot and cold are both 'cold'"),
    "two modules on one pair": (BENCH + '[modules.m2]\nhot = "cold"\ncold = "hot"\nseebeck = 0.05\nresistance = 2.0\n'
                                'conductance = 0.5\n', r"'m1' and 'm2' join the same two lumps.*as one module"),
    "fit of nothing": (changed('"links.foot.conductance"', '"links.feet.conductance"'),
                       r"no parameter 'links\.feet\.conductance'.*Did you mean 'links\.foot\.conductance'"),
    # numbers
    "negative capacity": (changed("capacity = 50.0", "capacity = -50.0"),
                          r"\[lumps\.hot\].*capacity = -50\.0.*above 0.*sign"),
    "zero capacity": (changed("capacity = 50.0", "capacity = 0.0"), r"\[lumps\.hot\].*capacity = 0\.0.*above 0"),
    "NaN": (changed("capacity = 50.0", "capacity = nan"), r"\[lumps\.hot\].*capacity = nan.*finite"),
    "infinite": (changed("conductance = 0.02", "conductance = inf"),
                 r"\[\[links\]\] number 2.*conductance = inf.*finite"),
    "infinite temperature": (changed("temperature = 22.0", "temperature = -inf"),
                             r"\[ambients\.room\].*temperature = -inf"),
    "NaN temperature": (changed("temperature = 22.0", "temperature = nan"),
                        r"\[ambients\.room\].*temperature = nan.*finite"),
    "text for a number": (changed("capacity = 50.0", 'capacity = "50"'), r"\[lumps\.hot\].*capacity = '50'.*a number"),
    "truth for a number": (changed("capacity = 50.0", "capacity = true"), r"\[lumps\.hot\].*capacity = True.*a number"),
    "number for a name": (changed('[sensors.T]\nlump = "cold"', "[sensors.T]\nlump = 3"),
                          r"\[sensors\.T\].*lump = 3.*text"),
    "number for a table": (changed("[lumps.cold]\ncapacity = 5\ndisturbance = 0.01", "[lumps]\ncold = 5"),
                           r"\[lumps\.cold\].*5.*a table"),
    "negative conductance": (changed("conductance = 0.02", "conductance = -0.02"), r"conductance = -0\.02.*at least 0"),
    "negative noise": (changed("noise = 0.01", "noise = -0.01"), r"\[sensors\.T\].*noise = -0\.01"),
    "negative delay": (changed("delay = 0.5", "delay = -0.5"), r"\[sensors\.T\].*delay = -0\.5"),
    "negative Seebeck": (changed("value = 0.05, slope", "value = -0.05, slope"),
                         r"\[modules\.m1\].*seebeck\.value = -0\.05"),
    "limits the wrong way": (changed("[-3.3, 3.3]", "[3.3, -3.3]"), r"\[modules\.m1\].*current_limits.*lower < upper"),
    "fit range the wrong way": (changed("upper = 3e-4", "upper = -3e-4"),
                                r"seebeck\.slope.*lower 0\.0 is not below upper"),
    "start outside the fit range": (changed("lower = 0.001, upper", "lower = 0.1, upper"),
                                    r"0\.02 is outside \[0\.1, 1\.0\]"),
    "slope without reference": (changed("reference_temperature = 35.0\n", ""), r"slope but no reference_temperature"),
    # temperatures in the wrong unit
    "Celsius declared K": (changed('"degC"', '"K"'),
                           r"\[ambients\.room\] temperature.*22\.0 K is below 150 K.*degrees Celsius"),
    "kelvin declared C": (changed("temperature = 22.0", "temperature = 295.15"),
                          r"\[ambients\.room\] temperature.*295\.15 °C is above 250.*kelvin declared as Celsius"),
    "kelvin start": (changed("initial = 25.1", "initial = 298.25"), r"\[lumps\.hot\] initial.*298\.25 °C is above 250"),
    "kelvin reference": (changed("reference_temperature = 35.0", "reference_temperature = 308.15"),
                         r"\[modules\.m1\] reference_temperature.*308\.15 °C is above 250"),
    # networks
    "stranded lump": (BENCH + "[lumps.alone]\ncapacity = 1.0\n",
                      r"\[lumps\.alone\].*no heat path to an ambient.*Add a \[\[links\]\]"),
    "stranded by a zero": (BENCH + "[lumps.alone]\ncapacity = 1.0\n[[links]]\nbetween = ['alone', 'room']\n"
                           "conductance = 0.0\n", r"no heat path to an ambient from lump alone"),
    "ambients joined": (BENCH + "[ambients.sky]\ntemperature = 0.0\n[[links]]\nbetween = ['sky', 'room']\n"
                        "conductance = 1.0\n", r"joins two ambients.*At least one end must be a lump"),
    "no lump": ('[system]\ntemperature_unit = "K"\n[ambients.a]\ntemperature = 300.0\n[lumps]\n',
                r"no lumps.*Add at least one"),
    "no ambient": ('[system]\ntemperature_unit = "K"\n[lumps.a]\ncapacity = 3.0\n[ambients]\n',
                   r"no ambient.*Add \[ambients\.room\]"),
    "no tables": ("x = 1\n", r"\[system\]"),
    # what is no system file
    "not TOML": ("[lumps.x\ncapacity", r"not valid TOML.*Correct the line"),
    "deep nesting": ("a = " + "[" * 20_000, r"not valid TOML"),
}


def test_all_places_that_are_not_right_are_listed() -> None:
    text = BENCH.replace("noise = 0.01", "nois = 0.01").replace("capacity = 50.0", "capacity = -50.0")
    with pytest.raises(rt.InputError, match="unknown key 'nois'") as refused:
        parse_system(text.replace("conductance = 0.02", 'conductance = "0.02"'))
    assert refused.value.remedy == ("Did you mean 'noise'? Not right either: [lumps.hot] capacity; [[links]] number 2 "
                                    "conductance.")
    with pytest.raises(rt.InputError, match="capacity = -50.0") as one:
        parse_system(BENCH.replace("capacity = 50.0", "capacity = -50.0"))
    assert "either" not in str(one.value)



@pytest.mark.parametrize("fault", BAD)
def test_bad_files_are_refused_with_file_place_and_remedy(tmp_path: Path, fault: str) -> None:
    text, message = BAD[fault]
    path = tmp_path / "bench.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(rt.InputError, match=rf"bench\.toml.*{message}") as refused:
        read_system(path)
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 600
    assert refused.value.remedy


@pytest.mark.parametrize(("content", "message"), [
    (b"", r"bench\.toml: is empty"), (b" \n\t\n", r"bench\.toml: is empty"),
    (bytes(range(256)), r"not a text file in UTF-8"),
    (b"\x7fELF\x02\x01\x01\x00\x00", r"not valid TOML"),
])
def test_junk_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "bench.toml"
    path.write_bytes(content)
    with pytest.raises(rt.InputError, match=message):
        read_system(path)


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(rt.InputError, match="cannot be read.*Check the path"):
            read_system(path)


def test_the_file_of_the_documentation_is_read_and_its_defaults_are_true() -> None:
    page = (Path(__file__).parents[2] / "docs" / "explanations" / "system.md").read_text(encoding="utf-8")
    text = re.search(r"^```toml\n(.*?)^```", page, re.M | re.S)[1]
    system = parse_system(text)
    stated = ["disturbance = 0.0", "time_constant = 0.0", "offset = 0.0", "gain = 1.0 ", "delay = 0.0",
              'name = "sink-room"']
    assert all(text.count(line) >= 1 for line in stated)
    bare = "\n".join(line for line in text.splitlines() if not line.startswith(tuple(stated)))
    again = parse_system(bare)
    assert [again.parameter(name) for name in system.parameter_names] == [
        system.parameter(name) for name in system.parameter_names]


def test_python_refuses_what_the_file_refuses() -> None:
    with pytest.raises(rt.InputError, match=r"\[ambients\.room\].*temperature = 25\.0.*150.*Celsius"):
        System(ambients={"room": {"temperature": 25.0}}, lumps={"a": {"capacity": 1.0}})
    with pytest.raises(rt.InputError, match=r"\[lumps\.a\].*capacity = nan"):
        System(ambients={"room": {"temperature": 300.0}}, lumps={"a": {"capacity": math.nan}})
    with pytest.raises(rt.InputError, match="'lumps' is missing"):
        System(ambients={"room": {"temperature": 300.0}})


def test_parameters_are_read_and_replaced_by_name() -> None:
    system = parse_system(BENCH)
    assert "modules.m1.seebeck.slope" in system.parameter_names
    changed_system = system.with_parameters({"modules.m1.seebeck.slope": 1e-4, "links.foot.conductance": 0.03})
    assert changed_system.parameter("modules.m1.seebeck.slope") == 1e-4
    assert changed_system.parameter("links.foot.conductance") == 0.03
    assert system.parameter("links.foot.conductance") == 0.02
    with pytest.raises(rt.InputError, match="Did you mean 'lumps.hot.capacity'"):
        system.parameter("lumps.hott.capacity")
    with pytest.raises(rt.InputError, match=r"lumps\.hot.*capacity = -1\.0"):
        system.with_parameters({"lumps.hot.capacity": -1.0})
