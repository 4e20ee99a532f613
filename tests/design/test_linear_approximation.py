"""Best linear approximation from heat v to cold face, with the feedback law and without it (Evers 5.5.4, remark)."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt

N, H = 120, 2.0  # samples in a period, sample time [s]
SYSTEM = rt.systems.two_module()
LAW = rt.design.feedback_linearization(SYSTEM)
AT, HELD = np.full(18, 298.15), np.zeros(2)  # in equilibrium without current


def distortion(plant: rt.System, law: object, rms: float = 3.0) -> tuple[float, np.ndarray]:
    """Nonlinear distortion of the first cold face relative to its linear response, and the response [K/W]."""
    excitation = rt.signals.multisines(N, inputs=1, realizations=2, sample_time=H, band=(0.0, 0.06), rms=rms,
                                       periods=5, seed=1)
    records = [rt.design.simulate_law(plant, np.column_stack([d[:, 0], 0 * d[:, 0]]), law=law, sample_time=H,
                                      initial=AT).select(inputs=["m1"], outputs=["x11"])[-2 * N:]
               for d in excitation.experiments]
    G = rt.identify.bla(records, period=N)
    U = np.fft.rfft(records[0].inputs[-N:, 0], norm="ortho")[np.round(G.frequencies * N * H).astype(int)]
    linear = np.abs(G.response[0, 0] * U) ** 2
    return float(np.sqrt(G.nonlinear_covariance[0, 0].real.sum() / linear.sum())), G.response[0, 0]


@pytest.fixture(scope="module")
def right() -> tuple[float, np.ndarray]:
    return distortion(SYSTEM, LAW)


def test_the_law_leaves_a_tenth_of_the_distortion(right: tuple[float, np.ndarray]) -> None:
    with_law, G = right
    without, _ = distortion(SYSTEM, rt.design.constant_gain(LAW, AT, HELD))
    assert with_law < 0.004 < 0.03 < without
    assert without > 10 * with_law
    # What it approximates is the linear cold side: the response of the plant that controllers are designed for.
    frequencies = np.arange(1, G.size + 1) / (N * H)
    expected = np.array([rt.design.cold_side(LAW).response(2 * np.pi * f)[0][0, 0] for f in frequencies[:6]])
    np.testing.assert_allclose(np.abs(G[:6]), np.abs(expected), rtol=0.03)


def test_a_law_with_another_seebeck_coefficient_leaves_more(right: tuple[float, np.ndarray]) -> None:
    modules = {name: m.model_copy(update={"seebeck": m.seebeck.model_copy(update={"value": 0.9 * m.seebeck.value})})
               for name, m in SYSTEM.modules.items()}
    plant = SYSTEM.model_copy(update={"modules": modules})
    wrong, _ = distortion(plant, LAW)
    assert wrong > 2 * right[0]


def test_heats_that_are_no_linear_experiment_are_refused() -> None:
    with pytest.raises(rt.InputError, match="meets the limit"):
        rt.design.simulate_law(SYSTEM, np.full((9, 2), -60.0), law=LAW, sample_time=1.0)
    with pytest.raises(rt.InputError, match="rows of 2 heats"):
        rt.design.simulate_law(SYSTEM, [-1.0, -1.0], law=LAW, sample_time=1.0)
    with pytest.raises(rt.InputError, match="law is a"):
        rt.design.simulate_law(SYSTEM, np.zeros((9, 2)), law="law", sample_time=1.0)  # type: ignore[arg-type]
