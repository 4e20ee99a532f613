"""Simultaneous ranges of parameters: the truth is inside in at least 95 % of repetitions; what is open is said."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import f, norm
from sequential import probable

import robthermal as rt
from robthermal.errors import InputError
from robthermal.thermal import FitRange

CAPACITY, CONDUCTANCE, GAIN, OFFSET = "lumps.bar.capacity", "links.bar-room.conductance", "inputs.q.drive.gain", \
    "sensors.T.offset"
TRUTH = {CAPACITY: 60.0, CONDUCTANCE: 0.4, GAIN: 1.0, OFFSET: 0.3}
BOUNDS = {CAPACITY: (6.0, 600.0), CONDUCTANCE: (0.04, 4.0)}
N, NOISE = 100, 0.1


def bar(**parameters: float) -> rt.System:
    system = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 60.0, "initial": 295.0}},
                       links=[{"between": ("bar", "room"), "conductance": 0.4}],
                       inputs={"q": {"lump": "bar", "drive": {"gain": 1.0}}},
                       sensors={"T": {"lump": "bar", "noise": NOISE, "offset": 0.0}})
    return system.with_parameters(parameters)


CLEAN = rt.thermal.simulate(bar(**{OFFSET: TRUTH[OFFSET]}), rt.Record(
    sample_time=10.0, inputs=np.repeat(np.random.default_rng(0).uniform(0, 10, 10), 10), outputs=np.zeros((N, 0)),
    input_names=["q"], output_names=[]))


def noisy(seed: int, pole: float = 0.0, clean: rt.Record = CLEAN) -> rt.Record:
    white = np.random.default_rng(seed).standard_normal(len(clean) + 200)
    colored = lfilter([math.sqrt(1 - pole**2)], [1.0, -pole], white)[200:]
    return clean.with_outputs(clean.outputs + NOISE * colored[:, None])


def calibrated(seed: int, pole: float = 0.0, **options: object) -> rt.calibration.Fit:
    start = bar(**{CAPACITY: 62.0, CONDUCTANCE: 0.41, OFFSET: TRUTH[OFFSET]})
    return rt.calibrate(start, noisy(seed, pole), parameters=BOUNDS, initial="system", **options)


def inside(fit: rt.calibration.Estimates, shape: str = "ellipsoid") -> bool:
    """Whether every true value is inside its range."""
    return all(low <= TRUTH[name] <= high for name, (low, high) in fit.ranges(0.95, shape).items())


def covers(happens: Callable[[int], bool]) -> bool:
    """In 95 % of repetitions rather than in 85 %: wrong with a chance of 1 in 200 either way."""
    return probable(happens, least=0.95, not_below=0.85)


@pytest.mark.exhaustive
def test_white_noise() -> None:
    fit = cache(calibrated)
    assert covers(lambda seed: inside(fit(seed)))
    assert covers(lambda seed: inside(fit(seed), "box"))
    scales = [fit(seed).covariance_scale for seed in range(fit.cache_info().currsize)]
    assert sum(scale > 1.5 for scale in scales) <= 0.06 * len(scales)  # blocks of white noise: 1 %, if that


@pytest.mark.exhaustive
def test_colored_noise() -> None:
    """Pole 0.8: a hundred readings are eleven independent ones, and 1.96 deviations cover far less often."""
    fit = cache(lambda seed: calibrated(seed, 0.8))

    def single(seed: int) -> bool:
        return all(abs(fit(seed).parameters[name] - TRUTH[name]) < 1.96 * std for name, std in fit(seed).std.items())

    assert covers(lambda seed: inside(fit(seed))) and not covers(single)
    scales = [fit(seed).covariance_scale for seed in range(fit.cache_info().currsize)]
    assert sum(scale > 2.0 for scale in scales) <= 0.06 * len(scales)


@pytest.mark.exhaustive
def test_one_undetermined_direction() -> None:
    """Capacity, conductance and gain have a common factor; the offset beside them is determined."""
    bounds = BOUNDS | {GAIN: (0.5, 2.0), OFFSET: (-5.0, 5.0)}

    def fit(seed: int) -> rt.calibration.Fit:
        start = np.random.default_rng(1000 + seed).uniform(0.7, 1.4)  # where along the direction the search begins
        return rt.calibrate(bar(**{CAPACITY: 60.0 * start, CONDUCTANCE: 0.4 * start, GAIN: start}), noisy(seed),
                            parameters=bounds, initial="system")

    one = fit(0)
    assert one.undetermined_parameters == (CAPACITY, CONDUCTANCE, GAIN)
    assert one.outcome.code == "undetermined"
    ranges = one.ranges()
    assert all(ranges[name] == bounds[name] for name in one.undetermined_parameters)
    low, high = ranges[OFFSET]
    assert 0.05 < high - low < 0.5
    assert one.range_table()["determined"].to_dict() == {CAPACITY: False, CONDUCTANCE: False, GAIN: False, OFFSET: True}
    assert covers(lambda seed: inside(fit(seed)))


@pytest.mark.exhaustive
def test_a_prior_closes_the_direction() -> None:
    """The prior is what is known before: its center scatters about the truth with its standard deviation."""
    sigma = 0.05

    def fit(seed: int) -> rt.calibration.Fit:
        gain = 1.0 + sigma * np.random.default_rng(2000 + seed).standard_normal()
        return rt.calibrate(bar(**{GAIN: gain, OFFSET: TRUTH[OFFSET]}), noisy(seed), initial="system", parameters={
            **{name: FitRange(lower=low, upper=high) for name, (low, high) in BOUNDS.items()},
            GAIN: FitRange(lower=0.2, upper=5.0, sigma=sigma)})

    one = fit(0)
    assert GAIN in one.undetermined_parameters and not one.bounded.any()
    low, high = one.ranges()[GAIN]
    assert 2 * 1.96 * sigma < high - low < 2 * 3.2 * sigma
    assert covers(lambda seed: inside(fit(seed)))


def test_a_prior_of_one_parameter_does_not_stand_for_another() -> None:
    """Two gains that act alike, one with a prior: the other is open only in the sum's sense, and both are covered."""
    two = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 60.0, "initial": 295.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.4, "name": "one"},
                           {"between": ("bar", "room"), "conductance": 0.4, "name": "two"}],
                    inputs={"q": {"lump": "bar"}}, sensors={"T": {"lump": "bar", "noise": NOISE}})
    bounds = {"links.one.conductance": FitRange(lower=0.01, upper=4.0, sigma=0.02),
              "links.two.conductance": FitRange(lower=0.01, upper=4.0)}
    fit = rt.calibrate(two, noisy(0, clean=rt.thermal.simulate(two, CLEAN)), parameters=bounds, initial="system")
    one, other = fit.ranges()["links.one.conductance"], fit.ranges()["links.two.conductance"]
    assert set(fit.undetermined_parameters) == set(bounds) and not fit.bounded.any()
    assert 0.06 < one[1] - one[0] < 0.2 and 0.06 < other[1] - other[0] < 0.2
    assert one[0] < 0.4 < one[1] and other[0] < 0.4 < other[1]
    free = rt.calibrate(two, noisy(0, clean=rt.thermal.simulate(two, CLEAN)), initial="system",
                        parameters={name: (0.01, 4.0) for name in bounds})
    assert all(ends == (0.01, 4.0) for ends in free.ranges().values())


