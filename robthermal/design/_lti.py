"""Controllers given as python-control systems, with anti-windup, sampled exactly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from .._checks import positive_number
from .._control import control
from ..errors import InputError
from ._controller import Controller, ControllerInput, expect_modules
from ._modules import Array
from ._numbers import expect
from ._plant import ColdSide
from ._sampling import check_sampling


@dataclass(frozen=True)
class LinearController(Controller):
    """v = C z + D e, z⁺ = A z + B e + L (achieved - wanted), e = r - y.

    L makes A - L C stable, so that under an active limit the state follows what is achieved, also for integrators.

    Parameters
    ----------
    A, B, C, D : ndarray
        Discrete-time state space from errors [K] to heats [W].
    L : ndarray
        Anti-windup gain on achieved minus wanted heat.
    sample_time : float
        Time between two samples [s].
    """

    A: Array
    B: Array
    C: Array
    D: Array
    L: Array
    sample_time: float

    @property
    def count(self) -> int:
        """Number of modules."""
        return len(self.C)

    def start(self, given: ControllerInput, heat: Array) -> Array:
        expect_modules(len(self.C), heat)
        # as constant as possible, and zero error gives the heat
        n = len(self.A)
        stack, wanted = np.vstack([self.C, np.eye(n) - self.A]), np.concatenate([heat, np.zeros(n)])
        return np.linalg.lstsq(stack, wanted, rcond=None)[0]

    def heat(self, state: Array, given: ControllerInput) -> Array:
        return self.C @ state + self.D @ (given.reference - given.cold)

    def advance(self, state: Array, given: ControllerInput, wanted: Array, achieved: Array) -> Array:
        return self.A @ state + self.B @ (given.reference - given.cold) + self.L @ (achieved - wanted)


def linear_controller(plant: ColdSide, system: Any, *, sample_time: float) -> LinearController:
    """Take a controller designed elsewhere, for example with python-control.

    Parameters
    ----------
    plant : ColdSide
        What it controls.
    system : control.StateSpace or control.TransferFunction
        From the errors r - y of the cold faces [K] to the heats v [W], in the order of the modules of the
        linearizing feedback law. A continuous
        one is sampled exactly with held input; a discrete one must have this sample time.
    sample_time : float
        Time between two samples [s].

    Returns
    -------
    LinearController

    Raises
    ------
    InputError
        Wrong sizes or sample time; a controller that does not stabilize the sampled plant.

    Examples
    --------
    >>> import control, numpy as np, robthermal as rt
    >>> plant = rt.design.cold_side(rt.design.feedback_linearization(rt.systems.two_module()))
    >>> s = control.tf("s")
    >>> one = 0.3 * (1 + 0.01 / s)
    >>> loop = rt.design.linear_controller(plant, control.append(control.ss(one), control.ss(one)), sample_time=1.0)
    >>> loop.A.round(12).tolist()  # two integrators
    [[1.0, 0.0], [0.0, 1.0]]
    """
    expect(plant, ColdSide, "plant", "rt.design.cold_side")
    h, m = positive_number(sample_time, "sample_time", "s"), len(plant.law.names)
    if not isinstance(system, control.lti.LTI):
        raise InputError(f"system is a {type(system).__name__}", where="argument system",
                         expected="a python-control StateSpace or TransferFunction")
    if (system.ninputs, system.noutputs) != (m, m):
        raise InputError(f"{system.ninputs} inputs, {system.noutputs} outputs", where="argument system",
                         expected=f"{m} of each: errors of {', '.join(plant.law.names)} to their heats")
    ss = control.ss(system)
    if ss.dt and ss.dt is not True and abs(ss.dt - h) > 1e-9 * h:
        raise InputError(f"the controller's sample time is {ss.dt:g} s", where="argument system",
                         expected=f"{h:g} s, or a continuous-time controller")
    controller = _sampled(ss, h)
    # a discrete one has only this sample time: no other is tried
    check_sampling(plant, controller, None if ss.dt else lambda time: _sampled(ss, time))
    return controller


def _sampled(ss: control.StateSpace, h: float) -> LinearController:
    """Exact with held input where it is continuous."""
    A, B, C, D = (np.asarray(M, float) for M in (ss.A, ss.B, ss.C, ss.D))
    if not ss.dt:  # 0 or None: continuous
        n, m = B.shape
        both = np.zeros((n + m, n + m))
        both[:n] = np.hstack([A, B]) * h
        exact = expm(both)[:n]
        A, B = exact[:, :n], exact[:, n:]
    return LinearController(A, B, C, D, _following(A, C), h)


def _following(A: Array, C: Array) -> Array:
    """Gain L with A - L C stable: the steady predictor of a state with unit noises."""
    if not len(A):
        return np.zeros((0, len(C)))
    try:
        P = solve_discrete_are(A.T, C.T, np.eye(len(A)), np.eye(len(C)))
    except (np.linalg.LinAlgError, ValueError):
        raise InputError("an unstable mode of the controller does not reach its outputs", where="argument system",
                         remedy="Remove it (control.minreal).") from None
    return A @ P @ C.T @ np.linalg.inv(C @ P @ C.T + np.eye(len(C)))
