"""The design check against the estimators themselves, and against simulated experiments."""

from __future__ import annotations

from typing import Any

import control
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import lfilter

import robthermal as rt
from robthermal import InputError
from robthermal.signals import design_check, multisine, multisines, noise

# Two lumps, heated and measured at both ends: time constants 1580 and 25 s.
A = np.array([[-0.0105, 0.01], [0.03, -0.0305]])
B = np.array([[0.01, 0.0], [0.0, 0.03]])
PLANT = control.ss(A, B, np.eye(2), np.zeros((2, 2)))


def outputs(u: NDArray[np.float64], h: float) -> NDArray[np.float64]:
    """From rest at zero, inputs held: sample by sample."""
    step = expm(np.block([[A, B], [np.zeros((2, 4))]]) * h)
    x, Y = np.zeros(2), np.empty((len(u), 2))
    for n, row in enumerate(u):
        Y[n] = x
        x = step[:2, :2] @ x + step[:2, 2:] @ row
    return Y


def truth(f: NDArray[np.float64], h: float) -> NDArray[np.complex128]:
    step = expm(np.block([[A, B], [np.zeros((2, 4))]]) * h)
    return np.stack(
        [np.linalg.inv(np.exp(2j * np.pi * one * h) * np.eye(2) - step[:2, :2]) @ step[:2, 2:] for one in f], -1
    )


def records(experiments: list[NDArray[np.float64]], h: float, Y: list[NDArray[np.float64]]) -> list[rt.Record]:
    names = [f"q{i}" for i in range(experiments[0].shape[1])]
    return [
        rt.Record(
            sample_time=h, inputs=u, outputs=y, input_names=names, output_names=[f"T{o}" for o in range(y.shape[1])]
        )
        for u, y in zip(experiments, Y, strict=True)
    ]


def bins_of(check: rt.signals.DesignCheck) -> NDArray[np.intp]:
    return np.rint(check.frequencies * check.duration).astype(int) - 1


@pytest.mark.parametrize("periods", [1, 2, 5])
@pytest.mark.parametrize("tau", [60.0, 900.0, 20_000.0])
def test_error_of_one_mode_is_the_error_of_lpm_without_noise(tau: float, periods: int) -> None:
    h = 2.0
    u = multisine(900, sample_time=h, band=(0.0, 0.1), amplitude=5.0, offset=5.0, periods=periods, seed=1)
    check = design_check(u, sample_time=h, poles=[-1 / tau])
    gamma = np.exp(-h / tau)
    y = lfilter([0.0, 1.0], [1.0, -gamma], u)
    G = rt.identify.lpm(records([u[:, None]], h, [y[:, None]]))
    exact = 1.0 / (np.exp(2j * np.pi * check.frequencies * h) - gamma)
    actual = np.abs(G.response[0, 0, bins_of(check)] / exact - 1.0)
    np.testing.assert_allclose(check.pole_errors[0], actual, rtol=1e-5, atol=1e-9)


def test_error_of_one_mode_is_the_error_of_etfe_without_noise() -> None:
    u = multisine(500, sample_time=1.0, band=(0.0, 0.2), amplitude=1.0, offset="nonnegative", periods=3, seed=2)
    check = design_check(u, sample_time=1.0, poles=[-0.004], method="etfe")
    y = lfilter([0.0, 1.0], [1.0, -np.exp(-0.004)], u)
    G = rt.identify.etfe(records([u[:, None]], 1.0, [y[:, None]]))
    exact = 1.0 / (np.exp(2j * np.pi * G.frequencies) - np.exp(-0.004))
    np.testing.assert_allclose(check.frequencies, G.frequencies)
    np.testing.assert_allclose(check.pole_errors[0], np.abs(G.response[0, 0] / exact - 1.0), rtol=1e-6, atol=1e-9)


def test_inputs_that_share_a_mode_share_its_transient() -> None:
    h, tau, power = 2.0, 900.0, np.array([1.0, 4.0])
    heat = multisines(
        900, inputs=2, arrangement="independent", sample_time=h, band=(0.0, 0.1), rms=1.0, offset=9.0, seed=1
    )
    check = design_check(heat, sample_time=h, poles=[-1 / tau], gain=power)
    y = [lfilter([0.0, 1.0], [1.0, -np.exp(-h / tau)], u @ power)[:, None] for u in heat.experiments]
    G = rt.identify.lpm(records(heat.experiments, h, y)).response[0][:, bins_of(check)]
    exact = power[:, None] / (np.exp(2j * np.pi * check.frequencies * h) - np.exp(-h / tau))
    np.testing.assert_allclose(check.pole_errors[0], np.abs(G / exact - 1.0).max(axis=0), rtol=1e-6)


