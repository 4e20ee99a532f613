"""The engine: starts, glitches, steps of a converter, noise levels, priors, stages; truth integrated in conftest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis.data import as_measured
from robthermal.diagnosis.data._glitches import outliers
from robthermal.diagnosis.fit import Whitened, descend, extended
from robthermal.diagnosis.path import linearized_record, whitener
from robthermal.diagnosis.search import Accepted, Entry, ShortList, _revise
from robthermal.diagnosis.search._scan import scanned
from robthermal.diagnosis.search._starts import Origin, held, started

Hide = Callable[..., tuple[rt.Record, rt.Record]]


def convection(gain: float, rate: Callable) -> Callable:
    """Natural convection from the plate."""

    def hidden(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        dT = u[1] - T[0]
        return rate(T, u, np.array([gain * abs(dT) ** 0.25 * dT, 0.0]))

    return hidden


def spiky(record: rt.Record, seed: int, share: float) -> tuple[rt.Record, np.ndarray]:
    """Spikes of 0.3 to 6 K, thirty to six hundred standard deviations, and where they are."""
    rng = np.random.default_rng(seed)
    where = rng.random(record.outputs.shape) < share
    size = rng.choice([-1.0, 1.0], where.sum()) * rng.uniform(0.3, 6.0, where.sum())
    y = np.array(record.outputs)
    y[where] += size
    return record.with_outputs(y), where


def stepped(record: rt.Record, step: float) -> rt.Record:
    """Readings of a converter with that step."""
    return record.with_outputs(np.round(np.asarray(record.outputs) / step) * step)


# Starts


def test_clip_is_named_with_its_level(plant: rt.System, hide: Hide) -> None:
    def clipped(u: np.ndarray) -> np.ndarray:
        return np.column_stack([np.minimum(u[:, 0], 8.5), u[:, 1]])

    train, validation = hide(drive=clipped)
    found = rt.diagnose(plant, train, validation=validation)
    assert found.verdict == "named"
    assert [effect.label for effect in found.effects] == ["input_saturation(heater)"]
    assert found.effects[0].values["clip"][0] == pytest.approx(8.5, abs=0.02)
    assert "cubic" not in found.effects[0].values
    assert found.system.parameter("inputs.heater.drive.clip") == pytest.approx(8.5, abs=0.02)


def test_cubic_saturation_is_not_called_a_clip(plant: rt.System, hide: Hide) -> None:
    train, validation = hide(drive=lambda u: np.column_stack([u[:, 0] - 1e-3 * u[:, 0] ** 3, u[:, 1]]))
    found = rt.diagnose(plant, train, validation=validation)
    assert [effect.label for effect in found.effects] == ["input_saturation(heater)"]
    assert found.effects[0].values["cubic"][0] == pytest.approx(1e-3, rel=0.05)


def test_strong_effect_is_reached_although_the_nominal_fit_is_far_off(plant: rt.System, hide: Hide,
                                                                     rate: Callable) -> None:
    # A large mass on the plate: the nominal fit moves its capacities instead. The start from there and the start from
    # the declared parameters have to end at the truth.
    C, tau = 150.0, 200.0

    def hidden(t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        flow = C / tau * (x[2] - x[0])
        return np.append(rate(x[:2], u, np.array([flow, 0.0])), -flow / C)

    fit = rt.diagnosis.refit(plant, hide(hidden, extra_states=1)[0])
    assert fit.variance > 50.0
    scores = rt.diagnosis.score(fit, ["hidden_mass"])
    place = [candidate.label for candidate in scores.candidates].index("hidden_mass(plate)")
    new = started(Origin(fit), scores.candidates[place], float(scores.size[place]))
    values = extended(new, new.structure, new.v).structure.quantities(extended(new, new.structure, new.v).v)[0]
    assert values["capacity"] == pytest.approx(C, rel=0.05)
    assert values["time_constant"] == pytest.approx(tau, rel=0.05)


@pytest.mark.exhaustive
def test_time_of_a_step_is_looked_for_beyond_the_nearest_minimum(plant: rt.System, hide: Hide, rate: Callable) -> None:
    # The link between plate and block doubles at 1230 s, inside a dwell of 100 s: near 1330 s is another minimum.
    def hidden(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        flow = 1.45 * (t > 1230.0) * (T[1] - T[0])
        return rate(T, u, np.array([flow, -flow]))

    fit = rt.diagnosis.refit(plant, hide(hidden)[0])
    scores = rt.diagnosis.score(fit, ["conductance_step"])
    place = [candidate.label for candidate in scores.candidates].index("conductance_step(plate-block)")
    right = started(Origin(fit), scores.candidates[place], float(scores.size[place]))
    right = extended(right, right.structure, right.v)
    at = right.structure.n_parameters + 1
    assert right.v[at] == pytest.approx(1230.0, abs=5.0)
    assert scanned(right) is right
    for shift in (-90.0, -40.0, 40.0, 90.0):
        v = right.v.copy()
        v[at] += shift
        found = scanned(replace(right, v=v, z=Whitened(right.structure, right.whiteners).residual(v)))
        assert found.v[at] == pytest.approx(right.v[at], abs=1.0)
        assert found.rss < right.rss * (1 + 1e-3)


def test_times_are_held_while_the_rest_settles_but_no_size_or_time_constant(plant: rt.System, hide: Hide) -> None:
    structure = rt.diagnosis.refit(plant, hide(n=200)[0]).structure
    tried = {c.label: c for c in rt.diagnosis.candidates(plant, ["hidden_mass", "conductance_step"])}
    step = replace(tried["conductance_step(plate-block)"], shape={"time": 300.0})
    mass = replace(tried["hidden_mass(plate)"], shape={"time_constant": 60.0})
    of_step, of_mass = {"relative": 0.5, "time": 300.0}, {"capacity": 10.0, "time_constant": 60.0}
    for first, last, values, fixed in ((mass, step, [of_mass, of_step], True), (step, mass, [of_step, of_mass], False)):
        both = structure.with_effects((first, last))
        v = both.start(both.ranges.start, values)
        low, high = held(both, v)
        at = both.n_parameters + 3
        assert bool(low[at] == high[at] == v[at]) is fixed
        free = np.arange(v.size) != at
        assert np.array_equal(low[free], both.bounds[0][free]) and np.array_equal(high[free], both.bounds[1][free])


def test_descent_does_not_polish_what_is_hopeless() -> None:
    # Rosenbrock's valley with a misfit that nothing removes: fewer evaluations than without it.
    bounds = np.full(2, -10.0), np.full(2, 10.0)
    exact = descend(Valley(0.0), np.array([-1.2, 1.0]), bounds, 100, 1e-6)
    rough = descend(Valley(1e4), np.array([-1.2, 1.0]), bounds, 100, 1e-6)
    assert np.allclose(exact.at.v, 1.0, atol=1e-4)
    assert rough.converged and rough.iterations < exact.iterations


def test_derivatives_are_computed_only_where_a_step_is_taken_from() -> None:
    bounds, start = (np.full(2, -10.0), np.full(2, 10.0)), np.array([-1.2, 1.0])
    whole, short = Valley(0.0), Valley(0.0)
    found = descend(whole, start, bounds, 100, 1e-6)
    assert whole.slopes_of == [v for v in whole.residual_of if v in whole.slopes_of]  # each once, in that order
    assert len(whole.slopes_of) < len(whole.residual_of) == found.iterations  # some steps were too long
    ended = descend(short, np.array([0.9, 0.8]), bounds, 2, 1e-6)
    assert not ended.converged and len(short.slopes_of) == 1
    assert ended.at.J.shape == (3, 2) and len(short.slopes_of) == 2


class Valley:
    """Rosenbrock's, with a constant misfit; it notes where it was asked for residuals and for derivatives."""

    def __init__(self, offset: float):
        self.offset = offset
        self.residual_of: list[tuple[float, ...]] = []
        self.slopes_of: list[tuple[float, ...]] = []

    def residual(self, v: np.ndarray) -> np.ndarray:
        self.residual_of.append(tuple(v))
        return np.array([10.0 * (v[1] - v[0] ** 2), 1.0 - v[0], self.offset])

    def slopes(self, v: np.ndarray) -> np.ndarray:
        self.slopes_of.append(tuple(v))
        return np.array([[20.0 * v[0], -10.0], [1.0, 0.0], [0.0, 0.0]])


