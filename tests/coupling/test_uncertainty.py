"""Dual-Youla parameters: built from known ones, refused where the data cannot carry them."""

from __future__ import annotations

from collections.abc import Callable

import control
import numpy as np
import pytest

import robthermal as rt
from robthermal.coupling.factors import overbound

from .conftest import DT, Array, Pair, at

W = np.geomspace(5.0, np.pi / DT * 0.99, 700)


def grid_of(pair: Pair) -> Array:
    """Frequencies fine enough for the modes at 700 and 900 Hz with 2 % damping."""
    return np.unique(np.concatenate([W, np.linspace(2 * np.pi * 600, 2 * np.pi * 1100, 200)]))


def perturbed(f: rt.coupling.CoprimeFactors, delta: Array, w: Array) -> Array:
    """(Np + Dk Delta)(Dp - Nk Delta)⁻¹ over frequency, Evers (6.18)-(6.19)."""
    values = {name: np.stack([np.diag(column) for column in value.T]) for name, value in f.at(w).items()}
    Delta = np.moveaxis(delta, -1, 0)
    plant = (values["Np"] + values["Dk"] @ Delta) @ np.linalg.inv(values["Dp"] - values["Nk"] @ Delta)
    return np.moveaxis(plant, 0, -1)


def test_known_parameters_come_back(pair: Pair) -> None:
    w = grid_of(pair)
    plants, controllers = (pair.P1, pair.P2), (pair.C1, pair.C2)
    f = rt.coupling.coprime(plants, controllers)
    z = np.exp(1j * w * DT)
    shape = 0.05 * (z - 1) / (z - 0.6)
    deltas = [np.einsum("ij,f->ijf", np.array(M), shape) for M in ([[1, 0.2], [-0.4, 0.7]], [[-0.5, 0], [0.1, 0.9]])]
    u = rt.coupling.dual_youla([control.FRD(perturbed(f, d, w), w) for d in deltas], plants, controllers)
    np.testing.assert_allclose(u.samples, np.array(deltas), atol=1e-7)
    np.testing.assert_allclose(u.envelope, np.abs(np.array(deltas)).max(axis=0), atol=1e-7)
    assert u.radius is None and u.with_confidence() is u


def test_formula_against_python_control(random_pair: Callable[[int], Pair]) -> None:
    p = random_pair(1)
    w = np.linspace(1, 314, 300)
    frf = np.zeros((2, 2, 300), dtype=complex)
    frf[0, 0], frf[1, 1], frf[0, 1] = 1.3 * at(p.P1, w), 0.8 * at(p.P2, w), 0.05
    u = rt.coupling.dual_youla(control.FRD(frf, w), control.append(p.P1, p.P2), control.append(p.C1, p.C2))
    _, Q = rt.coupling.inner_factor(p.P1)
    # with a stable controller Dk = 1 and Nk = C: (1 + P C)⁻¹ (P - P0) Q for the upper triangular plant
    expected = 0.3 * at(p.P1, w) / (1 + 1.3 * at(p.P1, w) * at(p.C1, w)) * at(Q, w)
    np.testing.assert_allclose(u.samples[0, 0, 0], expected, rtol=1e-7)
    assert np.all(u.samples[0, 1, 0] == 0)


def test_envelope_between_and_beyond_the_grid(random_pair: Callable[[int], Pair]) -> None:
    p = random_pair(0)
    w = np.linspace(5, 300, 160)
    frf = np.zeros((2, 2, len(w)), dtype=complex)
    frf[0, 0], frf[1, 1] = at(p.P1, w) * (1 + 0.2 * np.sin(w)), at(p.P2, w)
    u = rt.coupling.dual_youla(control.FRD(frf, w), (p.P1, p.P2), (p.C1, p.C2))
    R = u.envelope[0, 0]
    middle = 0.5 * (w[:-1] + w[1:])
    np.testing.assert_array_equal(u.at(middle)[0, 0], np.maximum(R[:-1], R[1:]))
    np.testing.assert_array_equal(u.at(np.array([0.0, 310.0]))[0, 0], R[[0, -1]])
    assert u.at(w[3:4])[0, 0, 0] == max(R[2], R[3], R[4])


