"""A fan that stands still leaves the law of still air, no constant: scipy's solve_ivp, the machine of two_days.py."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from two_days import NOISE, ROOM, STEP, SYSTEM, Day, record

import robthermal as rt
from robthermal.jobs.diagnose._answer import answer_sentence

FAN = "links.sink-room.conductance"
LENGTH = 300
CONTENT = rt.thermal.parse_system(SYSTEM)


def still_day(seed: int, at_ten: float, power: float = 0.25) -> rt.Record:
    """Sink to room G (|dT| / 10 K)^power with the conductance `at_ten` at 10 K [W/K]; all numbers 3 % off."""
    rng = np.random.default_rng(seed)
    off = np.exp(0.03 * rng.standard_normal(6))
    C, (g1, g2) = np.array([60.0, 90.0, 250.0]) * off[:3], np.array([1.2, 2.0]) * off[3:5]
    heat = np.repeat(rng.choice([0.0, 5.0, 10.0, 20.0, 30.0], -(-LENGTH // 40)), 40)[:LENGTH]
    T, rows = ROOM + rng.uniform(0.0, 3.0, 3), []

    def slope(t: float, T: np.ndarray, q: float) -> np.ndarray:
        lost = off[5] * at_ten * (abs(T[2] - ROOM) / 10.0) ** power * (T[2] - ROOM)
        first, second = g1 * (T[0] - T[1]), g2 * (T[1] - T[2])
        return np.array([q - first, first - second, second - lost]) / C

    for q in heat:
        rows.append(T)
        T = solve_ivp(slope, (0.0, STEP), T, args=(q,), rtol=1e-8, atol=1e-8).y[:, -1]
    readings = np.array(rows) + NOISE * rng.standard_normal((LENGTH, 3)) + 273.15
    return rt.Record(sample_time=STEP, inputs=np.column_stack([heat, np.full(LENGTH, ROOM + 273.15)]),
                     outputs=readings, input_names=["heater", "room"], output_names=["T_block", "T_plate", "T_sink"])


@pytest.fixture(scope="module")
def old() -> list[rt.Record]:
    return [record(seed, length=LENGTH) for seed in (1, 2, 3)]


@pytest.fixture(scope="module")
def still(old: list[rt.Record]) -> rt.diagnosis.Diagnosis:
    return rt.diagnose(CONTENT, still_day(71, 0.25), reference=old)  # with the whole catalog


def test_the_conductance_is_named_with_its_law(still: rt.diagnosis.Diagnosis) -> None:
    assert still.verdict in ("named", "named_with_remainder")
    (found,) = still.effects
    assert (found.effect, found.where) == ("parameter_change", (FAN,))
    value, std, _ = found.values["relative"]
    assert abs(value - (0.25 / 0.8 - 1.0)) < 3.0 * std and 0.005 < std < 0.03
    power, off, unit = found.values["exponent"]
    assert abs(power - 0.25) < 4.0 * off < 0.02 and unit == "-"
    assert f"{-100 * value:.0f} % lower" in answer_sentence(still)
    assert "at a difference of 10 K, and now grows with the difference to the power 0.25" in (
        answer_sentence(still))


def test_the_system_that_comes_back_has_the_law(still: rt.diagnosis.Diagnosis) -> None:
    (link,) = (one for one in still.system.links if set(one.between) == {"sink", "room"})
    assert link.natural is not None and link.natural.exponent == pytest.approx(0.25, abs=0.01)
    for difference in (2.0, 30.0):
        now = link.conductance + link.natural.gain * difference**link.natural.exponent
        assert now == pytest.approx(0.25 * (difference / 10.0) ** 0.25, rel=0.1)


def test_a_fan_that_is_slower_keeps_a_constant_conductance(old: list[rt.Record]) -> None:
    """Half the conductance, and no law of still air: nothing is said of one."""
    found = rt.diagnose(CONTENT, record(73, Day({"fan": 0.5}), length=LENGTH), reference=old)
    assert [(one.effect, one.where) for one in found.effects] == [("parameter_change", (FAN,))]
    assert set(found.effects[0].values) == {"relative"} and "still" not in answer_sentence(found)


@pytest.mark.parametrize(("seed", "power"), [(76, 0.1), (76, 1.0 / 3.0), *(
    pytest.param(seed, power, marks=pytest.mark.exhaustive) for seed in (75, 76, 77)
    for power in (0.1, 0.15, 0.2, 0.25, 1.0 / 3.0))])
def test_the_power_is_estimated(old: list[rt.Record], seed: int, power: float) -> None:
    """Turbulent air, or fins that lose by conduction: held at 1/4 they had none, or a second name."""
    found = rt.diagnose(CONTENT, still_day(seed, 0.25, power), reference=old)
    assert [(one.effect, one.where) for one in found.effects] == [("parameter_change", (FAN,))]
    value, std, _ = found.effects[0].values["exponent"]
    assert abs(value - power) < 4.0 * std < 0.02
