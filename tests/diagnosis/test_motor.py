"""A motor on a test bench, by Euler steps of half a second: six nodes against the four lumps of its user.

Copper gains resistance as it warms, and the air gap carries more heat the faster the rotor turns. The magnet may be
heated in proportion to its speed, for which effects may be named or not. Nothing is shared with robthermal.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis._one_curve import share_one_curve
from robthermal.diagnosis.fit import extended
from robthermal.jobs.diagnose._effect_words import at_place

H, FINER, RESISTANCE, COPPER, GAP = 4.0, 8, 0.04, 0.0039, 3e-4  # s, steps in each, Ω, 1/K, 1/rpm
EFFECTS = ["driven_conductance", "heater_power_slope", "sensor_offset", "heat_source", "input_feedthrough",
           "natural_convection", "sensor_lag", "hidden_mass"]

MOTOR = rt.thermal.parse_system("""
system = { name = "motor", temperature_unit = "degC" }
ambients.coolant = { temperature = 18.0 }
links = [{ between = ["winding", "tooth"], conductance = 10.0 }, { between = ["tooth", "yoke"], conductance = 15.0 },
         { between = ["yoke", "coolant"], conductance = 30.0 }, { between = ["magnet", "tooth"], conductance = 1.5 }]
[lumps]
winding = { capacity = 1500.0 }
tooth = { capacity = 1500.0 }
yoke = { capacity = 4000.0 }
magnet = { capacity = 900.0 }
[inputs]
copper = { lump = "winding" }
iron = { lump = "tooth" }
speed = { lump = "magnet", gain = 0.0 }
[sensors]
T_winding = { lump = "winding", noise = 0.05 }
T_tooth = { lump = "tooth", noise = 0.05 }
T_yoke = { lump = "yoke", noise = 0.05 }
T_magnet = { lump = "magnet", noise = 0.05 }
[fit]
"lumps.winding.capacity" = { lower = 150.0, upper = 15000.0, sigma = 300.0 }
"lumps.tooth.capacity" = { lower = 150.0, upper = 15000.0, sigma = 300.0 }
"lumps.yoke.capacity" = { lower = 400.0, upper = 40000.0, sigma = 800.0 }
"lumps.magnet.capacity" = { lower = 90.0, upper = 9000.0, sigma = 180.0 }
"links.winding-tooth.conductance" = { lower = 1.0, upper = 100.0 }
"links.tooth-yoke.conductance" = { lower = 1.0, upper = 100.0 }
"links.yoke-coolant.conductance" = { lower = 1.0, upper = 300.0 }
"links.magnet-tooth.conductance" = { lower = 0.1, upper = 30.0 }
""")


def held(rng: np.random.Generator, n: int, level: float) -> np.ndarray:
    """Levels up to this one, each held for 80 to 700 s."""
    rows, out = 0, np.zeros(n)
    while rows < n:
        dwell = int(rng.integers(20, 180))
        out[rows:rows + dwell] = 0.0 if rng.random() < 0.2 else rng.uniform(0.2, 1.0) * level
        rows += dwell
    return out


@cache
def day(seed: int, n: int, eddy: float) -> rt.Record:
    """A drive cycle; `eddy` is the heat of the magnet per turn of the rotor [W/rpm]."""
    rng = np.random.default_rng(seed)
    current, speed = held(rng, n, 100.0), held(rng, n, 6000.0)
    coolant = 18.0 + 4.0 * np.sin(np.arange(n) / 300.0 + seed)
    iron = 1.2e-2 * speed + 8e-6 * speed**2
    C = np.array([900.0, 600.0, 1500.0, 1500.0, 2500.0, 900.0])  # winding in slots and ends, tooth, yoke twice, magnet
    pairs = [(0, 1, 12.0), (0, 2, 9.0), (1, 2, 1.5), (2, 3, 25.0), (3, 4, 40.0)]
    T, rows = np.full(6, coolant[0]), []
    for k in range(n):
        rows.append([T[:2].mean(), T[2], T[4], T[5]])
        for _ in range(FINER):
            heat = np.array([0.6, 0.4, 0.0, 0.0, 0.0, 0.0]) * RESISTANCE * current[k]**2 * (1.0 + COPPER * (T - 20.0))
            heat += iron[k] * np.array([0.0, 0.0, 0.6, 0.4, 0.0, 0.0])
            heat[5] += eddy * speed[k]
            heat[4] -= 30.0 * (T[4] - coolant[k])
            for i, j, G in [*pairs, (5, 2, 0.9 * (1.0 + GAP * speed[k]))]:
                flow = G * (T[i] - T[j])
                heat[i] -= flow
                heat[j] += flow
            T = T + H / FINER * heat / C
    outputs = np.array(rows) + 0.05 * rng.standard_normal((n, 4)) + 273.15
    inputs = np.column_stack([RESISTANCE * current**2, iron, speed, coolant + 273.15])
    return rt.Record(sample_time=H, inputs=inputs, outputs=outputs, input_names=["copper", "iron", "speed", "coolant"],
                     output_names=["T_winding", "T_tooth", "T_yoke", "T_magnet"], start_time=1e5 * seed)


@cache
def found(eddy: float, *more: str) -> rt.Diagnosis:
    return rt.diagnose(MOTOR, day(1, 1500, eddy), validation=day(2, 1000, eddy), effects=[*EFFECTS, *more])


def sets(answer: rt.Diagnosis) -> list[set[str]]:
    return [{one.label, *(f"{name}({', '.join(where)})" for name, where in others)}
            for one, others in zip(answer.effects, answer.alternatives, strict=True)]


def test_copper_and_the_air_gap_are_named_with_their_sizes_and_nothing_else() -> None:
    values = {one.label: next(iter(one.values.values()))[0] for one in found(0.0).effects}
    assert found(0.0).verdict == "named_with_remainder" and found(0.0).alternatives == ((), ())
    assert values == {"heater_power_slope(copper)": pytest.approx(COPPER, rel=0.15),
                      "driven_conductance(magnet-tooth, speed)": pytest.approx(GAP, rel=0.15)}
    assert found(0.0).gap["validation"].after < 0.4 * found(0.0).gap["validation"].before


def test_eddy_currents_of_the_magnet_are_named_too() -> None:
    answer = found(2e-3, "driven_heat")
    values = {one.label: next(iter(one.values.values()))[0] for one in answer.effects}
    assert answer.verdict == "named_with_remainder" and answer.alternatives == ((), (), ())
    assert values == {"heater_power_slope(copper)": pytest.approx(COPPER, rel=0.2),
                      "driven_conductance(magnet-tooth, speed)": pytest.approx(GAP, rel=0.2),
                      "driven_heat(speed, magnet)": pytest.approx(2e-3, rel=0.2)}


def test_both_are_named_beside_a_heat_that_no_effect_says() -> None:
    named = [names for names in sets(found(2e-3)) if len(names) == 1]
    assert {"heater_power_slope(copper)"} in named and {"driven_conductance(magnet-tooth, speed)"} in named


def test_an_offset_does_not_stand_alone_for_a_heat_of_the_magnet() -> None:
    (offset,) = [names for names in sets(found(2e-3)) if "sensor_offset(T_magnet)" in names]
    assert found(2e-3).verdict == "ambiguous"
    assert {"heat_source(magnet)", "input_feedthrough(iron, magnet)"} <= offset


def test_a_column_heats_one_lump_at_a_time() -> None:
    (magnet, tooth), (share,) = ([one for one in rt.diagnosis.candidates(MOTOR, [name]) if one.where in places]
                                 for name, places in (("driven_heat", [("speed", "magnet"), ("speed", "tooth")]),
                                                      ("input_feedthrough", [("iron", "magnet")])))
    structure = rt.diagnosis.refit(MOTOR, day(1, 300, 0.0)).structure
    assert structure.with_effect(magnet).hides(tooth) and not structure.with_effect(magnet).hides(share)
    assert not structure.hides(tooth)


def test_what_follows_a_column_by_one_curve_is_said_and_no_column_saturates() -> None:
    """The path across the gap and the heat of the magnet have one curve of the speed, friction has another."""
    with_heat = MOTOR.with_parameters({"inputs.speed.gain": 0.01})
    both = rt.thermal.add_effect(with_heat, "driven_conductance", ["magnet-tooth", "speed"], {"relative": 3e-4}).system
    curve = next(one for one in rt.diagnosis.candidates(MOTOR, ["input_gain_slope"]) if one.where == ("speed",))
    for system, n in ((both, 1), (with_heat, 0)):
        fit = rt.diagnosis.refit(system, day(11, 400, 0.0), rt.diagnosis.noise_floor(MOTOR, day(11, 400, 0.0)),
                                 parameters=["lumps.magnet.capacity"])
        curved = fit.structure.with_effect(curve)
        v = curved.carried(fit.structure, fit.v, [{"slope": 1e-6}])
        said = share_one_curve(fit) + share_one_curve(extended(fit, curved, v, 1))
        assert len(said) == n and all("The conductance of magnet-tooth and the heat into magnet follow speed by one "
                                      "curve here, input_gain_slope(speed)" in one for one in said)
    words = at_place(MOTOR, "input_saturation", ("speed",))
    assert words == "a growth of what follows speed that is less than in proportion to it"
    assert at_place(MOTOR, "input_saturation", ("iron",)) == "the saturation of input iron"
