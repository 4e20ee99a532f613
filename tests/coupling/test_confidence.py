"""Confidence sets of measured plants: undecided bins, encirclements of every plant in the set, robust means stable."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import control
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binom

import robthermal as rt
from robthermal.coupling.factors._winding import MeasuredLoop

from .conftest import DT, Pair, at, half_sample_late, stage

Array = NDArray[Any]
Q = 20  # degrees of freedom of the noise at every bin


def measured(plants: tuple[Any, Any], hertz: Array, relative: Array, seed: int, dt: float
             ) -> rt.identify.FrequencyResponse:
    """A diagonal plant measured with circular noise; its variance is an estimate with Q degrees of freedom."""
    rng, n = np.random.default_rng(seed), len(hertz)
    response = np.zeros((2, 2, n), dtype=complex)
    covariance = np.zeros((4, 4, n), dtype=complex)
    for k, plant in enumerate(plants):
        truth = at(plant, 2 * np.pi * hertz)
        sigma = relative * np.abs(truth)
        error = sigma * (rng.standard_normal(n) + 1j * rng.standard_normal(n)) / np.sqrt(2)
        response[k, k] = truth + error
        covariance[3 * k, 3 * k] = sigma**2 * rng.chisquare(2 * Q, n) / (2 * Q)
    return rt.identify.FrequencyResponse(
        frequencies=hertz, response=response, covariance=covariance, noise_covariance=covariance[:2, :2],
        degrees_of_freedom=np.full(n, Q), input_names=["u1", "u2"], output_names=["y1", "y2"], sample_time=dt,
        n_samples=100_000, method="made up")


def scanner_grid() -> Array:
    return np.unique(np.concatenate([np.geomspace(2.0, 2400.0, 250), np.linspace(600.0, 1100.0, 120)]))


def machine(pair: Pair) -> tuple[Any, Any]:
    return 0.95 * pair.P1, 1.04 * pair.P2


def without_covariance(G: rt.identify.FrequencyResponse) -> control.FrequencyResponseData:
    return control.FRD(G.response, 2 * np.pi * G.frequencies)


def test_noisy_lowest_bins_are_left_out_and_never_called_unstable(pair: Pair) -> None:
    """True stabilizing loops: the noise of the five lowest bins is three times the plant."""
    hertz = scanner_grid()
    relative = np.where(np.arange(len(hertz)) < 5, 3.0, 0.01)
    args, wrong = ((pair.P1, pair.P2), (pair.C1, pair.C2)), []
    for seed in range(30):
        G = measured(machine(pair), hertz, relative, seed, DT)
        u = rt.coupling.dual_youla(G, *args)
        np.testing.assert_allclose(u.left_out, 2 * np.pi * hertz[:5])
        assert len(u.omega) == len(hertz) - 5 and np.isfinite(u.with_confidence().envelope).all()
        np.testing.assert_array_equal(u.at(np.array([1.0]))[..., 0], u.envelope[..., 0])  # assumed below the first bin
        try:
            rt.coupling.dual_youla(without_covariance(G), *args)
        except rt.InputError as error:
            wrong.append(str(error))
    assert len(wrong) >= 10  # what the count says of the same values without their covariance
    assert all("without covariance noise cannot be told from an unstable loop" in one or "jumps" in one
               for one in wrong)


def test_a_destabilizing_controller_is_refused_for_every_plant_in_the_set(pair: Pair) -> None:
    hertz = scanner_grid()
    plants, controllers = (pair.P1, pair.P2), (pair.C1, pair.C2)
    for factor in (6.0, -1.0):  # beyond the gain margin; a wrong sign
        assert max(abs(control.feedback(control.series(pair.C1, factor * pair.P1), 1).poles())) > 1
        true = (factor * pair.P1, pair.P2)
        clean = measured(true, hertz, np.full(len(hertz), 0.01), 0, DT)
        with pytest.raises(rt.InputError, match="do not stabilize .* for every plant in its confidence set"):
            rt.coupling.dual_youla(clean, plants, controllers)
        noisy = measured(true, hertz, np.where(np.arange(len(hertz)) < 5, 3.0, 0.01), 1, DT)
        with pytest.raises(rt.InputError, match="do not stabilize|cannot be decided"):
            rt.coupling.dual_youla(noisy, plants, controllers)


def test_undecided_between_decided_bins_and_everywhere(pair: Pair) -> None:
    hertz = scanner_grid()
    args = (pair.P1, pair.P2), (pair.C1, pair.C2)
    place = int(np.searchsorted(hertz, 40.0))
    relative = np.full(len(hertz), 0.01)
    relative[place:place + 3] = 5.0
    for closed in (False, True):  # a circle is needed either way
        with pytest.raises(rt.InputError) as refusal:
            rt.coupling.dual_youla(measured(machine(pair), hertz, relative, 0, DT), *args,
                                   measured_in_closed_loop=closed)
        low, high = hertz[[place, place + 2]]
        assert f"cannot be decided from bins {low:.4g} … {high:.4g} Hz" in str(refusal.value)
        assert "not stabilize" not in str(refusal.value) and f"Measure {low:.4g}" in str(refusal.value)
        assert "measured_in_closed_loop = true does not help" in str(refusal.value)
        assert "3 of them have a confidence circle that is infinite" in str(refusal.value)
    with pytest.raises(rt.InputError, match="cannot be decided from bins 2 … 2400 Hz"):
        rt.coupling.dual_youla(measured(machine(pair), hertz, np.full(len(hertz), 1e4), 0, DT), *args)


def test_undecided_bins_above_the_last_decided_one(pair: Pair) -> None:
    """Refused whoever says what, with what to measure; who ends the response below them assumes what is said."""
    hertz = scanner_grid()
    args = (pair.P1, pair.P2), (pair.C1, pair.C2)
    G = measured(machine(pair), hertz, np.where(np.arange(len(hertz)) < len(hertz) - 4, 0.01, 1e8), 0, DT)
    end, low, high = hertz[[-5, -4, -1]]
    for closed in (False, True):
        with pytest.raises(rt.InputError) as refusal:
            rt.coupling.dual_youla(G, *args, measured_in_closed_loop=closed)
        said = str(refusal.value)
        for words in (f"cannot be decided from bins {low:.4g} … {high:.4g} Hz", f"all 4 above {end:.4g} Hz",
                      f"Measure {low:.4g} … {high:.4g} Hz longer", f"end the response at {end:.4g} Hz (band of",
                      "measured_in_closed_loop = true does not help"):
            assert words in said
    u = rt.coupling.dual_youla(G.between(0.0, end), *args)
    assert len(u.omega) == len(hertz) - 4 and not len(u.left_out)
    np.testing.assert_array_equal(u.at(np.array([np.pi / DT]))[..., 0], u.envelope[..., -1])  # assumed above it


def test_bins_near_crossover_are_not_joined_by_the_model(pair: Pair) -> None:
    """All bins up to crossover undecided: there the model's own 1 + PC is small, and nothing is joined."""
    hertz = scanner_grid()
    args = (pair.P1, pair.P2), (pair.C1, pair.C2)
    G = measured(machine(pair), hertz, np.where(hertz < 150.0, 9.0, 0.01), 0, DT)
    with pytest.raises(rt.InputError, match="cannot be decided .* falls below 1 there .*Or say measured_in_closed"):
        rt.coupling.dual_youla(G, *args)
    known = rt.coupling.dual_youla(G, *args, measured_in_closed_loop=True)  # the closed loop is the evidence
    assert known.left_out[-1] < 2 * np.pi * 150.0 <= known.omega[0]


