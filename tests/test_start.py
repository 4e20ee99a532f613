"""What a command loads before its own work begins: modules, not seconds, for those depend on the machine."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import robthermal as rt

MACHINE = Path(rt.__file__).parent / "systems" / "two_module.toml"
COMMANDS = ("calibrate", "certify", "check", "couple", "datasheet", "demo", "design", "diagnose", "excitation",
            "explain", "frf", "map", "new", "report", "run", "simulate", "verify")
SLOW = ("scipy.linalg", "scipy.sparse", "scipy.special", "scipy.optimize", "scipy.signal", "scipy.stats", "pandas",
        "matplotlib", "control", "cvxpy", "clarabel", "flint", "joblib", "jinja2", "robthermal.calibration",
        "robthermal.certify", "robthermal.design", "robthermal.diagnosis", "robthermal.report",
        "robthermal.synthesis", "robthermal.verification")
NOTHING = ("numpy", "scipy", "robthermal.thermal", "robthermal.signals", "robthermal.identify", *SLOW)

# Every command in one process, and what was loaded after each: a module is loaded by the first one that names it.
_SCRIPT = """
import contextlib, io, json, sys
from robthermal import cli
lines, unwanted = json.loads(sys.argv[1]), json.loads(sys.argv[2])
found = []
for words in lines:
    sys.argv, said, status = ["robthermal", *words], io.StringIO(), None
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        try:
            cli.main()
        except SystemExit as stop:
            status = stop.code
    found.append([words, status or 0, said.getvalue(), [name for name in unwanted if name in sys.modules]])
print(json.dumps(found))
"""


def after(lines: list[list[str]], unwanted: tuple[str, ...], folder: Path
          ) -> list[tuple[list[str], int, str, list[str]]]:
    """Words, exit status, text and unwanted modules after each of some command lines, in one new process."""
    run = subprocess.run([sys.executable, "-c", _SCRIPT, json.dumps(lines), json.dumps(unwanted)], cwd=folder,
                         capture_output=True, text=True, check=True)
    return [(words, status, said, loaded) for words, status, said, loaded in json.loads(run.stdout)]


def test_help_loads_no_numerics(tmp_path: Path) -> None:
    found = after([[name, "--help"] for name in COMMANDS], NOTHING, tmp_path)
    assert [loaded for *_, loaded in found] == [[]] * len(COMMANDS)
    assert all(status == 0 and "Example: robthermal" in said for _, status, said, _ in found)


def test_a_missing_input_is_answered_before_anything_is_loaded(tmp_path: Path) -> None:
    lines = [["check", str(MACHINE), "lost.csv"], ["simulate", str(MACHINE), "lost.csv", "--out", "out.csv"],
             ["calibrate", str(MACHINE), "lost.csv"],
             ["diagnose", str(MACHINE), str(MACHINE), "--validation", "lost.csv"],
             ["diagnose", str(MACHINE), str(MACHINE), "--reference", "lost.csv"],
             ["frf", "lost.csv", "--system", str(MACHINE)], ["report", "lost.csv"], ["explain", "lost.csv"],
             *([name, "lost.csv"] for name in ("run", "certify", "design", "map", "couple", "datasheet")),
             *([name, "lost.csv", str(MACHINE)] for name in ("check", "simulate", "calibrate", "diagnose"))]
    lines[-3] += ["--out", "out.csv"]
    found = after(lines, NOTHING, tmp_path)
    assert [(words, loaded) for words, _, _, loaded in found] == [(words, []) for words in lines]
    assert [(words, status) for words, status, _, _ in found] == [(words, 2) for words in lines]
    assert all("lost.csv" in said for *_, said, _ in found)


def test_a_file_that_cannot_be_read_is_answered_with_its_reader_alone(tmp_path: Path) -> None:
    record, broken = tmp_path / "record.csv", tmp_path / "broken.toml"
    record.write_text("time,T\n0,20\n1,20\n", encoding="utf-8")
    broken.write_text("[lumps\n", encoding="utf-8")
    lines = [["run", "broken.toml"], ["check", "broken.toml", "record.csv"],
             ["simulate", "broken.toml", "record.csv", "--out", "out.csv"], ["calibrate", "broken.toml", "record.csv"],
             ["diagnose", "broken.toml", "record.csv"], ["frf", "record.csv", "--system", "broken.toml"],
             ["certify", "broken.toml"], ["design", "broken.toml"], ["design", "broken.toml", "--method", "hinf"],
             ["map", "broken.toml"], ["couple", "broken.toml"], ["datasheet", "broken.csv"],
             ["excitation", "m", "--period", "100", "--sample-time", "1", "--band", "0.01", "0.1", "--amplitude", "1",
              "--system", "broken.toml"]]
    found = after(lines, SLOW, tmp_path)
    assert [(words, loaded) for words, _, _, loaded in found] == [(words, []) for words in lines]
    assert [(words, status) for words, status, _, _ in found] == [(words, 2) for words in lines]
    assert all("broken." in said for *_, said, _ in found)


def test_a_missing_certificate_is_answered_with_the_checker_alone(tmp_path: Path) -> None:
    unwanted = ("scipy", "pandas", "matplotlib", "jinja2", "robthermal.thermal", "robthermal.signals",
                "robthermal.identify", "robthermal.certify", "robthermal.report")
    (_, status, said, loaded), = after([["verify", "lost.json"]], unwanted, tmp_path)
    assert (status, loaded) == (2, []) and "lost.json" in said


def test_a_missing_calibration_is_answered_before_anything_is_loaded(tmp_path: Path) -> None:
    lines = [["certify", str(MACHINE), "--parameters", "lost.json"],
             ["design", str(MACHINE), "--parameters", "lumps.x1.capacity=38:42", "--parameters", "lost.json"]]
    found = after(lines, NOTHING, tmp_path)
    assert [(words, status, loaded) for words, status, _, loaded in found] == [(words, 2, []) for words in lines]
    assert all("lost.json: there is no such file" in said for *_, said, _ in found)


@pytest.mark.exhaustive  # beside it `test_no_command_waits_for_scipy_stats` asks the files themselves
def test_records_are_diagnosed_without_what_certifies_and_designs(tmp_path: Path) -> None:
    """The whole command: read, fitted, drawn, written."""
    assert after([["new", "bench"]], (), tmp_path)[0][1] == 0
    unwanted = ("scipy.stats", "scipy.signal", "scipy.interpolate", "control", "cvxpy", "flint", "joblib",
                "robthermal.verification", "robthermal.certify", "robthermal.calibration", "robthermal.synthesis",
                "robthermal.design")
    record = tmp_path / "bench" / "train.csv"
    record.write_text("".join(record.read_text(encoding="utf-8").splitlines(keepends=True)[:120]), encoding="utf-8")
    (_, status, said, loaded), = after([["diagnose", "bench/setup.toml", "bench/train.csv"]],
                                       ("scipy.linalg", "matplotlib", *unwanted), tmp_path)
    assert (status, loaded) == (0, ["scipy.linalg", "matplotlib"]), said  # fits and figures: what is loaded is seen


def test_a_sound_system_is_checked_without_what_designs_and_draws(tmp_path: Path) -> None:
    unwanted = ("control", "pandas", "matplotlib", "cvxpy", "scipy.signal", "scipy.stats", "scipy.optimize",
                "robthermal.design", "robthermal.certify")
    (_, status, said, loaded), = after([["check", str(MACHINE)]], ("scipy.linalg", *unwanted), tmp_path)
    assert (status, loaded) == (0, ["scipy.linalg"]) and "sound" in said  # time constants: what is loaded is seen
