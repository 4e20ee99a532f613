"""Hybrid integrator-gain control: the element, its describing function, and when the circle criterion holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import control
import numpy as np
import pytest

import robthermal as rt

STAGE = control.tf([2.0], [3000.0, 160.0, 1.0])  # K/W, time constants 139 and 22 s
PI = control.tf([2.0, 0.02], [1, 0])


def design(gain: float = 4.0, rate: float = 0.05, linear: object = PI, plant: object = STAGE) -> object:
    return rt.design.hybrid_integrator_gain(plant, linear, gain=gain, rate=rate, sample_time=1.0)


def run(share: Callable[[int, float], float], n: int, start: np.ndarray | None = None, reference: float = 0.0,
        load: float = 0.0) -> np.ndarray:
    """The loop of STAGE and PI with any element beside it, by a program of its own; errors."""
    P = control.c2d(control.ss(STAGE), 1.0)
    x, z, errors = np.zeros(2) if start is None else start, 0.0, np.zeros(n)
    for k in range(n):
        e = reference - (P.C @ x)[0]
        u = 2.0 * e + 0.02 * z + share(k, e)
        z, x, errors[k] = z + e, P.A @ x + P.B[:, 0] * (u + load), e
    return errors


def test_the_element_follows_the_mode_rule_of_deenen() -> None:
    """Fine steps of the rule as published: integrate, unless at the gain and about to leave the sector."""
    d, dt = design(gain=3.0, rate=3.0), 1e-3
    d = replace(d, sample_time=dt)
    t = np.arange(0, 12, dt)
    e = np.sin(t) + 0.5 * np.sin(2.7 * t + 0.4) - 0.5 * np.sin(0.4)
    h, by_rule, by_projection = 0.0, np.zeros_like(t), np.zeros_like(t)
    for k in range(1, len(t)):
        slope = (e[k] - e[k - 1]) / dt
        at_gain = abs(h - 3.0 * e[k - 1]) <= 1e-9 or h * (3.0 * e[k - 1] - h) < 0
        if at_gain and 3.0 * e[k] ** 2 > 3.0 * e[k] * slope:
            h = 3.0 * e[k]  # gain mode
        else:
            h = h + dt * 3.0 * e[k]
            if h * (3.0 * e[k] - h) < 0:  # reached the sector's edge within this step
                h = 3.0 * e[k] if h * e[k] > 0 else 0.0
        by_rule[k] = h
        by_projection[k] = d.element(by_projection[k - 1], e[k])
    assert np.abs(by_rule - by_projection).max() < 2e-2
    assert 0.2 < np.mean(np.abs(by_projection - 3.0 * e) < 1e-9) < 0.8  # both modes occur


def test_output_is_always_in_the_sector() -> None:
    d, errors, outputs = design(gain=2.5, rate=5.0), np.random.default_rng(0).normal(size=2000), [0.0]
    for e in errors:
        outputs.append(d.element(outputs[-1], e))
    h = np.array(outputs[1:])
    assert (h * (2.5 * errors - h)).min() >= -1e-15 and np.abs(h).max() > 1.0


@pytest.mark.parametrize("w", [1e-3, 0.02, 0.3])
def test_describing_function_is_the_first_harmonic(w: float) -> None:
    d, n = design(gain=4.0, rate=0.1), 8000
    t = np.arange(n) * 2 * np.pi / (w * n)
    fine, h, out = replace(d, sample_time=float(t[1])), 0.0, np.zeros(2 * n)
    for k in range(2 * n):
        out[k] = h = fine.element(h, np.sin(w * t[k % n]))
    first = 2j / n * np.sum(out[n:] * np.exp(-1j * w * t))
    assert d.describing_function(w) == pytest.approx(first, rel=1e-3)


def test_lag_is_at_most_38_degrees() -> None:
    lag = -np.degrees(np.angle(design().describing_function(np.geomspace(1e-6, 1e4, 400))))
    assert (lag > 0).all() and (np.diff(lag) > -1e-6).all()
    assert lag[-1] == pytest.approx(90 - np.degrees(np.arctan(4 / np.pi)), abs=0.01)
    with pytest.raises(rt.InputError, match="frequency"):
        design().describing_function([1.0, 0.0])


@pytest.mark.parametrize("seed", range(4))
def test_the_criterion_is_that_of_the_nyquist_plot(seed: int) -> None:
    """Random stable stages: proven just below the gain at which 1 + k Re H reaches zero, refused just above it."""
    rng = np.random.default_rng(seed)
    taus, Kp, Ki = rng.uniform(5, 150, 3), rng.uniform(0.2, 1.0), rng.uniform(1e-4, 1e-3)
    plant = control.tf([2.0], np.poly(-1 / taus) * np.prod(taus))
    linear = control.tf([Kp, Ki], [1, 0])
    G = control.c2d(control.ss(plant), 1.0)
    z = np.exp(1j * np.geomspace(1e-6, np.pi, 4001))
    H = G(z) / (1 + G(z) * (Kp + Ki / (z - 1)))
    limit = -1 / H.real.min()
    below, above = design(0.99 * limit, 0.1, linear, plant), design(1.01 * limit, 0.1, linear, plant)
    assert below.holds and rt.verify(below.certificate).valid and below.outcome.code == "certified"
    assert not above.holds and above.outcome.code == "not_certified" and "circle criterion fails" in str(above)
    assert below.largest_gain == pytest.approx(limit, rel=1e-2)


def test_a_loop_that_needs_the_element_is_refused() -> None:
    """An unstable plant: gains at and above the middle of the sector stabilize it, 0 does not."""
    unstable = control.tf([1.0], [100.0, -1.0])
    d = design(8.0, 0.05, 0.0, unstable)
    assert not d.holds and d.largest_gain == 0.0 and "without the element" in str(d)


def test_a_sector_that_makes_the_loop_oscillate_is_refused() -> None:
    """With the constant gain k in the place of the element the loop is unstable: it must not be certified."""
    plant, k = control.tf([2.0], np.poly([-1 / 60, -1 / 30, -1 / 10]) * 60 * 30 * 10), 12.0
    G = control.c2d(control.ss(plant), 1.0)
    assert abs(np.linalg.eigvals(G.A - (0.2 + k) * G.B @ G.C)).max() > 1
    assert not design(k, 0.05, 0.2, plant).holds


def test_every_element_in_the_sector_decays() -> None:
    """Elements that jump at random, and those that do worst at each sample, with the criterion proven."""
    k, rng = 0.99 * design().largest_gain, np.random.default_rng(3)
    assert design(k).holds
    factors = rng.uniform(0, k, 6000)
    for share in (lambda n, e: factors[n] * e, lambda n, e: k * e * (n % 30 < 15), lambda n, e: k * e * (n % 7 < 3)):
        errors = np.abs(run(share, 6000, start=np.array([50.0, -3.0])))
        assert errors[:200].max() > 0.05 and errors[-200:].max() < 1e-6


def test_less_overshoot_than_the_integrator_and_slower_against_a_load() -> None:
    """The table of the documentation, by a program of its own."""
    d, state = design(), {"h": 0.0}

    def hybrid(k: int, e: float) -> float:
        state["h"] = min(max(state["h"] + 0.05 * e, min(0.0, 4 * e)), max(0.0, 4 * e))
        return state["h"]

    def integrator() -> Callable[[int, float], float]:
        sums = {"z": 0.0}

        def share(k: int, e: float) -> float:
            sums["z"] += 0.05 * e
            return sums["z"]
        return share

    def last(errors: np.ndarray, limit: float) -> int:
        return int(np.flatnonzero(np.abs(errors) > limit)[-1]) + 1

    step = run(hybrid, 2000, reference=1.0)
    np.testing.assert_allclose(d.simulate(1.0, samples=2000)["error"], step, atol=1e-9)
    state["h"] = 0.0
    load = run(hybrid, 2000, load=1.0)
    np.testing.assert_allclose(d.simulate(0.0, np.ones(2000))["error"], load, atol=1e-9)
    of_pi, load_of_pi = run(integrator(), 2000, reference=1.0), run(integrator(), 2000, load=1.0)
    assert -step.min() == pytest.approx(0.25, abs=0.01) and -of_pi.min() == pytest.approx(0.62, abs=0.01)
    assert last(step, 0.02) < 0.4 * last(of_pi, 0.02)
    assert abs(load).max() == pytest.approx(abs(load_of_pi).max(), rel=0.05)
    assert last(load, 0.02) > 1.2 * last(load_of_pi, 0.02)  # when not
    assert abs(step[-1]) < 1e-3 and abs(load[-1]) < 1e-3 and d.offset_free


def test_without_integrator_an_error_stays_and_is_said() -> None:
    d = design(4.0, 0.05, 2.0)
    assert d.holds and not d.offset_free and "leave an error" in str(d)
    seen = d.simulate(1.0, samples=3000)
    assert seen["error"][-1] == pytest.approx(1 / (1 + 2.0 * (2.0 + 4.0)), rel=1e-6)  # 1/(1 + G(0)(C + k))
    assert seen["gain_mode"][-1] and not seen["gain_mode"][1:40].all()


def test_certificates_of_another_loop_are_rejected() -> None:
    """A larger sector, less damping, another plant: the numbers of the file are the claim."""
    d = design(0.98 * design().largest_gain)
    assert d.holds
    document = d.certificate
    wide = {**document.system, "controller": {**document.system["controller"],
                                              "D": [[2.0, 0.6 * d.gain]]}}
    fast = {**document.system, "plant": {**document.system["plant"],
                                         "B": (1.5 * np.asarray(document.system["plant"]["B"])).tolist()}}
    for changed in (replace(document, system=wide), replace(document, system=fast),
                    replace(document, region={**document.region, "bound": 0.9 * document.region["bound"]})):
        assert not rt.verify(changed).valid


@pytest.mark.parametrize(("arguments", "words"), [
    ({"gain": 0.0}, "gain"), ({"rate": -1.0}, "rate"), ({"plant": control.tf([1.0, 1.0], [2.0, 1.0])}, "direct path"),
    ({"plant": control.ss([[-1.0]], [[1.0, 1.0]], [[1.0]], 0)}, "2 inputs"),
    ({"linear": control.tf([1.0, -0.5], [1.0, -1.0], 2.0)}, "sample times")])
def test_bad_arguments_are_named(arguments: dict, words: str) -> None:
    with pytest.raises(rt.InputError, match=words):
        design(**arguments)
    with pytest.raises(rt.InputError, match="sample_time"):
        rt.design.hybrid_integrator_gain(STAGE, 1.0, gain=1.0, rate=1.0)
    with pytest.raises(rt.InputError, match="samples"):
        design().simulate(1.0)