@pytest.mark.parametrize("arrangement", ["orthogonal", "zippered", "independent"])
def test_unresolved_frequencies_are_where_lpm_fails_on_a_simulated_record(arrangement: Any) -> None:
    h = 5.0
    heat = multisines(
        1440,
        inputs=2,
        arrangement=arrangement,
        sample_time=h,
        band=(0.0, 0.05),
        amplitude=5.0,
        offset="nonnegative",
        seed=3,
    )
    check = design_check(heat, sample_time=h, model=PLANT)
    assert check.outcome.code == "unresolved" and check.table["time constant [s]"][0] > 1000
    G = rt.identify.lpm(records(heat.experiments, h, [outputs(u, h) for u in heat.experiments]))
    error = np.abs(G.response[..., bins_of(check)] / truth(check.frequencies, h) - 1.0)
    own = np.max([error[0, 0], error[1, 1]], axis=0)  # each end heated answers most to its own heater
    np.testing.assert_array_equal(own > check.tolerance, check.unresolved)
    np.testing.assert_allclose(check.model_errors.max(axis=0) >= own * (1 - 1e-6), True)  # type: ignore[union-attr]
    assert 5 < check.unresolved.sum() < 100 and own[check.frequencies >= check.resolved_from].max() <= check.tolerance
    # From the time constants alone the limit is the same within a third.
    alone = design_check(heat, sample_time=h, poles=PLANT.poles())
    assert alone.resolved_from == pytest.approx(check.resolved_from, rel=1 / 3)


def test_a_longer_record_and_a_faster_machine_resolve_more() -> None:
    def limit(n: int, tau: float) -> float:
        u = multisine(n, sample_time=10.0, band=(0.0, 0.04), amplitude=1.0, seed=1)
        return design_check(u, sample_time=10.0, poles=[-1 / tau]).resolved_from

    assert limit(400, 2000.0) > limit(1600, 2000.0) > limit(6400, 2000.0)
    assert limit(1600, 20.0) == pytest.approx(1 / 16000)  # everything
    u = multisine(1600, sample_time=10.0, band=(0.01, 0.04), amplitude=1.0, seed=1)
    check = design_check(u, sample_time=10.0, poles=[-1 / 2000.0])
    assert check.outcome.code == "resolved" and check.table["verdict"][0] == "below the excited band"


CASES: list[tuple[Any, dict[str, Any]]] = [
    (multisine(400, sample_time=1.0, band=(0.0, 0.4), rms=1.0, seed=1), {}),
    (
        multisine(200, sample_time=1.0, band=(0.0, 0.4), rms=1.0, spectrum="logarithmic", periods=3, seed=2),
        {"half_width": 6},
    ),
    (noise(400, sample_time=1.0, rms=2.0, seed=3), {"degree": 3, "half_width": 9}),
    (
        multisines(400, inputs=2, sample_time=1.0, band=(0.0, 0.4), rms=1.0, arrangement="zippered", seed=4),
        {"half_width": 10},
    ),
    (multisines(400, inputs=2, sample_time=1.0, band=(0.0, 0.4), rms=1.0, arrangement="independent", seed=5), {}),
    (multisines(300, inputs=2, sample_time=1.0, band=(0.0, 0.4), rms=[1.0, 3.0], seed=6), {}),
]


@pytest.mark.parametrize("case", range(len(CASES)))
def test_noise_gain_is_that_of_lpm_at_every_line(case: int) -> None:
    u, settings = CASES[case]
    check = design_check(u, sample_time=1.0, poles=[-0.05], **settings)
    experiments = u.experiments if isinstance(u, rt.signals.Excitation) else [np.asarray(u)[:, None]]
    G = rt.identify.lpm(records(experiments, 1.0, [one[:, :1] for one in experiments]), **settings)
    np.testing.assert_allclose(check.noise_gain, np.einsum("iif->if", G.gram).real[:, bins_of(check)], rtol=1e-8)


