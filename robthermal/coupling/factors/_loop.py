"""One subsystem: plant and controller with the factors the coupling is built from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ..systems import LTI, Zpk, closed_loop_poles, constant, expect_stable, natural, paired, stable, zpk_of
from ._inner import inner_zpk, inverse_times


@dataclass(frozen=True, eq=False)
class Loop:
    """Plant P and controller C under negative feedback, with Z, Q = Z/P, S = 1/(1+PC) and C = Nk/Dk.

    Parameters
    ----------
    P, C, Z, Q, S, Nk, Dk : Zpk
        One input and one output each.
    """

    P: Zpk
    C: Zpk
    Z: Zpk
    Q: Zpk
    S: Zpk
    Nk: Zpk
    Dk: Zpk


def close(P: LTI, C: LTI, number: int, dt: float, Z: LTI | None = None, cutoff: float | None = None) -> Loop:
    """Read one subsystem, check its loop and build its factors.

    Parameters
    ----------
    P, C : LTI
        Plant and controller.
    number : int
        1 or 2, for messages.
    dt : float
        Sample time of the loop [s].
    Z : LTI, optional
        All-pass factor; None: constructed.
    cutoff : float, optional
        As :func:`inner_factor` [rad/s].
    """
    names = f"P{number}", f"C{number}", f"Z{number}"
    plant, controller = zpk_of(P, names[0], dt), zpk_of(C, names[1], dt)
    poles = _closed_loop_poles(plant, controller, names)
    if Z is None:
        factor = inner_zpk(plant, names[0], cutoff, poles)
    else:
        factor = zpk_of(Z, names[2], dt)
        expect_stable(factor.poles, names[2], dt)
    Q = inverse_times(plant, factor, names[2], names[0])
    expect_stable(Q.poles, names[2], dt, f"{names[0]}⁻¹Z is unstable", "Leave Z out: then it is constructed.")
    direct = 1.0 + plant.at_infinity() * controller.at_infinity()
    S = Zpk(np.concatenate([plant.poles, controller.poles]), poles, 1.0 / direct, dt)
    Nk, Dk = _controller_factors(controller, poles)
    return Loop(plant, controller, factor, Q, S, Nk, Dk)


def _closed_loop_poles(plant: Zpk, controller: Zpk, names: tuple[str, str, str]) -> Array:
    """Poles of the loop, which is refused unless all are strictly stable."""
    direct = 1.0 + plant.at_infinity() * controller.at_infinity()
    where = f"{names[0]}, {names[1]}"
    if abs(direct) < 1e-12:
        raise InputError("1 + P(∞) C(∞) = 0: the loop is not well posed", where=where,
                         expected="a well-posed loop", remedy="Add a delay or a low-pass filter to the controller.")
    poles = closed_loop_poles(plant, controller)
    expect_stable(poles, where, plant.dt, "the loop of plant and controller is unstable",
                  "The controllers must stabilize their own plants (negative feedback, e = r - y).")
    return poles


def feedback_matrix(plant: control.StateSpace, controller: control.StateSpace) -> Array:
    """State matrix of u = K e, e = -P u.

    Parameters
    ----------
    plant, controller : StateSpace
        P and K of matching sizes, states in this order.
    """
    well = np.linalg.inv(np.eye(plant.noutputs) + plant.D @ controller.D)  # e = -(I + Dp Dk)^-1 (Cp xp + Dp Ck xk)
    e_p, e_k = -well @ plant.C, -well @ plant.D @ controller.C
    u_p, u_k = controller.D @ e_p, controller.C + controller.D @ e_k
    return np.block([[plant.A + plant.B @ u_p, plant.B @ u_k], [controller.B @ e_p, controller.A + controller.B @ e_k]])


def _controller_factors(controller: Zpk, closed_poles: Array) -> tuple[Zpk, Zpk]:
    """C = Nk/Dk. Dk = 1 for a stable controller, as Evers (6.9); else it holds the unstable poles of C as zeros.

    Integrators are moved to the slowest closed-loop pole, where S leaves zero; poles beyond the boundary are reflected.
    """
    dt = controller.dt
    wrong = controller.poles[~stable(controller.poles, dt)]
    if not len(wrong):
        return controller, constant(1.0, dt)
    slowest = float(np.min(np.abs(natural(closed_poles, dt))))
    moved = natural(wrong, dt)
    inside = np.where(np.abs(moved.real) > slowest, -np.abs(moved.real), -slowest) + 1j * moved.imag
    poles = paired(np.exp(inside * dt)) if dt else paired(inside)
    Dk = Zpk(wrong, poles, float(np.real(np.prod((-1.0 - poles) / (-1.0 - wrong)))) if dt else 1.0, dt)
    return controller.times(Dk), Dk