@pytest.mark.exhaustive
def test_frequency_response() -> None:
    drive = np.random.default_rng(5).choice([0.0, 8.0], 400)
    run = rt.thermal.simulate(bar(), rt.Record(sample_time=20.0, inputs=drive, outputs=np.zeros((400, 0)),
                                               input_names=["q"], output_names=[]))

    def fit(seed: int) -> rt.calibration.Fit:
        G = rt.identify.lpm(noisy(seed, clean=run))
        return rt.calibrate(bar(**{CAPACITY: 62.0}), G, parameters=BOUNDS)

    one = fit(0)
    assert one.covariance_scale >= 1.0 and one.degrees_of_freedom > 10
    assert covers(lambda seed: inside(fit(seed)))


def test_numbers_of_a_linear_problem_with_known_covariance() -> None:
    """One offset, white noise: the interval is that of the mean of N readings, by Student's t."""
    fit = rt.calibrate(bar(), noisy(3), parameters={OFFSET: (-5.0, 5.0)}, initial="system")
    low, high = fit.ranges(0.9)[OFFSET]
    nu = fit.degrees_of_freedom
    assert nu == pytest.approx(N - 1, abs=0.01)
    e = noisy(3).outputs[:, 0] - CLEAN.outputs[:, 0] + TRUTH[OFFSET]
    expected = math.sqrt(f.ppf(0.9, 1, nu)) * e.std(ddof=1) / math.sqrt(N)
    assert (low + high) / 2 == pytest.approx(e.mean(), abs=1e-6)
    assert (high - low) / 2 == pytest.approx(expected, rel=0.01)


