"""PI and PID from frequency responses: brute force over the gains, plants drawn from the covariance, refusals."""

from __future__ import annotations

import control
import numpy as np
import pytest

import robthermal as rt
from robthermal.errors import InputError
from robthermal.identify import FrequencyResponse

LAG = control.tf([2.0], np.polymul([60, 1], np.polymul([8, 1], [3, 1])))  # of a thermal stage [K/W], seconds
RESONANT = control.tf([1], np.polymul([1, 0.2, 1], [1, 1]))


def measured(plant, noise=0.0, count=150, low=1e-4, high=1.0, seed=0, dof=200):
    """Response of a plant on a grid [Hz] with white noise of relative size, and its covariance."""
    f = np.geomspace(low, high, count)
    G = plant(2j * np.pi * f)
    variance = (noise * abs(G[0])) ** 2 * np.ones(count)
    rng = np.random.default_rng(seed)
    error = np.sqrt(variance / 2) * (rng.standard_normal(count) + 1j * rng.standard_normal(count))
    return FrequencyResponse(frequencies=f, response=(G + error)[None, None], noise_covariance=variance[None, None],
                             gram=np.ones((1, 1, count)), degrees_of_freedom=np.full(count, dof), input_names=["q"],
                             output_names=["T"], sample_time=0.1, n_samples=10_000, method="made for a test")


def stable(plant, gains, **more):
    """Whether python-control's loop with the gains is stable."""
    C = control.tf([gains.get("Kp", 0), gains.get("Ki", 0)], [1, 0])
    return bool((control.feedback(plant * C, 1).poles().real < 0).all())


def brute(G, w, radius, margin, plant, Kp, Ki):
    """Largest integral gain of a grid that keeps the margin at the bins and whose loop with the plant is stable."""
    best, num, den = 0.0, plant.num[0][0], np.append(plant.den[0][0], 0.0)
    for p in Kp:
        C = p + Ki[:, None] / (1j * w)
        keep = (abs(1 + G * C) - radius * abs(C)).min(axis=1) >= margin
        for k in np.flatnonzero(keep)[::-1]:
            if Ki[k] <= best:
                break
            if (np.roots(np.polyadd(den, np.polymul(num, [p, Ki[k]]))).real < 0).all():
                best = Ki[k]
                break
    return best


@pytest.mark.parametrize("plant", [LAG, RESONANT], ids=["lag", "resonant"])
@pytest.mark.parametrize("margin", [0.5, 0.7])
def test_integral_gain_against_brute_force(plant, margin):
    top = 3.0 if plant is RESONANT else 0.3
    G = measured(plant, 0.01, high=0.1 if plant is LAG else 1.0, count=250)
    d = rt.design.frf_pid(G, modulus_margin=margin)
    radius = G.confidence_radius(1 - 0.01 / 250)[0, 0]
    w = 2 * np.pi * G.frequencies
    found = brute(G.response[0, 0], w, radius, margin, plant, np.linspace(-2, 12, 141), np.geomspace(1e-4, top, 300))
    assert found > 0 and d.holds and d.outcome.code == "at_the_bins"
    assert 0.97 * found <= d.gains["Ki"] <= 1.3 * found and stable(plant, d.gains)
    C = d.gains["Kp"] + d.gains["Ki"] / (1j * w)
    kept = (abs(1 + G.response[0, 0] * C) - radius * abs(C)).min()
    assert kept >= margin and d.modulus_margin == {"stated": margin, "robust": pytest.approx(kept)}


def test_plants_drawn_from_the_covariance_keep_the_margin():
    """The estimate is one draw around the plant; of 1000 plants drawn around the estimate 99 % keep the margin."""
    G = measured(LAG, 0.02, high=0.1)
    d = rt.design.frf_pid(G, modulus_margin=0.6, probability=0.99)
    rng, w = np.random.default_rng(5), 2 * np.pi * G.frequencies
    C, sigma = d.gains["Kp"] + d.gains["Ki"] / (1j * w), np.sqrt(G.variance[0, 0] / 2)
    drawn = G.response[0, 0] + sigma * (rng.standard_normal((1000, len(w))) + 1j * rng.standard_normal((1000, len(w))))
    assert d.holds and (abs(1 + drawn * C).min(axis=1) >= 0.6).mean() >= 0.99
    true = LAG(1j * w)
    assert abs(1 + true * C).min() >= 0.6


def test_more_noise_costs_gain():
    gains = [rt.design.frf_pid(measured(LAG, noise, high=0.1)).gains["Ki"] for noise in (0.0, 0.02, 0.06)]
    assert gains[0] > gains[1] > gains[2] > 0


