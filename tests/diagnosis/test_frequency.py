"""Diagnosis of frequency responses estimated from records of an independent integrator."""

from __future__ import annotations

from collections.abc import Callable

import control
import numpy as np
import pytest
from numpy.typing import NDArray

import robthermal as rt
from robthermal.diagnosis.data import as_measured
from robthermal.diagnosis.evidence._frequency_tails import inflation, relative_degrees_of_freedom, tail
from robthermal.diagnosis.path._linearized_response import slope
from robthermal.fitting import as_complex, as_real
from robthermal.fitting._response_whitening import kept_bins

Array = NDArray[np.float64]
Measure = Callable[..., rt.identify.FrequencyResponse]
NAMES, SENSORS = ["heater", "room"], ["Tp", "Tb"]
TRUE = {"lumps.plate.capacity": 123.0, "lumps.block.capacity": 39.0, "links.plate-room.conductance": 0.62,
        "links.plate-block.conductance": 1.45, "links.block-room.conductance": 0.105}


def excited(n: int, seed: int) -> Array:
    """Heater and room held for four samples: rough spectra."""
    rng = np.random.default_rng(seed)
    return np.repeat(np.column_stack([rng.choice([0.0, 3.0, 7.0, 11.0], n // 4), 298.15 + rng.normal(0, 2.0, n // 4)]),
                     4, axis=0)


@pytest.fixture(scope="session")
def response(integrated: Callable[..., Array], recorded: Callable[..., rt.Record], rate: Callable[..., Array]
             ) -> Measure:
    def measure(seed: int, law: Callable[..., Array] | None = None, states: int = 2,
                read: Callable[[Array], Array] = lambda T: T[:, :2]) -> rt.identify.FrequencyResponse:
        u = excited(1200, seed)
        T = integrated(law or (lambda t, x, u: rate(x, u)), np.full(states, 298.15), u, 4)
        return rt.identify.lpm(recorded(read(T), u, NAMES, SENSORS, seed))

    return measure


@pytest.fixture(scope="module")
def plain(response: Measure) -> rt.identify.FrequencyResponse:
    return response(1)


def labels(found: rt.diagnosis.Diagnosis) -> list[str]:
    return [effect.label for effect in found.effects]


def test_nothing_hidden_is_consistent(plant: rt.System, plain: rt.identify.FrequencyResponse,
                                      response: Measure) -> None:
    found = rt.diagnose(plant, plain, validation=response(2))
    assert found.verdict == "consistent" and not found.effects
    assert found.gap["train"].unit == "standard deviations"
    assert found.gap["train"].after == pytest.approx(1.0, abs=0.1)
    assert found.gap["validation"].after == pytest.approx(1.0, abs=0.15)
    assert "constant" in found.not_testable["heat_source", ("plate",)]
    assert "time-invariant" in found.not_testable["conductance_step", ("plate-room",)]
    for name, value in TRUE.items():
        assert found.system.parameter(name) == pytest.approx(value, rel=0.08)


def test_hidden_mass_is_named_and_located(plant: rt.System, response: Measure, rate: Callable) -> None:
    C, tau = 25.0, 90.0

    def hidden(t: float, x: Array, u: Array) -> Array:
        flow = C / tau * (x[2] - x[0])
        return np.append(rate(x[:2], u, np.array([flow, 0.0])), -flow / C)

    found = rt.diagnose(plant, response(1, hidden, 3), effects=[
        "hidden_mass", "sensor_lag", "input_lag", "missing_ambient_link", "sensor_gain", "input_gain"])
    assert found.verdict == "named" and labels(found) == ["hidden_mass(plate)"]
    capacity, std, _ = found.effects[0].values["capacity"]
    assert abs(capacity - C) < 4 * std
    assert found.gap["train"].before > 1.3 > 1.1 > found.gap["train"].after
    assert any(line.startswith("Tp/heater: largest between") for line in found.located.conditions)
    assert found.to_dict()["gap"]["train"]["unit"] == "standard deviations"
    assert found.plot().size == 2


def test_sensor_lag_is_named(plant: rt.System, response: Measure, rate: Callable) -> None:
    def lagged(t: float, x: Array, u: Array) -> Array:
        return np.append(rate(x[:2], u), (x[1] - x[2]) / 20.0)

    found = rt.diagnose(plant, response(1, lagged, 3, read=lambda T: T[:, [0, 2]]))
    assert found.verdict == "named" and labels(found) == ["sensor_lag(Tb)"]
    value, std, _ = found.effects[0].values["time_constant"]
    assert abs(value - 20.0) < 4 * std and std < 0.5


def test_missing_link_is_found_with_what_one_operating_point_cannot_exclude(plant: rt.System, response: Measure,
                                                                            rate: Callable) -> None:
    closed = plant.model_copy(update={
        "links": tuple(link for link in plant.links if link.name != "block-room"),
        "fit": {name: limits for name, limits in plant.fit.items() if "block-room" not in name}})

    def leaky(t: float, T: Array, u: Array) -> Array:
        return rate(T, u, np.array([0.0, 0.3 * (u[1] - T[1])]))

    found = rt.diagnose(closed, response(1, leaky), operating_point={"heater": 5.25},
                        effects=["missing_ambient_link", "natural_convection", "radiation", "sensor_gain"])
    assert found.verdict == "ambiguous"  # one operating point: a conductance, or the slope of a convection there
    others = {f"{effect}({', '.join(where)})" for effect, where in found.alternatives[0]}
    assert {"missing_ambient_link(block, room)", "natural_convection(block, room)"} == {*labels(found), *others}


def test_outside_the_catalog_is_not_named(plant: rt.System, response: Measure, rate: Callable) -> None:
    def diffusive(t: float, x: Array, u: Array) -> Array:  # a semi-infinite rod on the block, ten cells
        rod = x[2:]
        into = 3.0 * np.diff(np.concatenate([[x[1]], rod]))
        flow = np.append(-into, 0.0)  # from cell to cell
        return np.concatenate([rate(x[:2], u, np.array([0.0, -flow[0]])), (flow[:-1] - flow[1:]) / 8.0])

    found = rt.diagnose(plant, response(1, diffusive, 12), effects=["sensor_lag", "input_lag", "missing_ambient_link",
                                                                    "sensor_gain"])
    assert found.verdict == "unexplained" and not found.effects
    assert min(found.located.lumps.values()) < 1e-6
    assert found.unknown_heat is None and found.next_experiment is None


def test_records_and_responses_together(plant: rt.System, plain: rt.identify.FrequencyResponse,
                                        hide: Callable[..., tuple[rt.Record, rt.Record]]) -> None:
    found = rt.diagnose(plant, [plain, hide(n=300)[0]], effects=["sensor_lag", "missing_ambient_link", "heat_source"])
    assert found.verdict == "consistent"
    assert found.gap["train"].unit == "K"
    assert {"Tp", "Tb", "Tp/heater", "Tb/room"} <= set(found.located.sensors)
    assert ("heat_source", ("plate",)) not in found.not_testable  # the record would have shown it


def test_whitener_makes_the_errors_of_the_estimate_white(plant: rt.System, recorded: Callable) -> None:
    # Monte Carlo of the estimator where the true response is 0: power of its whitened errors along smooth and rough
    # laws of frequency. Without the covariance between bins the smooth ones would have twice the power.
    record = recorded(np.zeros((240, 2)), excited(240, 5), NAMES, SENSORS, 0)
    rng = np.random.default_rng(3)
    smooth, rough = [], []
    for _ in range(80):
        G = rt.identify.lpm(record.with_outputs(rng.standard_normal((240, 2))), degree=1, half_width=10)
        data = as_measured(plant, G, "records")[0]
        n = len(data.index)
        law = np.cos(np.pi * np.outer(np.arange(n) + 0.5, np.arange(n)) / n) * np.sqrt(2.0 / n)  # of unit length
        part = np.einsum("kf,pkm->pfm", law, data.white(data.readings).reshape(2, n, -1)) ** 2
        smooth.append(part[:, 1:4].mean())
        rough.append(part[:, -4:].mean())
    assert np.mean(smooth) == pytest.approx(1.0, abs=0.15)
    assert np.mean(rough) == pytest.approx(1.0, abs=0.15)


def test_whitening_of_known_noise_is_exact(plain: rt.identify.FrequencyResponse, plant: rt.System) -> None:
    data = as_measured(plant, plain, "records")[0]
    n, m = data.white.roots.shape[:2]
    index, factor = kept_bins(plain, np.flatnonzero(~plain.suspect)[20:], np.array([0, 1]))
    s = factor @ factor.conj().T
    joint = plain.joint_covariance(index).reshape(len(index), 2, 2, len(index), 2, 2)
    level = plain.noise_covariance[1, 1, index].real
    again = joint[:, :, 1, :, :, 1] / (0.5 * (level[:, None] + level))[:, None, :, None]  # of the other output
    assert np.allclose(again.reshape(s.shape), s, atol=1e-9 * np.abs(s).max())
    columns = np.eye(2 * n * m)[:, ::97].reshape(2 * n, m, -1)
    z = as_complex(data.white(columns).reshape(2 * n, m, -1)).reshape(n * m // 2, -1)
    back = data.white.factor @ z / np.sqrt(2.0)  # L z = √2 roots r
    assert np.allclose(as_real(np.linalg.solve(data.white.roots, back.reshape(n, m, -1))), columns, atol=1e-8)


def test_scores_of_a_wishart_estimate_have_the_stated_mean_and_tails() -> None:
    # |gᴴC⁻¹e|²/gᴴC⁻¹g with C = W/q against q/(q-p) · q/(q-p+1), and its kurtosis against Student's t.
    rng = np.random.default_rng(1)
    q, p, n = 12, 2, 40000
    X = (rng.standard_normal((n, q, p)) + 1j * rng.standard_normal((n, q, p))) / np.sqrt(2.0)
    e = (rng.standard_normal((n, p)) + 1j * rng.standard_normal((n, p))) / np.sqrt(2.0)
    inverse = np.linalg.inv(X.conj().transpose(0, 2, 1) @ X / q)
    score = (inverse[:, 0] * e).sum(axis=1) / np.sqrt(inverse[:, 0, 0].real)
    mean = float(np.mean(np.abs(score) ** 2))
    assert mean == pytest.approx(q / (q - p) * q / (q - p + 1), rel=0.03)
    t = score.real / np.sqrt(mean / 2.0)
    nu = 2 * (q - p + 1)
    assert np.mean(t**4) == pytest.approx(3.0 + 6.0 / (nu - 4), rel=0.06)


def test_corrections_reduce_to_one_for_records(plant: rt.System, hide: Callable) -> None:
    fit = rt.diagnosis.refit(plant, hide(n=100)[0])
    U = np.linalg.qr(np.random.default_rng(0).standard_normal((fit.z.size, 3)))[0]
    assert np.all(inflation(fit, U) == 1.0) and np.all(np.isinf(tail(fit, U)))
    assert relative_degrees_of_freedom(fit, U) == 1.0


def test_slopes_are_the_derivative_of_a_closed_form() -> None:
    bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
                    sensors={"T": {"lump": "bar", "noise": 0.05}}, fit={"links.bar-room.conductance": {
                        "lower": 0.1, "upper": 2.0}})
    u = np.random.default_rng(0).standard_normal((400, 1))
    drive = rt.Record(sample_time=10.0, inputs=u, outputs=np.zeros((400, 0)), input_names=["heater"], output_names=[])
    run = rt.thermal.simulate(bar, drive)
    noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((400, 1)))
    G = rt.identify.lrmp(noisy, poles=bar)
    fit = rt.diagnosis.refit(bar, G)
    one = fit.structure.data[0]
    g = fit.system.parameter("links.bar-room.conductance")
    z = np.exp(2j * np.pi * one.frequencies * 10.0)

    def exact(g: complex) -> Array:
        pole = np.exp(-g * 10.0 / 100.0)
        return (1.0 - pole) / g / (z - pole)

    change = (exact(g * 1.001) - exact(g * 0.999)) / 0.002  # d/d log g
    J = as_complex(fit.structure.slopes(fit.v)[0][:, 0, 0])
    assert np.allclose(J, change, rtol=1e-5)
    assert np.allclose(as_complex(fit.paths[0].readings)[:, 0], exact(g), rtol=1e-9)
    one_sided = slope(lambda x: np.array([np.exp(x)]), 0.0, 1e-4, 0.0, 1.0)
    assert one_sided[0] == pytest.approx(1.0, abs=1e-7)


def test_response_without_covariance_is_refused(plant: rt.System, plain: rt.identify.FrequencyResponse) -> None:
    with pytest.raises(rt.InputError, match="without covariance.*lpm or lrmp"):
        rt.diagnose(plant, plain.to_control())
    bare = rt.identify.FrequencyResponse(
        frequencies=plain.frequencies, response=plain.response, degrees_of_freedom=plain.degrees_of_freedom,
        covariance=np.full((4, 4, len(plain)), np.nan), noise_covariance=np.full((2, 2, len(plain)), np.nan),
        input_names=NAMES, output_names=SENSORS, sample_time=5.0, n_samples=1200, method="by hand")
    with pytest.raises(rt.InputError, match="missing or singular"):
        rt.diagnose(plant, bare)
    assert isinstance(plain.to_control(), control.FrequencyResponseData)


def test_bad_use_of_responses_is_refused(plant: rt.System, plain: rt.identify.FrequencyResponse,
                                         hide: Callable[..., tuple[rt.Record, rt.Record]]) -> None:
    with pytest.raises(rt.InputError, match="validation response is the training response"):
        rt.diagnose(plant, plain, validation=plain)
    with pytest.raises(rt.InputError, match="noise is given with a frequency response"):
        rt.diagnose(plant, plain, noise=0.1)
    with pytest.raises(rt.InputError, match="operating_point is given with records"):
        rt.diagnose(plant, hide(n=100)[0], operating_point={"heater": 1.0})
    with pytest.raises(rt.InputError, match="there is no input 'fan'"):
        rt.diagnose(plant, plain, operating_point={"fan": 1.0})
    other = plant.model_copy(update={"sensors": {"T9": plant.sensors["Tp"]}})
    with pytest.raises(rt.InputError, match="no output of the system"):
        rt.diagnose(other, plain)
