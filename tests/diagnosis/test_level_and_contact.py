"""A heater's gain that depends on its level, contacts that follow a column, heat stored beside a heater.

Truth is integrated by scipy from balances written here.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import robthermal as rt

Array = NDArray[np.float64]
H, DWELL, N, ROOM = 5.0, 15, 450, 298.15
FREE = {"inputs.heater.gain": 1.0, "links.sample-plate.conductance": 1.2, "links.sink-room.conductance": 3.0,
        "lumps.sample.capacity": 40.0, "lumps.plate.capacity": 60.0, "modules.m1.seebeck.value": 0.05,
        "modules.m1.resistance.value": 2.0, "modules.m1.conductance.value": 0.5}


def stack(*fixed: str, clamp: bool = False) -> rt.System:
    """Sample with a heater, plate, module, sink; numbers some percent off the truth, all but `fixed` refitted."""
    fit = {name: {"lower": value / 5, "upper": 5 * value, "sigma": 0.15 * value}
           for name, value in FREE.items() if name not in fixed}
    recorded = {"clamp": {"lump": "sink", "gain": 0.0, "unit": "N"}} if clamp else {}
    return rt.System(
        ambients={"room": {"temperature": ROOM}},
        lumps={"sample": {"capacity": 40.0}, "plate": {"capacity": 60.0}, "sink": {"capacity": 300.0}},
        links=[{"between": ("sample", "plate"), "conductance": 1.2}, {"between": ("sink", "room"), "conductance": 3.0}],
        inputs={"heater": {"lump": "sample", "limits": (0.0, 10.0)}, **recorded},
        modules={"m1": {"hot": "sink", "cold": "plate", "seebeck": 0.05, "resistance": 2.0, "conductance": 0.5,
                        "reference_temperature": ROOM}},
        sensors={name: {"lump": name[2:], "noise": 0.01} for name in ("T_sample", "T_plate", "T_sink")}, fit=fit)


Power = Callable[[float], float]
Contact = Callable[[float, float, float], float]  # of the current, the clamp and the record's time


def record(seed: int, *, power: Power = lambda u: u, contact: Contact = lambda current, clamp, t: 1.0,
           levels: tuple[float, ...] = (0.0, 2.0, 5.0, 8.0, 10.0), stored: float = 0.0,
           clamp: bool = False) -> rt.Record:
    """Readings of the true machine; with `stored` [J/K] the heater acts through a small lump of its own, 0.5 W/K."""
    rng = np.random.default_rng(seed)
    steps = N // DWELL
    u = np.column_stack([rng.choice(levels, steps), rng.choice([10.0, 25.0, 60.0], steps),
                         rng.choice([-1.0, 0.0, 0.0, 1.0, 2.0], steps)])
    x, rows = np.full(4, ROOM), []

    def balance(t: float, x: Array, heater: float, force: float, current: float) -> Array:
        sample, plate, sink, cable = x
        g = 1.15 * contact(current, force, t) * (plate - sample)
        arriving = 0.5 * (cable - sample) if stored else 1.04 * power(heater)
        mean = 0.5 * 1.96 * current**2
        return np.array([(g + arriving) / 41.0,
                         (-g - 0.0515 * plate * current + mean + 0.48 * (sink - plate)) / 58.0,
                         (0.0515 * sink * current + mean - 0.48 * (sink - plate) + 3.1 * (ROOM - sink)) / 300.0,
                         (1.04 * power(heater) - arriving) / stored if stored else 0.0])

    for k, held in enumerate(u):
        t = H * (k * DWELL + np.arange(DWELL + 1))
        run = solve_ivp(balance, (t[0], t[-1]), x, method="LSODA", t_eval=t, args=tuple(held), rtol=1e-8, atol=1e-8)
        rows.append(run.y.T[:-1])
        x = run.y[:, -1]
    T = np.concatenate(rows)[:, :3]
    columns = ["heater", "clamp", "m1"] if clamp else ["heater", "m1"]
    inputs = np.repeat(u if clamp else u[:, [0, 2]], DWELL, axis=0)
    return rt.Record(sample_time=H, inputs=inputs, outputs=T + 0.01 * rng.standard_normal(T.shape),
                     input_names=columns, output_names=["T_sample", "T_plate", "T_sink"])


def labels(found: rt.diagnosis.Diagnosis) -> list[str]:
    return [effect.label for effect in found.effects]


def said(found: rt.diagnosis.Diagnosis) -> set[str]:
    """Everything the diagnosis would allow."""
    others = {f"{effect}({', '.join(where)})" for one in found.alternatives for effect, where in one}
    return {*labels(found), *others}


def rising(u: float) -> float:
    """A driver whose gain grows by 3 % per watt."""
    return u * (1 + 0.03 * u)


NAMED = {
    "gain rises with the level": ({"power": rising}, "input_gain_slope(heater)", "slope", 0.03),
    "gain falls with the level": ({"power": lambda u: u * (1 - 0.03 * u)}, "input_saturation(heater)", "gain_slope",
                                  -0.03),
    "contact follows the current": ({"contact": lambda current, clamp, t: 1 + 0.3 * abs(current)},
                                    "driven_conductance(sample-plate, m1)", "relative", 0.3),
    "contact follows a recorded force": ({"contact": lambda current, clamp, t: (1 + 0.01 * clamp) / 1.2, "clamp": True},
                                         "driven_conductance(sample-plate, clamp)", "relative", 0.01),
    "contact loosens once": ({"contact": lambda current, clamp, t: 1 - 0.3 * (t > 1000)},
                             "conductance_step(sample-plate)", "relative", -0.3)}


@pytest.mark.parametrize("what", NAMED)
def test_it_is_named_alone_with_its_size(what: str) -> None:
    hidden, label, quantity, size = NAMED[what]
    clamp = "clamp" in hidden
    found = rt.diagnose(stack(clamp=clamp), record(1, **hidden), validation=record(2, **hidden))
    assert found.verdict == "named" and labels(found) == [label] and said(found) == {label}
    value, std, _ = found.effects[0].values[quantity]
    assert abs(value - size) < 4 * std and std < 0.05 * abs(size)
    assert found.gap["validation"].after == pytest.approx(0.01, rel=0.05) and found.gap["validation"].before > 0.05


def test_a_clamp_that_does_nothing_is_not_named() -> None:
    found = rt.diagnose(stack(clamp=True), record(1, clamp=True))
    assert found.verdict == "consistent"
    assert ("input_gain", ("clamp",)) in found.not_testable  # it heats nothing


def test_two_levels_cannot_show_a_gain_that_depends_on_the_level() -> None:
    two = record(3, power=rising, levels=(0.0, 8.0))
    found = rt.diagnose(stack(), two)
    assert found.verdict == "consistent"  # the gain takes all of it
    assert found.not_testable["input_gain_slope", ("heater",)] == "the nominal parameters imitate it exactly"
    known = rt.diagnose(stack("inputs.heater.gain"), two)
    assert known.verdict == "ambiguous" and said(known) == {"input_gain(heater)", "input_gain_slope(heater)"}


def test_a_contact_that_follows_the_clock_does_not_follow_the_current() -> None:
    hidden = {"contact": lambda current, clamp, t: 1 + 0.3 * np.sin(t / 170)}
    found = rt.diagnose(stack(), record(1, **hidden), validation=record(2, **hidden),
                        effects=["driven_conductance", "seebeck_slope", "thomson"])  # with none that could be right
    assert found.verdict == "unexplained" and not said(found)


@pytest.mark.exhaustive
def test_heat_stored_between_heater_and_body_is_a_lag_and_a_mass_with_one_time_constant() -> None:
    hidden = {"stored": 15.0}
    chosen = ["input_lag", "hidden_mass", "sensor_lag", "input_gain_slope", "driven_conductance"]
    found = rt.diagnose(stack(), record(1, **hidden), effects=chosen)
    assert found.verdict == "named" and sorted(labels(found)) == ["hidden_mass(sample)", "input_lag(heater)"]
    for effect in found.effects:
        value, std, _ = effect.values["time_constant"]
        assert abs(value - 15.0 / 0.5) < 4 * std and std < 1.0


def test_an_alias_of_an_impossible_sign_is_not_listed() -> None:
    fit = rt.diagnosis.refit(stack("inputs.heater.gain"), record(3, power=rising, levels=(0.0, 8.0)))
    scores = rt.diagnosis.score(fit, ["input_gain", "input_gain_slope", "input_saturation"])
    names = [candidate.key[0] for candidate in scores.candidates]
    gain = names.index("input_gain")
    every = {names[j] for j in scores.aliases(gain)}
    assert every == {"input_gain_slope", "input_saturation"}
    falling = names.index("input_saturation")
    for i, known in ((gain, True), (falling, False)):
        assert bool(scores.possible[i]) is known
    assert {twin.candidate.effect.name for twin in scores.twins(gain) if twin.possible} == {"input_gain_slope"}
    assert all(twin.possible for twin in scores.twins(falling))  # beside another effect its sign may be the other one
    for i in range(len(names)):
        for twin in scores.twins(i):
            j = [candidate is twin.candidate for candidate in scores.candidates].index(True)
            assert scores.size[i] * twin.per == pytest.approx(scores.size[j], rel=1e-3)


def test_an_alias_whose_sign_the_refit_turns_is_listed() -> None:
    """The heater gives 4 % less than it should; the file's capacity is too large by a quarter and not fitted.

    The conductance ends at its bound. The linearization does not know that, and asks for 20 % more heat: a gain that
    falls with the level is impossible there, and was not listed although the refit says 4 % less.
    """
    C, G, rng = 40.0, 1.2, np.random.default_rng(0)
    u = np.repeat(rng.choice([0.0, 8.0], 40), 20)
    T, rows, a = ROOM, [], np.exp(-H * G / C)
    for power in 0.96 * u:
        rows.append(T)
        T = ROOM + a * (T - ROOM) + (1.0 - a) * power / G
    run = rt.Record(sample_time=H, inputs=np.column_stack([u, np.full(u.size, ROOM)]),
                    outputs=np.array(rows)[:, None] + 0.01 * rng.standard_normal((u.size, 1)),
                    input_names=["heater", "room"], output_names=["T"])
    block = rt.System(ambients={"room": {"temperature": ROOM}}, lumps={"block": {"capacity": 50.0}},
                      links=[{"between": ("block", "room"), "conductance": 1.0}], inputs={"heater": {"lump": "block"}},
                      sensors={"T": {"lump": "block", "noise": 0.01}},
                      fit={"links.block-room.conductance": {"lower": 0.5, "upper": 1.2}})
    fit = rt.diagnosis.refit(block, run)
    scores = rt.diagnosis.score(fit, ["input_gain", "input_gain_slope", "input_saturation"])
    entry, = rt.diagnosis.refit_short_list(fit, scores).entries
    assert entry.candidate.effect.name == "input_gain"
    linearized = scores.size[[candidate.key for candidate in scores.candidates].index(entry.candidate.key)]
    assert linearized > 0.1 and entry.values["gain"][0] < -0.02
    assert {one.effect.name for one in entry.aliases} == {"input_gain_slope", "input_saturation"}
