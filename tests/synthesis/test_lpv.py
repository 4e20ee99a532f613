"""Scheduled controllers: optima of constant plants, plants drawn from the hull, moving plants, refusals."""

from __future__ import annotations

import json

import control
import numpy as np
import pytest
from plants import generalized, norm
from scipy.linalg import expm

import robthermal as rt
from robthermal.errors import InputError
from robthermal.synthesis._formulations import lpv_level
from robthermal.synthesis._hinf import best_of
from robthermal.synthesis._lpv_program import scheduled
from robthermal.synthesis._plant import read_generalized
from robthermal.synthesis._schedule import read_schedule

LAG = [control.ss([[a]], [[1, 0, 1]], [[1], [0], [1]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]]) for a in (-1, 1)]


def turning(stiffness, input_gain=1.0, seen=1.0, through=0.0, dt=0.0):
    """A mass on a spring, pushed through a gain, its place measured with a gain and noise."""
    A, B = np.array([[0, 1], [-stiffness, -0.2]]), np.array([[0.0], [input_gain]])
    if dt:
        both = expm(np.block([[A, B], [np.zeros((1, 3))]]) * dt)
        A, B = both[:2, :2], both[:2, 2:]
    return generalized(A, [[0, 0], [0.3, 0]], B, [[1, 0], [0, 0]], [[seen, 0]], np.zeros((2, 2)), [[0], [0.2]],
                       [[0, 0.1]], np.array([[through]]), dt)


@pytest.fixture(scope="module")
def spring():
    """Stiffness from -1 (unstable) to 3."""
    return rt.design.lpv([turning(-1.0), turning(3.0)], {"stiffness": [-1.0, 3.0]}, 1, 1)


def proven(d):
    return bool(d.certificates) and all(rt.verify(one).valid for one in d.certificates)


def averaged(systems, weights):
    A, B, C, D = (sum(w * getattr(one, key) for w, one in zip(weights, systems, strict=True)) for key in "ABCD")
    return control.ss(A, B, C, D, systems[0].dt)


def worst(d, count=15, seed=0):
    """Largest norm of python-control's loops of averaged plants with averaged controllers."""
    draws = np.vstack([np.eye(len(d.plants)),
                       np.random.default_rng(seed).dirichlet(np.full(len(d.plants), 0.7), count)])
    return max(norm(averaged(d.plants, row), averaged(d.controllers, row)) for row in draws)


def test_one_plant_is_the_h_infinity_problem():
    """x' = x + w1 + u: the optimum is 1 + √3; alone, twice, or with the stable plant, which is easier."""
    one = rt.design.lpv(LAG[1], {"a": [1.0]}, 1, 1)
    for d in (one, rt.design.lpv(LAG, {"a": [-1.0, 1.0]}, 1, 1)):
        assert d.holds and proven(d) and 1 + 3**0.5 <= d.value < 1.012 * (1 + 3**0.5)
        assert d.lower == pytest.approx(1 + 3**0.5, rel=5e-3)
    assert one.gain({"a": 1.0}).A == pytest.approx(one.controllers[0].A)


def test_least_level_is_that_of_the_reference_program():
    for plants in (LAG, [turning(-1.0), turning(3.0)]):
        own = [read_generalized(P, 1, 1) for P in plants]
        mean = read_generalized(averaged(plants, [0.5, 0.5]), 1, 1)
        least = next(scheduled(own, mean, best_of(mean, 0.005, None, {}, None)[0].K, None)).least
        assert least == pytest.approx(lpv_level(own), rel=1e-4)


def test_constant_plants_of_the_hull_stay_below_the_value(spring):
    assert spring.holds and proven(spring) and spring.lower < spring.value
    assert 0.5 * spring.value < worst(spring) <= spring.value
    assert 0.2 < spring.margins["all loops at once"]["disk"] < 2
    assert "every plant, constant or varying" in spring.certificates[0].claim


