"""Every error of the room names the argument, the value and the remedy; never a filter."""

from __future__ import annotations

from typing import Any

import control
import numpy as np
import pytest

import robthermal as rt

from .conftest import make_random_pair

PAIR = make_random_pair(0)
PULL = control.tf([1.0], [1, -0.5], 0.01)


def refuses(words: str, **changed: Any) -> None:
    arguments = {"P1": PAIR.P1, "P2": PAIR.P2, "C1": PAIR.C1, "C2": PAIR.C2, **changed}
    with pytest.raises(rt.InputError, match=words):
        rt.coupling.evaluate(*[arguments.pop(name) for name in ("P1", "P2", "C1", "C2")], **arguments)


def test_loops() -> None:
    refuses(r"P1, C1: the loop of plant and controller is unstable: pole at", C1=-50.0)
    refuses(r"P2, C2: the loop .* unstable", P2=control.tf([1], [1, -1.1], 0.01), C2=0.01)
    hidden = control.ss([[1.5, 0], [0, 0.5]], [[0], [1]], [[1, 1]], 0, 0.01)  # a mode no controller reaches
    refuses("P1: a mode that the input does not reach.* is unstable: pole at 1.5", P1=hidden)
    turned = np.array([[0.6, 0.8], [-0.8, 0.6]])
    mixed = control.ss(turned.T @ hidden.A @ turned, turned.T @ hidden.B, hidden.C @ turned, 0, 0.01)
    refuses("P1, C1: the loop .* unstable: pole at 1.5", P1=mixed)  # hidden, but not by zeros in the matrices
    refuses("P1, C1: the loop .* unstable: pole at 1.5", P1=control.tf(np.poly([1.5]), np.poly([1.5, 0.5]), 0.01))
    refuses("X_hat: a mode .* unstable", X_hat=hidden)
    with pytest.raises(rt.InputError, match="P0: a mode"):
        rt.coupling.coprime(control.append(hidden, PAIR.P2), (PAIR.C1, PAIR.C2))
    refuses("not well posed", P1=control.tf([1, 0], [1, -0.5], 0.01), C1=-1.0)


def test_sample_times() -> None:
    refuses(r"different sample times: P1 has dt = 0\.02 s", P1=control.tf([1], [1, -0.5], 0.02))
    refuses(r"X_hat: sample time 0 s, the others have 0\.01 s", X_hat=control.tf([1], [1, 1]))
    refuses(r"dt = True", C2=control.tf([0.1], [1], True))


def test_not_linear_systems() -> None:
    refuses("C1: 'PID' is not a linear system", C1="PID")
    refuses("P1: 2 outputs and 2 inputs", P1=control.append(PAIR.P1, PAIR.P2))
    refuses("P1: NaN or infinite", P1=control.ss([[np.nan]], [[1]], [[1]], [[0]], 0.01))
    refuses("X_hat: nan is not finite", X_hat=float("nan"))
    refuses("P1: the plant is zero", P1=control.ss([[0.5]], [[1]], [[0]], [[0]], 0.01), C1=0.1)
    with pytest.raises(rt.InputError, match="K0: entry .1, 2. is not zero"):
        rt.coupling.coprime((PAIR.P1, PAIR.P2), control.ss([], [], [], [[0.1, 0.1], [0, 0.1]], 0.01))


def test_filters() -> None:
    refuses(r"X_hat: is unstable: pole at 1\.2", X_hat=control.tf([1], [1, -1.2], 0.01))
    refuses(r"Y_hat: is unstable: pole at 1\. Expected every pole inside", Y_hat=control.tf([0.1], [1, -1], 0.01))
    refuses("X_hat: improper", X_hat=control.tf([1, 0, 0], [1, 0.1], 0.01))
    P, C = control.tf([1, -0.3], [1, -0.5], 0.01), control.tf([0.1], [1, -0.2], 0.01)  # no delay: Z = 1
    refuses(r"1 - X\(∞\)Y\(∞\) = 0", P1=P, P2=P, C1=C, C2=C, X_hat=2.0, Y_hat=0.5)


def test_all_pass_factors() -> None:
    refuses("P1⁻¹Z is improper: Z has relative degree 0, P1 has 2", Z1=rt.coupling.inner_factor(
        control.zpk(control.ss(PAIR.P1).zeros(), [0.1, 0.1], 1, dt=0.01))[0])
    refuses("P1⁻¹Z is unstable: Z lacks the zero of P1 at .*, and improper: Z has relative degree 0, P1 has", Z1=1.0)
    refuses("Z lacks the zero of P2", Z2=control.tf([1], [1, 0, 0], 0.01))
    refuses("Z1: is unstable", Z1=control.tf([1], [1, -2], 0.01))


@pytest.mark.parametrize(("plant", "place"), [
    (control.tf([1, 1], [1, -0.5, 0.1], 0.01), "zero at -1.* on the unit circle"),
    (control.zpk([np.exp(0.3j), np.exp(-0.3j)], [0.1, 0.2, 0.5], 1, dt=0.01), "on the unit circle"),
    (control.tf([1, 0], [1, 3, 2]), r"zero at 0.* on the imaginary axis"),
    (control.tf([1, 0, 4], [1, 3, 2, 5]), "on the imaginary axis"),
])
def test_zeros_on_the_boundary(plant: Any, place: str) -> None:
    with pytest.raises(rt.InputError, match=place):
        rt.coupling.inner_factor(plant)


def test_window_weight_and_disturbances() -> None:
    continuous = control.tf([1], [1, 1])
    refuses("window: a window in continuous time", P1=continuous, P2=continuous, C1=0.5, C2=0.5, window=0.1)
    refuses("window of 0.001 s. Expected at least one sample", window=0.001)
    refuses("window of nan", window=float("nan"))
    refuses("weight: both weight and window", window=0.1, weight=PULL)
    refuses("weight: weight S1 W1 is unstable", weight=control.tf([1], [1, -1], 0.01))
    refuses("disturbances: float is not a pair", disturbances=1.0)
    refuses("cutoff: -3", cutoff=-3.0)
    refuses("cutoff: nan", cutoff=float("nan"))


def test_continuous_rigid_body_needs_a_cutoff_only_without_controller() -> None:
    with pytest.raises(rt.InputError, match="cutoff.*relative degree 2.*Give cutoff"):
        rt.coupling.inner_factor(control.tf([1], [1, 0, 0]))
    f = rt.coupling.coprime((control.tf([1], [1, 0, 0]),) * 2, (control.tf([10, 5], [1, 8]),) * 2)
    assert f.Np.nstates == 4


def test_uncertainty_of_other_plants() -> None:
    w = np.linspace(1, 314, 150)
    other = make_random_pair(1)
    frf = np.zeros((2, 2, 150), dtype=complex)
    z = np.exp(0.01j * w)
    frf[0, 0], frf[1, 1] = other.P1(z), other.P2(z)
    u = rt.coupling.dual_youla(control.FRD(frf, w), (other.P1, other.P2), (other.C1, other.C2))
    refuses("uncertainty: made for other plants", uncertainty=u)
    refuses("uncertainty: str is not a frequency response", uncertainty=["p1.csv"])
