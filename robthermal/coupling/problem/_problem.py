"""Everything a design starts from, read and checked once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ..factors import CoprimeFactors, Loop, Uncertainty, check_cutoff, close, corner_grid, from_factors
from ..systems import LTI, Zpk, constant, realize, sample_time_of, stable, zpk_of

_OTHER_PLANT = 1e-6  # relative difference of responses beyond which an uncertainty belongs to other plants


@dataclass(frozen=True, eq=False)
class Subsystem:
    """One subsystem with its factors and disturbance, each as zeros, poles and gain.

    Parameters
    ----------
    P, C : Zpk
        Plant and controller.
    Z, Q : Zpk
        All-pass factor and P⁻¹Z.
    S : Zpk
        Sensitivity 1/(1 + PC).
    Nk, Dk : Zpk
        Factors of the controller.
    W : Zpk
        Shaping filter of the disturbance at the output [m].
    SW : Zpk
        S W, common factors cancelled; poles of W at the boundary must be zeros of S.
    signal : Zpk
        weight S W: what the improvement factor multiplies.
    """

    P: Zpk
    C: Zpk
    Z: Zpk
    Q: Zpk
    S: Zpk
    Nk: Zpk
    Dk: Zpk
    W: Zpk
    SW: Zpk
    signal: Zpk


@dataclass(frozen=True, eq=False)
class Problem:
    """Two subsystems, what disturbs them, what is uncertain, and what counts.

    Parameters
    ----------
    one, two : Subsystem
        The two controlled subsystems.
    weight : Zpk
        Performance filter on e12.
    window : float or None
        Length of the exposure [s].
    samples : int
        Samples in the window; 0 without.
    uncertainty : Uncertainty or None
        In the factors of the subsystems.
    """

    one: Subsystem
    two: Subsystem
    weight: Zpk
    window: float | None
    samples: int
    uncertainty: Uncertainty | None

    @property
    def dt(self) -> float:
        """Sample time [s]; 0 in continuous time."""
        return self.one.P.dt

    @property
    def signals(self) -> tuple[control.StateSpace, control.StateSpace]:
        """What 1 + Y and 1 + X multiply in e12: weight S1 W1 and weight S2 W2."""
        return realize(self.one.signal), realize(self.two.signal)

    def envelope(self, omega: ArrayLike) -> Array:
        """Envelope of Delta_p as the proofs use it, zero without uncertainty.

        Parameters
        ----------
        omega : array_like, shape (n_f,)
            Frequencies of the responses [rad/s].

        Returns
        -------
        ndarray, shape (2, 2, n_f)
        """
        if self.uncertainty is None:
            return np.zeros((2, 2, np.size(omega)))
        return self.uncertainty.at(omega)

    def grid(self, points: int = 400) -> Array:
        """Frequencies [rad/s] that see every corner and resonance, and those of the measured plants.

        Parameters
        ----------
        points : int
            Number of logarithmic points; the others come on top.
        """
        systems = [zpk for half in (self.one, self.two) for zpk in (half.P, half.C, half.S, half.signal, half.Q)]
        grid = corner_grid(systems, points, lowest=0.1)
        if self.uncertainty is None:
            return grid
        return np.unique(np.concatenate([grid, self.uncertainty.omega[self.uncertainty.omega > 0]]))


def prepare(P1: LTI, P2: LTI, C1: LTI, C2: LTI, *, Z1: LTI | None = None, Z2: LTI | None = None,
            uncertainty: Any = None, disturbances: Any = (1, 1), weight: LTI = 1, window: float | None = None,
            cutoff: float | None = None) -> Problem:
    """Read and check the arguments that synthesis and evaluation share.

    Parameters
    ----------
    P1, P2, C1, C2 : LTI
        Plants and controllers.
    Z1, Z2 : LTI, optional
        All-pass factors; None: constructed.
    uncertainty : Uncertainty, 2x2 frequency response or list of them, optional
        Measured plants, or their envelope.
    disturbances : pair of LTI
        Shaping filters of v1, v2.
    weight : LTI
        Performance filter on e12.
    window : float, optional
        Exposure [s], discrete time only.
    cutoff : float, optional
        As :func:`inner_factor` [rad/s].
    """
    dt = sample_time_of({"P1": P1, "P2": P2, "C1": C1, "C2": C2})
    check_cutoff(cutoff)
    samples = _window_samples(window, dt)
    loops = close(P1, C1, 1, dt, Z1, cutoff), close(P2, C2, 2, dt, Z2, cutoff)
    filters = _pair(disturbances)
    performance = zpk_of(weight, "weight", dt)
    if window is not None and (performance.gain != 1.0 or len(performance.poles)):
        raise InputError("both weight and window are given", where="weight", expected="one of the two",
                         remedy="The window is the performance filter: leave weight out.")
    halves = [_with_disturbance(loop, filters[k], k + 1, performance) for k, loop in enumerate(loops)]
    return Problem(halves[0], halves[1], performance, window, samples, _matched(uncertainty, CoprimeFactors(loops)))


def _window_samples(window: float | None, dt: float) -> int:
    if window is None:
        return 0
    if not dt:
        raise InputError("a window in continuous time", where="window", expected="discrete-time systems (dt > 0)",
                         remedy="Discretize the systems, or use weight.")
    if not (np.isfinite(window) and window > 0) or round(window / dt) < 1:
        raise InputError(f"window of {window} s", where="window", expected=f"at least one sample, {dt:g} s")
    return round(window / dt)


def _pair(disturbances: Any) -> tuple[LTI, LTI]:
    if not isinstance(disturbances, (tuple, list)) or len(disturbances) != 2:
        raise InputError(f"{type(disturbances).__name__} is not a pair", where="disturbances",
                         expected="two shaping filters (systems or numbers), of v1 and v2")
    return disturbances[0], disturbances[1]


def _with_disturbance(loop: Loop, disturbance: LTI, number: int, weight: Zpk) -> Subsystem:
    W = zpk_of(disturbance, f"disturbances[{number - 1}]", loop.P.dt)
    SW, signal = loop.S.times(W), weight.times(loop.S, W)
    for product, where, what in ((SW, f"disturbances[{number - 1}]", f"S{number} W{number}"),
                                 (signal, "weight", f"weight S{number} W{number}")):
        wrong = product.poles[~stable(product.poles, product.dt)]
        if product.gain and len(wrong):
            raise InputError(f"{what} is unstable: pole at {wrong[0]:.6g}", where=where,
                             expected="stable filters, or integrators that the loop suppresses",
                             remedy="Move the pole inside: replace the integrator by a slow low-pass.")
    return Subsystem(loop.P, loop.C, loop.Z, loop.Q, loop.S, loop.Nk, loop.Dk, W, _or_zero(SW), _or_zero(signal))


def _or_zero(product: Zpk) -> Zpk:
    return product if product.gain else constant(0.0, product.dt)


def _matched(uncertainty: Any, factors: CoprimeFactors) -> Uncertainty | None:
    """Uncertainty in these factors: new Dp, Dk multiply Delta_p from the right and, inverted, from the left."""
    if uncertainty is None:
        return None
    if not isinstance(uncertainty, Uncertainty):
        return from_factors(uncertainty, factors, "uncertainty")
    if not isinstance(uncertainty.factors, CoprimeFactors):
        raise InputError("made for subsystems of several inputs and outputs", where="uncertainty",
                         expected="the same plants and controllers", remedy="Call dual_youla with them.")
    old, new = uncertainty.factors.at(uncertainty.omega), factors.at(uncertainty.omega)
    if uncertainty.factors.dt != factors.dt:
        raise InputError("made for another sample time", where="uncertainty",
                         expected="the same plants and controllers", remedy="Call dual_youla with them.")
    for name, was, now in (("plants", old["P0"], new["P0"]),
                           ("controllers", old["Nk"] / old["Dk"], new["Nk"] / new["Dk"])):
        if np.max(np.abs(now - was) / np.abs(now)) > _OTHER_PLANT:
            raise InputError(f"made for other {name}", where="uncertainty", expected="the same plants and controllers",
                             remedy="Call dual_youla with them.")
    scale = (old["Dk"] / new["Dk"])[:, None, :] * (new["Dp"] / old["Dp"])[None, :, :]
    if np.allclose(scale, 1.0, rtol=1e-12, atol=0.0):
        return uncertainty
    size = np.abs(scale)
    return replace(uncertainty, samples=uncertainty.samples * scale, envelope=uncertainty.envelope * size,
                   factors=factors, radius=None if uncertainty.radius is None else uncertainty.radius * size)