def test_positive_parameters_stay_positive_and_ranges_grow_with_confidence() -> None:
    fit = calibrated(1)
    narrow, wide = fit.ranges(0.5), fit.ranges(0.999)
    for name, (low, high) in wide.items():
        assert 0 < low < narrow[name][0] < fit.parameters[name] < narrow[name][1] < high
        assert low * high == pytest.approx(fit.parameters[name] ** 2)  # symmetric in the logarithm
    box = fit.ranges(set="box")
    assert all(fit.ranges()[name][0] < box[name][0] < box[name][1] < fit.ranges()[name][1] for name in box)
    single = norm.ppf(0.975) * fit.std[CAPACITY]
    assert box[CAPACITY][1] - fit.parameters[CAPACITY] > single


@pytest.mark.exhaustive
def test_a_parameter_at_its_bound_has_a_range_from_the_bound() -> None:
    """Truth at the bound, so that half of the estimates run into it: both true values are inside as often."""
    bounds = {CAPACITY: (60.0, 600.0), CONDUCTANCE: (0.04, 4.0)}

    def fit(seed: int) -> rt.calibration.Fit:
        return rt.calibrate(bar(**{CAPACITY: 62.0, OFFSET: TRUTH[OFFSET]}), noisy(seed), parameters=bounds,
                            initial="system")

    fits = [fit(seed) for seed in range(20)]
    stuck = [one for one in fits if one.at_bound[0]]
    assert 5 <= len(stuck) <= 15
    for one in stuck:
        low, high = one.ranges()[CAPACITY]
        assert low == 60.0 and 60.1 < high < 66.0
        assert one.range_table().loc[CAPACITY, "ends_at"] == "lower bound"
    assert covers(lambda seed: inside(fits[seed] if seed < len(fits) else fit(seed)))


def test_larger_misfit_in_some_blocks_widens_the_ranges() -> None:
    """A load that is on for a while: no autoregression of all residuals describes it."""
    def disturbed(size: float) -> rt.calibration.Fit:
        run = noisy(0)
        extra = np.zeros((N, 1))
        extra[70:90] = size
        start = bar(**{OFFSET: TRUTH[OFFSET]})
        return rt.calibrate(start, run.with_outputs(run.outputs + extra), parameters=BOUNDS, initial="system")

    calm, load = disturbed(0.0), disturbed(1.0)
    wide, narrow = load.ranges()[CAPACITY], calm.ranges()[CAPACITY]
    assert wide[1] - wide[0] > 4 * (narrow[1] - narrow[0])
    assert calm.covariance_scale < 1.1 < load.covariance_scale


def test_tied_parameters_have_one_range_each() -> None:
    two = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 60.0, "initial": 295.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.2, "name": "one"},
                           {"between": ("bar", "room"), "conductance": 0.2, "name": "two"}],
                    inputs={"q": {"lump": "bar"}}, sensors={"T": {"lump": "bar", "noise": NOISE}})
    names = ("links.one.conductance", "links.two.conductance")
    fit = rt.calibrate(two, noisy(0, clean=rt.thermal.simulate(two, CLEAN)), parameters={names: (0.01, 4.0)},
                       initial="system")
    assert fit.ranges()[names[0]] == fit.ranges()[names[1]]
    assert list(fit.ranges()) == list(names)


def test_ranges_are_written() -> None:
    fit = calibrated(2)
    said = json.loads(json.dumps(fit.to_dict()))
    assert said["ranges"] == {name: list(ends) for name, ends in fit.ranges(0.95).items()}
    assert said["undetermined_parameters"] == []


def test_bad_input_is_refused() -> None:
    fit = calibrated(2)
    for confidence in (0.0, 1.0, 95, True, "0.95"):
        with pytest.raises(InputError, match="confidence is"):
            fit.ranges(confidence)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="set is 'sphere'"):
        fit.ranges(set="sphere")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="did not converge.*max_iterations"):
        calibrated(2, max_iterations=1).ranges()
    assert calibrated(2, max_iterations=1).to_dict()["ranges"] is None
