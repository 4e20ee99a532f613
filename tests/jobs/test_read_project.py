"""PROJECT.toml: what it says, and every way to get it wrong."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

import robthermal as rt

PAGE = Path(__file__).resolve().parents[2] / "docs" / "project_file.md"
SYSTEM = """
[system]
name = "bench"
temperature_unit = "degC"
[ambients.room]
temperature = 22.0
[lumps.plate]
capacity = 120.0
[lumps.stage]
capacity = 35.0
[[links]]
between = ["plate", "room"]
conductance = 0.9
[modules.m1]
hot = "plate"
cold = "stage"
seebeck = 0.05
resistance = 4.0
conductance = 0.3
current_limits = [-3.0, 3.0]
[sensors.T1]
lump = "stage"
noise = 0.02
[fit]
"links.plate-room.conductance" = { lower = 0.1, upper = 5.0 }
"""
PROJECT = """
[project]
name = "bench"
system = "bench.toml"
train = ["run.csv"]
[certify]
temperature = [5.0, 85.0]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "bench.toml").write_text(SYSTEM)
    (tmp_path / "run.csv").write_text("time,m1\n0,0\n")  # read_project only looks whether it is there
    return tmp_path


def read(folder: Path, text: str | bytes) -> rt.jobs.request.Project:
    file = folder / "project.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return rt.jobs.read_project(file)


