"""A machine between 20 and 600 °C: bodies that radiate to each other; truth in tests/furnace.py."""

from __future__ import annotations

from types import SimpleNamespace

import furnace
import pytest

import robthermal as rt
from robthermal.diagnosis import search
from robthermal.diagnosis._steep_power import falling_powers

LEVELS, OTHERS = [200.0, 450.0, 300.0, 600.0, 350.0, 150.0], [350.0, 550.0, 250.0, 480.0]


def diagnosed(seed: int, *, radiates: bool) -> rt.diagnosis.Diagnosis:
    train = furnace.day(seed, LEVELS, radiates=radiates)
    unseen = furnace.day(seed + 50, OTHERS, radiates=radiates, n=600, room=24.0)
    return rt.diagnose(furnace.declared(), train, validation=unseen)


def pairs_tried(fit: rt.diagnosis.Refit) -> set[tuple[str, ...]]:
    return {one.where for one in fit.testable(rt.diagnosis.candidates(furnace.declared(), ["radiation"]))}


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.exhaustive)])
def test_radiation_between_two_lumps_is_named_with_its_coefficient(seed: int) -> None:
    """Beside it nothing but what is there: the lag of the thermocouple, and the mass of fibre as one lump."""
    found = diagnosed(seed, radiates=True)
    (radiation,) = [one for one in found.effects if one.effect == "radiation"]
    value, std, unit = radiation.values["coefficient"]
    assert found.verdict == "named_with_remainder" and radiation.where == ("muffle", "crucible") and unit == "W/K⁴"
    assert abs(value - furnace.COEFFICIENT) < 3.0 * std < 0.5 * furnace.COEFFICIENT
    assert {one.label for one in found.effects} <= {"radiation(muffle, crucible)", "sensor_lag(T_crucible)",
                                                    "hidden_mass(muffle)"}
    assert found.gap["validation"].after < 0.06 * found.gap["validation"].before  # 0.6 with radiation alone
    assert found.system.parameter("links.muffle-crucible 2.radiation") == pytest.approx(value, rel=0.3)


def test_a_crucible_that_touches_the_muffle_is_not_said_to_be_radiated_to() -> None:
    found = diagnosed(1, radiates=False)
    assert found.verdict == "named" and not [one for one in found.effects if one.effect == "radiation"]
    (lag,) = [one for one in found.effects if one.effect == "sensor_lag"]
    value, std, _ = lag.values["time_constant"]
    assert lag.where == ("T_crucible",) and abs(value - furnace.LAG) < 4.0 * std < 2.0


@pytest.mark.exhaustive
def test_contact_is_named_where_the_file_has_radiation() -> None:
    """The reverse: over 580 K a conductance is not taken for more radiation."""
    given, fit = furnace.declared(), furnace.declared().fit
    links = [link for link in given.links if set(link.between) != {"muffle", "crucible"}]
    system = given.model_copy(update={
        "links": (*links, rt.thermal.Link(between=("muffle", "crucible"), name="bare", radiation=1e-10)),
        "fit": {name: one for name, one in fit.items() if "muffle-crucible" not in name}})
    found = rt.diagnose(system, furnace.day(1, LEVELS, radiates=False),
                        validation=furnace.day(51, OTHERS, radiates=False, n=600, room=24.0),
                        effects=["missing_link", "radiation", "sensor_lag", "hidden_mass"])
    assert ("missing_link", ("muffle", "crucible")) in {(one.effect, one.where) for one in found.effects}
    assert not [one for one in found.effects if one.effect == "radiation"]


def test_a_power_that_falls_over_a_wide_range_is_not_said_without_what_it_may_be() -> None:
    def named(slope: float) -> list[SimpleNamespace]:
        return [SimpleNamespace(effect="heater_power_slope", where=("ssr",), values={"slope": (slope, 1e-5, "1/K")})]

    (said,) = falling_powers(named(-4.6e-4), 580.0)
    assert said.startswith("Over 580 K") and "falls by 0.046 % per kelvin: measure voltage and current of ssr" in said
    assert falling_powers(named(-4.6e-4), 60.0) == falling_powers(named(4.6e-4), 580.0) == []
    assert falling_powers(named(-0.02), 580.0) == []  # of that something else is said


def test_radiation_between_lumps_is_tried_where_the_readings_cover_eighty_kelvins() -> None:
    lumps = {("muffle", "insulation"), ("muffle", "crucible"), ("insulation", "crucible")}
    to_room = {(lump, "room") for lump in furnace.declared().lumps}
    wide = rt.diagnosis.refit(furnace.declared(), furnace.day(4, [150.0], n=100))
    small = rt.diagnosis.refit(furnace.declared(), furnace.day(4, [90.0], n=100))
    assert wide.span > 110.0 and pairs_tried(wide) == to_room | lumps
    assert 60.0 < small.span < 80.0 and pairs_tried(small) == to_room


def test_what_a_fit_has_already_is_not_tried_again_at_the_same_place() -> None:
    """Two masses on one lump have one name, and the answer would give it twice."""
    fit = rt.diagnosis.refit(furnace.declared(), furnace.day(4, [150.0], n=100))
    tried = rt.diagnosis.candidates(furnace.declared(), ["hidden_mass"])
    mass = next(one for one in tried if one.where == ("muffle",)).trials(fit.paths[0])[0]
    found = search.refit_set(fit, (mass,), [20.0]).fit
    assert {one.where for one in fit.testable(tried)} - {one.where for one in found.testable(tried)} == {("muffle",)}
