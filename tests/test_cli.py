"""The command line: exit status, one message on standard error, nothing half-written, JSON for scripts."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import typer
from commands import Run, Said
from rich.console import Console

import robthermal as rt
from robthermal.cli.terminal import duration, progress, progress_bar, show_report

pytestmark = pytest.mark.usefixtures("sketched")
ROOT = Path(__file__).resolve().parents[1]
CHILD = "import robthermal.cli; print('ready', flush=True); robthermal.cli.main()"
COMMANDS = ["demo", "run", "check", "simulate", "calibrate", "frf", "excitation", "design", "map", "certify",
            "couple", "diagnose", "report", "verify", "new", "explain", "datasheet"]

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

[[links]]
between = ["stage", "room"]
conductance = 0.05

[modules.m1]
hot = "plate"
cold = "stage"
seebeck = { value = 0.0537, slope = 7.4e-5 }
resistance = { value = 4.63, slope = 0.0228 }
conductance = 0.297
reference_temperature = 35.0
current_limits = [-3.3, 3.3]

[sensors.T_plate]
lump = "plate"

[sensors.T_stage]
lump = "stage"

[fit]
"links.plate-room.conductance" = { lower = 0.1, upper = 5.0 }
"""
SECOND_MODULE = """
[modules.m2]
hot = "stage"
cold = "plate"
seebeck = 0.05
resistance = 4.0
conductance = 0.3
"""


@pytest.fixture
def system(tmp_path: Path) -> Path:
    return write(tmp_path / "bench.toml", SYSTEM)


@pytest.fixture
def record(tmp_path: Path, system: Path) -> Path:
    """Simulated with the true conductance 1.2 W/K, of which the file says 0.9."""
    truth = rt.read_system(system).with_parameters({"links.plate-room.conductance": 1.2})
    current = rt.signals.staircase([0.0, 0.8, 0.3, 1.1], 100.0, sample_time=2.0)
    drive = rt.Record(sample_time=2.0, inputs=np.column_stack([current, np.full(len(current), 295.15)]),
                      outputs=np.zeros((len(current), 0)), input_names=["m1", "room"], output_names=[])
    clean = rt.thermal.simulate(truth, drive)
    noisy = clean.outputs + np.random.default_rng(0).normal(0, 0.01, clean.outputs.shape)
    file = tmp_path / "run.csv"
    rt.Record(sample_time=2.0, inputs=clean.inputs, outputs=noisy, input_names=clean.input_names,
              output_names=clean.output_names).save(file, temperature_unit="degC",
                                                   temperatures=["room", "T_plate", "T_stage"])
    return file


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[subprocess.CompletedProcess[str], Path]:
    folder = tmp_path_factory.mktemp("demo")
    done = subprocess.run([sys.executable, "-c", CHILD, "demo", "--out", "out"], cwd=folder, env=environment(),
                          capture_output=True, text=True)
    return done, folder / "out"


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}


def write(path: Path, text: str | bytes) -> Path:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def everything(folder: Path) -> set[Path]:
    return set(folder.rglob("*"))


def refused(outcome: Said, *words: str) -> None:
    """Status 2, one line on standard error with all words, nothing on standard output."""
    assert outcome.status == 2
    assert outcome.out == ""
    lines = outcome.err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("robthermal: "), outcome.err
    for word in words:
        assert word in lines[0]


# The main job


def test_demo_writes_a_complete_folder_and_says_yes(demo: tuple[subprocess.CompletedProcess[str], Path]) -> None:
    done, out = demo
    assert done.returncode == 0, done.stderr
    assert {path.name for path in out.iterdir()} == {"report.html", "report.json", "junit.xml", "summary.json",
                                                     "certificates", "calibrated.toml", "calibrated.json",
                                                     "parameters.csv", ".cache"}
    assert [path.name for path in out.parent.iterdir()] == ["out"]
    assert "SIMULATED DATA" in (out / "report.html").read_text(encoding="utf-8")
    assert str(Path("out") / "report.html") in done.stdout