def test_moving_plants_keep_the_l2_gain(spring):
    """Stiffness jumps or swings, driven near resonance: ∫z² <= value² ∫w², the states exact at the samples."""
    rng, dt, seen, loops = np.random.default_rng(4), 0.02, 0.0, {}
    for share in np.arange(11) / 10:
        P, K = (averaged(one, [1 - share, share]) for one in (spring.plants, spring.controllers))
        loop = P.lft(K)
        both = expm(np.block([[loop.A, loop.B], [np.zeros((2, loop.nstates + 2))]]) * dt)[:loop.nstates]
        loops[round(10 * share)] = both, np.hstack([loop.C, loop.D])
    for trial in range(6):
        tenth, x, energy, spent, pace = 0, np.zeros(2 + spring.controllers[0].nstates), 0.0, 0.0, rng.uniform(0.3, 3)
        for step in range(1500):
            if trial % 2:
                tenth = round(5 + 5 * np.sin(pace * step * dt))
            elif rng.random() < 0.02:
                tenth = int(rng.integers(11))
            grown, seen_as = loops[tenth]
            w = np.array([np.sin(pace * step * dt), 0.1 * rng.standard_normal()]) * (step < 1000)
            z, x = seen_as @ [*x, *w], grown @ [*x, *w]
            energy, spent = energy + float(z @ z), spent + float(w @ w)
        seen = max(seen, np.sqrt(energy / spent))
        assert np.sqrt(energy / spent) <= 1.01 * spring.value  # 1 %: z is summed at the samples
    assert seen > 0.2 * spring.value


@pytest.mark.parametrize(("plants", "words"), [
    ([turning(1.0, 1.0), turning(2.0, 1.5)], "lags at u"),
    ([turning(1.0, seen=1.0), turning(2.0, seen=1.3)], "lags at y"),
    ([turning(1.0, through=0.3), turning(2.0, through=0.3)], "lags at u"),
    ([turning(1.0, through=0.3), turning(2.0)], "lags at u and y"),
    ([turning(1.0, 1.0, 1.0), turning(2.0, 1.5, 1.3)], "lags at u and y")])
def test_plants_whose_ways_in_and_out_vary_get_lags(plants, words):
    d = rt.design.lpv(plants, {"k": [1.0, 2.0]}, 1, 1)
    assert d.holds and proven(d) and d.method.endswith(words)
    assert d.certificates[0].system["vertices"][1]["A"] == plants[1].A.tolist()  # of the plants as given
    assert worst(d, 8) <= d.value < 1.3 * d.lower


def test_sampled_plants(tmp_path):
    plants = [turning(k, dt=0.1) for k in (-1.0, 3.0)]
    d = rt.design.lpv(plants, {"k": [-1.0, 3.0]}, 1, 1)
    assert d.holds and proven(d) and worst(d, 8) <= d.value and d.gain({"k": 0.0}).dt == 0.1
    d.export(tmp_path / "out")
    assert "Controllers of 2 points" in (tmp_path / "out" / "controller.c").read_text()
    content = json.loads((tmp_path / "out" / "design.json").read_text())
    assert content["scheduling"] == {"k": [-1.0, 3.0]} and len(content["controllers"]) == 2


def test_continuous_plants_have_no_c_source(spring, tmp_path):
    with pytest.raises(InputError, match="needs sampled plants"):
        spring.export(tmp_path / "controller.c")


def test_a_smaller_gain_is_asked_for_by_a_larger_gamma(spring):
    """Controllers for twice the bound are slower; one below the optimum is refused with the best number."""
    plants = list(spring.plants)
    mild = rt.design.lpv(plants, {"k": [-1, 3]}, 1, 1, gamma=2 * spring.value, rates={"k": 5.0})
    assert mild.holds and spring.value < mild.value <= 2 * spring.value and "rates given" in str(mild.robust_against)
    assert f"could reach {spring.lower:.4g} at best" in mild.outcome.text and "at best" not in spring.outcome.text
    alone = [rt.design.hinf(plant, 1, 1, tolerance=0.005).value for plant in plants]
    assert spring.lower <= max(alone) <= 1.01 * spring.lower  # no schedule does better than the best for one plant
    speed = [max(abs(np.linalg.eigvals(K.A)).max() for K in d.controllers) for d in (spring, mild)]
    assert speed[1] < speed[0]
    none = rt.design.lpv(plants, {"k": [-1, 3]}, 1, 1, gamma=0.9 * spring.lower)
    assert not none.holds and none.value == np.inf and not none.certificates
    assert f"best achievable with one quadratic form is about {spring.value / 1.01:.2g}"[:-1] in none.outcome.text
    assert not none.gain({"k": 0}).D.any()


