"""What supply and bridge can drive, and what the ripple of a bridge costs: brute force and integration as truth."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import solve_ivp

import robthermal as rt
from robthermal.thermal import Module, Supply, drivable_range, pwm_ripple

PART: dict[str, Any] = {"hot": "sink", "cold": "stage", "seebeck": 0.05, "resistance": 2.0, "conductance": 0.5}
SLOPED: dict[str, Any] = {**PART, "seebeck": {"value": 0.05, "slope": 2e-4},
                          "resistance": {"value": 2.0, "slope": 9e-3}, "reference_temperature": 298.15, "thomson": 1e-3}
BOX = (258.15, 348.15)


def voltage(module: Module, series: float, current: float) -> np.ndarray:
    """On a grid of the temperatures of both faces [V]."""
    hot, cold = np.meshgrid(*2 * [np.linspace(*BOX, 61)])
    away = 0.5 * (hot + cold) - module.reference_temperature
    S = module.seebeck.value + module.seebeck.slope * away - module.thomson
    return S * (hot - cold) + (module.resistance.value + module.resistance.slope * away + series) * current


@pytest.mark.parametrize("part", [PART, SLOPED, {**SLOPED, "seebeck": {"value": 0.05, "slope": -4e-4},
                                                 "resistance": {"value": 2.0, "slope": -6e-3}}])
@pytest.mark.parametrize("volts", [9.0, 12.0, 24.0])
def test_the_largest_current_is_that_of_a_grid_of_temperatures(part: dict[str, Any], volts: float) -> None:
    module = Module(**part, supply={"voltage": volts, "duty": 0.9, "resistance": 0.1})
    found = drivable_range(module, BOX)
    for current, sign in ((found.high, 1.0), (found.low, -1.0)):
        assert (sign * voltage(module, 0.1, current)).max() == pytest.approx(0.9 * volts, rel=1e-9)
        assert (sign * voltage(module, 0.1, 1.01 * current)).max() > 0.9 * volts
    assert "faces anywhere between -15 and 75 °C" in found.why_high and f"{volts:g} V" in found.why_low


def test_a_difference_of_temperature_alone_may_take_the_whole_supply() -> None:
    found = drivable_range(Module(**PART, supply={"voltage": 4.0}), BOX)  # 0.05 V/K times 90 K
    assert (found.low, found.high) == (0.0, 0.0)


def test_the_tightest_limit_names_itself() -> None:
    found = drivable_range(Module(**PART, current_limits=(-6.4, 6.4), supply={"current": 4.0, "voltage": 50.0}), BOX)
    assert (found.low, found.high, found.why_high) == (-4.0, 4.0, "bridge or supply, 4 A")
    one_way = drivable_range(Module(**PART, current_limits=(-3.0, 6.4), supply={"reversible": False, "current": 8.0}))
    assert (one_way.low, one_way.high, one_way.why_high) == (0.0, 6.4, "current_limits")
    assert one_way.why_low == "the bridge cannot reverse the current"
    assert str(drivable_range(Module(**PART))) == "-inf A (no limit) to inf A (no limit)"


@pytest.mark.parametrize("bad", [{}, {"voltage": 0.0}, {"current": -1.0}, {"voltage": 12.0, "duty": 1.2},
                                 {"voltage": 12.0, "resistance": -0.1}, {"volts": 12.0}])
def test_what_is_no_supply_is_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Supply(**bad)


def test_it_stands_in_a_system_file_and_no_equation_knows_it() -> None:
    plain = rt.systems.two_module()
    given = plain.model_copy(update={"modules": {name: module.model_copy(update={"supply": Supply(current=0.5)})
                                                 for name, module in plain.modules.items()}})
    again = rt.thermal.parse_system(rt.thermal.format_system(given))
    assert again.modules["m1"].supply == Supply(current=0.5)
    lumps, at = np.linspace(280.0, 320.0, len(plain.lumps)), np.array([1.0, 1.0, 298.15])
    rates = [rt.thermal.Equations(system).rate(lumps, at) for system in (plain, again)]
    assert np.array_equal(*rates)


def chopped(module: Module, duty: float, inductance: float, frequency: float, **at: float) -> tuple[float, float]:
    """Mean and mean square of the current of the circuit, integrated over a settled period."""
    away = 0.5 * (at["t_hot"] + at["t_cold"]) - module.reference_temperature
    R = module.resistance.value + module.resistance.slope * away + 0.1
    emf = (module.seebeck.value + module.seebeck.slope * away - module.thomson) * (at["t_hot"] - at["t_cold"])
    state, period = np.array([0.0, 0.0, 0.0]), 1.0 / frequency
    for _ in range(int(20 * inductance / R / period) + 3):
        state[1:] = 0.0
        for length, volts in ((duty * period, at["voltage"]), ((1 - duty) * period, 0.0)):
            def rate(t: float, y: np.ndarray, volts: float = volts) -> list[float]:
                return [(volts - emf - R * y[0]) / inductance, y[0], y[0] ** 2]

            state = solve_ivp(rate, (0.0, length), state, rtol=1e-10, atol=1e-14, method="DOP853").y[:, -1]
    return state[1] / period, state[2] / period


@pytest.mark.parametrize("inductance", [2e-6, 2e-5, 3e-4])
def test_ripple_is_that_of_the_integrated_circuit(inductance: float) -> None:
    module, at = Module(**SLOPED), {"t_hot": 320.0, "t_cold": 280.0, "voltage": 12.0}
    found = pwm_ripple(module, 1.7, frequency=20e3, inductance=inductance, resistance=0.1, **at)
    mean, square = chopped(module, found.duty, inductance, 20e3, **at)
    R = module.resistance.value + module.resistance.slope * (300.0 - 298.15)
    assert mean == pytest.approx(1.7, rel=1e-6) and found.rms**2 == pytest.approx(square, rel=1e-6)
    assert found.extra_heat == pytest.approx(R * (square - mean**2), rel=1e-4)
    assert found.lost_cooling == pytest.approx(0.5 * found.extra_heat)


def test_the_limits_of_the_filter_are_the_textbook_ones() -> None:
    module, at = Module(**PART), {"t_hot": 300.0, "t_cold": 300.0, "voltage": 12.0, "frequency": 20e3}
    bare = pwm_ripple(module, 1.5, **at)
    assert bare.extra_heat == pytest.approx(2.0 * 1.5**2 * (1 / 0.25 - 1))  # R I² (1/D - 1)
    for inductance in (0.05, 0.5):  # on both sides of where the triangle takes over
        swing = 12.0 * 0.25 * 0.75 / (20e3 * inductance)  # peak to peak of a triangle
        assert pwm_ripple(module, 1.5, inductance=inductance, **at).extra_heat == pytest.approx(
            2.0 * swing**2 / 12.0, rel=1e-4)
    reverse = pwm_ripple(module, -1.5, **at)
    assert reverse.extra_heat == bare.extra_heat and reverse.mean == -1.5


@pytest.mark.parametrize(("bad", "words"), [
    ({"current": 7.0}, "needs 14 V"), ({"t_hot": 400.0, "current": -1.0}, "needs -3 V"), ({"voltage": 0.0}, "voltage"),
    ({"frequency": float("nan")}, "frequency"), ({"inductance": -1.0}, "inductance"),
    ({"current": float("inf")}, "current")])
def test_what_a_supply_cannot_do_is_refused(bad: dict[str, float], words: str) -> None:
    given = {"current": 1.0, "t_hot": 300.0, "t_cold": 300.0, "voltage": 12.0, "frequency": 20e3, **bad}
    with pytest.raises(rt.InputError, match=words):
        pwm_ripple(Module(**PART), **given)


def cooled(**supply: Any) -> rt.System:
    """One module between a stage and a sink."""
    module = rt.systems.surrogate_module("sink", "stage").model_copy(update={"supply": Supply(**supply)})
    return rt.System(
        ambients={"room": {"temperature": 295.15}}, lumps={"sink": {"capacity": 120.0}, "stage": {"capacity": 35.0}},
        links=[{"between": ("sink", "room"), "conductance": 0.9}, {"between": ("stage", "room"), "conductance": 0.05}],
        modules={"m1": module})


@pytest.mark.parametrize(("direction", "supply", "size", "why"), [
    ("cooling", {"current": 0.7}, 0.7, "Module 'm1': bridge or supply, 0.7 A."),
    ("heating", {"current": 0.4, "reversible": False}, 0.0, "Module 'm1': the bridge cannot reverse the current."),
    ("cooling", {"current": 9.0}, 3.3, "current_limits of module 'm1' in the system file.")])
def test_the_usable_current_knows_the_bridge(direction: Any, supply: dict[str, Any], size: float, why: str) -> None:
    found = rt.certify.usable_current(cooled(**supply), direction=direction, temperature=(263.15, 358.15))
    rating = found.limits["rating"]
    assert (rating.current, rating.text, rating.basis) == (size, why, "declared")
    assert found.current <= size and (found.limited_by == "rating") == (size < 1.0)


def test_the_usable_current_knows_the_voltage_in_the_stated_box() -> None:
    system, box = cooled(voltage=9.0), (263.15, 358.15)
    found = rt.certify.usable_current(system, temperature=box).limits["rating"]
    assert found.current == drivable_range(system.modules["m1"], box).high < 1.0
    assert "9 V at a duty of 1" in found.text


@pytest.mark.parametrize(("supply", "words"), [
    ({"current": 0.05}, "m1 at 0 °C cannot be held: the current limit is reached; m1 can have -0.05 A .bridge"),
    ({"voltage": 2.0}, "no current can be driven: 2 V at a duty of 1")])
def test_a_set_point_that_the_supply_cannot_hold_is_refused_with_the_reason(supply: dict[str, Any], words: str) -> None:
    request = rt.jobs.DesignRequest(setpoint={"m1": 273.15}, temperature=(263.15, 358.15))
    with pytest.raises(rt.InputError, match=words):
        rt.jobs.design_system(cooled(**supply), request)


def test_a_current_beyond_the_bridge_is_refused() -> None:
    request = rt.jobs.DesignRequest(setpoint={"m1": 285.15}, current={"m1": (0.0, 1.0)})
    with pytest.raises(rt.InputError, match="bridge or supply, 0.7 A: the supply of the system file"):
        rt.jobs.design_system(cooled(current=0.7), request)
    law = rt.design.feedback_linearization(cooled(current=0.7))
    assert (law.current_low.tolist(), law.current_high.tolist()) == ([-0.7], [0.7])
