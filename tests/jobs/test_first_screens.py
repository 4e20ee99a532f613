"""First screens: words for effects, the banner of simulated data, lengths without exponents."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import Run

import robthermal as rt
from robthermal._digits import chance
from robthermal.jobs.diagnose._effect_words import WORDS, in_words, labels_in_words

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


@pytest.mark.parametrize(("p", "said"), [(0.0, "< 1e-16"), (1e-300, "< 1e-16"), (0.0312, "0.0312"), (np.nan, "–")])
def test_a_probability_is_never_written_as_zero(p: float, said: str) -> None:
    assert chance(p) == said
