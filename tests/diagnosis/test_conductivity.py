"""A bar between a heated and a cooled plate, 20 to 340 °C, whose conductivity follows temperature as handbooks say.

Sixty cells integrated by scipy's LSODA, with tables of Incropera and DeWitt (Fundamentals of Heat and Mass Transfer,
tables A.1 and A.4) and linear interpolation: nothing of the package but the record, and no power law.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import robthermal as rt
from robthermal.diagnosis import search

ZERO, CELLS, H, NOISE = 273.15, 60, 10.0, 0.15
KELVINS = [200.0, 300.0, 400.0, 600.0, 800.0, 1000.0]
TABLES = {"air": [18.1, 26.3, 33.8, 46.9, 57.3, 66.7], "alumina": [55.0, 36.0, 26.4, 15.8, 10.4, 7.85],
          "even": [1.0] * 6}
POWERS = {"air": [40.0, 120.0, 75.0, 160.0, 20.0, 95.0], "alumina": [40.0, 110.0, 70.0, 140.0, 20.0, 90.0],
          "even": [40.0, 120.0, 75.0, 160.0, 20.0, 95.0]}
BETWEEN = {("hot", "mid"): 1.1, ("mid", "cold"): 0.9, ("cold", "room"): 3.5, ("hot", "room"): 0.1}
CAPACITIES = {"hot": 330.0, "mid": 220.0, "cold": 420.0}


def day(material: str, seed: int, powers: list[float], n: int = 900, room: float = 22.0) -> rt.Record:
    """Readings of both plates and of the middle of the bar; 0.5 W/K from end to end at 300 K."""
    rng, T_room = np.random.default_rng(seed), room + ZERO
    table = np.array(TABLES[material])
    end_to_end = 0.5 * CELLS / np.interp(300.0, KELVINS, table)
    capacity = np.concatenate([[300.0], np.full(CELLS, 250.0 / CELLS), [400.0]])

    def rates(t: float, T: np.ndarray, power: float) -> np.ndarray:
        g = end_to_end * np.interp(0.5 * (T[1:] + T[:-1]), KELVINS, table)
        g[[0, -1]] *= 2.0
        flows = g * (T[:-1] - T[1:])
        heat = np.concatenate([[power - 0.08 * (T[0] - T_room)], flows]) - np.concatenate(
            [flows, [4.0 * (T[-1] - T_room)]])
        return heat / capacity

    T, held = np.full(CELLS + 2, T_room), n // len(powers)
    readings, power = np.zeros((n, 3)), np.repeat(powers, held)
    for k in range(n):
        readings[k] = np.round(T[[0, CELLS // 2, -1]] + NOISE * rng.standard_normal(3), 2)
        T = solve_ivp(rates, (0.0, H), T, "LSODA", args=(power[k],), rtol=1e-6, atol=1e-4).y[:, -1]
    return rt.Record(sample_time=H, inputs=power[:, None], outputs=readings, input_names=["heater"],
                     output_names=["T_hot", "T_mid", "T_cold"], name=f"{material} {seed}")


def declared() -> rt.System:
    """Three lumps joined by conductances."""
    fit = {f"lumps.{name}.capacity": (value, 0.3) for name, value in CAPACITIES.items()}
    fit |= {f"links.{a}-{b}.conductance": (value, 0.5) for (a, b), value in BETWEEN.items()}
    return rt.System(
        ambients={"room": {"temperature": 22.0 + ZERO}}, inputs={"heater": {"lump": "hot"}},
        lumps={name: {"capacity": value} for name, value in CAPACITIES.items()},
        links=[{"between": pair, "conductance": value} for pair, value in BETWEEN.items()],
        sensors={f"T_{name}": {"lump": name, "noise": NOISE} for name in CAPACITIES},
        fit={name: {"lower": value / 50.0, "upper": value * 20.0, "sigma": share * value}
             for name, (value, share) in fit.items()})


def diagnosed(material: str, seed: int) -> rt.diagnosis.Diagnosis:
    powers = POWERS[material]
    unseen = [0.8 * powers[3], 0.5 * powers[0], powers[2], 0.6 * powers[3]]
    return rt.diagnose(declared(), day(material, seed, powers),
                       validation=day(material, seed + 50, unseen, n=600, room=24.0))


@pytest.mark.parametrize(("material", "seed", "exponent"), [
    ("alumina", 1, -1.2), pytest.param("air", 1, 0.83, marks=pytest.mark.exhaustive)])
def test_a_conductivity_that_follows_temperature_is_named_with_its_exponent(material: str, seed: int, exponent: float
                                                                            ) -> None:
    """Or it stands in the set: gas that conducts better when hot is hard to distinguish from radiation."""
    found = diagnosed(material, seed)
    (at,) = [place for place, one in enumerate(found.effects) if one.where == ("hot-mid",)]
    value, std, unit = found.effects[at].values["exponent"]
    assert found.effects[at].effect == "conductance_exponent" and unit == "-"
    assert abs(value - exponent) < 3.5 * std < 2.0 and np.sign(value) == np.sign(exponent)
    assert found.verdict in ("named_with_remainder", "ambiguous")
    assert found.gap["validation"].after < 0.3 * found.gap["validation"].before
    assert set(found.alternatives[at]) <= {("radiation", ("hot", "mid"))}
    assert found.system.parameter("links.hot-mid.temperature_law.exponent") == pytest.approx(value, abs=0.4)


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.exhaustive)])
def test_an_even_conductivity_has_no_law(seed: int) -> None:
    found = diagnosed("even", seed)
    assert not found.effects and not [one for one in found.provisional if one.effect == "conductance_exponent"]


def test_radiation_stands_beside_a_conductance_that_grows_as_much() -> None:
    system, record = declared(), day("air", 5, POWERS["air"])
    nominal = rt.diagnosis.refit(system, record, rt.diagnosis.noise_floor(system, record))
    state = search.begin(nominal, ["conductance_exponent"])
    for _ in range(2):
        state = search.accept(search.refit_candidates(search.shortlist(state)))
    known = {round_.best.candidate.where[0]: place for place, round_ in enumerate(state.rounds)}
    place = known["mid-cold"]
    less = search.without(state.fit, place, nominal)
    assert set(known) == {"hot-mid", "mid-cold"} and less is not None

    def beside(names: list[str] | None) -> list[str]:
        found = search.other_laws(state.rounds[place], state.fit, less, names)
        return [entry.candidate.label for entry in found]

    assert beside(None) == ["radiation(mid, cold)"]
    assert beside(["conductance_exponent"]) == []  # what may not be named is not asked


def test_it_is_tried_where_the_readings_cover_eighty_kelvins() -> None:
    tried = rt.diagnosis.candidates(declared(), ["conductance_exponent"])
    warm, cool = (rt.diagnosis.refit(declared(), day("even", 1, [power], n=100)) for power in (100.0, 20.0))
    assert warm.span > 80.0 > cool.span > 20.0
    assert {one.where for one in warm.testable(tried)} == {("-".join(pair),) for pair in BETWEEN}
    assert cool.testable(tried) == []


def _laws(entry: search.Entry, less: rt.diagnosis.Refit, names: list[str] | None) -> list[search.Entry]:
    return search.other_laws(search.Accepted(less, best=entry), entry.fit, less, names)


def test_radiation_from_end_to_end_has_both_links_beside_it() -> None:
    """One heat between the plates stood alone for a bar whose two halves conduct better when hot."""
    system, record = declared(), day("air", 5, POWERS["air"])
    nominal = rt.diagnosis.refit(system, record, rt.diagnosis.noise_floor(system, record))
    far = next(one for one in rt.diagnosis.candidates(system, ["radiation"]) if one.where == ("hot", "cold"))
    fit = search.refit_set(nominal, (far,), [1e-10]).fit
    entry = search.Entry(far, fit, 1e3, 0.0)
    beside = {one.candidate.label for one in _laws(entry, nominal, None)}
    assert beside == {"conductance_exponent(hot-mid)", "conductance_exponent(mid-cold)"}
    assert _laws(entry, nominal, ["radiation", "natural_convection"]) == []