@pytest.mark.exhaustive
@pytest.mark.parametrize("case", range(len(CASES)))
def test_expected_variance_is_the_scatter_of_lpm(case: int) -> None:
    u, settings = CASES[case]
    check = design_check(u, sample_time=1.0, poles=[-0.05], noise=[0.02, 0.5], **settings)
    experiments = u.experiments if isinstance(u, rt.signals.Excitation) else [np.asarray(u)[:, None]]
    rng, runs, chosen = np.random.default_rng(7), 200, bins_of(check)
    square = np.zeros(check.variance.shape)  # type: ignore[union-attr]
    for _ in range(runs):  # the estimate is linear in the outputs: noise alone gives its error
        V = [rng.normal(size=(len(one), 2)) * [0.02, 0.5] for one in experiments]
        square += np.abs(rt.identify.lpm(records(experiments, 1.0, V), **settings).response[..., chosen]) ** 2
    ratio = square / runs / check.variance
    # |error|^2 is exponential: per bin a scatter of 200^-1/2; over the bins about len / (2 half_width + 1) independent.
    assert ratio.mean(axis=2) == pytest.approx(np.ones(ratio.shape[:2]), abs=4 / np.sqrt(runs * len(chosen) / 19))
    assert np.abs(ratio - 1.0).max() < 6 / np.sqrt(runs)


def test_expected_variance_of_etfe_is_that_of_the_inverse_of_the_input_matrix() -> None:
    heat = multisines(256, inputs=3, sample_time=1.0, band=(0.05, 0.4), rms=2.0, seed=1)
    check = design_check(heat, sample_time=1.0, poles=[-0.05], noise=0.1, method="etfe")
    # Orthogonal: sigma^2 (U U^H)^-1 = sigma^2 / (3 |U|^2), |U|^2 = rms^2 N / (2 lines)
    expected = 0.01 / (3 * 4.0 * 256 / (2 * check.frequencies.size))
    np.testing.assert_allclose(check.variance, expected)
    one = multisine(256, sample_time=1.0, band=(0.05, 0.4), rms=2.0, seed=1)
    U = np.fft.rfft(one, norm="ortho")
    single = design_check(one, sample_time=1.0, poles=[-0.05], noise=0.1, method="etfe")
    np.testing.assert_allclose(
        single.variance[0, 0], 0.01 / np.abs(U[np.rint(single.frequencies * 256).astype(int)]) ** 2
    )  # type: ignore[index]


def test_heat_rise_and_relative_deviation() -> None:
    h, power = 5.0, np.array([2.0, 0.5])
    heat = multisines(720, inputs=2, sample_time=h, band=(0.0, 0.05), amplitude=[5.0, 3.0], offset=[6.0, 3.0], seed=3)
    check = design_check(heat, sample_time=h, model=PLANT, noise=[0.01, 0.02], gain=power)
    np.testing.assert_allclose(check.mean_heat, power * [6.0, 3.0])
    np.testing.assert_allclose(check.energy, 2 * 720 * h * (12.0 + 1.5))
    np.testing.assert_allclose(check.heat_range[:, 0], power * heat.signals.min(axis=(0, 1, 2)))
    np.testing.assert_allclose(check.mean_rise, -np.linalg.solve(A, B @ [6.0, 3.0]))
    np.testing.assert_allclose(check.response, truth(check.frequencies, h))
    expected = np.sqrt(check.variance) / np.abs(truth(check.frequencies, h))  # type: ignore[arg-type]
    np.testing.assert_allclose(check.relative_deviation, expected)
    sampled = design_check(heat, sample_time=h, model=PLANT.sample(h), noise=[0.01, 0.02], gain=power)
    np.testing.assert_allclose(sampled.pole_errors, check.pole_errors, rtol=1e-6)
    np.testing.assert_allclose(sampled.response, check.response, rtol=1e-9)


def test_a_system_tells_its_poles_and_its_linearization_its_response() -> None:
    system = rt.systems.two_module()
    heat = multisines(1200, inputs=2, sample_time=1.0, band=(0.004, 0.05), amplitude=0.3, seed=1)
    with_poles = design_check(heat, sample_time=1.0, model=system, noise=0.01)
    assert with_poles.response is None and with_poles.relative_deviation is None
    linear = rt.thermal.linearize(system)[:, [0, 1]]
    with_response = design_check(heat, sample_time=1.0, model=linear, noise=0.01)
    assert with_response.relative_deviation.shape == (linear.noutputs, 2, with_response.frequencies.size)  # type: ignore[union-attr]
    with pytest.raises(InputError, match="model has 3 inputs, u has 2.*Select the excited inputs"):
        design_check(heat, sample_time=1.0, model=rt.thermal.linearize(system))


