"""Records and frequency responses in one calibration; the machine is an own integration with scipy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.stats import binom

import robthermal as rt
from robthermal.errors import InputError

Array = NDArray[np.float64]
STEP, NOISE, ROOM = 5.0, 0.1, 295.0
TRUTH = {"lumps.a.capacity": 60.0, "links.a-b.conductance": 1.5, "links.b-room.conductance": 0.8}
START = {"lumps.a.capacity": 45.0, "links.a-b.conductance": 2.2, "links.b-room.conductance": 0.6}
RANGES = {name: (0.1 * value, 10.0 * value) for name, value in TRUTH.items()}


def system(**parameters: float) -> rt.System:
    """Heated lump a, lump b, room; sensors on both."""
    return rt.System(
        ambients={"room": {"temperature": ROOM}}, lumps={"a": {"capacity": 60.0}, "b": {"capacity": 90.0}},
        links=[{"between": ("a", "b"), "conductance": 1.5}, {"between": ("b", "room"), "conductance": 0.8}],
        inputs={"q": {"lump": "a"}}, sensors={"Ta": {"lump": "a", "noise": NOISE}, "Tb": {"lump": "b", "noise": NOISE}},
    ).with_parameters(START | parameters)


def temperatures(heat: Array, values: Array) -> Array:
    """Zero-order hold of C dT/dt = balance by the matrix exponential, from the room's temperature, (n, 2)."""
    Ca, Gab, Gb = values
    A = np.array([[-Gab / Ca, Gab / Ca, 1 / Ca], [Gab / 90.0, -(Gab + Gb) / 90.0, 0.0], [0.0, 0.0, 0.0]])
    F = expm(A * STEP)
    x, out = np.zeros(2), np.empty((len(heat), 2))
    for k, q in enumerate(heat):
        out[k] = x
        x = F[:2, :2] @ x + F[:2, 2] * q
    return out + ROOM