# Glitches


def test_outliers_are_told_from_ramps_and_kinks() -> None:
    t = np.arange(60.0)
    r = np.where(t < 30, 0.02 * t, 0.6 - 0.05 * (t - 30))[:, None] + np.zeros((60, 2))  # a kink, steep on both sides
    r[12, 0] += 0.5
    r[40:42, 1] -= 1.0  # two side by side
    found = outliers(r, np.full(r.shape, 0.08))
    assert np.flatnonzero(found[:, 0]).tolist() == [12]
    assert np.flatnonzero(found[:, 1]).tolist() == [40, 41]


def test_spikes_make_no_name_when_nothing_is_hidden(plant: rt.System, hide: Hide) -> None:
    (train, where), (validation, _) = (spiky(record, seed, 0.01) for seed, record in enumerate(hide()))
    found = rt.diagnose(plant, train, validation=validation)
    assert found.verdict == "consistent"
    counted = found.noise_floor.glitches
    assert counted == {"Tp": int(where[:, 0].sum()), "Tb": int(where[:, 1].sum())}
    assert "isolated outliers" in str(found.noise_floor)
    assert found.nominal.variance == pytest.approx(1.0, abs=0.1)


def test_spikes_do_not_hide_an_effect(plant: rt.System, hide: Hide, rate: Callable) -> None:
    train, validation = (spiky(record, seed, 0.01)[0] for seed, record in enumerate(hide(convection(0.08, rate))))
    found = rt.diagnose(plant, train, validation=validation)
    assert found.verdict == "named"
    assert [effect.label for effect in found.effects] == ["natural_convection(plate, room)"]
    gain, std, _ = found.effects[0].values["gain"]
    assert abs(gain - 0.08) < 4 * std


