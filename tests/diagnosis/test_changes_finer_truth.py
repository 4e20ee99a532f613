"""What changed between two days where the truth is finer than the network, and where air takes part of the heat."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import robthermal as rt

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from foreign.days import CHANGES, CONVECTION, HEALTHY, OUTSIDE, Change, days  # noqa: E402 - beside the benchmarks
from foreign.machines import MACHINES  # noqa: E402


@pytest.mark.parametrize("kind", [*HEALTHY, *CHANGES, *OUTSIDE])
def test_days_are_of_one_machine_and_differ(kind: str) -> None:
    one = days(Change("plate", kind, 1), n_healthy=2)
    assert len(one.healthy) == 2 and bool(one.truth) == (kind in CHANGES)
    assert {record.output_names for record in (*one.healthy, one.new)} == {one.new.output_names}
    assert not np.array_equal(one.healthy[0].outputs, one.healthy[1].outputs)
    names = {*one.system.parameters, *one.system.inputs, *one.system.sensors}
    assert not one.truth or set(one.truth[0]) <= names


def test_a_loose_contact_halves_the_conductance_of_the_network() -> None:
    """Heat through a chain at rest: the same as through a network whose conductance has the factor."""
    from foreign.days import _loosen

    plain, loose = (MACHINES["bar"](np.random.default_rng(0)) for _ in range(2))
    _loosen(loose, ("x3", "x4"), 0.4)

    def resistance(machine) -> float:
        chain = [G for i, j, G in machine.plant.links if 100 <= i < 140]  # middle of x3 to middle of x4
        return float(np.sum(1.0 / np.array(chain)))

    assert resistance(plain) == pytest.approx(1.0 / plain.links["x3", "x4"], rel=0.01)
    assert resistance(loose) == pytest.approx(resistance(plain) / 0.4, rel=0.01)


@pytest.mark.parametrize("seed", [3, pytest.param(4, marks=pytest.mark.exhaustive)])
def test_the_link_is_named_that_came_loose_and_not_the_next_one(seed: int) -> None:
    """A bar whose losses nobody has modelled right: without the change its fit bends both links against each other."""
    one = days(Change("bar", "contact" + CONVECTION, seed))
    found = rt.diagnose(one.system, one.new, reference=one.healthy)
    assert [effect.where for effect in found.effects] == list(one.truth) and found.alternatives == ((),)
    assert "compare with the model that has what they name by themselves" in found.outcome.text


def test_a_change_beyond_the_range_of_the_fit_table(tmp_path: Path) -> None:
    """The table's range is that of the healthy machine: the changed system has a wider one, and can be written."""
    one = days(Change("bar", "ambient", 4))
    name = one.truth[0][0]
    value = one.system.parameter(name)
    narrow = one.system.model_copy(update={"fit": {**one.system.fit, name: one.system.fit[name].model_copy(
        update={"lower": 0.7 * value, "upper": 1.4 * value})}})
    found = rt.diagnose(narrow, one.new, reference=one.healthy, effects=["input_feedthrough", "missing_ambient_link"])
    assert (name,) in [effect.where for effect in found.effects]
    changed = found.system.parameter(name)
    assert changed < 0.7 * value
    assert found.system.fit[name].lower < changed < found.system.fit[name].upper
    rt.thermal.write_system(found.system, tmp_path / "augmented.toml")
    assert rt.thermal.read_system(tmp_path / "augmented.toml").parameter(name) == pytest.approx(changed)


STILL_AIR = """
[system]
name = "sink in still air"
temperature_unit = "K"
[ambients.room]
temperature = 295.0
[lumps.block]
capacity = 60.0
[lumps.sink]
capacity = 200.0
[[links]]
between = ["block", "sink"]
conductance = 1.5
[[links]]
between = ["sink", "room"]
conductance = 0.3
[[links]]
between = ["sink", "room"]
name = "air"
natural = { gain = 0.3 }
[inputs.heater]
lump = "block"
limits = [0.0, 30.0]
[sensors.T_block]
lump = "block"
noise = 0.03
[sensors.T_sink]
lump = "sink"
noise = 0.03
[fit]
"lumps.block.capacity" = { lower = 20.0, upper = 200.0 }
"links.block-sink.conductance" = { lower = 0.3, upper = 6.0 }
"links.sink-room.conductance" = { lower = 0.01, upper = 3.0 }
"""


def covered(seed: int, factor: float, n: int = 300, step: float = 20.0) -> rt.Record:
    """A sink in still air on one day: both its paths to the room have the factor; scipy's integrator."""
    rng = np.random.default_rng(seed)
    off = np.exp(0.02 * rng.standard_normal(5))
    heater = np.repeat(rng.choice([0.0, 8.0, 16.0, 25.0], -(-n // 30)), 30)[:n]

    def rate(t: float, T: np.ndarray) -> list[float]:
        G, far = 1.5 * off[0], T[1] - 295.0
        out = factor * (0.3 * off[1] * far + 0.3 * off[2] * abs(far) ** 0.25 * far)
        q = heater[min(int(t / step), n - 1)]
        return [(q - G * (T[0] - T[1])) / (60.0 * off[3]), (G * (T[0] - T[1]) - out) / (200.0 * off[4])]

    T = solve_ivp(rate, (0.0, (n - 1) * step), [296.0, 296.0], max_step=step, t_eval=step * np.arange(n), rtol=1e-8).y.T
    return rt.Record(sample_time=step, inputs=heater, outputs=T + 0.03 * rng.standard_normal(T.shape),
                     input_names=["heater"], output_names=["T_block", "T_sink"])


def test_a_covered_sink_changes_both_its_paths_to_the_room() -> None:
    system = rt.thermal.parse_system(STILL_AIR)
    found = rt.diagnose(system, covered(9, 0.5), reference=[covered(seed, 1.0) for seed in (1, 2, 3)])
    (one,) = found.effects
    names = {(one.effect, one.where), *found.alternatives[0]}
    assert ("parameter_change", ("links.sink-room.conductance", "links.air.natural.gain")) in names
    assert rt.diagnose(system, covered(8, 1.0), reference=[covered(seed, 1.0) for seed in (1, 2, 3)]
                       ).verdict == "consistent"


def test_a_size_that_ends_at_its_bound_does_not_rule_out_its_neighbors() -> None:
    """Side to bottom "broken off" explained a failed fan below the bottom, which no sensor sees, a little better."""
    one = days(Change("housing", "fan", 108))
    found = rt.diagnose(one.system, one.new, reference=one.healthy)
    assert found.verdict == "ambiguous"
    (names,) = [[(effect.effect, effect.where), *others]
                for effect, others in zip(found.effects, found.alternatives, strict=True)]
    assert any(where in one.truth for _, where in names)


def test_a_fan_that_stands_still_leaves_the_law_of_still_air() -> None:
    """A sink of a stack: 250 cells and more; before, a heat into the sink came nearest, and no name."""
    one = days(Change("stack", "fan", 102))
    found = rt.diagnose(one.system, one.new, reference=one.healthy)
    assert [effect.where for effect in found.effects] == [one.truth[0]] and not any(found.alternatives)
    assert 0.1 < found.effects[0].values["exponent"][0] < 0.4


@pytest.mark.exhaustive
def test_a_sensor_that_drifts_beside_missing_convection_is_no_step_of_a_conductance() -> None:
    """Named while what is gone was counted from the unchanged model for effects of the catalog too."""
    one = days(Change("housing", "sensor drifts" + CONVECTION, 112))
    found = rt.diagnose(one.system, one.new, reference=one.healthy)
    assert found.verdict == "unexplained" and not found.effects