def test_what_the_excitation_does_not_determine_is_infinite() -> None:
    # Two inputs in one record, six periods: one excited line per window cannot tell two inputs apart.
    heat = multisines(
        100, inputs=2, arrangement="independent", sample_time=1.0, band=(0.0, 0.4), rms=1.0, periods=12, seed=1
    )
    check = design_check(heat, sample_time=1.0, poles=[-0.02], noise=0.1, half_width=5)
    assert check.undetermined.all() and np.isinf(check.variance).all() and check.unresolved.all()  # type: ignore[arg-type]
    assert check.outcome.code == "undetermined" and "fewer periods" in check.outcome.text
    orthogonal = multisines(100, inputs=2, sample_time=1.0, band=(0.0, 0.4), rms=1.0, periods=12, seed=1)
    assert not design_check(orthogonal, sample_time=1.0, poles=[-0.02], half_width=5).undetermined.any()


def test_printed_and_drawn() -> None:
    u = multisine(600, sample_time=10.0, band=(0.0, 0.02), amplitude=5.0, offset="nonnegative", seed=1)
    for settings in ({"poles": [-0.001, -0.1]}, {"poles": [-0.001], "noise": 0.1}):
        check = design_check(u, sample_time=10.0, **settings)
        assert "time constant [s]" in str(check) and "mean heat" in str(check) and "lrmp" in str(check)
        assert len(check.plot()) == 2


GOOD: dict[str, Any] = {
    "u": multisine(200, sample_time=1.0, band=(0.0, 0.2), rms=1.0, seed=0),
    "sample_time": 1.0,
    "poles": [-0.01],
}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"u": [1.0, np.nan, 2.0, 3.0]}, "nan.*row 1"),
        ({"u": np.ones(200)}, "input 0 is constant.*does not excite"),
        ({"u": np.zeros((200, 2))}, "input 0 is constant"),
        ({"u": [1.0, 2.0]}, "at least 4 samples"),
        ({"u": [np.ones((50, 1)), np.ones((60, 1))]}, "experiment 1 has shape"),
        ({"u": "heat"}, "argument u"),
        ({"u": 1j * np.arange(200)}, "complex"),
        ({"sample_time": 0.0}, "sample_time is 0.0"),
        ({"sample_time": 400.0}, "sample_time 400 s is too slow.*100 s.*Sample every 10 s"),
        ({"poles": None}, "neither of model and poles"),
        ({"model": PLANT}, "both of model and poles"),
        ({"poles": None, "model": 3.0}, r"got float.*poles\(\)"),
        ({"poles": [0.01]}, "pole 0.01.* stable.*-1/tau"),
        ({"poles": [0.0]}, "stable"),
        ({"poles": [1j]}, "stable"),
        ({"poles": [np.nan]}, "not finite"),
        ({"poles": []}, "poles is"),
        ({"poles": "auto"}, "poles is 'auto'"),
        ({"poles": [[1.0], [1.0, 2.0]]}, "ragged"),
        ({"poles": None, "model": control.ss([], [], [], [[1.0]])}, "no poles"),
        ({"poles": None, "model": control.ss(-0.01, 1.0, 1.0, 0.0).sample(2.0)}, "sampled every 2 s"),
        ({"noise": 0.0}, r"noise\[0\] is 0.0"),
        ({"noise": -1.0}, r"noise\[0\] is -1.0"),
        ({"noise": "low"}, "noise"),
        ({"noise": []}, "noise has shape"),
        ({"poles": None, "model": control.ss(-0.01, 1.0, 1.0, 0.0), "noise": [1.0, 2.0]}, "one per output"),
        ({"gain": 0.0}, "gain is 0.0"),
        ({"gain": [1.0, 2.0]}, "gain has 2 values for 1 inputs"),
        ({"method": "lrmp"}, "method is 'lrmp'"),
        ({"degree": -1}, "degree is -1"),
        ({"degree": 1.5}, "degree is 1.5"),
        ({"half_width": 0}, "half_width is 0"),
        ({"half_width": 60}, "needs 121 bins"),
        ({"half_width": 2}, "no degrees of freedom"),
        ({"tolerance": 0.0}, "tolerance is 0.0"),
        ({"tolerance": 1.0}, "tolerance is 1"),
        ({"u": GOOD["u"].reshape(100, 2), "method": "etfe"}, "1 experiment.* for 2 inputs"),
        ({"u": multisines(100, inputs=1, sample_time=2.0, lines=[3], rms=1.0, seed=0)}, "designed for 2 s"),
    ],
)
def test_design_check_refuses(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        design_check(**{**GOOD, **changes})