def test_too_many_spikes_are_refused(plant: rt.System, hide: Hide) -> None:
    record, where = spiky(hide(n=300)[0], 3, 0.08)
    assert where[:, 0].mean() > 0.055
    with pytest.raises(rt.InputError, match="are isolated outliers"):
        rt.diagnose(plant, record)


def test_a_missing_reading_counts_for_nothing(plant: rt.System, hide: Hide) -> None:
    # Any value at the place of a missing reading gives the same innovations everywhere else.
    moving = plant.model_copy(update={"lumps": {name: lump.model_copy(update={"disturbance": 0.05})
                                                for name, lump in plant.lumps.items()}})
    one = as_measured(moving, hide(n=100)[0], "records")[0]
    missing = np.zeros(one.readings.shape, bool)
    missing[40, 0] = True
    path = linearized_record(moving, type(one)(one.record, one.sensors, one.columns, one.readings, missing))
    w = whitener(path, np.array([0.01, 0.01]), np.array([0.05, 0.05]))
    r = np.random.default_rng(0).standard_normal((100, 2, 2))
    r[:, :, 1] = r[:, :, 0]
    r[40, 0, 1] += 7.0
    z = w(r)
    assert np.allclose(z[..., 0], z[..., 1], atol=1e-4)
    assert abs(z[40, 0, 0]) < 1e-4


# Converters


def test_steps_of_a_converter_make_no_name(plant: rt.System, hide: Hide) -> None:
    train, validation = (stepped(record, 0.25) for record in hide())
    found = rt.diagnose(plant, train, validation=validation)
    assert found.verdict == "consistent"
    assert found.noise_floor.noise["Tp"] == pytest.approx(0.25 / 12**0.5, rel=1e-6)
    assert found.noise_floor.quantized == ("Tp", "Tb")


@pytest.mark.exhaustive
def test_an_effect_is_named_through_the_steps_of_a_converter(plant: rt.System, hide: Hide, rate: Callable) -> None:
    train, validation = (stepped(record, 0.25) for record in hide(convection(0.3, rate)))
    found = rt.diagnose(plant, train, validation=validation)
    assert found.verdict == "named"
    assert [effect.label for effect in found.effects] == ["natural_convection(plate, room)"]
    assert found.effects[0].values["gain"][0] == pytest.approx(0.3, rel=0.1)


# Noise levels, limits, priors


