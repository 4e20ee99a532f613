"""The recommended experiment: its promise against refits, and ambiguous records that it makes unique."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis.plan import rivals, trial_conditions
from robthermal.diagnosis.plan._next_experiment import _alike, _clearest
from robthermal.diagnosis.plan._separation import hypotheses_of, separation
from robthermal.diagnosis.plan._trial_inputs import limits_of
from robthermal.diagnosis.plan._trial_search import LONGEST, Trial, search_of
from robthermal.diagnosis.search import refit_set

Array = np.ndarray
H, ROOM = 5.0, 298.15


@pytest.fixture(scope="module")
def bench() -> rt.System:
    """A heated block on a plate, the block well insulated."""
    return rt.System(
        ambients={"room": {"temperature": ROOM}}, lumps={"plate": {"capacity": 120.0}, "block": {"capacity": 40.0}},
        links=[{"between": ("plate", "room"), "conductance": 0.6}, {"between": ("plate", "block"), "conductance": 1.5}],
        inputs={"heater": {"lump": "block", "limits": (0.0, 12.0)}},
        sensors={"Tp": {"lump": "plate", "noise": 0.01}, "Tb": {"lump": "block", "noise": 0.01}},
        fit={name: {"lower": value / 4, "upper": value * 4, "sigma": 0.1 * value} for name, value in {
            "lumps.plate.capacity": 120.0, "lumps.block.capacity": 40.0, "links.plate-room.conductance": 0.6,
            "links.plate-block.conductance": 1.5}.items()})


def truth(heat: Callable[[Array, float], tuple[float, float]] = lambda T, q: (0.0, q), delay: float = 0.0
          ) -> Callable[[Array], Array]:
    """The bench with other numbers, Runge-Kutta in steps of 0.25 s; `heat` goes into plate and block."""
    def rate(T: Array, q: float) -> Array:
        plate, block = heat(T, q)
        across = 1.45 * (T[1] - T[0])
        return np.array([(across - 0.62 * (T[0] - ROOM) + plate) / 123.0, (block - across) / 39.0])

    def run(heater: Array) -> Array:
        T, out, dt = np.full(2, ROOM), np.empty((heater.size, 2)), H / 20
        for k in range(heater.size):
            out[k] = T
            for s in range(20):
                late = int(np.floor(k + (s + 0.5) / 20 - delay / H))
                q = float(heater[max(late, 0)])
                a = rate(T, q)
                b = rate(T + dt / 2 * a, q)
                c = rate(T + dt / 2 * b, q)
                T = T + dt / 6 * (a + 2 * b + 2 * c + rate(T + dt * c, q))
        return out

    return run


def measured(run: Callable[[Array], Array], heater: Array, seed: int) -> rt.Record:
    y = run(heater) + 0.01 * np.random.default_rng(1000 + seed).standard_normal((heater.size, 2))
    return rt.Record(sample_time=H, inputs=np.column_stack([heater, np.full(heater.size, ROOM)]), outputs=y,
                     input_names=["heater", "room"], output_names=["Tp", "Tb"])


def timid(seed: int, n: int = 300) -> Array:
    """Two levels, held long: an experiment that shows little."""
    return np.repeat(np.random.default_rng(seed).choice([2.0, 5.0], n // 50), 50)


def convection(T: Array, q: float) -> tuple[float, float]:
    d = ROOM - T[0]
    return 0.0105 * abs(d) ** 0.25 * d, q


def radiation(T: Array, q: float) -> tuple[float, float]:
    return 0.0, q + 1.1e-10 * (ROOM**4 - T[1] ** 4)


def allowed(found: rt.diagnosis.Diagnosis) -> set[str]:
    others = {f"{effect}({', '.join(where)})" for group in found.alternatives for effect, where in group}
    return {effect.label for effect in found.effects} | others


CASES = {
    "delay or lag": (truth(delay=2.0), 101, "input_delay(heater)", {"input_lag(heater)"}),
    "convection or a constant": (truth(convection), 106, "natural_convection(plate, room)", {"heat_source(plate)"}),
    "radiation or a link": (truth(radiation), 105, "radiation(block, room)", {"missing_ambient_link(block, room)"}),
}


@pytest.mark.exhaustive
@pytest.mark.parametrize("case", CASES)
def test_recommended_experiment_makes_the_name_unique(bench: rt.System, case: str) -> None:
    run, seed, name, confused = CASES[case]
    first = measured(run, timid(seed), seed)
    found = rt.diagnose(bench, first)
    assert found.verdict == "ambiguous" and {name} | confused <= allowed(found)
    plan = found.next_experiment
    assert plan is not None and plan.expected > 10.0 * max(plan.present, 1.0)
    heater = plan.record["heater"]
    above, below = plan.plot()
    assert above.get_legend_handles_labels()[1] == list(plan.inputs) and "heater" in plan.inputs
    assert not set(plan.inputs) & set(found.system.ambients) and below.get_ylabel() == "predicted readings [K]"
    assert heater.min() >= 0.0 and heater.max() <= 12.0
    again = rt.diagnose(bench, [first, measured(run, heater, 500 + seed)])
    assert again.verdict == "named"
    assert [effect.label for effect in again.effects] == [name]


def test_promise_is_the_gain_that_refits_find(bench: rt.System) -> None:
    # λ is the noise-free gain of ΔBIC: mean over noises of what refitting both candidates to both records gives.
    run = truth(delay=2.0)
    first = measured(run, timid(101), 101)
    fit = rt.diagnosis.refit(bench, first)
    names = ["input_delay", "input_lag"]
    entries = rt.diagnosis.decide(rt.diagnosis.refit_short_list(fit, rt.diagnosis.score(fit, names)))
    plan = rt.diagnosis.next_experiment(rivals(entries), trials=2)
    gains = []
    for seed in range(3):
        both = rt.diagnosis.refit(bench, [first, measured(run, plan.record["heater"], seed)])
        short = rt.diagnosis.refit_short_list(both, rt.diagnosis.score(both, names))
        bic = {entry.candidate.effect.name: entry.delta_bic for entry in short.entries}
        gains.append(bic["input_delay"] - bic["input_lag"])
    assert np.mean(gains) == pytest.approx(plan.expected, rel=0.5)


def test_exact_aliases_need_another_measurement(bench: rt.System) -> None:
    run = truth(lambda T, q: (0.3, q))
    found = rt.diagnose(bench, measured(run, np.repeat([2.0, 8.0, 0.0, 11.0, 4.0, 7.0], 50), 3))
    assert found.verdict == "ambiguous"
    plan = found.next_experiment
    assert plan is not None
    pairs = {frozenset(pair) for pair in plan.inseparable}
    assert frozenset({"heat_source(plate)", "ambient_gradient(plate)"}) in pairs
    assert "No input within the limits separates" in plan.advice
    assert "a second ambient sensor beside plate" in plan.advice and "Tp with another excitation" in plan.advice
    assert found.to_dict()["next_experiment"]["advice"] == plan.advice


@pytest.fixture(scope="module")
def convective(bench: rt.System) -> tuple[rt.diagnosis.Entry, ...]:
    fit = rt.diagnosis.refit(bench, measured(truth(convection), timid(106), 106))
    short = rt.diagnosis.refit_short_list(fit, rt.diagnosis.score(fit, ["natural_convection", "heat_source"]), length=2)
    return short.entries


def test_temperature_limits_are_kept(bench: rt.System, convective: tuple[rt.diagnosis.Entry, ...]) -> None:
    free = rt.diagnosis.next_experiment(convective, trials=3)
    kept = rt.diagnosis.next_experiment(convective, trials=3, temperature=(290.0, 312.0))
    assert max(free.record["Tp"].max(), free.record["Tb"].max()) > 312.0  # otherwise the test could not fail
    assert 0.0 < kept.expected < free.expected
    assert max(kept.record["Tp"].max(), kept.record["Tb"].max()) <= 312.0


def test_a_longer_record_promises_about_as_many_times_more(convective: tuple[rt.diagnosis.Entry, ...]) -> None:
    search = search_of(convective, None)
    short = search.at(search.conditions.one.record)
    (pair, gain), = short.pairs.items()
    assert 0.5 < gain < 40.0 / LONGEST  # otherwise the test says little
    longer = search.prolonged(short, gain)
    np.testing.assert_array_equal(longer.record.inputs, np.tile(short.record.inputs, (LONGEST, 1)))
    assert 0.5 * LONGEST * gain < longer.pairs[pair] < 2.0 * LONGEST * gain
    too_warm = search_of(convective, (290.0, float(short.record["Tb"].max()) - 1.0))
    assert too_warm.prolonged(short, gain) is short
    for enough_or_hopeless in (45.0, 0.01):
        kept = Trial(short.record, {pair: enough_or_hopeless})
        assert search.prolonged(kept, enough_or_hopeless) is kept


def test_length_decides_which_sample_time_is_best() -> None:
    def trial(sample_time: float, *gains: float) -> Trial:
        record = rt.Record(sample_time=sample_time, inputs=np.zeros((4, 1)), outputs=np.zeros((4, 0)),
                           input_names=["heater"], output_names=[])
        return Trial(record, dict(zip((("a", "b"), ("a", "c"), ("b", "c")), gains, strict=bool(gains))))

    slow, none = trial(3.0, 30.0, 30.0, 0.0), trial(0.1)
    fast, other = trial(0.3, 3.4, 2.2, 5.4), trial(0.3, 1.0, 4.2, 5.1)
    assert _clearest([none, slow, fast, other], 1) == [slow, other]  # as they are; the slow one never tells b from c
    assert _clearest([none, slow, fast, other], LONGEST) == [fast, slow]  # as long as may be, the fast one tells all


def test_inputs_without_limits_stay_within_the_record(bench: rt.System) -> None:
    record = measured(truth(), timid(1), 1)
    unlimited = bench.model_copy(update={"inputs": {"heater": rt.thermal.Input(lump="block")}})
    assert limits_of(unlimited, record) == {"heater": (2.0, 5.0)}
    assert limits_of(bench, record) == {"heater": (0.0, 12.0)}


def test_one_candidate_is_refused(convective: tuple[rt.diagnosis.Entry, ...]) -> None:
    with pytest.raises(rt.InputError, match="two or more to separate"):
        rt.diagnosis.next_experiment(convective[:1])


def test_short_delay_needs_faster_sampling(bench: rt.System) -> None:
    run = truth(delay=0.5)
    heater = np.repeat(np.random.default_rng(7).uniform(0.0, 12.0, 60), 5)
    fit = rt.diagnosis.refit(bench, measured(run, heater, 7))
    short = rt.diagnosis.refit_short_list(fit, rt.diagnosis.score(fit, ["input_delay", "input_lag"]), length=2)
    plan = rt.diagnosis.next_experiment(short.entries)
    assert plan.record.sample_time == pytest.approx(H / 10) and len(plan.record) == 300
    assert "sample every 0.5 s" in plan.advice
    assert plan.expected > 20.0 > 1.0 > plan.present


@pytest.fixture(scope="module")
def split() -> tuple[tuple[rt.diagnosis.Entry, ...], rt.System]:
    """A module whose Joule heat is split unevenly; lead heating at the cold face and another resistance are as good."""
    cooler = rt.System(
        ambients={"room": {"temperature": ROOM}},
        lumps={"cold": {"capacity": 40.0, "disturbance": 0.02}, "hot": {"capacity": 200.0}},
        links=[{"between": ("hot", "room"), "conductance": 3.0}],
        modules={"m": {"hot": "hot", "cold": "cold", "seebeck": 0.03, "resistance": 1.8, "conductance": 0.5,
                       "reference_temperature": ROOM, "current_limits": (-1.5, 2.5)}},
        sensors={"Tc": {"lump": "cold", "noise": 0.01}, "Th": {"lump": "hot", "noise": 0.01}},
        fit={"modules.m.resistance.value": {"lower": 0.9, "upper": 3.6, "sigma": 0.15},
             "modules.m.seebeck.value": {"lower": 0.015, "upper": 0.06, "sigma": 0.002}})
    current = np.repeat(np.random.default_rng(3).uniform(-1.5, 2.5, 30), 10)
    drive = rt.Record(sample_time=H, inputs=np.column_stack([current, np.full(300, ROOM)]), outputs=np.zeros((300, 0)),
                      input_names=["m", "room"], output_names=[])
    seen = rt.thermal.simulate(cooler.with_parameters({"modules.m.joule_split": 0.03}), drive)
    record = seen.with_outputs(seen.outputs + 0.01 * np.random.default_rng(4).standard_normal((300, 2)))
    fit = rt.diagnosis.refit(cooler, record)
    tried = rt.diagnosis.score(fit, ["joule_split", "lead_heating"])
    entries = rt.diagnosis.refit_short_list(fit, tried, length=3).entries
    pair = {"joule_split(m)", "lead_heating(cold, m)", "lead_heating(hot, m)"}
    return tuple(entry for entry in entries if entry.candidate.label in pair)[:2], cooler


def test_resistance_measured_by_itself_tells_split_from_lead(
        split: tuple[tuple[rt.diagnosis.Entry, ...], rt.System]) -> None:
    entries, _ = split
    assert len(entries) == 2 and abs(entries[0].delta_bic - entries[1].delta_bic) < 10.0
    plan = rt.diagnosis.next_experiment(entries)
    assert plan.measurement is not None and plan.measurement.parameter == "modules.m.resistance.value"
    assert plan.expected > 40.0 and not plan.inseparable
    assert "measure modules.m.resistance.value by itself" in plan.advice


def test_promise_of_a_measurement_is_the_distance_of_the_two_values(
        split: tuple[tuple[rt.diagnosis.Entry, ...], rt.System]) -> None:
    # beside an idle record only the measured value tells: (R_j - R_k)² / (accuracy² R_j² + variance of R_k)
    entries, _ = split
    j, k = (entry.fit for entry in entries)
    at = list(j.structure.ranges.names).index("modules.m.resistance.value")
    R_j, R_k = (float(fit.structure.ranges.values(fit.v[:fit.structure.n_parameters])[at]) for fit in (j, k))
    idle = rt.Record(sample_time=H, inputs=np.tile([0.0, ROOM], (300, 1)), outputs=np.zeros((300, 2)),
                     input_names=["m", "room"], output_names=["Tc", "Th"])
    found = separation(hypotheses_of(entries), trial_conditions(j), idle)
    asked = rt.diagnosis.Measurement("modules.m.resistance.value", 0.005)
    gain = found.pairs(asked)[entries[0].candidate.label, entries[1].candidate.label]
    each = [(R_j - R_k) ** 2 / ((0.005 * true) ** 2 + (own**2) * fit.covariance[at, at] / max(fit.variance, 1.0))
            for true, own, fit in ((R_j, R_k, k), (R_k, R_j, j))]
    assert gain == pytest.approx(min(each), rel=0.05)
    assert max(found.pairs().values()) < 1.0


def answered(run: Callable[[Array], Array], seed: int) -> rt.identify.FrequencyResponse:
    heater = np.repeat(np.random.default_rng(seed).uniform(3.0, 6.0, 1500), 2)
    y = run(heater) + 0.01 * np.random.default_rng(1000 + seed).standard_normal((heater.size, 2))
    return rt.identify.lpm(rt.Record(sample_time=H, inputs=heater, outputs=y, input_names=["heater"],
                                     output_names=["Tp", "Tb"]))


def test_response_of_a_delayed_held_input_is_not_taken_for_a_lag(bench: rt.System) -> None:
    late = rt.diagnose(bench, answered(truth(delay=2.0), 5), operating_point={"heater": 4.5},
                       effects=["input_delay", "input_lag", "sensor_lag"])
    assert late.verdict == "named" and late.effects[0].label == "input_delay(heater)"
    value, std, _ = late.effects[0].values["delay"]
    assert abs(value - 2.0) < 4.0 * std


@pytest.mark.exhaustive
def test_record_is_planned_after_a_response(bench: rt.System) -> None:
    run = truth(delay=0.5)
    found = rt.diagnose(bench, answered(run, 5), operating_point={"heater": 4.5}, effects=["input_delay", "input_lag"])
    assert found.verdict == "ambiguous" and {"input_delay(heater)", "input_lag(heater)"} == allowed(found)
    plan = found.next_experiment
    assert plan is not None and plan.expected > 100.0 > plan.present
    assert plan.record.sample_time == pytest.approx(0.1 * 3000 * H / 2000) and len(plan.record) == 2000
    assert plan.record["heater"].min() >= 0.0 and plan.record["heater"].max() <= 12.0


def test_no_record_is_planned_for_sensors_of_unknown_noise(bench: rt.System) -> None:
    silent = bench.model_copy(update={"sensors": {name: sensor.model_copy(update={"noise": 0.0})
                                                  for name, sensor in bench.sensors.items()}})
    found = rt.diagnose(silent, answered(truth(delay=0.5), 5), operating_point={"heater": 4.5},
                        effects=["input_delay", "input_lag"])
    assert found.verdict == "ambiguous" and found.next_experiment is None


def test_an_alias_of_a_swing_has_its_period_also_where_another_effect_was_chosen_later(
        plant: rt.System, hide: Callable[..., tuple[rt.Record, rt.Record]]) -> None:
    """The swing is then not the last effect of its fit."""
    nominal = rt.diagnosis.refit(plant, hide(n=200)[0])
    swing, alias = rt.diagnosis.candidates(plant, ["periodic_load"])[:2]
    (lag, *_) = rt.diagnosis.candidates(plant, ["sensor_lag"])
    both = (swing.trials(nominal.paths[0])[0], lag.trials(nominal.paths[0])[0])
    fit = refit_set(nominal, both, [0.3, 2.0]).fit
    entry = rt.diagnosis.Entry(next(one for one in fit.structure.effects if one.key == swing.key), fit, 0.0, 0.0)
    ((found,), (size,)) = _alike(nominal, alias, entry)
    assert found.key == alias.key and np.isfinite(size)
    assert found.shape == {name: entry.found[name] for name in ("period", "phase")}