def test_demo_is_quiet_in_a_pipe(demo: tuple[subprocess.CompletedProcess[str], Path]) -> None:
    done, _ = demo
    # A line every ten seconds, on a machine that needs so long.
    plain = re.compile(r"robthermal: .+ so far(, about .+ left)?")
    assert [line for line in done.stderr.splitlines() if not plain.fullmatch(line)] == []
    for text in (done.stdout, done.stderr):
        assert "\x1b" not in text and "\r" not in text


def test_no_spinner_in_a_pipe_that_may_have_colors(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
                                                    ) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # as many CI runners set it: rich then takes a pipe for a terminal
    assert Console(stderr=True).is_terminal
    with progress() as stage, progress_bar("points") as bar:
        stage("simulating")
        bar(1, 2)
    assert capsys.readouterr().err == ""


def test_plain_lines_of_long_work_in_a_pipe(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("robthermal.cli._progress.EVERY", 0.02)
    clock = iter([0.0])
    monkeypatch.setattr("robthermal.cli._progress.time.monotonic", lambda: next(clock, 80.0))
    said = ["", ""]

    def line_with(words: str) -> str:
        for _ in range(1000):
            found = capfd.readouterr()
            said[:] = [said[0] + found.out, said[1] + found.err]
            line = next((line for line in said[1].splitlines() if words in line), "")
            if line:
                return line
            time.sleep(0.01)
        return ""

    with progress() as told:
        told("calibrating")
        assert line_with("calibrating") == "robthermal: calibrating, 1 min 20 s so far"
        told("certifying", 2, 6)
        told("verifying every certificate")  # a sentence of the third stage: two of six are done
        assert line_with("verifying") == ("robthermal: verifying every certificate: 2 of 6 (33 %), 1 min 20 s so far, "
                                          "about 2 min 40 s left")
    assert said[0] == ""


def test_durations_in_words() -> None:
    assert [duration(s) for s in (0.4, 59.4, 59.6, 3599.6, 7260.0)] == ["0 s", "59 s", "1 min 0 s", "1 h 0 min",
                                                                      "2 h 1 min"]


def test_a_terminal_gets_percentage_and_remaining_time() -> None:
    script = ("import time; from robthermal.cli.terminal import progress_bar\n"
              "with progress_bar('points') as told:\n"
              "    for k in range(6): told(k, 8); time.sleep(0.25)\n")
    pty = pytest.importorskip("pty", reason="terminals of Unix")
    master, slave = pty.openpty()
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.DEVNULL, stderr=slave,
                          env={**os.environ, "TERM": "xterm", "COLUMNS": "100"}) as process:
        os.close(slave)
        said = b""
        with contextlib.suppress(OSError):  # the terminal is gone
            while block := os.read(master, 4096):
                said += block
        os.close(master)
    assert process.returncode == 0
    text = said.decode()
    assert "points" in text and "62%" in text and re.search(r"0:00:0[0-2]", text)


def test_demo_finds_the_parameters_the_records_were_made_with(
        demo: tuple[subprocess.CompletedProcess[str], Path]) -> None:
    found = rt.read_system(demo[1] / "calibrated.toml")
    # examples/two_module/make_records.py
    assert found.modules["m1"].seebeck.value == pytest.approx(0.053743 * 1.04, rel=0.01)
    assert found.modules["m1"].resistance.value == pytest.approx(4.6298 * 0.95, rel=0.01)
    assert found.parameter("links.x1-room.conductance") == pytest.approx(0.6942 * 0.88, rel=0.01)


def test_junit_of_the_demo_is_well_formed_and_agrees_with_the_summary(
        demo: tuple[subprocess.CompletedProcess[str], Path]) -> None:
    suite = ElementTree.parse(demo[1] / "junit.xml").getroot()
    cases = list(suite.iter("testcase"))
    summary = json.loads((demo[1] / "summary.json").read_text(encoding="utf-8"))
    assert summary["holds"] is True
    assert summary["verdict"] == "PASS WITH REMARKS" and len(summary["claims"]) == 6
    assert len([case for case in cases if case.get("classname") == "robthermal.certificates"]) == 6
    assert {one["code"] for one in summary["reasons"]} >= {"simulated_data", "not_diagnosed"}
    assert not list(suite.iter("failure"))


