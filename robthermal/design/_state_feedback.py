"""State feedback with integral action, sampled exactly: LQR, one gain for several plants, or gains given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag, solve_discrete_are

from .._checks import positive_number
from ..errors import InputError, Outcome
from ._controller import Controller, ControllerInput, expect_modules
from ._modules import Array
from ._numbers import expect, numbers
from ._outcomes import DesignCode
from ._plant import ColdSide
from ._robust_feedback import robust_gain
from ._sampling import check_sampling


@dataclass(frozen=True)
class StateFeedback(Controller):
    """v = z - K x_c + Kr r, z⁺ = z + h Ki (r - y) + (achieved - wanted) h / tracking_time.

    Parameters
    ----------
    plant : ColdSide
        Whose states are fed back.
    K, reference_gain : ndarray
        (n_modules, n) [W/K] and (n_modules, n_modules) [W/K].
    integral : ndarray, shape (n_modules, n_modules)
        Integral gain on the control errors [W/(K s)].
    tracking_time : float
        Time in which the integrators give way to an active limit [s].
    sample_time : float
        Time between two samples [s].
    outcome : Outcome
        What is known about the loop.
    """

    plant: ColdSide
    K: Array
    reference_gain: Array
    integral: Array
    tracking_time: float
    sample_time: float
    outcome: Outcome = DesignCode.DESIGNED.outcome("Stable with the linear cold side while no limit is active.")

    def _proportional(self, given: ControllerInput) -> Array:
        return self.reference_gain @ given.reference - self.K @ given.temperatures[self.plant.indices]

    def start(self, given: ControllerInput, heat: Array) -> Array:
        expect_modules(len(self.K), heat)
        at_rest = self.reference_gain @ given.cold - self.K @ given.temperatures[self.plant.indices]
        return heat - at_rest

    def heat(self, state: Array, given: ControllerInput) -> Array:
        return state + self._proportional(given)

    def advance(self, state: Array, given: ControllerInput, wanted: Array, achieved: Array) -> Array:
        change = self.sample_time * self.integral @ (given.reference - given.cold)
        return state + change - np.expm1(-self.sample_time / self.tracking_time) * (achieved - wanted)


def state_feedback(plant: ColdSide, *, sample_time: float, bandwidth: float | None = None,
                   gain: ArrayLike | None = None, integral: ArrayLike | None = None,
                   tracking_time: float | None = None, method: Literal["lqr", "lmi"] = "lqr",
                   plants: Sequence[Any] = ()) -> StateFeedback:
    """State feedback with integral action, by LQR, by a matrix inequality, or from gains designed elsewhere.

    Parameters
    ----------
    plant : ColdSide
        What it controls; all its lumps are fed back, measured or estimated (`observer`).
    sample_time : float
        Time between two samples [s].
    bandwidth : float, optional
        LQR tuned like this [rad/s]: the error, and its integral times the bandwidth, are weighed against the heat that
        moves a face by as much at this frequency.
    gain, integral : array_like, optional
        Own K (n_modules, n) [W/K] and Ki (n_modules, n_modules) [W/(K s)], for example of an LMI, for v = -K x + z,
        ż = Ki (r - y).
    tracking_time : float, optional
        Anti-windup [s]; default one over the bandwidth, else ten samples.
    method : {"lqr", "lmi"}, optional
        How a bandwidth is turned into gains: for this plant alone, or with the least bound on the same cost that holds
        for this one and all of `plants`.
    plants : sequence of control.StateSpace or ColdSide, optional
        For "lmi": further plants the gain must stabilize, with the same lumps as states and the heats v as first
        inputs; sampled exactly. `corner_plants` makes those of a constant gain.

    Returns
    -------
    StateFeedback
        With "lmi", `.outcome` tells whether one quadratic norm was found that shrinks for every plant; if not, the
        gains are the LQR's.

    Raises
    ------
    InputError
        Wrong shapes, a loop that is not stable, a sample time too slow for the bandwidth.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> plant = rt.design.cold_side(rt.design.feedback_linearization(rt.systems.two_module()))
    >>> loop = rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0)
    >>> bool(abs(rt.design.loop_poles(plant, loop)).max() < 1)
    True
    """
    expect(plant, ColdSide, "plant", "rt.design.cold_side")
    plant.expect_faces("a state feedback")
    h, m, n = positive_number(sample_time, "sample_time", "s"), len(plant.law.names), len(plant.A)
    if (bandwidth is None) == (gain is None):
        raise InputError("give either bandwidth or gain", where="argument bandwidth", expected="one of the two")
    if method not in ("lqr", "lmi") or (method == "lmi") != bool(len(plants)) or (method == "lmi" and gain is not None):
        raise InputError(f"method = {method!r} with {len(plants)} plants{'' if gain is None else ' and a gain'}",
                         where="arguments method, plants", expected='"lqr" without plants, or "lmi" with a bandwidth '
                         "and plants to stabilize", remedy="rt.design.corner_plants makes those of a constant gain.")
    outcome = StateFeedback.outcome
    if bandwidth is not None:
        w = positive_number(bandwidth, "bandwidth", "rad/s")
        K, Ki = _lqr(plant, h, w)
        if plants:
            found = robust_gain(plant, plants, h, w, (K, Ki))
            K, Ki, outcome = found.K, found.integral, found.outcome
        Kr = K @ np.linalg.pinv(plant.C)
    else:
        K = numbers(gain, "gain")
        Ki = np.zeros((m, m)) if integral is None else numbers(integral, "integral")
        Kr = np.zeros((m, m))
        if K.shape != (m, n) or Ki.shape != (m, m):
            raise InputError(f"gain has shape {K.shape}, integral {Ki.shape}", where="arguments gain, integral",
                             expected=f"({m}, {n}) for the lumps {', '.join(plant.lumps)}, and ({m}, {m})")
    own = 10 * h if bandwidth is None else max(1 / bandwidth, h)
    tracking = own if tracking_time is None else tracking_time
    controller = StateFeedback(plant, K, Kr, Ki, positive_number(tracking, "tracking_time", "s"), h, outcome)
    check_sampling(plant, controller, lambda time: replace(controller, sample_time=time))
    return controller


def _lqr(plant: ColdSide, h: float, w: float) -> tuple[Array, Array]:
    """LQR of the sampled cold side with its integrators: y² + w² (∫y)² against |v / G(jw)|²."""
    if h * w > 1:
        raise InputError(f"a sample time of {h:g} s is too slow for a bandwidth of {w:g} rad/s",
                         where="argument sample_time", expected=f"at most {1 / w:.3g} s")
    A, B = plant.sampled(h)
    m, n = len(plant.law.names), len(A)
    whole = np.block([[A, np.zeros((n, m))], [-h * plant.C, np.eye(m)]])
    drive = np.vstack([B[:, :m], np.zeros((m, m))])
    G = plant.C @ np.linalg.solve(1j * w * np.eye(n) - plant.A, plant.B[:, :m])
    heat = np.diag(np.abs(np.diag(G)) ** 2)
    error = block_diag(plant.C.T @ plant.C, w**2 * np.eye(m))
    P = solve_discrete_are(whole, drive, error, heat)
    both = np.linalg.solve(drive.T @ P @ drive + heat, drive.T @ P @ whole)
    return both[:, :n], -both[:, n:]
