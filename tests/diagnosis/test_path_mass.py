"""A wall that stores heat between a box and an outside that swings: `path_mass`, and what it had been taken for."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

import robthermal as rt

from ..insulated_box import SYSTEM, TOTAL, WALL, write

FEW = ("hidden_mass", "missing_ambient_link", "periodic_load", "sensor_lag", "natural_convection", "heat_source")


@cache
def found(swing: float, most: float, *effects: str) -> rt.Diagnosis:
    with TemporaryDirectory() as folder:
        files = [write(Path(folder) / f"{seed}.csv", seed, n, swing) for seed, n in ((61, 240), (62, 144))]
        system = rt.thermal.parse_system(SYSTEM.format(most=most))
        train, held_out = (rt.signals.read_record(file, system) for file in files)
    return rt.diagnose(system, train, validation=held_out, effects=effects)


def labels(diagnosis: rt.Diagnosis) -> set[str]:
    return {one.label for one in diagnosis.effects}


def test_a_wall_is_named_and_keeps_the_conductance_of_its_path() -> None:
    answer = found(6.0, 300.0, *FEW, "path_mass")
    assert answer.verdict == "named_with_remainder" and answer.effects[0].label == "path_mass(air-outside)"
    assert answer.effects[0].values["capacity"][0] == pytest.approx(WALL, rel=0.4)
    inner, outer = (answer.system.parameter(f"links.{name}.conductance")
                    for name in ("air-outside", "air_outside_mass-outside"))
    assert inner * outer / (inner + outer) == pytest.approx(TOTAL, rel=0.1)
    gap = answer.gap["validation"]
    assert gap.after < 0.25 * gap.before


def test_a_mass_behind_a_constant_outside_hangs_on_the_lump() -> None:
    answer = found(0.0, 300.0, *FEW, "path_mass")
    assert labels(answer) == {"hidden_mass(air)"}
    assert not [one for one in answer.scores.candidates if one.effect.name == "path_mass"]  # the same to these records


def test_a_heat_with_the_period_of_the_recorded_outside_is_no_name() -> None:
    assert not found(6.0, 300.0, "periodic_load", "heat_source").effects
    fit = found(6.0, 300.0, *FEW, "path_mass").fit
    tried = rt.diagnosis.refit_short_list(fit, rt.diagnosis.score(fit, FEW))
    assert "in which outside swings, which is recorded" in tried.failed["periodic_load", ("air",)]


def test_a_number_at_the_end_of_its_range_is_said() -> None:
    answer = found(6.0, 50.0, *FEW, "path_mass")
    assert "the conductance of link air-outside at its upper end, 50" in answer.outcome.text
    assert " end, " not in found(6.0, 300.0, *FEW, "path_mass").outcome.text


def test_bounds_follow_the_machine() -> None:
    system = rt.thermal.parse_system(SYSTEM.format(most=300.0))
    upper = {one.effect.name: one.effect.size.upper for one in rt.diagnosis.candidates(system)}
    small = {one.effect.name: one.effect.size.upper for one in rt.diagnosis.candidates(rt.systems.two_module())}
    assert upper["hidden_mass"] == upper["path_mass"] == 1e9 and small["hidden_mass"] < 3e5
    assert upper["heat_source"] == 4000.0 and small["heat_source"] < 1400.0
    assert small["sensor_self_heating"] < 14.0  # no thermometer heats with kilowatts because a link is good


def test_the_path_keeps_its_steady_state_its_name_and_its_range() -> None:
    system = rt.thermal.parse_system(SYSTEM.format(most=300.0))
    added = rt.thermal.add_effect(system, "path_mass", ["air-outside"], {"capacity": 1e6, "ratio": 0.25})
    assert added.parameters == {"capacity": "lumps.air_outside_mass.capacity",
                                "ratio": "links.air_outside_mass-outside.conductance"}
    inner, outer = (added.system.parameter(f"links.{name}.conductance")
                    for name in ("air-outside", "air_outside_mass-outside"))
    assert (inner, outer) == pytest.approx((200.0, 50.0)) and inner * outer / (inner + outer) == pytest.approx(40.0)
    assert added.system.fit["links.air-outside.conductance"].upper == pytest.approx(1500.0)
    rest = rt.thermal.steady_state(added.system, {"heater": 800.0})
    assert rest.equilibria[0].temperatures["air"] == pytest.approx(273.15 + 15.0 + 800.0 / 40.0)


def test_a_path_of_more_than_conduction_is_refused() -> None:
    system = rt.thermal.add_effect(rt.thermal.parse_system(SYSTEM.format(most=300.0)), "conductance_step",
                                   ["air-outside"], {"relative": 0.1, "time": 50.0}).system
    with pytest.raises(rt.errors.InputError, match="no path of conduction alone"):
        rt.thermal.add_effect(system, "path_mass", ["air-outside"], {"capacity": 1e6})