def test_certificates_of_the_demo_verify(demo: tuple[subprocess.CompletedProcess[str], Path], run: Run) -> None:
    done = run("verify", demo[1])
    assert done.status == 0
    assert done.out.count("valid  ") == len(list((demo[1] / "certificates").iterdir()))


def test_a_changed_certificate_is_not_valid(demo: tuple[subprocess.CompletedProcess[str], Path], run: Run,
                                            tmp_path: Path) -> None:
    data = json.loads((demo[1] / "certificates" / "contraction.json").read_text(encoding="utf-8"))
    data["evidence"]["rate"] = 1.0
    changed = write(tmp_path / "changed.json", json.dumps(data))
    done = run("verify", changed)
    assert done.status == 1
    assert "NOT VALID" in done.out
    assert run("verify", demo[1], changed).status == 1  # one bad one among good ones


def test_demo_replaces_an_earlier_result_and_nothing_else(run: Run, tmp_path: Path,
                                                          monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*args: object) -> None:
        pytest.fail("the job was run although its folder was refused")

    monkeypatch.setattr("robthermal.jobs.run_job", never)
    mine = tmp_path / "mine"
    mine.mkdir()
    precious = write(mine / "thesis.tex", "years of work")
    refused(run("demo", "--out", mine), str(mine), "--out")
    assert everything(mine) == {precious} and precious.read_text() == "years of work"
    refused(run("demo", "--out", precious), str(precious), "is a file")
    refused(run("demo", "--out", precious / "sub"), str(precious), "not a folder")


# Interrupt


