"""What a chain refuses before it computes anything, although a later stage asks for it."""

from pathlib import Path

import pytest
from commands import Run
from heated_bar import write_bar

import robthermal as rt

SYSTEM = """
[system]
name = "stack"
temperature_unit = "degC"
[ambients.room]
temperature = 22.0
[lumps.sink]
capacity = 200.0
[lumps.middle]
capacity = 20.0
[lumps.cold]
capacity = 10.0
[[links]]
between = ["sink", "room"]
conductance = 4.0
[modules.lower]
hot = "sink"
cold = "middle"
seebeck = { value = 0.05 }
resistance = { value = 2.0 }
conductance = { value = 0.5 }
current_limits = [0.0, 2.0]
[modules.upper]
hot = "{hot}"
cold = "cold"
seebeck = { value = 0.02 }
resistance = { value = 1.0 }
conductance = { value = 0.2 }
current_limits = [0.0, 1.0]
[sensors.T]
lump = "cold"
noise = 0.02
"""
PROJECT = """
[project]
name = "stack"
system = "stack.toml"
[certify]
temperature = [-20.0, 60.0]
"""


def refused(folder: Path, run: Run, tables: str, hot: str = "sink") -> str:
    (folder / "stack.toml").write_text(SYSTEM.replace("{hot}", hot))
    (folder / "project.toml").write_text(PROJECT + tables)
    said = run("run", folder / "project.toml", "--out", folder / "out")
    assert said.status == 2 and not (folder / "out").exists(), said
    assert str(folder / "project.toml") in said.err and len(said.err.replace(str(folder), "")) < 600
    return said.err


def test_a_cascade_is_refused_before_anything_is_computed(tmp_path: Path, run: Run) -> None:
    said = refused(tmp_path, run, "[design]\n", hot="middle")
    assert "[design]: a cascade: module 'lower' cools the hot face 'middle' of module 'upper'" in said
    assert "Leave [design] out" in said


@pytest.mark.parametrize(("tables", "words"), [
    ('[design]\nregulate = { upper = "T9" }\n', ("[design]", "T9")),
    ('[design]\nregulate = { lower = "T" }\n', ("[design]", "lower")),  # the cold face of the other module
    ("[design]\nsetpoint = { upper = 90.0, lower = 5.0 }\n", ("[design] setpoint", "outside of the box")),
    ("[design]\nsetpoint = { upper = 5.0 }\n", ("[design] setpoint", "lower")),
    ("[design]\nmargins = { gain = -1.0 }\n", ("[design]", "gain")),
    ('[couple]\nfrf_1 = ["identify.one"]\n', ("[couple]", "identify.one", "no [identify.NAME]"))])
def test_what_later_stages_cannot_do_is_refused_at_once(tables: str, words: tuple[str, ...], tmp_path: Path, run: Run
                                                        ) -> None:
    said = refused(tmp_path, run, tables)
    assert all(word in said for word in words), said


@pytest.mark.parametrize(("tables", "words"), [
    ('parameters = { "links.sink-rom.conductance" = [1.0, 5.0] }\n',
     ("[certify] parameters", "Did you mean 'links.sink-room.conductance'?")),
    ('parameters = { "links.sink-room.conductance" = [5.0, 1.0] }\n',
     ("[certify] parameters.links.sink-room.conductance: [5, 1]", "Write [1, 5].")),
    ("heat = { colt = [0.0, 1.0] }\n", ("[certify] heat: there is no lump 'colt'", "Did you mean 'cold'?")),
    ("ambient = { rom = [20.0, 25.0] }\n", ("[certify] ambient: there is no ambient 'rom'", "Did you mean 'room'?")),
    ("current = { lover = [0.0, 1.0] }\n", ("[certify] current: there is no module 'lover'",)),
    ("setpoint = { lover = 5.0 }\n", ("[certify] setpoint: there is no module 'lover'",)),
    ("current = { lower = [1.0, 0.0] }\n", ("[certify] current.lower: [1, 0]", "Write [0, 1].")),
    ('[gate]\ntolerance = "0.1"\n', ("gate.tolerance = '0.1'",)),
    ("heats = { cold = [0.0, 1.0] }\n", ("unknown key 'certify.heats'", "Did you mean 'heat'?")),
    ("inputs = { cold = [0.0, 1.0] }\n", ("unknown key 'certify.inputs'", "of another table", "Keys of [certify]")),
    ("colour = 1\n", ("unknown key 'certify.colour'. Keys of [certify]: temperature, ambient, current, heat,",)),
    ("heats = 1\n[gate]\nconfidence = true\n", ("'certify.heats'", "Not right either: gate.confidence.")),
    ("[identify.one]\nrecord = []\n", ("unknown key 'identify.one.record'", "Did you mean 'records'?")),
    ('[system]\nname = "x"\n', ("unknown key 'system'", "is a key of another table"))])
def test_the_project_is_checked_before_anything_is_computed(tables: str, words: tuple[str, ...], tmp_path: Path,
                                                             run: Run) -> None:
    said = refused(tmp_path, run, tables)
    assert all(word in said for word in words) and "constrained" not in said, said


def test_a_list_of_parameters_is_cut() -> None:
    system = rt.systems.two_module()
    with pytest.raises(rt.InputError, match="no parameter 'lumps.x1.capacitx'.*more.*Did you mean 'lumps.x1.ca") as no:
        rt.certify.contraction(system, current={"m1": (0, 1), "m2": (0, 1)}, temperature=(278.15, 358.15),
                               parameters={"lumps.x1.capacitx": (1.0, 2.0)})
    assert len(str(no.value)) < 600


def test_the_header_proposed_for_a_column_is_the_nearest(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time,NTC Stage,NTC Probe\n0,20.0,21.0\n1,20.1,21.1\n2,20.2,21.2\n")
    with pytest.raises(rt.InputError, match="Did you mean 'NTC Probe'.*--column 'T=NTC Probe'"):
        rt.read_record(log, outputs=["T"], columns={"T": "NTC Prob"})


def test_heat_into_a_lump_that_there_is_not() -> None:
    with pytest.raises(rt.InputError, match="argument heat: there is no lump 'x99'"):
        rt.certify.usable_current(rt.systems.two_module(), temperature=(278.15, 358.15), heat={"x99": (0.0, 1.0)})


def test_nothing_to_calibrate_is_refused_in_the_words_of_files(tmp_path: Path, run: Run) -> None:
    """What is proposed is taken: the same project with that line is run."""
    project = write_bar(tmp_path)
    system = tmp_path / "bar.toml"
    bare = system.read_text().partition("[fit]")[0]
    for text in (bare, bare + "[fit]\n"):
        system.write_text(text)
        said = run("run", project, "--out", tmp_path / "out")
        assert said.status == 2 and "[calibrate.parameters]: nothing to calibrate: no parameter has a" in said.err
        assert "or in [fit] of the system file" in said.err and "parameters=" not in said.err
        alone = run("calibrate", system, tmp_path / "train.csv", "--out", tmp_path / "new.toml")
        assert alone.status == 2 and "[fit]: nothing to calibrate" in alone.err and "parameters=" not in alone.err
    line = said.err.partition("system file: ")[2].strip().removesuffix(".")
    assert line == '"lumps.bar.capacity" = { lower = 10, upper = 250 }'
    system.write_text(bare.replace("conductance = 0.5", "conductance = 0.4") + "[fit]\n" + line)
    assert run("calibrate", system, tmp_path / "train.csv", "--out", tmp_path / "new.toml").status == 0