def rigid(mass: float) -> control.StateSpace:
    return half_sample_late(control.StateSpace([[0, 1], [0, 0]], [[0], [1 / mass]], [[1, 0]], [[0]]), DT)


def test_a_response_that_ends_below_crossover_says_nothing_about_stability(pair: Pair) -> None:
    """Up to 60 Hz a machine whose mode at 300 Hz turns the other way looks like the model; its loop is unstable."""
    args, hertz = ((rigid(10.0), rigid(20.0)), (pair.C1, pair.C2)), np.geomspace(2.0, 60.0, 120)
    true = stage(10.0, 300.0, 0.001, -1.0), args[0][1]
    omega = 2 * np.pi * hertz
    assert np.abs(at(true[0], omega) / at(args[0][0], omega) - 1).max() < 0.06
    assert np.abs(control.poles(control.feedback(true[0], pair.C1))).max() > 1.001
    below = measured(true, hertz, np.full(len(hertz), 0.02), 0, DT)
    with pytest.raises(rt.InputError, match=r"ends at 60 Hz, and the model's \|T1\| is .* Measure further up, or say "
                                            "measured_in_closed_loop"):
        rt.coupling.dual_youla(below, *args)
    assert rt.coupling.dual_youla(below, *args, measured_in_closed_loop=True).left_out.size == 0  # the user's word
    whole = np.geomspace(2.0, 2400.0, 400)
    u = rt.coupling.dual_youla(measured(args[0], whole, np.full(len(whole), 0.02), 0, DT), *args)
    assert len(u.omega) == 400


