"""robthermal diagnose --reference: files of two days, exit status, report; records from scipy (two_days.py)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from commands import Run
from two_days import SYSTEM, Day, record

import robthermal as rt
from robthermal.jobs.diagnose._change_words import gain_in_words

FAN = "links.sink-room.conductance"
CELSIUS = ["T_block", "T_plate", "T_sink", "room"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("days")
    (place / "setup.toml").write_text(SYSTEM, encoding="utf-8")
    days = {"old1": record(1, length=300), "old2": record(2, length=300), "old3": record(3, length=300),
            "new": record(11, Day({"fan": 0.5}), length=300)}
    for name, one in days.items():
        rt.signals.save_records([one], place / f"{name}.csv", temperature_unit="degC", temperatures=CELSIUS)
    return place


@pytest.mark.exhaustive
def test_a_fan_that_stands_still(run: Run, folder: Path) -> None:
    """As the manual writes it: all files after --reference are of the healthy machine."""
    out = folder / "changed"
    status, text, _ = run("diagnose", folder / "setup.toml", folder / "new.csv", "--reference", folder / "old1.csv",
                          folder / "old2.csv", folder / "old3.csv", "--out", out, "--json")
    found: dict[str, Any] = json.loads(text)
    assert status == 0 and found["verdict"] in ("named", "named_with_remainder")
    assert [(one["effect"], one["where"]) for one in found["effects"]] == [("parameter_change", [FAN])]
    relative = found["effects"][0]["parameters"]["relative"]
    assert relative["unit"] == "" and relative["value"] == pytest.approx(-0.5, abs=3 * relative["std"])
    assert found["reference"]["records"] == 3 and len(found["reference"]["scatter"]) == 5
    assert json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))["reference"] == found["reference"]
    assert rt.read_system(out / "augmented.toml").parameter(FAN) == pytest.approx(0.4, rel=0.1)
    page = (out / "report.html").read_text(encoding="utf-8")
    for words in ("Since the reference records: the conductance of link sink-room is", "% lower",
                  "the new records falls", "new: new.csv", "Measured − model, new record", "scatter of healthy records",
                  "Before: the model fitted to the reference records", "old3.csv"):
        assert words in page, words
    assert "The model lacks" not in page


def test_a_reference_without_files_is_refused(run: Run, folder: Path) -> None:
    status, _, err = run("diagnose", folder / "setup.toml", folder / "new.csv", "--reference")
    assert status == 2 and "--reference" in err


def test_all_files_after_the_option_are_reference(run: Run, folder: Path) -> None:
    status, _, err = run("diagnose", folder / "setup.toml", "--reference", folder / "old1.csv", folder / "new.csv")
    assert status == 2 and "TRAIN.csv" in err


@pytest.mark.parametrize(("gain", "words"), [(-0.1, "heater gives 10 % less than its record column says (± 2 %)"),
                                             (0.25, "heater gives 25 % more than its record column says (± 2 %)")])
def test_a_weak_heater_in_words(gain: float, words: str) -> None:
    one = rt.diagnosis.Found("input_gain", ("heater",), {"gain": (gain, 0.02, "-")}, 1e-4, 50.0, None)
    assert gain_in_words(one) == words