def heard() -> None:
    """Listen to interrupts, which a shell turns off for what it runs in the background."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def interrupted(folder: Path, when: Callable[[], None]) -> str:
    """What a demo says that is interrupted from outside."""
    child = subprocess.Popen([sys.executable, "-c", CHILD, "demo", "--out", "out"], cwd=folder, env=environment(),
                             stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                             preexec_fn=heard)  # noqa: PLW1509
    assert child.stdout is not None and child.stdout.readline() == "ready\n"
    when()
    child.send_signal(signal.SIGINT)
    sent = time.monotonic()
    _, said = child.communicate(timeout=60)
    assert time.monotonic() - sent < 20
    assert child.returncode == 130
    return said


def test_interrupt_by_signal_leaves_nothing(tmp_path: Path) -> None:
    said = interrupted(tmp_path, lambda: time.sleep(0.3))  # during the first stage, before it keeps anything
    assert said == "robthermal: interrupted; nothing was written\n"
    assert everything(tmp_path) == set()


def test_interrupt_between_stages_keeps_what_is_finished_and_nothing_else(tmp_path: Path) -> None:
    def kept() -> None:
        while not (tmp_path / "out" / ".cache" / "calibrate.json").exists():
            time.sleep(0.01)

    *progress, said = interrupted(tmp_path, kept).splitlines()
    assert said == "robthermal: interrupted; finished stages are kept in out: the same command goes on from there"
    assert all(line.endswith("s so far") for line in progress)  # of a slow machine
    assert "calibrated.toml" in {path.name for path in (tmp_path / "out").iterdir()}
    assert {path.name for path in (tmp_path / "out" / ".cache").iterdir()} == {"calibrate.json"}


def test_an_interrupt_that_python_loses_ends_the_job_at_its_next_step() -> None:
    before = signal.getsignal(signal.SIGINT)
    try:
        heard()
        with pytest.raises(KeyboardInterrupt), progress() as told:
            told("simulating")
            with contextlib.suppress(KeyboardInterrupt):  # as inside a callback of an import
                signal.raise_signal(signal.SIGINT)
            told("writing")
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)


def test_interrupt_while_writing_leaves_nothing(run: Run, system: Path, tmp_path: Path,
                                                monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[set[Path]] = []

    def interrupt(*args: object) -> None:
        seen.append(everything(tmp_path))
        raise KeyboardInterrupt

    monkeypatch.setattr("robthermal.jobs.report_files.write_html", interrupt)
    before = everything(tmp_path)
    done = run("certify", system, "--current", "m1=0:1", "--out", tmp_path / "out")
    assert done.status == 130 and "interrupted" in done.err
    assert seen[0] > before  # it was in the middle of it
    assert everything(tmp_path) == before


# Certify, verify


def test_certify_says_yes_and_its_certificates_verify(run: Run, system: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = run("certify", system, "--current", "m1=0:1", "--ambient", "room=15:30", "--setpoint", "m1=10", "--out",
               out, "--json")
    assert done.status == 0
    answer = json.loads(done.out)
    assert answer["holds"] is True
    assert all(claim["holds"] and claim["verified"] for claim in answer["claims"])
    assert (out / "certificates" / "runaway_m1.json").is_file()
    assert run("verify", out).status == 0


def test_certify_with_a_full_matrix(run: Run, system: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = run("certify", system, "--current", "m1=0:1", "--ambient", "room=15:30", "--method", "lyapunov",
               "--structure", "block", "--out", out, "--json")
    assert done.status == 0
    claims = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in (out / "certificates").iterdir()}
    assert claims["contraction"]["evidence"]["method"] == "lyapunov"


def test_certify_too_large_a_current_says_no_and_why(run: Run, system: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = run("certify", system, "--current", "m1=-20:20", "--out", out)
    assert done.status == 1
    assert "NOT CERTIFIED" in done.out
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["holds"] is False
    failed = [claim for claim in summary["claims"] if not claim["holds"]]
    assert failed and all(claim["reason"] for claim in failed)
    assert summary["verdict"] == "FAIL" and "FAIL" in (out / "report.html").read_text(encoding="utf-8")
    assert list(ElementTree.parse(out / "junit.xml").getroot().iter("failure"))
    assert run("verify", out).status == 1


@pytest.mark.parametrize(("options", "words"), [
    (["--current", "m1"], ["--current", "m1=0:1.5"]),
    (["--current", "mx=0:1"], ["mx", "m1"]),
    (["--current", "m1=1:0"], ["m1", "(1.0, 0.0)"]),
    (["--current", "m1=nan:1"], ["m1", "nan"]),
    (["--method", "magic"], ["--method", "magic", "energy"]),
    (["--method", "lyapunov", "--structure", "round"], ["--structure", "round", "block"]),
    (["--temperature", "85", "5"], ["temperature", "lower <= upper"]),
    (["--temperature", "278", "358"], ["--temperature", "278", "kelvin", "degC"]),
    (["--ambient", "room=290:300"], ["--ambient", "290", "kelvin"]),
    (["--ambient", "hall=1:2"], ["hall", "room"]),
    (["--setpoint", "m1=280"], ["--setpoint", "280", "kelvin"]),
    (["--setpoint", "mx=3"], ["mx", "m1"]),
    (["--setpoint", "m1=cold"], ["--setpoint", "m1=cold"]),
])
def test_certify_refuses(run: Run, system: Path, tmp_path: Path, options: list[str], words: list[str]) -> None:
    before = everything(tmp_path)
    refused(run("certify", system, *options, "--out", tmp_path / "out"), *words)
    assert everything(tmp_path) == before


@pytest.mark.parametrize("content", [b"", b"\x00\xff\xfe" * 1000, b"[1, 2]", b'{"format": "other/1"}', b"[" * 100_000,
                                     b'{"format": "robthermal-certificate/1", "kind": NaN}'])
def test_verify_cannot_read(run: Run, tmp_path: Path, content: bytes) -> None:
    done = run("verify", write(tmp_path / "c.json", content))
    assert done.status == 2
    assert "unreadable" in done.out and "c.json" in done.out


def test_verify_of_missing_files_and_folders_without_certificates(run: Run, tmp_path: Path) -> None:
    missing = run("verify", tmp_path / "none.json")
    assert missing.status == 2 and "none.json" in missing.out
    refused(run("verify", tmp_path), str(tmp_path), "holds no certificates")


# Is the input sound


def test_check_of_sound_input(run: Run, system: Path, record: Path) -> None:
    said = run("check", system, record)
    assert said.status == 0 and "no [fit] table" not in said.out
    done = run("check", system, record, "--json")
    answer = json.loads(done.out)
    understood = answer["records"][0]["import"]
    assert done.status == 0 and answer["modules"] == ["m1"]
    assert understood["rows"] == {"file": 200, "used": 200} and [p["samples"] for p in understood["parts"]] == [200]


def test_check_says_that_a_system_without_a_fit_table_fits_nothing(run: Run, tmp_path: Path) -> None:
    text = """[system]
