"""The all-pass factor Z that makes the inverse of a plant stable and proper, Evers (6.15)."""

from __future__ import annotations

import numpy as np
import scipy

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ..systems import LTI, Zpk, matrix_of, on_boundary, realize, sample_time_of, stable, zpk_of
from ._inner_matrix import inner_pair

_FASTER = 10.0  # default cut-off over the fastest pole or zero
_SAME_ZERO = 1e-6  # how well a given Z must hold a wrong-side zero of P


def inner_factor(P: LTI, cutoff: float | None = None) -> tuple[control.StateSpace, control.StateSpace]:
    """Factor Z with \\|Z\\| = 1 and the stable, proper Q = Z / P.

    Z holds every zero of P on the wrong side and its delay (discrete) or relative degree (continuous).

    Parameters
    ----------
    P : StateSpace or TransferFunction
        Plant: one input and one output, or a state space of several (then by a Riccati equation).
    cutoff : float, optional
        Continuous time: corner of the Butterworth low-pass of order "relative degree" in Z [rad/s].
        Default: ten times the fastest pole or zero of P.

    Returns
    -------
    Z : StateSpace
        Stable; \\|Z\\| = 1 at every frequency (continuous time with a relative degree: below the cut-off).
    Q : StateSpace
        Z / P, stable and proper; of several channels P Q = Z, with Z inner from the left.

    Raises
    ------
    InputError
        If P has a zero on the unit circle or imaginary axis (other than at infinity), is zero, or a cut-off is missing.

    Examples
    --------
    Example 6.5 of Evers (2021): a zero at a = 2, a pole at -b = -3.

    >>> import control
    >>> import robthermal as rt
    >>> Z, Q = rt.coupling.inner_factor(control.tf([1, -2], [1, 3]))
    >>> bool(abs(abs(Z(0.7j)) - 1) < 1e-12), bool(abs(Q(0.7j) - (0.7j + 3) / (0.7j + 2)) < 1e-12)
    (True, True)
    """
    if isinstance(P, control.StateSpace) and (P.ninputs, P.noutputs) != (1, 1):
        return inner_pair(matrix_of(P, "P", sample_time_of({"P": P})), "P", cutoff)
    plant = zpk_of(P, "P", sample_time_of({"P": P}))
    Z = inner_zpk(plant, "P", cutoff)
    return realize(Z), realize(inverse_times(plant, Z, "Z", "P"))


def inner_zpk(plant: Zpk, where: str, cutoff: float | None, other_corners: Array | None = None) -> Zpk:
    """Z of a plant.

    Parameters
    ----------
    plant : Zpk
        Plant P to be factored.
    where : str
        Its name, for messages.
    cutoff : float or None
        As :func:`inner_factor`.
    other_corners : ndarray, optional
        Where the default cut-off comes from when every pole of the plant is at zero [rad/s].
    """
    expect_invertible(plant, where)
    wrong = plant.zeros[~stable(plant.zeros, plant.dt)]
    if plant.dt:  # (z - a)/(1 - conj(a) z), then the delay
        reflected = 1.0 / np.conj(wrong)
        gain = float(np.real(np.prod(-1.0 / np.conj(wrong)))) if len(wrong) else 1.0
        delay = np.zeros(plant.excess, dtype=complex)
        return Zpk(wrong, np.concatenate([reflected, delay]), gain, plant.dt)
    lowpass = _lowpass(plant, where, cutoff, np.zeros(0) if other_corners is None else other_corners)
    return Zpk(wrong, np.concatenate([-np.conj(wrong), lowpass.poles]), lowpass.gain, 0.0)


def inverse_times(plant: Zpk, Z: Zpk, where: str, plant_name: str) -> Zpk:
    """Q = Z / P with the wrong-side zeros of P cancelled exactly.

    Parameters
    ----------
    plant, Z : Zpk
        P and its factor.
    where, plant_name : str
        Names for messages.
    """
    zeros = [complex(z) for z in Z.zeros]
    held = []
    for zero in plant.zeros:
        if stable(np.array([zero]), plant.dt)[0] and not on_boundary(np.array([zero]), plant.dt)[0]:
            continue
        near = min(zeros, key=lambda z: abs(z - zero), default=complex("inf"))
        if not abs(near - zero) <= _SAME_ZERO * abs(zero):
            also = "" if Z.excess >= plant.excess else f", and improper: {_degrees(plant, Z, plant_name)}"
            raise InputError(f"{plant_name}⁻¹Z is unstable: Z lacks the zero of {plant_name} at {zero:.6g}{also}",
                             where=where, expected=f"a Z with every wrong-side zero of {plant_name}",
                             remedy="Leave Z out: then it is constructed.")
        zeros.remove(near)
        held.append(zero)
    if Z.excess < plant.excess:
        raise InputError(f"{plant_name}⁻¹Z is improper: {_degrees(plant, Z, plant_name)}", where=where,
                         expected=f"a relative degree of Z of at least {plant.excess}",
                         remedy="Add delay (discrete) or a low-pass filter (continuous) to Z, or leave Z out.")
    exact = Zpk(np.concatenate([np.array(zeros, dtype=complex), np.array(held, dtype=complex)]), Z.poles, Z.gain, Z.dt)
    return exact.times(plant.inverse())


def _degrees(plant: Zpk, Z: Zpk, plant_name: str) -> str:
    return f"Z has relative degree {Z.excess}, {plant_name} has {plant.excess}"


def expect_invertible(plant: Zpk, where: str) -> None:
    """Refuse a plant that no stable filter inverts.

    Parameters
    ----------
    plant : Zpk
        Plant P to be factored.
    where : str
        Name of the plant, for messages.
    """
    if plant.gain == 0.0:
        raise InputError("the plant is zero", where=where, expected="a plant that passes its input")
    edge = plant.zeros[on_boundary(plant.zeros, plant.dt)]
    if len(edge):
        place = "unit circle" if plant.dt else "imaginary axis"
        raise InputError(f"zero at {edge[0]:.6g} on the {place}", where=where, expected="zeros off that boundary",
                         remedy="A zero at z = -1 comes from sampling without delay: model the delay, or add damping.")


def _lowpass(plant: Zpk, where: str, cutoff: float | None, other_corners: Array) -> Zpk:
    order = plant.excess
    if not order:
        return Zpk(np.array([], dtype=complex), np.array([], dtype=complex), 1.0, 0.0)
    corner = cutoff
    if corner is None:
        own = float(np.max(np.abs(np.concatenate([plant.zeros, plant.poles])), initial=0.0))
        corner = _FASTER * (own or float(np.max(np.abs(other_corners), initial=0.0)))
    if not corner > 0 or not np.isfinite(corner):
        raise InputError(f"cut-off {cutoff} for {where}, which has relative degree {order}", where="cutoff",
                         expected="a positive frequency [rad/s], above the frequencies that matter",
                         remedy="Give cutoff: the corner of the low-pass that makes P⁻¹Z proper.")
    poles = scipy.signal.buttap(order)[1] * corner
    poles = np.where(np.abs(poles.imag) < 1e-9 * corner, poles.real, poles)
    poles = np.concatenate([poles[poles.imag > 0], poles[poles.imag > 0].conj(), poles[poles.imag == 0]])
    return Zpk(np.array([], dtype=complex), poles, float(corner**order), 0.0)