def turns(values: Array) -> int:
    """Windings of a polygon by fine interpolation, independent of the package."""
    closed = np.concatenate([values, values[::-1].conj(), values[:1]])
    fine = np.concatenate([np.linspace(a, b, 400) for a, b in zip(closed[:-1], closed[1:], strict=True)])
    return round(float(np.sum(np.angle(fine[1:] / fine[:-1]))) / (2 * np.pi))


@pytest.mark.exhaustive
def test_where_a_count_is_accepted_all_plants_of_the_set_have_it() -> None:
    """Random discs of det: an accepted or refused count is that of 40 drawn members; where undecided, some differ."""
    rng = np.random.default_rng(0)
    tally = {"stable": 0, "unstable": 0, "undecided": 0, "really differ": 0}
    for _ in range(400):
        n = int(rng.integers(3, 9))
        center = np.exp(np.cumsum(rng.normal(0, 0.6, n) + 1j * rng.normal(0, rng.uniform(0.1, 1.2), n)))
        rho = rng.uniform(0.0, 0.95, n) * rng.uniform(0.0, 1.0)
        loop = MeasuredLoop(np.arange(1.0, n + 1), center[None], np.arcsin(rho)[None], True, "P")
        members = [center * (1 + rho * np.sqrt(rng.uniform(size=n)) * np.exp(2j * np.pi * rng.uniform(size=n)))
                   for _ in range(40)]
        edges = [center * (1 + rho * np.exp(1j * sign * np.arccos(-rho))) for sign in (1.0, -1.0)]  # the tangents
        mixed = [np.where(rng.uniform(size=n) < 0.5, *edges) for _ in range(40)]
        counts = {turns(one) for one in [*members, *mixed, center]}
        try:
            loop.expect_stable()
            kind = "stable"
        except rt.InputError as error:
            kind = "undecided" if "cannot be decided" in error.what else (
                "unstable" if "do not stabilize" in error.what else "stable")
        tally[kind] += 1
        if kind == "undecided":
            tally["really differ"] += len(counts) > 1
        assert kind == "undecided" or (len(counts) == 1 and (counts == {0}) == (kind == "stable"))
    assert min(tally.values()) > 20


def test_all_circles_hold_at_once(random_pair: Callable[[int], Pair]) -> None:
    """400 repetitions of 60 bins and two plants; bound at a chance of 0.1 %."""
    p, hertz = random_pair(2), np.linspace(0.5, 49.0, 60)
    plants, inside = (p.P1, p.P2), 0
    truth = np.stack([at(plant, 2 * np.pi * hertz) for plant in plants])
    for seed in range(400):
        G = measured(plants, hertz, np.full(60, 0.05), seed, 0.01)
        u = rt.coupling.factors._frf.read_plants(G, 0.01, "P")
        error = np.abs(np.stack([G.response[0, 0], G.response[1, 1]]) - truth)
        inside += bool(np.all(error <= u.radius[0, [0, 1], [0, 1]]))
    assert binom.ppf(1e-3, 400, 0.95) <= inside