def test_identified_plants_in_hertz_carry_confidence_circles(random_pair: Callable[[int], Pair]) -> None:
    p = random_pair(2)
    hertz = np.linspace(0.5, 49.0, 200)
    w = 2 * np.pi * hertz
    frf = np.zeros((2, 2, 200), dtype=complex)
    frf[0, 0], frf[1, 1] = 1.1 * at(p.P1, w), 0.95 * at(p.P2, w)
    G = rt.identify.FrequencyResponse(
        frequencies=hertz, response=frf, noise_covariance=np.repeat(1e-6 * np.eye(2)[:, :, None], 200, axis=2),
        gram=np.repeat(np.eye(2)[:, :, None], 200, axis=2), degrees_of_freedom=np.full(200, 20),
        input_names=["u1", "u2"], output_names=["y1", "y2"], sample_time=0.01, n_samples=4000, method="made up")
    u = rt.coupling.dual_youla(G, (p.P1, p.P2), (p.C1, p.C2))
    same = rt.coupling.dual_youla(control.FRD(frf, w), (p.P1, p.P2), (p.C1, p.C2))
    np.testing.assert_allclose(u.samples, same.samples)
    assert u.radius is not None and np.all(u.radius[0, 0, 0] > 0)
    wide = u.with_confidence().envelope
    rng = np.random.default_rng(0)
    circle = G.confidence_radius(0.95)
    for _ in range(20):  # any plant in the circles of all entries
        moved = frf + circle * np.exp(2j * np.pi * rng.uniform(size=(2, 2, 200)))
        d = rt.coupling.dual_youla(control.FRD(moved, w), (p.P1, p.P2), (p.C1, p.C2))
        assert np.all(np.abs(d.samples - u.samples)[0] <= u.radius[0] * (1 + 1e-9))
        assert np.all(d.envelope <= wide * (1 + 1e-9))


def made_up(response: Array, hertz: Array, deviation: float) -> rt.identify.FrequencyResponse:
    """2x2 frequency response whose entries have this standard deviation; infinite where it is not known."""
    n, variance = len(hertz), np.where(np.eye(2), deviation**2, 0.0)
    return rt.identify.FrequencyResponse(
        frequencies=hertz, response=response, noise_covariance=np.repeat(variance[:, :, None], n, axis=2),
        gram=np.repeat(np.eye(2)[:, :, None], n, axis=2), degrees_of_freedom=np.full(n, 200),
        input_names=["u1", "u2"], output_names=["y1", "y2"], sample_time=0.01, n_samples=4000, method="made up")


def test_large_circles_are_bounded_not_linearized() -> None:
    """The worst phase moves Delta_p a third more than first order says; the bound holds for it."""
    P, C = control.tf([0.1], [1, -0.9], 0.01), control.tf([2.0], [1.0], 0.01)
    w = np.array([30.0, 60.0, 200.0])
    frf = np.zeros((2, 2, 3), dtype=complex)
    frf[0, 0] = frf[1, 1] = at(P, w)
    G = made_up(frf, w / (2 * np.pi), 0.07)
    u = rt.coupling.dual_youla(G, (P, P), (C, C), measured_in_closed_loop=True)
    assert u.radius is not None
    r, Dp = G.confidence_radius(0.95)[0, 0], abs(u.factors.at(w)["Dp"][0])
    turns = r * np.exp(1j * np.linspace(0, 2 * np.pi, 400))[:, None]
    worst = np.max(np.abs(turns * Dp / (1 + 2 * (frf[0, 0] + turns))), axis=0)  # the other entries at rest
    first_order = r * Dp / abs(1 + 2 * frf[0, 0])
    assert np.any(worst > 1.3 * first_order) and np.all(u.radius[0, [0, 1], [0, 1]] >= worst * (1 - 1e-6))


def test_from_a_record_to_filters_that_keep_off_the_circles(random_pair: Callable[[int], Pair]) -> None:
    p = random_pair(2)
    rng = np.random.default_rng(0)
    machine = control.append(1.1 * p.P1, 0.9 * p.P2)
    U = rng.standard_normal((2, 400))
    Y = control.forced_response(machine, np.arange(400) * 0.01, U).outputs
    noisy = Y + 0.03 * np.std(Y) * rng.standard_normal((2, 400))
    record = rt.Record(sample_time=0.01, inputs=U.T, outputs=noisy.T, input_names=["u1", "u2"],
                       output_names=["y1", "y2"])
    args, loops = ((p.P1, p.P2), (p.C1, p.C2)), (p.P1, p.P2, p.C1, p.C2)
    u = rt.coupling.dual_youla(rt.identify.lpm(record), *args)
    truth = rt.coupling.dual_youla(control.FRD(at(machine, u.omega), u.omega), *args).samples
    assert u.radius is not None and np.mean(np.abs(u.samples - truth) <= u.radius) > 0.9  # nominal 0.95
    wide = u.with_confidence()
    assert np.mean(np.abs(truth).max(axis=0) <= wide.envelope) > 0.9
    bold = rt.coupling.synthesize(*loops, uncertainty=u, order=4, margin=0.6)
    careful = rt.coupling.synthesize(*loops, uncertainty=wide, order=4, margin=0.6)
    assert bold.holds and careful.holds and careful.norms["robust"] <= 0.4
    judged = rt.coupling.evaluate(*loops, X_hat=bold.X_hat, Y_hat=bold.Y_hat, uncertainty=wide)
    assert judged.norms["robust"] > 0.45  # the circles were in the way
    assert careful.norms["h2"] > bold.norms["h2"]