def test_model_is_certified_at_every_frequency():
    d = rt.design.frf_pid(RESONANT, modulus_margin=0.6)
    c = d.certificates[0]
    assert d.holds and rt.verify(c).valid and d.value == c.region["bound"] == pytest.approx(1 / 0.6)
    loop = control.feedback(1, RESONANT * d.controller)
    w = np.geomspace(1e-4, 1e3, 20000)
    assert abs(loop(1j * w)).max() < 1 / 0.6
    assert (d.closed_loop.poles().real < 0).all()


def test_negative_gain_and_derivative():
    d = rt.design.frf_pid(-1 * LAG)
    assert d.holds and d.gains["Ki"] < 0
    three = rt.design.frf_pid(LAG, structure="pid")
    two = rt.design.frf_pid(LAG, structure="pi")
    assert three.holds and two.holds and three.gains["Ki"] > 1.1 * two.gains["Ki"]
    lags = rt.design.frf_pid(LAG, structure=2)
    assert lags.holds and lags.gains["Ki"] >= 0.99 * two.gains["Ki"] and set(lags.gains) == {"Kp", "Ki", "c1", "c2"}
    pd = rt.design.frf_pid(LAG, structure="pd")
    assert pd.holds and pd.gains["Kp"] > 0 and set(pd.gains) == {"Kp", "Kd"}


@pytest.mark.parametrize("structure", ["pi", "pid", 2])
def test_realization_has_the_response_of_the_basis(structure):
    for plant in (LAG, control.c2d(control.ss(LAG), 0.5)):
        d = rt.design.frf_pid(plant, structure=structure)
        assert d.holds and (d.controller.dt or 0.0) == (plant.dt or 0.0)
        w = np.array([0.003, 0.05, 0.9])
        z = np.exp(1j * w * plant.dt) if plant.dt else 1j * w
        wanted = d.structure.basis(w) @ np.array(list(d.gains.values()))
        assert [complex(d.controller(x)) for x in z] == pytest.approx(wanted.tolist(), rel=1e-9)


def test_sampled_controller_of_a_measured_response():
    """Response of the held plant; the loop of the sampled plant with the controller is stable and keeps the margin."""
    T = 0.5
    held = control.c2d(control.ss(LAG), T)
    f = np.geomspace(1e-4, 0.9, 200)
    G = measured(LAG, 0.0, high=0.9, count=200).replace(
        response=np.array([complex(held(np.exp(2j * np.pi * x * T))) for x in f])[None, None])
    d = rt.design.frf_pid(G, modulus_margin=0.6, sample_time=T)
    loop = control.feedback(1, held * d.controller)
    assert d.holds and (abs(loop.poles()) < 1).all()
    w = np.geomspace(1e-4, np.pi / T, 5000)
    assert abs(loop(np.exp(1j * w * T))).max() < 1 / 0.59


def test_one_controller_for_several_responses():
    plants = [LAG, 1.6 * LAG, control.tf([2.5], np.polymul([90, 1], np.polymul([8, 1], [6, 1])))]
    both = rt.design.frf_pid([measured(p, 0.005, high=0.1) for p in plants])
    assert both.holds and all(stable(p, both.gains) for p in plants)
    alone = [rt.design.frf_pid(measured(p, 0.005, high=0.1)).gains["Ki"] for p in plants]
    assert both.gains["Ki"] <= 1.001 * min(alone)


def test_bandwidth_and_weights():
    d = rt.design.frf_pid(LAG, structure="pid", bandwidth=0.05)
    w = np.geomspace(1e-4, 0.05, 300)
    S = 1 / (1 + LAG(1j * w) * d.controller(1j * w))
    assert d.holds and abs(S).max() <= 1 / np.sqrt(2) * 1.001
    d = rt.design.frf_pid(LAG, structure="pi", bandwidth=5.0)
    assert not d.holds and d.outcome.code == "infeasible" and d.value == np.inf and not d.certificates
    free = rt.design.frf_pid(measured(LAG, high=0.1))
    top = free.gains["Kp"]
    held = rt.design.frf_pid(measured(LAG, high=0.1), weights={"KS": 1.5 / top})
    w = 2 * np.pi * measured(LAG, high=0.1).frequencies
    C = held.gains["Kp"] + held.gains["Ki"] / (1j * w)
    G = measured(LAG, high=0.1).response[0, 0]
    assert held.holds and abs(C / (1 + G * C)).max() <= top / 1.5 * (1 + 1e-6) and held.gains["Ki"] < free.gains["Ki"]


