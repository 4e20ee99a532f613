"""Output feedback of fixed structure: closed forms, brute force, published COMPleib values, refusals."""

from __future__ import annotations

from pathlib import Path

import control
import numpy as np
import pytest
from plants import norm, random_plant

import robthermal as rt
from robthermal.errors import InputError
from robthermal.linear import Plant, plant_norm

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data" / "compleib"
# x' = x + w + u, z = (x, u): the norm of u = -k x is √(1 + k²)/(k - 1)
ONE = control.ss([[1.0]], [[1.0, 1.0]], [[1.0], [0.0], [1.0]], [[0, 0], [0, 1.0], [0, 0]])
# a double integrator whose position alone is measured: no static gain stabilizes it, one state does
DOUBLE = control.ss([[0, 1], [0, 0]], [[0, 0], [1, 1]], [[1, 0], [0, 0], [1, 0]], [[0, 0], [0, 1], [0, 0]])


def proven(d, P):
    c, K = d.certificates[0], d.controller
    return bool(d.holds and rt.verify(c).valid and c.region["bound"] == d.value and norm(P, K) < d.value
                and np.array_equal(np.asarray(c.system["controller"]["D"]).reshape(K.D.shape), K.D))


def compleib(name):
    data = np.load(SHARED / "compleib.npz")
    A, B1, B, C1, C, D11, D12, D21 = (data[f"{name}.{key}"].astype(float)
                                      for key in ("A", "B1", "B", "C1", "C", "D11", "D12", "D21"))
    D = np.block([[D11, D12], [D21, np.zeros((len(C), B.shape[1]))]])
    return control.ss(A, np.hstack([B1, B]), np.vstack([C1, C]), D), len(C), B.shape[1]


def test_static_gain_of_two_states_against_brute_force():
    """x'' = -x + w + u, z = (x, u), position and speed measured with one sensor: y = x + 2 x'."""
    P = control.ss([[0, 1], [1, 0]], [[0, 0], [1, 1]], [[1, 0], [0, 0], [1, 2]], [[0, 0], [0, 0.3], [0, 0]])
    d = rt.design.output_feedback(P, 1, 1)
    brute = min(norm(P, control.ss([], [], [], [[k]])) for k in -np.geomspace(1.01, 1e5, 300))
    assert proven(d, P) and brute * 0.999 < d.value < 1.005 * brute


@pytest.mark.exhaustive
def test_a_state_stabilizes_what_no_gain_does():
    none = rt.design.output_feedback(DOUBLE, 1, 1)
    assert not none.holds and np.isinf(none.value) and not none.certificates and "does not say" in none.outcome.text
    d = rt.design.output_feedback(DOUBLE, 1, 1, order=1)
    assert proven(d, DOUBLE) and d.controller.nstates == 1 and d.lower <= d.value


@pytest.mark.parametrize("order", [0, 1])
def test_decentralized(order):
    """Two unstable lags, weakly coupled: each control may use its own measurement alone."""
    A = [[0.5, 0.2], [-0.3, 0.4]]
    P = control.ss(A, np.hstack([np.eye(2), np.eye(2)]), np.vstack([np.eye(2), np.zeros((2, 2)), np.eye(2)]),
                   np.vstack([np.zeros((2, 4)), np.hstack([np.zeros((2, 2)), np.eye(2)]), np.zeros((2, 4))]))
    d = rt.design.output_feedback(P, 2, 2, structure=np.eye(2), order=order)
    K = d.controller
    assert proven(d, P) and d.lower <= d.value < 1.3 * d.lower and K.nstates == 2 * order
    at = K.C @ np.linalg.solve(0.7j * np.eye(K.nstates) - K.A, K.B) + K.D
    assert at[0, 1] == at[1, 0] == 0 and at[0, 0] != 0


@pytest.mark.exhaustive
def test_sampled_plant():
    P = random_plant(3, 3, dt=0.5)
    d = rt.design.output_feedback(P, 2, 2, order=1)
    assert d.controller.dt == 0.5 and proven(d, P) and d.lower <= d.value


@pytest.mark.skipif(not SHARED.is_dir(), reason="the COMPleib models are not beside the project")
@pytest.mark.parametrize(("name", "published"), [("NN2", 2.2216), ("CM1", 0.8165), ("HE1", 0.154)])
def test_published_static_gains(name, published):
    """Static H-infinity norms of HIFOO and of Apkarian and Noll; only ever better than 1 % above them."""
    P, n_meas, n_ctrl = compleib(name)
    d = rt.design.output_feedback(P, n_meas, n_ctrl, gamma=1.01 * published)
    assert d.holds and rt.verify(d.certificates[0]).valid and d.lower * 0.999 < d.value <= 1.01 * published


def test_a_pole_on_the_axis_to_rounding_has_an_infinite_norm():
    """ROC7 of COMPleib met one in its search: its response at 0 is no number."""
    with np.errstate(all="ignore"):
        found, where = plant_norm(Plant(np.diag([0.0, -1.0]), np.eye(2), np.eye(2), np.zeros((2, 2)), 0.0))
    assert found == np.inf and where == 0.0


@pytest.mark.exhaustive
@pytest.mark.skipif(not SHARED.exists(), reason="COMPleib is not beside this tree")
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", ["ROC7", "NN3", "REA1", "HF2D12"])
def test_no_model_ends_in_an_exception_or_a_wrong_claim(name):
    P, n_meas, n_ctrl = compleib(name)
    d = rt.design.output_feedback(P, n_meas, n_ctrl)
    assert d.holds == bool(d.certificates) == (name != "NN3")
    assert not d.holds or (rt.verify(d.certificates[0]).valid and d.lower * 0.999 < norm(P, d.controller) < d.value)


def test_gamma_below_the_full_order_optimum_is_infeasible():
    d = rt.design.output_feedback(ONE, 1, 1, gamma=0.9)
    assert not d.holds and d.outcome.code == "infeasible" and "gamma = 0.9" in d.outcome.text


@pytest.mark.parametrize(("arguments", "words"), [
    ({"structure": [[1, 1]]}, "structure = "), ({"structure": [[0]]}, "structure = "), ({"order": -1}, "order"),
    ({"gamma": 0.0}, "gamma"), ({"structure": "all"}, "structure = ")])
def test_bad_input(arguments, words):
    with pytest.raises(InputError, match=words):
        rt.design.output_feedback(ONE, 1, 1, **arguments)


def test_groups_with_zeros_inside_need_order_zero():
    P = random_plant(1, 2)
    with pytest.raises(InputError, match="zeros inside a group"):
        rt.design.output_feedback(P, 2, 2, structure=[[1, 0], [1, 1]], order=1)
