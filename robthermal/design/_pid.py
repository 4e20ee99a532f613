"""PI and PID with back-calculation from the heat that the feedback law achieved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._checks import positive_number
from ..errors import InputError
from ._controller import Controller, ControllerInput, expect_modules
from ._modules import Array
from ._numbers import expect, non_negative, per_module
from ._plant import ColdSide
from ._sampling import check_sampling


@dataclass(frozen=True)
class PID(Controller):
    """One PI or PID per module, anti-windup by back-calculation from the heat the feedback law achieved.

    v = Kp (r - y) + z - Kd ẏ_f, with z held exactly over a sample and the filtered derivative sampled exactly.

    Parameters
    ----------
    proportional : ndarray, shape (n_modules,)
        Proportional gain Kp of every module [W/K].
    integral : ndarray, shape (n_modules,)
        Integral gain Ki of every module [W/(K s)].
    derivative : ndarray, shape (n_modules,)
        Kd [W s/K]; acts on the measurement.
    filter_time : float
        Time constant of the derivative's filter [s].
    tracking_time : ndarray, shape (n_modules,)
        Time in which the integrator gives way to an active limit [s].
    sample_time : float
        Time between two samples [s].
    """

    proportional: Array
    integral: Array
    derivative: Array
    filter_time: float
    tracking_time: Array
    sample_time: float

    @property
    def count(self) -> int:
        """Number of modules."""
        return len(self.proportional)

    def start(self, given: ControllerInput, heat: Array) -> Array:
        expect_modules(len(self.proportional), heat)
        # integrators at the heat, derivative filters at rest
        return np.concatenate([heat, given.cold])

    def heat(self, state: Array, given: ControllerInput) -> Array:
        z, filtered = state[:self.count], state[self.count:]
        slope = (given.cold - filtered) / self.filter_time
        return self.proportional * (given.reference - given.cold) + z - self.derivative * slope

    def advance(self, state: Array, given: ControllerInput, wanted: Array, achieved: Array) -> Array:
        z, filtered = state[:self.count], state[self.count:]
        z = z + self.sample_time * self.integral * (given.reference - given.cold)
        z = z + -np.expm1(-self.sample_time / self.tracking_time) * (achieved - wanted)
        keep = np.exp(-self.sample_time / self.filter_time)
        return np.concatenate([z, keep * filtered + (1 - keep) * given.cold])


def pid(plant: ColdSide, *, sample_time: float, bandwidth: float | None = None,
        proportional: float | Array | None = None, integral: float | Array = 0.0,
        derivative: float | Array = 0.0, filter_time: float | None = None, tracking_time: float | None = None) -> PID:
    """One PI or PID per module in discrete time.

    Parameters
    ----------
    plant : ColdSide
        What it controls; its regulated points may be sensors or lumps away from the cold faces.
    sample_time : float
        Time between two samples [s].
    bandwidth : float, optional
        Tune a PI for this crossover frequency [rad/s]: the modulus of Kp G is 1 there, integral action takes over a
        factor four below.
    proportional, integral, derivative : float or ndarray, optional
        Own gains [W/K], [W/(K s)], [W s/K] instead of a bandwidth.
    filter_time : float, optional
        Time constant of the derivative's filter [s]; default two samples.
    tracking_time : float, optional
        Anti-windup [s]; default Kp/Ki.

    Returns
    -------
    PID

    Raises
    ------
    InputError
        Neither or both of bandwidth and proportional; a sample time too slow for the sampled loop to be stable, with
        the slowest that would do; modules that are paired crosswise with their points.

    Examples
    --------
    >>> import robthermal as rt
    >>> plant = rt.design.cold_side(rt.design.feedback_linearization(rt.systems.two_module()))
    >>> controller = rt.design.pid(plant, bandwidth=0.05, sample_time=1.0)
    >>> bool(abs(rt.design.loop_poles(plant, controller)).max() < 1)
    True
    """
    expect(plant, ColdSide, "plant", "rt.design.cold_side")
    h = positive_number(sample_time, "sample_time", "s")
    if (bandwidth is None) == (proportional is None):
        raise InputError("give either bandwidth or proportional", where="argument bandwidth",
                         expected="one of the two")
    m = len(plant.law.names)
    if bandwidth is not None:
        check_pairs(plant)
        tuned = pi_of_bandwidth(plant, positive_number(bandwidth, "bandwidth", "rad/s"), h)
        kp, ki, kd = tuned.proportional, tuned.integral, tuned.derivative
    else:
        kp, ki, kd = (per_module(gain, m, name, unit) for gain, name, unit in (
            (proportional, "proportional", "W/K"), (integral, "integral", "W/(K s)"),
            (derivative, "derivative", "W s/K")))
        non_negative(np.stack([kp, ki, kd]), "proportional, integral, derivative")
    own = (kp / np.where(ki > 0, ki, 1.0) if tracking_time is None
           else positive_number(tracking_time, "tracking_time", "s"))
    tracking = np.where(ki > 0, np.maximum(own, h), np.inf)  # what never integrates must not drift either
    tau = 2 * h if filter_time is None else positive_number(filter_time, "filter_time", "s")
    controller = PID(kp, ki, kd, tau, tracking, h)
    check_sampling(plant, controller, lambda time: PID(kp, ki, kd, max(tau, 2 * time), tracking, time))
    return controller


def pi_of_bandwidth(plant: ColdSide, bandwidth: float, sample_time: float) -> PID:
    """PI whose proportional part crosses 1 at a bandwidth, stable or not.

    Parameters
    ----------
    plant : ColdSide
        What it controls.
    bandwidth : float
        Crossover of the loops [rad/s].
    sample_time : float
        Time between two samples [s].
    """
    kp = 1 / np.abs(np.diag(plant.response(bandwidth)[0]))
    ki = kp * bandwidth / 4
    return PID(kp, ki, np.zeros(len(kp)), 2 * sample_time, np.maximum(kp / ki, sample_time), sample_time)


def check_pairs(plant: ColdSide) -> None:
    """Refuse modules that regulate each other's points: the relative gain of a loop is then negative."""
    gain = plant.response(0.0)[0].real
    relative = np.diag(gain * np.linalg.inv(gain).T)
    for point, share in zip(plant.points, relative, strict=True):
        if share <= 0:
            raise InputError(f"module {point.module!r} regulates {point.name!r}, which the other modules move more "
                             f"(relative gain {share:.3g})", where=f"regulate {point.module}",
                             expected="a point that its own module moves most",
                             remedy="Swap the points between the modules.")
