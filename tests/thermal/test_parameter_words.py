"""Names of parameters as a reader calls them: every number that a system file can hold has words and a unit."""

from __future__ import annotations

import pytest

from robthermal.thermal._parameter_words import WORDS, parameter_in_words, parameter_label
from robthermal.thermal._parameters import FIELDS


def test_every_number_of_a_system_has_words_and_a_unit() -> None:
    assert {table: set(fields) for table, fields in FIELDS.items()} == {table: set(words) for table, words in
                                                                        WORDS.items()}
    assert all("{0}" in words and unit for fields in WORDS.values() for words, unit in fields.values())


@pytest.mark.parametrize(("name", "label"), [
    ("links.sink-room.conductance", "conductance of link sink-room [W/K]"),
    ("modules.a.b.conductance.value", "conductance of a.b [W/K]"),  # names may contain dots
    ("modules.m1.drive.gain", "gain of the drive of m1 [-]"),  # not the gain of "m1.drive"
    ("lumps.plate.capacity = lumps.base.capacity", "heat capacity of plate = heat capacity of base [J/K]"),
    ("nothing.known", "nothing.known"), ("links.a-b.colour", "links.a-b.colour")])
def test_words_of_a_table(name: str, label: str) -> None:
    assert parameter_label(name) == label


def test_words_of_a_sentence() -> None:
    assert parameter_in_words("modules.m1.seebeck.value") == "the Seebeck coefficient of m1"
    assert parameter_in_words("what is this") == "what is this"