@pytest.mark.exhaustive
def test_robust_means_stable_for_plants_of_the_confidence_set(random_pair: Callable[[int], Pair]) -> None:
    """Every drawn plant in all circles and under the envelope between them is stable with the coupling controller."""
    drawn, hertz = 0, np.linspace(0.25, 49.75, 160)
    fine = np.linspace(0.5, np.pi / 0.01, 900)
    rng = np.random.default_rng(0)
    for seed in (0, 1, 2):
        p = random_pair(seed)
        G = measured((p.P1, p.P2), hertz, np.full(160, 0.02), seed, 0.01)
        u = rt.coupling.dual_youla(G, (p.P1, p.P2), (p.C1, p.C2)).with_confidence()
        designed = rt.coupling.synthesize(p.P1, p.P2, p.C1, p.C2, uncertainty=u, order=4, margin=0.2)
        larger = 0.93 / designed.norms["robust"]  # as far as the claim reaches
        filters = rt.coupling.evaluate(p.P1, p.P2, p.C1, p.C2, X_hat=larger * designed.X_hat,
                                       Y_hat=larger * designed.Y_hat, uncertainty=u)
        assert filters.verdict == "robust" and filters.norms["robust"] > 0.9
        circles = rt.coupling.factors._frf.read_plants(G, 0.01, "P").radius[0]
        for _ in range(60):
            pole, size = rng.uniform(-0.9, 0.9, 2), rng.uniform(-0.045, 0.045, 2)
            plants = [control.ss(plant * (1 + s * control.tf([1 - abs(r), 0], [1, -r], 0.01)))
                      for plant, s, r in zip((p.P1, p.P2), size, pole, strict=True)]
            near = all(np.all(np.abs(at(plant, 2 * np.pi * hertz) - G.response[k, k]) <= circles[k, k])
                       for k, plant in enumerate(plants))
            frf = np.zeros((2, 2, len(fine)), dtype=complex)
            frf[0, 0], frf[1, 1] = at(plants[0], fine), at(plants[1], fine)
            true = rt.coupling.dual_youla(control.FRD(frf, fine), (p.P1, p.P2), (p.C1, p.C2)).samples[0]
            if near and np.all(np.abs(true) <= u.at(fine) * (1 + 1e-9)):
                drawn += 1
                poles = control.feedback(control.append(*plants), filters.controller).poles()
                assert np.max(np.abs(poles)) < 1
    assert drawn >= 45


def test_more_than_the_envelope_may_be_unstable(random_pair: Callable[[int], Pair]) -> None:
    """The number is not idle: a plant beyond the envelope by 1/robust is unstable, so a wider circle must change it."""
    p, hertz = random_pair(1), np.linspace(0.25, 49.75, 160)
    G = measured((p.P1, p.P2), hertz, np.full(160, 0.03), 0, 0.01)
    bare = rt.coupling.dual_youla(G, (p.P1, p.P2), (p.C1, p.C2))
    filters = rt.coupling.synthesize(p.P1, p.P2, p.C1, p.C2, uncertainty=bare, order=4, margin=0.1)
    judged = rt.coupling.evaluate(p.P1, p.P2, p.C1, p.C2, X_hat=filters.X_hat, Y_hat=filters.Y_hat,
                                  uncertainty=bare.with_confidence())
    assert judged.norms["robust"] > 1.2 * judged.norms["robust_without_circles"]
    assert judged.norms["robust_without_circles"] == pytest.approx(filters.norms["robust"], rel=0.02)


@pytest.mark.parametrize("confidence", [0.0, 1.0, 95, True, "high"])
def test_confidence_is_a_probability(random_pair: Callable[[int], Pair], confidence: object) -> None:
    p, hertz = random_pair(2), np.linspace(0.5, 49.0, 60)
    G = measured((p.P1, p.P2), hertz, np.full(60, 0.05), 0, 0.01)
    with pytest.raises(rt.InputError, match="confidence"):
        rt.coupling.dual_youla(G, (p.P1, p.P2), (p.C1, p.C2), confidence=confidence)