temperature_unit = "K"
[ambients.room]
temperature = 295.0
[lumps.bar]
capacity = 9.0
[[links]]
between = ["bar", "room"]
conductance = 0.5
"""
    done = run("check", write(tmp_path / "bar.toml", text))
    assert done.status == 0 and "no [fit] table" in done.out


def changed(old: str, new: str) -> str:
    assert SYSTEM.count(old) >= 1
    return SYSTEM.replace(old, new, 1)


@pytest.mark.parametrize(("text", "words"), [
    (changed("[lumps.stage]", "[lumps.lost]\ncapacity = 1.0\n[lumps.stage]"), ["[lumps.lost]", "ambient", "[[links]]"]),
    (changed("[sensors.T_plate]", SECOND_MODULE + "[sensors.T_plate]"), ["[modules.m2]", "'m1'", "one module"]),
    (changed("capacity = 120.0", "capacity = 120.0\ncapacty = 3.0"), ["[lumps.plate]", "capacty", "Did you mean"]),
    (changed("capacity = 120.0", "capacity = -120.0"), ["[lumps.plate]", "capacity", "-120", "sign"]),
    (changed("capacity = 120.0", "capacity = nan"), ["[lumps.plate]", "capacity", "nan", "finite"]),
    (changed("conductance = 0.9", "conductance = inf"), ["conductance", "inf"]),
    (changed("[sensors.T_plate]", "[sensors.plate]"), ["plate", "[lumps]", "[sensors]", "rename"]),
    (changed('"degC"', '"K"'), ["[ambients.room]", "temperature", "22", "degC"]),
    (changed("temperature = 22.0", "temperature = 295.0"), ["[ambients.room]", "temperature", "295", '"K"']),
    (changed('lump = "plate"', 'lump = "plat"'), ["T_plate", "plat"]),
    ("", ["empty"]),
    (bytes(range(256)) * 100, ["text"]),
    ("[system\nname=", ["TOML"]),
])
def test_check_refuses_a_system(run: Run, tmp_path: Path, text: str | bytes, words: list[str]) -> None:
    file = write(tmp_path / "bad.toml", text)
    refused(run("check", file), "bad.toml", *words)
    assert everything(tmp_path) == {file}


HEADER = "time,m1,room,T_plate,T_stage\n"
ROWS = [f"{i},0.5,22,{22 + 0.01 * i:.2f},{22 - 0.01 * i:.2f}\n" for i in range(20)]
RECORD = HEADER + "".join(ROWS)


@pytest.mark.parametrize(("text", "words"), [
    (RECORD.replace(",0.5,", ",500,"), ["m1", "500 A", "mA", "1000"]),
    (HEADER + "".join(f"{i},0.5,295.1,295.2,295.3\n" for i in range(20)), ["room", "295.1", "kelvin", "degC"]),
    (RECORD.replace("22.05", "warm"), ["T_plate", "line 7", "warm"]),
    (RECORD.replace("\n7,", "\n6,"), ["line 9", "duplicate"]),
    (RECORD.replace("\n7,", "\n3,"), ["line 9", "backward"]),
    (RECORD.replace("m1", "mm1"), ["'m1'", "Did you mean 'mm1'", "--column", "Zeros if 'm1' was off"]),
    (HEADER, ["no data rows"]),
    ("", ["empty"]),
    (bytes(range(256)) * 100, ["binary"]),
])
def test_check_refuses_a_record(run: Run, system: Path, tmp_path: Path, text: str | bytes, words: list[str]) -> None:
    file = write(tmp_path / "bad.csv", text)
    refused(run("check", system, file), "bad.csv", *words)


@pytest.mark.parametrize(("text", "words", "parts"), [
    (HEADER + "".join(ROWS[:9] + ROWS[13:]), ["line 10", "4 samples are missing"], [9, 7]),
    (RECORD.replace("22.05", "nan"), ["line 7", "T_plate", "nothing was measured"], [5, 14]),
])
def test_check_splits_at_a_gap_and_says_so_or_refuses_it_where_asked(run: Run, system: Path, tmp_path: Path, text: str,
                                                                     words: list[str], parts: list[int]) -> None:
    file = write(tmp_path / "gap.csv", text)
    done = run("check", system, file, "--json")
    understood = json.loads(done.out)["records"][0]["import"]
    assert done.status == 0 and [part["samples"] for part in understood["parts"]] == parts
    assert [one["what"] for one in understood["actions"] if one["what"] != "converted"] == ["split"]
    assert "note: gap.csv" in done.err
    refused(run("check", system, file, "--record", "gaps=refuse"), "gap.csv", *words, 'gaps = "split"')


def test_what_is_said_of_two_files_of_one_name_is_said_twice(run: Run, system: Path, tmp_path: Path) -> None:
    """Notes have the name of a file without its folder: the same text may be about another file."""
    text = HEADER + "".join(ROWS[:9] + ROWS[13:])
    for folder in "ab":
        (tmp_path / folder).mkdir()
    files = [write(tmp_path / folder / "log.csv", text) for folder in "ab"]
    assert run("check", system, *files).err.count("note: log.csv: 4 samples") == 2


def test_check_refuses_celsius_declared_kelvin(run: Run, tmp_path: Path) -> None:
    kelvin = SYSTEM.replace('"degC"', '"K"').replace("= 22.0", "= 295.15")
    kelvin = kelvin.replace("reference_temperature = 35.0", "reference_temperature = 308.15")
    file = write(tmp_path / "run.csv", RECORD)
    refused(run("check", write(tmp_path / "kelvin.toml", kelvin), file), "run.csv", "room", "22", "Celsius")


def test_check_refuses_a_record_longer_than_memory(run: Run, system: Path, tmp_path: Path) -> None:
    file = tmp_path / "long.csv"
    with file.open("wb") as stream:
        stream.write(RECORD.encode())
        stream.truncate(3 * 2**30)  # a hole: takes no room on the disk
    refused(run("check", system, file), "long.csv", "3.221e+09 bytes", "Slice the file")


def test_a_line_of_100_megabytes_is_refused_everywhere(run: Run, system: Path, tmp_path: Path) -> None:
    line = b"1" * 100_000_000
    first = write(tmp_path / "first.csv", line)
    refused(run("check", system, first), "first.csv", "first line")
    refused(run("check", first), "first.csv")
    assert run("verify", first).status == 2
    second = write(first, HEADER.encode() + line)
    done = run("check", system, second)
    refused(done, "first.csv", "no data rows")  # a last row with too few cells is dropped
    assert len(done.err) < 1000
    first.unlink()


# The other commands


def test_simulate_writes_a_record_that_reads_back(run: Run, system: Path, record: Path, tmp_path: Path) -> None:
    out = tmp_path / "simulated.csv"
    done = run("simulate", system, record, "--out", out, "--json")
    assert done.status == 0
    assert json.loads(done.out)["samples"] == 200
    found = rt.read_system(system)
    again = rt.read_record(out, found)
    expected = rt.thermal.simulate(found, rt.read_record(record, found))
    np.testing.assert_allclose(again.outputs, expected.outputs, atol=1e-6)


def test_calibrate_finds_the_conductance_the_record_was_made_with(run: Run, system: Path, record: Path,
                                                                  tmp_path: Path) -> None:
    out = tmp_path / "calibrated.toml"
    done = run("calibrate", system, record, "--out", out, "--json")
    assert done.status == 0
    json.loads(done.out)
    assert rt.read_system(out).parameter("links.plate-room.conductance") == pytest.approx(1.2, rel=0.01)


def test_calibrate_says_no_where_the_data_leave_it_open(run: Run, system: Path, tmp_path: Path) -> None:
    short = write(tmp_path / "short.csv", RECORD)  # 20 s of a machine whose fastest time constant is a minute
    done = run("calibrate", system, short, "--out", tmp_path / "c.toml")
    assert done.status == 1
    assert "not determined" in done.out


def test_a_calibrated_system_is_named_as_one(run: Run, system: Path, record: Path, tmp_path: Path) -> None:
    """Without .toml every later command would take it for a record."""
    before = everything(tmp_path)
    done = run("calibrate", system, record, "--out", tmp_path / "fitted")
    assert done.status == 2 and "fitted.toml" in done.err and everything(tmp_path) == before


def test_simulation_that_runs_away_says_no(run: Run, tmp_path: Path) -> None:
    loose = write(tmp_path / "loose.toml", changed("current_limits = [-3.3, 3.3]", ""))
    rows = HEADER + "".join(f"{i},60,22,22,22\n" for i in range(2000))
    before = everything(tmp_path) | {tmp_path / "hot.csv"}
    done = run("simulate", loose, write(tmp_path / "hot.csv", rows), "--out", tmp_path / "out.csv")
    assert done.status == 1
    assert "runs away" in done.err
    assert everything(tmp_path) == before


@pytest.mark.parametrize("command", [["simulate", "SYSTEM", "RECORD", "--out", "no/x.csv"],
                                     ["calibrate", "SYSTEM", "RECORD", "--out", "no/x.toml"],
                                     ["frf", "RECORD", "--system", "SYSTEM", "--out", "no/x.json"],
                                     ["frf", "RECORD", "--system", "SYSTEM", "--plot", "no/x.svg"]])
def test_output_into_a_missing_folder_is_refused_before_the_work(run: Run, system: Path, record: Path,
                                                                 command: list[str]) -> None:
    here = {"SYSTEM": str(system), "RECORD": str(record)}
    refused(run(*(here.get(word, word) for word in command)), "--out" if "--out" in command else "--plot", "'no'")


def test_plot_of_an_unknown_kind_is_refused_before_the_work(run: Run, system: Path, record: Path,
                                                            tmp_path: Path) -> None:
    before = everything(tmp_path)
    refused(run("frf", record, "--system", system, "--out", tmp_path / "f.json", "--plot", tmp_path / "f.xyz"),
            "--plot", ".xyz", ".svg")
    assert everything(tmp_path) == before


def test_frf_and_excitation_write_what_they_say(run: Run, tmp_path: Path) -> None:
    done = run("excitation", "q", "--period", "400", "--sample-time", "1", "--band", "0.005", "0.2", "--amplitude",
               "1", "--out", tmp_path / "u.csv", "--json")
    assert done.status == 0 and json.loads(done.out)["out"] == [str(tmp_path / "u.csv")]
    u = rt.read_record(tmp_path / "u.csv", inputs=["q"], outputs=[])["q"]
    assert len(u) == 400 and np.abs(u - u.mean()).max() <= 1.0 + 1e-9
    np.savetxt(tmp_path / "run.csv", np.column_stack([np.arange(1200), np.tile(u, 3), 2 * np.tile(u, 3) + 300]),
               delimiter=",", header="time,q,T", comments="")
    out, plot = tmp_path / "G.json", tmp_path / "G.svg"
    done = run("frf", tmp_path / "run.csv", "--input", "q", "--output", "T", "--method", "etfe", "--band", "0.01",
               "0.1", "--out", out, "--plot", plot, "--json")
    assert done.status == 0 and json.loads(done.out)["bins"] > 10
    np.testing.assert_allclose(rt.identify.FrequencyResponse.load(out).response, 2.0, atol=1e-9)
    assert plot.read_text(encoding="utf-8").startswith("<?xml")


# Help


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_every_command_has_an_example(run: Run, command: str) -> None:
    done = run(command, "--help")
    assert done.status == 0
    assert f"Example: robthermal {command}" in " ".join(done.out.split())


def test_every_command_is_tested_and_documented(run: Run) -> None:
    listed = re.findall(r"^  ([a-z]+) ", run("--help").out.partition("Commands:")[2], re.M)
    assert sorted(listed) == sorted(COMMANDS)
    page = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")
    for command in COMMANDS:
        assert f"## `{command}`" in page and f"robthermal {command} " in page


def test_every_option_is_documented(run: Run) -> None:
    page = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")
    for command in COMMANDS:
        section = page.partition(f"## `{command}`")[2].partition("\n## ")[0]
        options = set(re.findall(r"^  (?:-h, )?(--[a-z-]+)", run(command, "--help").out, re.M)) - {"--help", "--json"}
        assert not {option for option in options if option not in section}, command


def test_units_stay_in_the_help(run: Run) -> None:
    assert "[s]" in run("excitation", "--help").out
    assert "[fit]" in run("calibrate", "--help").out


def test_version(run: Run) -> None:
    done = run("--version")
    assert done.status == 0 and done.out == f"robthermal {rt.__version__}\n"


@pytest.mark.parametrize(("args", "words"), [
    (["nonsense"], ["nonsense", "--help"]),
    (["diagnos"], ["Did you mean 'diagnose', 'design'? See robthermal --help."]),
    (["demo", "--nonsense"], ["--nonsense", "demo --help"]),
    (["check"], ["SYSTEM.toml", "check --help"]),
    (["certify", "x.toml", "--temperature", "warm", "5"], ["--temperature"]),
    (["check", "none.toml"], ["none.toml", "no such file", "Check the path."]),
])
def test_wrong_command_lines(run: Run, args: list[str], words: list[str]) -> None:
    refused(run(*args), *words)


def test_no_command_shows_the_help(run: Run) -> None:
    done = run()
    assert done.status == 2 and "Commands:" in done.err


def test_the_list_of_commands_has_whole_sentences(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    listed = run("--help").out.partition("Commands:\n")[2].rstrip()
    said = [" ".join(one.split()[1:]) for one in re.split(r"\n(?=  [a-z])", listed)]
    assert len(said) == len(COMMANDS) and all(one.endswith(".") and "..." not in one for one in said)


@pytest.mark.parametrize(("option", "value", "known"), [
    ("--current", "m9=0:1", "one of m1"), ("--setpoint", "m9=5", "one of m1"),
    ("--ambient", "hall=1:2", "one of room")])
def test_names_that_the_system_lacks_are_refused_by_their_option(run: Run, system: Path, option: str, value: str,
                                                                 known: str) -> None:
    said = run("certify", system, option, value)
    assert said.status == 2 and f"robthermal: {option}: there is no" in said.err and known in said.err


@pytest.mark.parametrize(("columns", "box"), [(80, False), (120, True)])
def test_a_narrow_terminal_has_no_room_for_boxes(columns: int, box: bool, monkeypatch: pytest.MonkeyPatch,
                                                 capsys: pytest.CaptureFixture[str]) -> None:
    """And what became of the stages is said in words."""
    monkeypatch.setattr("robthermal.cli.terminal._PIPE_WIDTH", columns)
    monkeypatch.setenv("COLUMNS", "80")
    claim = rt.report.Claim("Contraction", "They meet.", True, True, "m1: 0 to 1 A", "0.01 1/s", "energy", "",
                            "certificates/contraction.json", "contraction")
    report = rt.report.Report("bar", "", "", (claim,), (), {}, (), "today")
    stages = {"calibrate": "done", "design": "skipped", "certify": "done", "couple": "skipped"}
    with contextlib.suppress(SystemExit, typer.Exit):
        show_report(report, Path("out"), False, stages=stages)
    said = capsys.readouterr().out
    assert ("m1: 0 to 1 A" in said) == box
    assert "stages: done: calibrate, certify; skipped: design, couple" in said
    assert said.splitlines()[-1] == f"report: {Path('out') / 'report.html'}"
    assert max(map(len, said.splitlines())) <= columns
