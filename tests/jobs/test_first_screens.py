"""First screens: words for effects, the banner of simulated data, lengths without exponents."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import Run

import robthermal as rt
from robthermal._digits import chance
from robthermal.jobs.claims._words import claim_of
from robthermal.jobs.diagnose._effect_words import WORDS, in_words, labels_in_words
from robthermal.jobs.provenance import simulated_label
from robthermal.jobs.run import project_label
from robthermal.verification import not_certified

BAR = """
[system]
name = "{name}"
temperature_unit = "degC"
[ambients.room]
temperature = 22.0
[lumps.bar]
capacity = 100.0
[[links]]
between = ["bar", "room"]
conductance = 0.5
[inputs.heater]
lump = "bar"
limits = [0.0, 10.0]
[sensors.T]
lump = "bar"
"""


def test_every_effect_of_the_catalog_has_words_for_its_places() -> None:
    catalog = rt.thermal.effects()
    assert set(WORDS) == {*catalog, "ambient_drift"}
    for name, effect in catalog.items():
        places = tuple(f"part{k}" for k in range(len(effect.where)))
        said = in_words(name, places)
        assert all(place in said for place in places) and "_" not in said, said


def test_labels_of_tables_are_written_out() -> None:
    said = labels_in_words("room was not recorded: heat_source(plate), missing_link(a, b) may be room itself.")
    assert said == "room was not recorded: a constant heat into plate, a heat path between a and b may be room itself."
    assert labels_in_words("f(x) and own_effect(a) stay.") == "f(x) and own_effect(a) stay."


@pytest.mark.parametrize(("name", "file", "label"), [
    ("bar", "bar.toml", ""), ("Bar (simulated)", "bar.toml", "SIMULATED DATA: Bar (simulated)"),
    ("bar", "Simulated_bar.toml", "SIMULATED DATA: Simulated_bar.toml")])
def test_what_is_called_simulated_has_a_banner(run: Run, tmp_path: Path, name: str, file: str, label: str) -> None:
    (tmp_path / file).write_text(BAR.format(name=name), encoding="utf-8")
    done = run("certify", tmp_path / file, "--out", tmp_path / "out")
    assert done.status == 0, done.out + done.err
    assert json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["label"] == label
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert ('class="banner"' in page) == bool(label)


@pytest.mark.parametrize(("head", "label"), [
    ("# simulated with a script\n", "SIMULATED DATA: run.csv"), ("\n#  SIMULATED data\n", "SIMULATED DATA: run.csv"),
    ("# compared with a simulated run\n", ""), ("Logger\n# simulated\n", ""), ("", "")])
def test_a_comment_before_the_header_says_that_a_record_is_simulated(tmp_path: Path, head: str, label: str) -> None:
    file = tmp_path / "run.csv"
    file.write_text(f"{head}time,T\n0,1\n# simulated\n", encoding="utf-8")
    assert simulated_label(["bar", file.name], [file]) == label


def test_a_project_whose_records_say_so_has_the_banner_and_the_remark(tmp_path: Path) -> None:
    project = rt.jobs.read_project(rt.jobs.new_project(tmp_path / "new"))
    plain = replace(project, label="BEFORE REPAIR")
    assert project_label(project) == project.label and project_label(plain) == "BEFORE REPAIR"
    train = plain.train[0]
    train.write_text("# simulated\n" + train.read_text(encoding="utf-8"), encoding="utf-8")
    assert project_label(plain) == f"BEFORE REPAIR; SIMULATED DATA: {train.name}"


@pytest.mark.parametrize(("key", "title", "sentence"), [
    ("map_3_never_left", "Condition 3: the box is never left", "A machine that starts inside"),
    ("map_3_contraction", "Condition 3: contraction in the box that is never left", "Inside those ranges")])
def test_a_condition_of_a_map_is_said_in_words(key: str, title: str, sentence: str) -> None:
    region = {"current": {"m1": [0.0, 1.5]}, "temperature": {"a": [270.0, 300.0]},
              "ambient": {"room": [293.15, 293.15]}, "heat": {"a": [5 / 3, 5 / 3]},
              "parameters": {"links.a-b.conductance": [1.0, 2.0]}}
    certificate = not_certified("invariance", system={"modules": {"m1": {}}}, region=region, evidence={}, reason="no",
                                made_by={}, claim="exact")
    claim = claim_of(f"certificates/{key}.json", certificate, None)
    assert claim.title == title and claim.sentence.startswith(sentence)
    assert claim.box.split("; ")[2:] == ["room: 20 °C", "heat into a: 1.66667 W",
                                         "1 parameter in its range: links.a-b.conductance 1 to 2"]


@pytest.mark.parametrize(("p", "said"), [(0.0, "< 1e-16"), (1e-300, "< 1e-16"), (0.0312, "0.0312"), (np.nan, "–")])
def test_a_probability_is_never_written_as_zero(p: float, said: str) -> None:
    assert chance(p) == said