def test_overbound_lies_above_and_is_stable(random_pair: Callable[[int], Pair]) -> None:
    p = random_pair(4)
    w = np.linspace(1, 314, 300)
    frf = np.zeros((2, 2, 300), dtype=complex)
    frf[0, 0], frf[1, 1] = 1.3 * at(p.P1, w), 0.8 * at(p.P2, w)
    u = rt.coupling.dual_youla(control.FRD(frf, w), (p.P1, p.P2), (p.C1, p.C2))
    bound = overbound(u, 0, 0)
    size = abs(at(bound, w))
    assert np.all(size >= u.envelope[0, 0] * (1 - 1e-6)) and max(abs(bound.poles())) < 1
    assert np.median(size / u.envelope[0, 0]) < 1.5


def test_grid_too_coarse_for_a_resonance(pair: Pair) -> None:
    w = np.linspace(5, 15000, 100)  # 151 rad/s apart; 2 zeta omega is 176 rad/s at 700 Hz, 226 at 900 Hz
    frf = np.zeros((2, 2, 100), dtype=complex)
    frf[0, 0], frf[1, 1] = at(pair.P1, w), at(pair.P2, w)
    rt.coupling.dual_youla(control.FRD(frf, w), (pair.P1, pair.P2), (pair.C1, pair.C2))
    with pytest.raises(rt.InputError, match=r"spacing of 302.9 rad/s at the resonance of P1 at 56\d\d.*226.2 rad/s"):
        rt.coupling.dual_youla(control.FRD(frf[:, :, ::2], w[::2]), (pair.P1, pair.P2), (pair.C1, pair.C2))
    low = w < 4000
    with pytest.raises(rt.InputError, match="do not cover the resonance of P1"):
        rt.coupling.dual_youla(control.FRD(frf[:, :, low], w[low]), (pair.P1, pair.P2), (pair.C1, pair.C2))


def test_a_plant_the_controllers_do_not_stabilize(pair: Pair) -> None:
    w = grid_of(pair)
    frf = np.zeros((2, 2, len(w)), dtype=complex)
    frf[0, 0], frf[1, 1] = at(pair.P1, w), at(pair.P2, w)
    for factor in (6.0, -1.0):  # beyond the gain margin; a wrong sign
        bad = frf.copy()
        bad[0, 0] = factor * frf[0, 0]
        assert max(abs(control.feedback(control.series(pair.C1, factor * pair.P1), 1).poles())) > 1
        with pytest.raises(rt.InputError, match=r"P_frf\[1\]: .* encircles the origin .* more time"):
            rt.coupling.dual_youla([control.FRD(frf, w), control.FRD(bad, w)], (pair.P1, pair.P2), (pair.C1, pair.C2))


@pytest.mark.parametrize("seed", range(4))
def test_winding_agrees_with_poles(random_pair: Callable[[int], Pair], seed: int) -> None:
    p = random_pair(seed)
    w = np.linspace(0.5, 314, 2000)
    for gain in (0.5, 1.5, 3.0, 8.0, -8.0):
        frf = np.zeros((2, 2, len(w)), dtype=complex)
        frf[0, 0], frf[1, 1] = at(p.P1, w), gain * at(p.P2, w)
        stable = max(abs(control.feedback(gain * p.P2 * p.C2, 1).poles())) < 1
        try:
            rt.coupling.dual_youla(control.FRD(frf, w), (p.P1, p.P2), (p.C1, p.C2))
            accepted = True
        except rt.InputError:
            accepted = False
        assert accepted == stable, gain


def test_zero_frequency_of_a_rigid_body(pair: Pair) -> None:
    w = np.append(0.0, grid_of(pair))
    frf = np.zeros((2, 2, len(w)), dtype=complex)
    frf[0, 0, 1:], frf[1, 1, 1:] = at(pair.P1, w[1:]), at(pair.P2, w[1:])
    with pytest.raises(rt.InputError, match="frequency 0 rad/s is a pole of the model"):
        rt.coupling.dual_youla(control.FRD(frf, w), (pair.P1, pair.P2), (pair.C1, pair.C2))


def test_wrong_shapes_and_numbers(random_pair: Callable[[int], Pair]) -> None:
    p = random_pair(0)
    w = np.linspace(1, 314, 100)
    frf = np.zeros((2, 2, 100), dtype=complex)
    frf[0, 0], frf[1, 1] = at(p.P1, w), at(p.P2, w)
    args = (p.P1, p.P2), (p.C1, p.C2)

    def refuses(plants: object, words: str) -> None:
        with pytest.raises(rt.InputError, match=words):
            rt.coupling.dual_youla(plants, *args)

    refuses(control.FRD(frf[0, 0], w), "1x1 response")
    refuses([], "no measured plant")
    refuses(frf, "not a frequency response")
    refuses([control.FRD(frf, w), control.FRD(frf, w * 0.999)], r"\[1\]: its frequencies differ")
    refuses(control.FRD(frf, w * 2), "above the Nyquist frequency")
    holed = frf.copy()
    holed[0, 1, 7] = np.nan
    refuses(control.FRD(holed, w), "NaN or infinite value at index 7")
