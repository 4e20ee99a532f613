"""Joint selection: optimality against a solver written here, hidden pairs, and a sum that fools a stepwise search."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis.evidence import Scores
from robthermal.diagnosis.search import Accepted, EffectSet, Entry, checked_jointly, refit_set
from robthermal.diagnosis.search._joint_program import Program

Hide = Callable[..., tuple[rt.Record, rt.Record]]
CUBIC, SLOPE, GAIN = 5e-4, 8e-3, 0.02


def labels(found: EffectSet) -> set[str]:
    return {candidate.label for candidate in found.candidates}


def random_program(seed: int) -> Program:
    """Correlated columns: 5 of one sign, 3 bounded on both sides, and a pair; the truth is sparse."""
    rng = np.random.default_rng(seed)
    J = rng.standard_normal((80, 10)) + 0.8 * rng.standard_normal((80, 1))
    J /= np.linalg.norm(J, axis=0)
    truth = np.array([30.0, 0.0, 0.0, 0.0, 0.0, -12.0, 0.0, 0.0, 9.0, -14.0])
    z = J @ truth + rng.standard_normal(80)
    lower = np.array([0.0] * 5 + [-10.0] * 3 + [-np.inf] * 2)
    upper = np.array([np.inf] * 4 + [5.0] + [10.0] * 3 + [np.inf] * 2)
    groups = (*(np.array([i]) for i in range(8)), np.array([8, 9]))
    dummy = rt.diagnosis.candidates(rt.systems.two_module(), ["sensor_gain"])[0]
    return Program((dummy,) * 9, groups, J.T @ J, J.T @ z, np.ones(10), lower, upper, np.array([1.0] * 8 + [2**0.5]))


def proximal_gradient(G: np.ndarray, c: np.ndarray, lower: np.ndarray, upper: np.ndarray, penalty: float) -> np.ndarray:
    """Independent: accelerated proximal gradient, 8 scalars and a pair, nothing of the package."""
    step = 1.0 / np.linalg.eigvalsh(G)[-1]
    x, y, t = np.zeros(10), np.zeros(10), 1.0
    for _ in range(20_000):
        v = y - step * (G @ y - c)
        new = np.sign(v) * np.maximum(np.abs(v) - step * penalty, 0.0)
        new[:8] = np.clip(new[:8], lower[:8], upper[:8])
        length = np.hypot(v[8], v[9])
        new[8:] = v[8:] * max(1.0 - step * penalty * 2**0.5 / length, 0.0)
        faster = (1.0 + (1.0 + 4.0 * t * t) ** 0.5) / 2.0
        y, x, t = new + (t - 1.0) / faster * (new - x), new, faster
    return x


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("share", [0.7, 0.2, 0.02])
def test_solution_is_that_of_a_proximal_gradient_method(seed: int, share: float) -> None:
    program = random_program(seed)
    penalty = share * program.largest_penalty
    beta, kkt = program.solve(penalty)
    assert kkt < 1e-8
    other = proximal_gradient(program.G, program.c, program.lower, program.upper, penalty)
    np.testing.assert_allclose(beta, other, atol=1e-6)
    assert program.chosen(beta) and np.array_equal(beta != 0.0, np.abs(other) > 1e-9)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_largest_penalty_is_where_the_first_effect_enters(seed: int) -> None:
    program = random_program(seed)
    above, _ = program.solve(1.001 * program.largest_penalty)
    below, _ = program.solve(0.999 * program.largest_penalty)
    assert not program.chosen(above) and len(program.chosen(below)) == 1


def test_a_moved_solution_fails_its_kkt_check() -> None:
    # The residual must see a point that is not optimal: it is what the result shows.
    program = random_program(1)
    penalty = 0.2 * program.largest_penalty
    beta, _ = program.solve(penalty)
    wrong = replace(program, c=program.c + 1e-3 * program.largest_penalty)
    step = 1.0 / np.linalg.norm(program.G, 2)
    assert np.abs(wrong._stepped(beta, penalty, step) - beta).max() / (step * penalty) > 1e-4


def heated(rate: Callable, cubic: float = CUBIC, slope: float = SLOPE) -> Callable:
    """The plant's equations with a saturated heater whose power grows with the block's temperature."""
    def hidden(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        q = (u[0] - cubic * u[0] ** 3) * (1.0 + slope * (T[1] - 298.15))
        return rate(T, np.array([q, u[1]]))

    return hidden


def added(system: rt.System, values: dict[str, float]) -> rt.System:
    known = set(system.parameter_names)
    return system.with_parameters({name: value + (system.parameter(name) if name in known else 0.0)
                                   for name, value in values.items()})


@pytest.fixture
def register() -> Iterator[Callable[..., rt.diagnosis.Effect]]:
    """Effects that move several numbers at once, in fixed shares."""
    names: list[str] = []

    def own(name: str, shares: dict[str, float]) -> rt.diagnosis.Effect:
        effect = rt.diagnosis.Effect(
            name=name, places=lambda system: [("heater",)],
            quantities=(rt.diagnosis.Quantity("size", "-", 0.0, 100.0),),
            add=lambda system, where, q: added(system, {key: q["size"] * share for key, share in shares.items()}))
        rt.diagnosis.register_effect(effect)
        names.append(name)
        return effect

    yield own
    for name in names:
        rt.diagnosis.forget_effect(name)


def scored(plant: rt.System, train: rt.Record, effects: list[str]) -> tuple[rt.diagnosis.Refit, Scores]:
    fit = rt.diagnosis.refit(plant, train)
    return fit, rt.diagnosis.score(fit, effects)


def as_rounds(fit: rt.diagnosis.Refit, found: EffectSet) -> tuple[Accepted, ...]:
    """A set as if a stepwise search had accepted it."""
    return tuple(Accepted(fit, best=Entry(candidate, found.fit, found.delta_bic, 0.0))
                 for candidate in found.candidates)


def taken(fit: rt.diagnosis.Refit, scores: Scores, names: dict[str, float]) -> EffectSet:
    chosen = {candidate.label: candidate for candidate in scores.candidates
              if candidate.effect.size.name not in ("clip", "gain_slope")}
    return refit_set(fit, tuple(chosen[name] for name in names), list(names.values()))


def test_two_hidden_effects_are_selected_together(plant: rt.System, hide: Hide, rate: Callable) -> None:
    train, _ = hide(heated(rate))
    fit, scores = scored(plant, train, ["input_saturation", "heater_power_slope", "sensor_lag", "sensor_gain",
                                        "natural_convection", "input_feedthrough", "periodic_load"])
    found = rt.diagnosis.select_jointly(fit, scores)
    assert found.outcome.ok and found.kkt.max() < 1e-6
    assert labels(found.sets[0]) == {"input_saturation(heater)", "heater_power_slope(heater)"}
    values = found.sets[0].fit.structure.quantities(found.sets[0].fit.v)
    sizes = {c.label: v for c, v in zip(found.sets[0].candidates, values, strict=True)}
    assert sizes["input_saturation(heater)"]["cubic"] == pytest.approx(CUBIC, rel=0.05)
    assert sizes["heater_power_slope(heater)"]["slope"] == pytest.approx(SLOPE, rel=0.05)
    assert found.compared(found.sets[0].candidates).endswith("agree")
    assert "stepwise only: sensor_gain(Tp)" in found.compared([c for c in found.candidates
                                                               if c.label == "sensor_gain(Tp)"])
    assert "irrepresentable" in str(found)


def test_nothing_hidden_selects_nothing(plant: rt.System, hide: Hide) -> None:
    train, _ = hide(n=300)
    fit, scores = scored(plant, train, ["input_saturation", "heater_power_slope", "sensor_lag", "missing_ambient_link"])
    found = rt.diagnosis.select_jointly(fit, scores)
    assert found.outcome.code == "nothing" and not found.sets


@pytest.mark.exhaustive
def test_diagnose_compares_both_ways(plant: rt.System, hide: Hide, rate: Callable) -> None:
    train, validation = hide(heated(rate))
    found = rt.diagnose(plant, train, validation=validation, effects=["input_saturation", "heater_power_slope",
                                                                  "sensor_lag", "sensor_gain"])
    assert found.verdict == "named"
    assert {effect.label for effect in found.effects} == {"input_saturation(heater)", "heater_power_slope(heater)"}
    assert found.joint is not None and "agree" in str(found.joint)


def test_a_sum_that_fools_a_stepwise_search_is_replaced(plant: rt.System, hide: Hide, rate: Callable,
                                                        register: Callable) -> None:
    # "both" is nearly the sum of the two hidden effects plus a gain error; input_gain then takes that error away again:
    # changing one of {both, input_gain} at a time never arrives at the truth.
    register("both", {"inputs.heater.drive.cubic": 1.15 * CUBIC, "inputs.heater.power_slope": SLOPE,
                      "inputs.heater.drive.gain": GAIN})
    train, _ = hide(heated(rate), n=300)
    known = plant.model_copy(update={"fit": {}}).with_parameters({  # a known plant: nothing else can take a gain up
        "lumps.plate.capacity": 123.0, "lumps.block.capacity": 39.0, "links.plate-room.conductance": 0.62,
        "links.plate-block.conductance": 1.45, "links.block-room.conductance": 0.105})
    names = ["input_saturation", "heater_power_slope", "both", "input_gain"]
    fit, scores = scored(known, train, names)
    assert scores.candidates[scores.order[0]].label == "both(heater)"
    fooled = taken(fit, scores, {"both(heater)": 1.0, "input_gain(heater)": -GAIN})
    true = {"input_saturation(heater)", "heater_power_slope(heater)"}
    rounds, after, check = checked_jointly(as_rounds(fit, fooled), fooled.fit, fit, scores, names)
    assert labels(check.selection.sets[0]) == true
    assert check.advantage > 10.0 and "was taken" in str(check)
    assert {round_.best.candidate.label for round_ in rounds if round_.best} == true
    assert after.variance == pytest.approx(1.0, abs=0.15)


def test_sets_that_explain_as_much_become_alternatives(plant: rt.System, hide: Hide, rate: Callable,
                                                       register: Callable) -> None:
    # "both" and either of its parts span what the two parts span: no record can choose.
    register("both", {"inputs.heater.drive.cubic": CUBIC, "inputs.heater.power_slope": 2.0 * SLOPE})
    train, _ = hide(heated(rate))
    names = ["input_saturation", "heater_power_slope", "both"]
    fit, scores = scored(plant, train, names)
    accepted = taken(fit, scores, {"input_saturation(heater)": 0.5 * CUBIC, "both(heater)": 0.5})
    rounds, _, check = checked_jointly(as_rounds(fit, accepted), accepted.fit, fit, scores, names)
    assert abs(check.advantage) < 10.0 and "both explain" in str(check)
    others = {entry.candidate.label for round_ in rounds for entry in round_.contenders}
    assert others and others <= {"input_saturation(heater)", "heater_power_slope(heater)", "both(heater)"}