def record(seed: int, n: int, values: Array | None = None) -> rt.Record:
    rng = np.random.default_rng(seed)
    heat = np.repeat(rng.uniform(0.0, 10.0, -(-n // 4)), 4)[:n]
    clean = temperatures(heat, np.array(list(TRUTH.values())) if values is None else values)
    return rt.Record(sample_time=STEP, inputs=heat, outputs=clean + NOISE * rng.standard_normal(clean.shape),
                     input_names=["q"], output_names=["Ta", "Tb"], name=f"run {seed}")


def response(seed: int, n: int, values: Array | None = None) -> rt.identify.FrequencyResponse:
    poles = [-float(x) for x in 1.0 / rt.thermal.time_constants(system(**TRUTH))["time constant [s]"]]
    return rt.identify.lrmp(record(seed, n, values), poles=poles)


def test_what_both_know_adds_up() -> None:
    """Joint standard deviations are below each alone, and those of the summed information, to 1 %."""
    run, G = record(0, 3000), response(1, 3000)
    alone = [rt.calibrate(system(), one, parameters=RANGES) for one in (run, G)]
    both = rt.calibrate(system(), [G, run], parameters=RANGES)
    assert both.outcome.code == "converged" and len(both.residuals) == len(both.responses) == 1
    known = sum(np.linalg.inv(fit.covariance) for fit in alone)
    expected = np.sqrt(np.diag(np.linalg.inv(known)))
    stated = np.array(list(both.std.values()))
    np.testing.assert_allclose(stated, expected, rtol=0.01)
    for fit in alone:
        assert np.all(stated < np.array(list(fit.std.values())))
    weighted = np.linalg.solve(known, sum(np.linalg.inv(fit.covariance) @ list(fit.parameters.values())
                                          for fit in alone))  # the estimate of least variance from the two
    np.testing.assert_array_less(np.abs(np.array(list(both.parameters.values())) - weighted), 0.1 * expected)


def test_information_of_the_record_is_that_of_own_derivatives() -> None:
    """Fisher information of white noise, J'J/s², with J by differences of the own integration."""
    run = record(0, 3000)
    fit = rt.calibrate(system(), [run], parameters=RANGES, initial="measured")
    values = np.array(list(fit.parameters.values()))
    J = np.stack([(temperatures(run["q"], values + h) - temperatures(run["q"], values - h)).ravel() / (2 * h.max())
                  for h in 1e-4 * np.diag(values)], axis=1)
    own = np.linalg.inv(J.T @ J) * NOISE**2
    np.testing.assert_allclose(list(fit.std.values()), np.sqrt(np.diag(own)), rtol=0.05)


@pytest.mark.exhaustive
def test_ranges_cover_the_truth_and_the_estimates_are_those_of_least_variance() -> None:
    """95 % ranges of both kinds together, 40 repetitions, bound at a chance of 0.1 %; scatter as stated."""
    count, truth = 40, np.array(list(TRUTH.values()))
    fits = [rt.calibrate(system(**TRUTH), [record(2 * k, 120), response(2 * k + 1, 300)], parameters=RANGES)
            for k in range(count)]
    inside = sum(all(low <= TRUTH[name] <= high for name, (low, high) in fit.ranges(0.95).items()) for fit in fits)
    assert inside >= binom.ppf(1e-3, count, 0.95)
    error = np.sqrt(np.mean([(np.array(list(fit.parameters.values())) / truth - 1.0) ** 2 for fit in fits], axis=0))
    stated = np.sqrt(np.mean([(np.array(list(fit.std.values())) / truth) ** 2 for fit in fits], axis=0))
    assert np.all((stated / error > 0.75) & (stated / error < 1.35))  # 40 repetitions know a deviation to 11 %
    alone = [rt.calibrate(system(), data, parameters=RANGES) for data in (record(0, 120), response(1, 300))]
    known = np.linalg.inv(sum(np.linalg.inv(fit.covariance) for fit in alone))
    assert np.all(error < 1.3 * np.sqrt(np.diag(known)) / truth)


def test_several_responses_each_at_its_operating_point() -> None:
    """Radiation seen at two temperatures: each response is linearized at the means of its own record."""
    hot = rt.System(ambients={"room": {"temperature": ROOM}}, lumps={"a": {"capacity": 50.0}},
                    links=[{"between": ("a", "room"), "radiation": 2e-9}], inputs={"q": {"lump": "a"}},
                    sensors={"T": {"lump": "a"}})

    def measured(heat: float, seed: int) -> rt.identify.FrequencyResponse:
        rng, T, out = np.random.default_rng(seed), (ROOM**4 + heat / 2e-9) ** 0.25, np.empty(1200)
        q = heat + np.repeat(rng.uniform(-1.0, 1.0, 300), 4)
        for k in range(1200):  # exact to rounding at a hundredth of the sample time
            out[k] = T
            for _ in range(20):
                middle = T + 0.5 * (q[k] - 2e-9 * (T**4 - ROOM**4)) / 50.0
                T += (q[k] - 2e-9 * (middle**4 - ROOM**4)) / 50.0
        readings = out + 0.002 * rng.standard_normal(1200)
        return rt.identify.lpm(rt.Record(sample_time=20.0, inputs=q, outputs=readings, input_names=["q"],
                                         output_names=["T"]))

    pair = [measured(5.0, 0), measured(40.0, 1)]
    ranges = {"links.a-room.radiation": (1e-10, 1e-8), "lumps.a.capacity": (10.0, 200.0)}
    fit = rt.calibrate(hot.with_parameters({"links.a-room.radiation": 1e-9}), pair, parameters=ranges)
    assert [round(one.operating_point["q"]) for one in fit.responses] == [5, 40]
    assert fit.parameters["links.a-room.radiation"] == pytest.approx(2e-9, rel=0.01)
    assert fit.parameters["lumps.a.capacity"] == pytest.approx(50.0, rel=0.01)
    assert fit.misfit < 1.5 and np.isnan(rt.calibrate(system(), record(0, 200), parameters=RANGES).misfit)


def test_validation_by_either_kind() -> None:
    run, G, wrong = record(0, 400), response(1, 600), response(2, 600)
    fit = rt.calibrate(system(), [run, G], parameters=RANGES, validation=[record(3, 300), wrong])
    assert max(fit.validation_rmse.values()) < 1.5 * NOISE and 0.6 < fit.validation_responses[0].misfit < 1.5
    beside = rt.calibrate(system(), run, parameters=RANGES, validation=response(4, 600, np.array([40.0, 1.5, 0.5])))
    assert beside.validation == () and beside.validation_responses[0].misfit > 3.0
    with pytest.raises(InputError, match="the validation response .* is the training response"):
        rt.calibrate(system(), [run, G], parameters=RANGES, validation=G)


def test_a_response_of_another_machine_widens_the_ranges_and_shows() -> None:
    run = record(0, 400)
    good, bad = (rt.calibrate(system(), [run, response(5, 600, values)], parameters=RANGES)
                 for values in (None, np.array([40.0, 1.5, 0.5])))
    assert good.misfit < 1.5 < 3.0 < bad.misfit and bad.covariance_scale >= bad.misfit
    assert "misfit" in str(bad) and "run 0" in str(bad)


def test_a_prior_is_weighed_against_a_response() -> None:
    """A prior of a tenth of what the response knows decides; one of ten times does not count."""
    G = response(1, 600)
    free = rt.calibrate(system(), G, parameters=RANGES)
    name = "links.b-room.conductance"
    low, high = RANGES[name]
    for part in (0.1, 10.0):
        sigma = part * free.std[name]
        fit = rt.calibrate(system(), G, parameters=RANGES | {
            name: rt.thermal.FitRange(lower=low, upper=high, sigma=sigma)})
        expected = 1.0 / np.hypot(1.0 / sigma, 1.0 / free.std[name])
        assert fit.std[name] == pytest.approx(expected, rel=0.15 if part < 1 else 0.02)


def test_glitches_of_a_record_do_not_touch_the_response() -> None:
    run = record(0, 400)
    spoiled = run.outputs.copy()
    spoiled[::40] += 3.0
    fit = rt.calibrate(system(), [run.with_outputs(spoiled), response(1, 600)], parameters=RANGES, loss="huber")
    assert set(fit.parameters) == set(TRUTH)
    for name, value in fit.parameters.items():
        assert value == pytest.approx(TRUTH[name], rel=0.05)


def test_bad_input_is_named() -> None:
    run, G = record(0, 200), response(1, 400)
    for match, data, options in (
            ("operating_point is given with a record", run, {"operating_point": {"q": 1.0}}),
            ("there is no input 'heat'", [run, G], {"operating_point": {"heat": 1.0}}),
            ("data holds a float", [run, 1.0], {}), ("data holds a ndarray, a response without", np.ones(3), {}),
            ("data is an empty list", [], {}), ("loss is given with a frequency response", G, {"loss": "huber"}),
            ("no influence on the frequency", G, {"parameters": {"sensors.Ta.offset": (-1.0, 1.0)}})):
        with pytest.raises(InputError, match=match):
            rt.calibrate(system(), data, **({"parameters": RANGES} | options))


def response_with(gram: Array) -> rt.identify.FrequencyResponse:
    """Responses of both sensors to heater and room at three frequencies, as the truth has them, gram (2, 2, 3)."""
    f = np.array([1e-4, 5e-4, 2e-3])
    Ca, Gab, Gb = TRUTH.values()
    A = np.array([[-Gab / Ca, Gab / Ca], [Gab / 90.0, -(Gab + Gb) / 90.0]])
    B = np.array([[1.0 / Ca, 0.0], [0.0, Gb / 90.0]])
    F = expm(np.block([[A, B], [np.zeros((2, 4))]]) * STEP)
    G = [np.linalg.solve(np.exp(2j * np.pi * one * STEP) * np.eye(2) - F[:2, :2], F[:2, 2:]) for one in f]
    return rt.identify.FrequencyResponse(frequencies=f, response=np.moveaxis(G, 0, -1), gram=gram,
                                noise_covariance=np.repeat(np.eye(2)[:, :, None] * 1e-6, 3, axis=2),
                                degrees_of_freedom=np.full(3, 50), input_names=["q", "room"], output_names=["Ta", "Tb"],
                                sample_time=STEP, half_width=0, n_samples=20000, method="own",
                                operating_point={"q": 5.0, "room": ROOM})


def test_bins_in_which_an_input_is_not_excited_are_left_out() -> None:
    """A multisine has nothing between its frequencies but rounding: such a bin is no reason to refuse the others."""
    gram = np.repeat(np.eye(2)[:, :, None], 3, axis=2)
    gram[1, 1, 1] = 1e40
    fit = rt.calibrate(system(), response_with(gram), parameters=RANGES)
    assert fit.outcome and fit.responses[0].bins.size == 2
    for name, value in TRUTH.items():
        assert abs(fit.parameters[name] - value) < 4.0 * fit.std[name]
    gram[1, 1, :] = 1e40
    with pytest.raises(InputError, match="no bin of the frequency response.*Excite every input"):
        rt.calibrate(system(), response_with(gram), parameters=RANGES)