def test_unstable_plant_needs_its_number_of_poles_and_a_start():
    plant = control.tf([1], np.polymul([1, -0.5], [0.1, 1]))
    good = {"Kp": 3.0, "Ki": 0.5}
    assert stable(plant, good)
    d = rt.design.frf_pid(plant, unstable_poles=1, initial=good, modulus_margin=0.4)
    assert d.holds and stable(plant, d.gains) and d.gains["Ki"] > 0.5
    for given, words in (({"unstable_poles": 1}, "without initial"), ({"initial": good}, "unstable_poles"),
                         ({"unstable_poles": 1, "initial": {"Kp": 0.1, "Ki": 0.01}}, "does not turn"),
                         ({"unstable_poles": 2, "initial": good}, "does not turn")):
        with pytest.raises(InputError, match=words):
            rt.design.frf_pid(plant, modulus_margin=0.4, **given)


def test_responses_that_cannot_be_designed_from():
    G = measured(LAG, 0.01)
    broken = np.array(G.response)
    broken[0, 0, 7] = np.nan
    sparse = measured(control.tf([1], [1, 0.002, 1]), high=1.0, low=1e-3, count=12)
    integrating = measured(control.tf([1], [10, 1, 0]))
    for given, words in ((G.replace(response=broken), "not determined"), (sparse, "coarser than a resonance"),
                         (integrating, "integrator or a slow mode"), ([measured(LAG), measured(-1 * LAG)], "sign"),
                         (3.0, "float"), ([], "no response")):
        with pytest.raises(InputError, match=words):
            rt.design.frf_pid(given)


@pytest.mark.parametrize(("given", "words"), [
    ({"modulus_margin": 1.0}, "modulus_margin"), ({"probability": 1.0}, "probability"),
    ({"structure": "pidd"}, "structure"),
    ({"weights": {"X": 1}}, "weights"), ({"weights": {"S": [1, 2]}}, "weights"), ({"initial": {"Kp": 1}}, "initial"),
    ({"bandwidth": 1e-9}, "bandwidth"), ({"sample_time": 60.0}, "Nyquist"), ({"unstable_poles": -1}, "unstable_poles")])
def test_bad_arguments_are_named(given, words):
    with pytest.raises(InputError, match=words):
        rt.design.frf_pid(measured(LAG, 0.01), **given)


def test_result_prints_exports_and_has_margins(tmp_path):
    d = rt.design.frf_pid(measured(LAG, 0.01, high=0.1))
    found = d.margins["control"]
    assert "nothing is claimed between the bins" in str(d) and found["modulus"] >= 0.5
    assert found["gain"] > 1 and 20 < found["phase"] < 120 and found["delay"] > 0
    d.export(tmp_path / "pi.json")
    assert (tmp_path / "pi.json").exists()


@pytest.mark.parametrize("high", [0.01, 0.06])
def test_a_loop_that_crosses_one_outside_of_the_bins_is_refused(high):
    """The phase of 1/(s+1)^3 passes -180 degrees at 0.28 Hz: nothing measured says how a useful loop ends there."""
    G = measured(control.tf([1], [1, 3, 3, 1]), 1e-6, high=high)
    d = rt.design.frf_pid(G, modulus_margin=0.5)
    assert not d.holds and d.outcome.code == "infeasible"
    assert "crosses 1 below the first bin" in d.outcome.text, d.outcome.text


def test_the_picture_is_the_sensitivity_of_the_centers_and_of_the_worst_plants():
    """Against plants drawn on the edges of the circles: none is more sensitive than the dotted curve."""
    G = measured(LAG, noise=0.01)
    d = rt.design.frf_pid(G, modulus_margin=0.6)
    centers, worst, asked = d.plot().get_lines()
    f, radius = centers.get_xdata() / (2 * np.pi), d.discs[0].radius
    assert f == pytest.approx(G.frequencies)
    C = d.gains["Kp"] + d.gains["Ki"] / (2j * np.pi * f)
    assert centers.get_ydata() == pytest.approx(abs(1 / (1 + G.response[0, 0] * C)))
    turns = np.exp(2j * np.pi * np.arange(720) / 720)[:, None]
    drawn = abs(1 / (1 + (G.response[0, 0] + radius * turns) * C)).max(axis=0)
    assert (drawn <= worst.get_ydata() * (1 + 1e-9)).all() and drawn == pytest.approx(worst.get_ydata(), rel=1e-3)
    assert worst.get_ydata().max() <= asked.get_ydata()[0] == 1 / 0.6