def test_plants_that_no_scheduled_controller_bears():
    """x' = x ± u: at the mean of the two no control is left, whatever the schedule."""
    plants = [control.ss([[1.0]], [[1, 0, b]], [[1], [0], [1]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]]) for b in (1, -1)]
    d = rt.design.lpv(plants, {"b": [1, -1]}, 1, 1)
    assert not d.holds and d.value == np.inf and "No scheduled controller was found" in d.outcome.text


def test_weights_of_grids_and_scattered_points():
    grid = read_schedule({"I": [0.0, 1.0, 3.0], "T": [300.0, 280.0]}, 6)
    assert grid.points[1].tolist() == [0.0, 280.0]
    rng = np.random.default_rng(0)
    scattered = read_schedule({"x": [0, 1, 0, 1, 0.4], "y": [0, 0, 1, 1.5, 0.6]}, 5)
    for one, low, high in ((grid, [0, 280], [3, 300]), (scattered, [0.05, 0.05], [0.9, 0.9])):
        for _ in range(20):
            point = rng.uniform(low, high)
            w = one.weights(dict(zip(one.names, point, strict=True)))
            assert w.min() >= 0 and w.sum() == pytest.approx(1) and w @ one.points == pytest.approx(point)
            assert (w > 1e-9).sum() <= 4
    for k, row in enumerate(scattered.points):
        assert scattered.weights(dict(zip("xy", row, strict=True))) == pytest.approx(np.eye(5)[k], abs=1e-7)
    with pytest.raises(InputError, match="convex hull"):
        scattered.weights({"x": 0.01, "y": 1.4})


@pytest.mark.parametrize(("arguments", "words"), [
    ({"scheduling": {"a": [1.0]}}, "values for 2 plants"), ({"scheduling": {"a": [1.0, 1.0]}}, "same values"),
    ({"scheduling": {}}, "by name"), ({"scheduling": {"a": "12"}}, "finite numbers"),
    ({"scheduling": {"a": [1, np.nan]}}, "finite numbers"), ({"rates": {"b": 1.0}}, "argument rates"),
    ({"rates": {"a": -1.0}}, "rates"), ({"gamma": 0.0}, "gamma"), ({"n_meas": 3}, "n_meas = 3"),
    ({"n_ctrl": 5}, "n_ctrl"),
    ({"plants": [LAG[0], turning(1.0)]}, "plant 1 has 2 states"), ({"plants": []}, "1 to 4096"),
    ({"plants": [LAG[0], control.ss([[1.0]], [[1, 0, 0]], LAG[0].C, LAG[0].D)]}, r"plants\[1\].*not stabilisable"),
    ({"plants": [turning(k) for k in range(400)], "scheduling": {"a": list(range(400))}}, "unknowns")])
def test_bad_arguments_are_named(arguments, words):
    given = {"plants": LAG, "scheduling": {"a": [-1.0, 1.0]}, "n_meas": 1, "n_ctrl": 1, **arguments}
    with pytest.raises(InputError, match=words):
        rt.design.lpv(**given)


@pytest.mark.parametrize("values", [{"stiffness": 4.0}, {"k": 1.0}, {"stiffness": True}, {"stiffness": "1"}, 3.0])
def test_points_outside_are_refused(spring, values):
    with pytest.raises(InputError, match="scheduling"):
        spring.gain(values)