def test_every_key_of_the_documentation_is_read(folder: Path) -> None:
    text = re.search(r"^```toml\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.M | re.S)
    assert text
    for name in ("monday.csv", "tuesday.csv", "friday.csv", "multisine.csv", "old.json"):
        (folder / name).write_text("")
    project = read(folder, text[1])
    assert project.label == "BEFORE REPAIR" and project.median_filter == 9.0
    assert [path.name for path in project.train] == ["monday.csv", "tuesday.csv"]
    assert [path.name for path in project.validation] == ["friday.csv"]
    assert [path.name for path in project.files] == ["project.toml", "bench.toml", "monday.csv", "tuesday.csv",
                                                     "friday.csv", "multisine.csv", "old.json"]
    (stage,) = project.identify
    assert (stage.name, stage.use, [path.name for path in stage.records]) == ("stage", "train", ["multisine.csv"])
    assert stage.operating_point == {"m1": 0.5, "room": 296.15}
    assert [path.name for path in project.responses] == ["old.json"]
    assert project.design is not None and project.design.margins == {"gain": 2.0, "phase": 45.0}
    assert project.couple is not None and project.couple.frf_2 == ["identify.two"] and not project.adopt
    assert (project.initial, project.loss) == ("free", "linear")
    assert set(project.system.fit) == {"links.plate-room.conductance", "modules.m1.resistance.value"}
    assert project.system.fit["modules.m1.resistance.value"].sigma == 0.5
    assert project.boxes == rt.jobs.Boxes(
        temperature=(278.15, 358.15), ambient={"room": (288.15, 303.15)}, current={"m1": (0.0, 1.2)},
        heat={"plate": (0.0, 2.0)}, setpoint={"m1": 283.15}, method="energy", parameters="calibration", confidence=0.95,
        set="ellipsoid", temperature_lower="reported")
    assert project.gate == rt.jobs.request.Gate({"T1": 0.1, "default": 0.05}, "pass")
    assert project.diagnose and not project.session_gain


def test_a_file_that_is_named_twice_is_read_in_one_way(folder: Path) -> None:
    """What is said where it is named last must not silently hold for the other place."""
    text = PROJECT + '[identify.stage]\nrecords = [{ file = "run.csv", columns = { m1 = "I" } }]\n'
    with pytest.raises(rt.InputError, match=r"\[identify.stage\]: 'run.csv' is read in two ways"):
        read(folder, text)
    both = text.replace('["run.csv"]', '[{ file = "run.csv", columns = { m1 = "I" } }]')
    assert [path.name for path in read(folder, both).train] == ["run.csv"]


def test_every_key_is_documented() -> None:
    page = PAGE.read_text(encoding="utf-8")
    tables = rt.jobs.request._schema._File.model_fields
    kinds = [next(iter(get_args(table.annotation)), table.annotation) for table in tables.values()]
    keys = [key for kind in kinds for key in getattr(kind, "model_fields", ())]
    keys += list(rt.signals.ImportOptions.model_fields)  # [record]; [columns] has the user's own names
    assert len(keys) > 10
    page += (PAGE.parent / "measured_files.md").read_text(encoding="utf-8")
    assert not [key for key in keys if not re.search(rf"\b{key} = |^\[\w+\.{key}\]", page, re.M)]


def test_defaults(folder: Path) -> None:
    project = read(folder, '[project]\nname = "x"\nsystem = "bench.toml"\n')
    assert project.train == project.validation == ()
    assert set(project.system.fit) == {"links.plate-room.conductance"}
    assert project.boxes.temperature == (278.15, 358.15) and project.boxes.current is None


def test_a_file_from_an_editor_that_writes_a_mark_at_the_start(folder: Path) -> None:
    assert read(folder, b"\xef\xbb\xbf" + PROJECT.encode()).name == "bench"


def changed(old: str, new: str) -> str:
    assert PROJECT.count(old) == 1
    return PROJECT.replace(old, new)


@pytest.mark.parametrize(("text", "words"), [
    (changed("train", "trian"), ["unknown key", "trian", "Did you mean 'train'?"]),
    (changed("[certify]", "[certfy]"), ["unknown key", "certfy"]),
    (changed('name = "bench"\n', ""), ["project.name", "missing"]),
    (changed('system = "bench.toml"\n', ""), ["project.system", "missing"]),
    (changed('"bench.toml"', '"bensh.toml"'), ["bensh.toml", "does not exist", "relative"]),
    (changed("run.csv", "rum.csv"), ["rum.csv", "does not exist", "relative"]),
    (changed('["run.csv"]', '"run.csv"'), ["project.train", "run.csv"]),
    (changed("[5.0, 85.0]", "[278.15, 358.15]"), ["[certify] temperature", "278.15", "kelvin", "degC"]),
    (changed("[5.0, 85.0]", "[5.0]"), ["certify.temperature"]),
    (changed("[5.0, 85.0]", '["cold", "hot"]'), ["certify.temperature", "cold"]),
    (changed("[5.0, 85.0]", "[nan, 85.0]"), ["certify.temperature", "nan"]),
    (PROJECT + "setpoint = { m1 = 283.15 }\n", ["setpoint.m1", "283.15", "kelvin"]),
    (PROJECT + "ambient = { room = [290.0, 300.0] }\n", ["ambient.room", "290", "kelvin"]),
    (PROJECT + 'method = "magic"\n', ["certify.method", "magic", "energy"]),
    (PROJECT + 'parameters = "guess"\n', ["certify.parameters", "guess"]),
    (PROJECT + 'set = "ball"\n', ["certify.set", "ball", "ellipsoid"]),
    (PROJECT + '[gate]\ntolerance = { T7 = 0.1 }\n', ["[gate] tolerance", "T7", "T1"]),
    (PROJECT + '[gate]\ntolerance = -0.1\n', ["gate.tolerance", "-0.1"]),
    (PROJECT + '[gate]\nconfidence = 95.0\n', ["gate.confidence", "95"]),
    (PROJECT + '[gate]\nremarks = "shrug"\n', ["gate.remarks", "shrug"]),
    (PROJECT + '[calibrate]\nloss = "magic"\n', ["calibrate.loss", "magic", "soft_l1"]),
    (PROJECT + '[calibrate.parameters]\n"links.a-b.conductance" = { lower = 0.0, upper = 1.0 }\n',
     ["[calibrate.parameters]", "links.a-b.conductance"]),
    (PROJECT + '[calibrate.parameters]\n"lumps.plate.capacity" = { lower = 1.0, upper = 2.0 }\n',
     ["[calibrate.parameters]", "lumps.plate.capacity"]),
    ("", ["project", "missing"]),
    ("[project\n", ["TOML", "line 1"]),
    (bytes(range(256)), ["TOML"]),
    (b"a = " + b"[" * 100_000, ["TOML"]),
    (b"#" * 10_000_001, ["10 MB"]),
])
def test_it_is_refused(folder: Path, text: str | bytes, words: list[str]) -> None:
    with pytest.raises(rt.InputError) as refusal:
        read(folder, text)
    for word in ("project.toml", *words):
        assert word in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(rt.InputError, match=r"none\.toml.*No such file"):
        rt.jobs.read_project(tmp_path / "none.toml")


@pytest.mark.parametrize(("options", "words"), [
    ({"current": ["m1=0"]}, ["--current", "NAME=LO:HI"]),
    ({"ambient": ["room"]}, ["--ambient", "NAME=LO:HI"]),
    ({"setpoint": ["m1="]}, ["--setpoint", "NAME=VALUE"]),
    ({"temperature": (278.15, 358.15)}, ["--temperature", "kelvin"]),
    ({"method": "magic"}, ["--method", "magic"]),
])
def test_boxes_from_text_are_refused(folder: Path, options: dict[str, object], words: list[str]) -> None:
    system = rt.read_system(folder / "bench.toml")
    with pytest.raises(rt.InputError) as refusal:
        rt.jobs.request.boxes_from_text(system, **options)
    for word in words:
        assert word in str(refusal.value)


def test_boxes_of_a_system_in_kelvin(folder: Path) -> None:
    text = SYSTEM.replace('"degC"', '"K"').replace("= 22.0", "= 295.0")
    (folder / "kelvin.toml").write_text(text)
    system = rt.read_system(folder / "kelvin.toml")
    boxes = rt.jobs.request.boxes_from_text(system, temperature=(280.0, 350.0), setpoint=["m1=281"])
    assert boxes.temperature == (280.0, 350.0) and boxes.setpoint == {"m1": 281.0}
    with pytest.raises(rt.InputError, match=r"--temperature.*5 K.*Celsius"):
        rt.jobs.request.boxes_from_text(system, temperature=(5.0, 85.0))


def test_a_box_of_a_hot_machine_begins_cold(folder: Path) -> None:
    """No range in kelvin does; one that begins hot is written in kelvin."""
    system = rt.read_system(folder / "bench.toml")
    boxes = rt.jobs.request.boxes_from_text(system, temperature=(10.0, 700.0))
    assert boxes.temperature == pytest.approx((283.15, 973.15))
    with pytest.raises(rt.InputError, match=r'300 °C is above 250 °C: it looks like kelvin.*temperature_unit = "K"'):
        rt.jobs.request.boxes_from_text(system, temperature=(300.0, 700.0))
    with pytest.raises(rt.InputError, match="283 °C is above 250 °C"):
        rt.jobs.request.boxes_from_text(system, temperature=(283.0, 293.0))


def test_how_records_are_read_is_said_in_the_project_or_beside_one_of_them(tmp_path: Path) -> None:
    rt.jobs.new_project(tmp_path / "mine")
    folder = tmp_path / "mine"
    text = (folder / "train.csv").read_text()
    header, _, rows = text.partition("\n")
    names = header.split(",")
    foreign = ";".join({"T_stage": "NTC 1 [°C]", "m1": "I [mA]"}.get(name, name) for name in names)
    k = names.index("m1")
    lines = [row.split(",") for row in rows.splitlines()]
    scaled = [[str(1000 * float(cell)) if j == k else cell for j, cell in enumerate(line)] for line in lines]
    body = "\n".join(map(";".join, scaled))
    (folder / "foreign.txt").write_bytes(f"A logger\n{foreign}\n{body}\n".encode("cp1252"))
    project = folder / "project.toml"
    said = '[{ file = "foreign.txt", columns = { T_stage = "NTC 1", m1 = "I" } }]'
    project.write_text(project.read_text().replace('["train.csv"]', said) + '\n[record]\ngaps = "refuse"\n')
    job = rt.jobs.read_project(project)
    tables = job.reading[job.train[0]]
    mine, = rt.jobs.measured.read_files(job.train, job.system, tables=tables)
    plain, = rt.jobs.measured.read_files([folder / "train.csv"], job.system)
    np.testing.assert_allclose(mine.outputs, plain.outputs, rtol=1e-13)
    np.testing.assert_allclose(mine.inputs, plain.inputs, rtol=1e-13)
    project.write_text(project.read_text().replace("gaps =", "gap ="))
    with pytest.raises(rt.InputError, match="unknown key 'gap'"):
        rt.jobs.read_project(project)