def test_twice_the_declared_random_heat_is_said_and_is_no_name() -> None:
    system = rt.System(
        ambients={"room": {"temperature": 298.15}}, lumps={"bar": {"capacity": 50.0, "disturbance": 0.05}},
        links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
        sensors={"T": {"lump": "bar", "noise": 0.003}})
    rng = np.random.default_rng(5)
    h, n, p = 5.0, 900, np.exp(-0.05)
    heater = np.repeat(rng.uniform(0.0, 4.0, n // 30), 30)
    spread = 2.0 * 0.05 / 50.0 * np.sqrt((1 - p**2) / (2 * 0.01))  # exact for one lump
    T = np.zeros(n)
    for k in range(n - 1):
        T[k + 1] = p * T[k] + (1 - p) * heater[k] / 0.5 + spread * rng.standard_normal()
    record = rt.Record(sample_time=h, inputs=heater, outputs=298.15 + T + 0.003 * rng.standard_normal(n),
                       input_names=["heater"], output_names=["T"])
    found = rt.diagnose(system, record)
    assert found.verdict == "consistent"
    assert found.nominal.levels.disturbance == pytest.approx(2.0, rel=0.15)
    assert "Nothing but noise is missing" in found.outcome.text


def test_limits_are_those_of_the_noise_not_of_the_misfit(plant: rt.System, hide: Hide, rate: Callable) -> None:
    def limit(record: rt.Record) -> float:
        return float(rt.diagnosis.score(rt.diagnosis.refit(plant, record), ["sensor_gain"]).limit[0])

    train, strange = hide(n=300)[0], hide(convection(0.6, rate), n=300)[0]
    assert rt.diagnosis.refit(plant, strange).variance > 20.0
    assert limit(strange) < 2.0 * limit(train)


def test_a_contradicted_prior_is_named(plant: rt.System, hide: Hide) -> None:
    sure = plant.model_copy(update={"fit": {name: limits.model_copy(update={"sigma": 0.01}) if "capacity" in name
                                            else limits for name, limits in plant.fit.items()}})
    found = rt.diagnose(sure, hide(n=300)[0], effects=["sensor_offset"])
    told = " ".join(found.fit.contradictions)
    assert "The prior of lumps.plate.capacity is contradicted by the records: 120 ± 0.01 declared" in told
    # leave the prior out: the records alone differ from it as much, or more, as the misfit does not raise their noise
    free = sure.model_copy(update={"fit": {name: limits.model_copy(update={"sigma": None}) if name ==
                                           "lumps.plate.capacity" else limits for name, limits in sure.fit.items()}})
    fit = rt.diagnosis.refit(free, hide(n=300)[0])
    std = np.sqrt(fit.covariance[0, 0]) * fit.system.parameter("lumps.plate.capacity")
    distance = (fit.system.parameter("lumps.plate.capacity") - 120.0) / np.hypot(std, 0.01)
    said = int(told.split(" fitted, ")[1].split()[0])
    assert 0.4 < said / distance < 1.1
    assert told in found.outcome.text and told in str(found.fit).replace("\n", " ")
    assert not rt.diagnosis.refit(plant, hide(n=300)[0]).contradictions


def test_a_parameter_at_its_bound_makes_no_error(plant: rt.System, hide: Hide) -> None:
    structure = rt.diagnosis.refit(plant, hide(n=100)[0]).structure
    ranges = structure.ranges
    beyond = 0
    for factor in np.linspace(0.9, 1.1, 40):  # some exp(log(x)) exceed x by a rounding
        upper = ranges.upper * factor
        fit = {name: limits.model_copy(update={"upper": top}) for (name, limits), top in
               zip(plant.fit.items(), upper, strict=True)}
        tight = replace(structure, ranges=replace(ranges, upper=upper), base=plant.model_copy(update={"fit": fit}))
        beyond += int(np.any(ranges.values(ranges.coordinates(upper)) > upper))
        built = tight.system(tight.bounds[1])
        assert built.parameter("lumps.plate.capacity") == pytest.approx(upper[0], rel=1e-12)
    assert beyond  # otherwise nothing was tested


# Stages


def test_stages_are_told_in_order(plant: rt.System, hide: Hide) -> None:
    told: list[str] = []
    train, validation = hide(n=200)
    rt.diagnose(plant, train, validation=validation, effects=["sensor_lag"], progress=told.append)
    assert len(told) > 4 and all(told)
    assert told.index("refitting the nominal system") < told.index("predicting the validation data")


def test_effects_without_a_place_are_no_error(plant: rt.System, hide: Hide) -> None:
    scores = rt.diagnosis.score(rt.diagnosis.refit(plant, hide(n=100)[0]), ["thomson"])
    assert scores.candidates == () and scores.order == [] and scores.not_testable == {}


def test_an_effect_that_another_stands_on_stays(plant: rt.System, hide: Hide, monkeypatch: pytest.MonkeyPatch) -> None:
    nominal = rt.diagnosis.refit(plant, hide(n=100)[0])
    mass = next(c for c in rt.diagnosis.candidates(plant, ["hidden_mass"]) if c.where == ("plate",))
    mass = mass.trials(nominal.paths[0])[0]
    warm = next(c for c in rt.diagnosis.candidates(mass.add(plant, 1.0), ["heat_source"])
                if c.where == ("plate_hidden",))
    with pytest.raises(rt.InputError):
        nominal.structure.with_effects((warm,))
    both = nominal.structure.with_effects((mass, warm))
    v = both.start(nominal.structure.ranges.values(nominal.v[:nominal.structure.n_parameters]),
                   [{"capacity": 1.0, **mass.shape}, {"heat": 0.01}])
    fit = extended(nominal, both, v, 3)
    first, second = (Accepted(nominal, best=Entry(c, fit, 100.0, 0.0)) for c in (mass, warm))
    # the heat on the hidden mass is chosen again as it was; then it is the mass's turn
    monkeypatch.setattr(_revise, "refit_short_list", lambda *a, **k: ShortList(nominal, (second.best,), {}))
    monkeypatch.setattr(_revise, "settled", lambda *a: second)
    monkeypatch.setattr(_revise, "needed", lambda rounds, last, _: (rounds, last))  # nothing is hidden in these data
    kept, _ = _revise.revised((first, second), nominal, ["heat_source"])
    assert [decision.best.candidate.key for decision in kept] == [mass.key, warm.key]


def test_choosing_again_does_not_lose_what_was_accepted(
        plant: rt.System, hide: Hide, rate: Callable, monkeypatch: pytest.MonkeyPatch) -> None:
    """Far from the truth the score of the true effect may be too low for the short list."""
    def lagged(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        return np.append(rate(T[:2], u), (T[0] - T[2]) / 15.0)

    train, _ = hide(lagged, extra_states=1, read=lambda T: T[:, [2, 1]], n=200)
    names = ["sensor_lag", "heat_source"]
    nominal = rt.diagnosis.refit(plant, train)
    decision = rt.diagnosis.decide(rt.diagnosis.refit_short_list(nominal, rt.diagnosis.score(nominal, names)))
    assert decision.best is not None and decision.best.candidate.label == "sensor_lag(Tp)"
    rivals = rt.diagnosis.refit_short_list(nominal, rt.diagnosis.score(nominal, ["heat_source"])).entries
    assert rivals
    for listed in ((), rivals):
        monkeypatch.setattr(_revise, "refit_short_list", lambda *a, ls=listed, **k: ShortList(nominal, ls, {}))
        (kept,), fit = _revise.revised((decision,), nominal, names)
        assert kept.best is not None and kept.best.candidate.label == "sensor_lag(Tp)" and fit is kept.best.fit
        assert kept.best.values["time_constant"][0] == pytest.approx(15.0, rel=0.1)


# Effects that are not needed in the end


def test_only_what_explains_something_is_kept(plant: rt.System, hide: Hide, rate: Callable, monkeypatch) -> None:
    fit = rt.diagnosis.refit(plant, hide(convection(0.3, rate))[0])
    decision = rt.diagnosis.decide(rt.diagnosis.refit_short_list(fit, rt.diagnosis.score(fit)))
    idle = next(c for c in rt.diagnosis.candidates(plant, ["sensor_lag"]))
    beside = decision.best.fit.structure.with_effect(idle)
    v = beside.carried(decision.best.fit.structure, decision.best.fit.v,
                       [*decision.best.fit.structure.quantities(decision.best.fit.v), {"time_constant": 1e-3}])
    both = extended(decision.best.fit, beside, v)
    rounds = (decision, replace(decision, best=Entry(idle, both, 50.0, 1e-9)))
    kept, less = _revise.needed(rounds, both, fit)
    assert [one.best.candidate.key for one in kept] == [decision.best.candidate.key]
    assert [one.key for one in less.structure.effects] == [decision.best.candidate.key]
    assert kept[-1].best.fit is less

    def lost(*_: object) -> None:
        raise rt.Diverged("runs away", time=1.0)

    monkeypatch.setattr(_revise, "extended", lost)
    kept, same = _revise.needed(rounds, both, fit)  # what does not survive without an effect needs it
    assert kept == rounds and same is both
