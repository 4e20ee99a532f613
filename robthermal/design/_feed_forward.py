"""Feed-forward of what is measured, and a disturbance observer for what is not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_are

from .._checks import positive_number
from ..errors import InputError
from ._controller import Controller, ControllerInput, expect_controller
from ._modules import Array
from ._numbers import expect
from ._plant import ColdSide
from ._sampling import check_sampling


@dataclass(frozen=True)
class _Around(Controller):
    """Something around a controller."""

    plant: ColdSide
    controller: Controller

    @property
    def sample_time(self) -> float:  # type: ignore[override]  # its controller's: nobody sets it
        """[s]."""
        return self.controller.sample_time


@dataclass(frozen=True)
class FeedForward(_Around):
    """A controller plus the steady heat that holds the reference in the measured surroundings.

    Parameters
    ----------
    plant : ColdSide
        Its static gains.
    controller : Controller
        Works on what is left.
    """

    def _share(self, given: ControllerInput) -> Array:
        return self.plant.holding_heat(given.reference, given.around)

    def start(self, given: ControllerInput, heat: Array) -> Array:
        return self.controller.start(given, heat - self.plant.holding_heat(given.cold, given.around))

    def heat(self, state: Array, given: ControllerInput) -> Array:
        return self.controller.heat(state, given) + self._share(given)

    def advance(self, state: Array, given: ControllerInput, wanted: Array, achieved: Array) -> Array:
        share = self._share(given)
        return self.controller.advance(state, given, wanted - share, achieved - share)


def feed_forward(plant: ColdSide, controller: Controller) -> FeedForward:
    """Add feed-forward of the measured ambient, heaters and reference to a controller.

    Parameters
    ----------
    plant : ColdSide
        The cold side.
    controller : Controller
        For example from `pid`.

    Returns
    -------
    FeedForward
        Its heat holds the set-point exactly in steady state when the model is right and nothing unmeasured acts. A
        `disturbance_observer` goes around it, not inside.

    Examples
    --------
    >>> import robthermal as rt
    >>> plant = rt.design.cold_side(rt.design.feedback_linearization(rt.systems.two_module()))
    >>> loop = rt.design.feed_forward(plant, rt.design.pid(plant, bandwidth=0.02, sample_time=1.0))
    >>> loop.sample_time
    1.0
    """
    expect(plant, ColdSide, "plant", "rt.design.cold_side")
    plant.expect_faces("feed-forward")
    expect_controller(controller)
    if isinstance(controller, DisturbanceObserver):
        raise InputError("the controller is a disturbance observer", where="argument controller",
                         expected="a controller without one: it must see all of the heat",
                         remedy="Turn them round: disturbance_observer(plant, feed_forward(plant, …)).")
    return FeedForward(plant, controller)


@dataclass(frozen=True)
class DisturbanceObserver(_Around):
    """A controller that also cancels the estimated unmeasured heat on the cold faces.

    x̂⁺ = A_d x̂ + B_d (achieved + d̂) + B_w w + L_x e, d̂⁺ = d̂ + L_d e, e = y - C x̂. It is driven by the heat that the
    law *achieved*, so it does not wind up.

    Parameters
    ----------
    plant : ColdSide
        Linear model of the cold side.
    controller : Controller
        Works on what is left; needs no integral action.
    A, B, L : ndarray
        Augmented model [x̂; d̂] and gain.
    """

    A: Array
    B: Array
    L: Array

    def _split(self, state: Array) -> tuple[Array, Array]:
        size = len(self.A)
        return state[:size], state[size:]

    def disturbance(self, state: Array) -> Array:
        """Estimated unmeasured heat on the cold faces [W].

        Parameters
        ----------
        state : ndarray
            Memory of the controller.
        """
        return self._split(state)[0][len(self.plant.lumps):]

    def start(self, given: ControllerInput, heat: Array) -> Array:
        # estimates at the measured temperatures, no disturbance
        own = np.concatenate([given.temperatures[self.plant.indices], np.zeros(len(given.cold))])
        return np.concatenate([own, self.controller.start(given, heat)])

    def heat(self, state: Array, given: ControllerInput) -> Array:
        own, inner = self._split(state)
        return self.controller.heat(inner, given) - own[len(self.plant.lumps):]

    def advance(self, state: Array, given: ControllerInput, wanted: Array, achieved: Array) -> Array:
        own, inner = self._split(state)
        error = given.cold - self.plant.C @ own[:len(self.plant.lumps)]
        estimate = self.A @ own + self.B @ np.concatenate([achieved, given.around]) + self.L @ error
        share = self.disturbance(state)
        return np.concatenate([estimate, self.controller.advance(inner, given, wanted + share, achieved + share)])


def disturbance_observer(plant: ColdSide, controller: Controller, *, time_constant: float) -> DisturbanceObserver:
    """Add a disturbance observer to a controller.

    Parameters
    ----------
    plant : ColdSide
        The cold side.
    controller : Controller
        For example a P or PI controller from `pid`.
    time_constant : float
        How fast the disturbance is followed [s].

    Returns
    -------
    DisturbanceObserver

    Raises
    ------
    InputError
        A time constant below two samples; a loop that is not stable with it.

    Examples
    --------
    >>> import robthermal as rt
    >>> plant = rt.design.cold_side(rt.design.feedback_linearization(rt.systems.two_module()))
    >>> p = rt.design.pid(plant, proportional=0.2, sample_time=1.0)
    >>> loop = rt.design.disturbance_observer(plant, p, time_constant=20.0)
    >>> bool(abs(rt.design.loop_poles(plant, loop)).max() < 1)
    True
    """
    expect(plant, ColdSide, "plant", "rt.design.cold_side")
    plant.expect_faces("a disturbance observer")
    expect_controller(controller)
    h, tau = controller.sample_time, positive_number(time_constant, "time_constant", "s")
    if tau < 2 * h:
        raise InputError(f"time_constant = {tau:g} s with a sample time of {h:g} s", where="argument time_constant",
                         expected=f"at least {2 * h:g} s", remedy="Sample faster.")
    A_d, B_d = plant.sampled(h)
    n, m = len(A_d), len(plant.law.names)
    A = np.block([[A_d, B_d[:, :m]], [np.zeros((m, n)), np.eye(m)]])
    B = np.vstack([B_d, np.zeros((m, B_d.shape[1]))])
    C = np.hstack([plant.C, np.zeros((m, m))])
    # all but noise-free, and shifted: modes slower than the time constant are moved to it, faster ones stay
    shift, noise = np.exp(h / tau), 1e-9 * np.eye(n + m)
    P = solve_discrete_are(shift * A.T, shift * C.T, noise, np.eye(m))
    L = shift**2 * A @ P @ C.T @ np.linalg.inv(shift**2 * C @ P @ C.T + np.eye(m))
    observer = DisturbanceObserver(plant, controller, A, B, L)
    check_sampling(plant, observer)
    return observer
