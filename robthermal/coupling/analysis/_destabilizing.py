"""A plant perturbation, no larger than the robust number says, that makes the coupled loop unstable."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ..evaluation import Filters
from ..problem import Problem, radius
from ..systems import Zpk, realize, siso

_GRID_POINTS, _FINER = 2500, 400
_FAR = 1e8  # roots this far out or in count as infinite or zero


@dataclass(frozen=True, eq=False)
class Destabilizing:
    """Delta_p with det(I + Delta_p Delta_k) = 0 at one frequency, `scale` times the envelope there.

    Parameters
    ----------
    omega : float
        Frequency of the pole [rad/s].
    delta : ndarray, shape (2, 2)
        Delta_p there (complex).
    scale : float
        Its size relative to the envelope: below 1, a plant inside the stated uncertainty is not stabilized.
    system : StateSpace
        Stable 2x2 Delta_p with that value at that frequency and smaller away from it (a narrow band-pass).
    """

    omega: float
    delta: Array
    scale: float
    system: control.StateSpace


def destabilizing(filters: Filters, width: float = 1e-3) -> Destabilizing:
    """Show that the robust number is tight: a perturbation 1/robust times the envelope that destabilizes.

    Parameters
    ----------
    filters : Filters
        From `synthesize` or `evaluate`, with an uncertainty and both filters nonzero.
    width : float
        Damping ratio of the band-pass in `system` [-].

    Returns
    -------
    Destabilizing

    Raises
    ------
    InputError
        If no perturbation under any multiple of the envelope destabilizes: no uncertainty, or one-way coupling.

    Examples
    --------
    >>> import robthermal as rt
    >>> machine = rt.systems.scanner()
    >>> filters = rt.coupling.evaluate(machine.P1, machine.P2, machine.C1, machine.C2, X_hat=-1, Y_hat=1,
    ...                                uncertainty=list(machine.frf))
    >>> found = rt.coupling.destabilizing(filters)
    >>> filters.robustly_stable, found.scale < 1  # not robust: a plant inside the envelope is not stabilized
    (False, True)
    """
    problem, omega = filters.problem, _worst_frequency(filters)
    a, b = (entry[0] for entry in _youla(filters, np.array([omega])))
    R = problem.envelope(np.array([omega]))[:, :, 0]
    size = float(radius(R, abs(a), abs(b)))
    if not size > 0:
        raise InputError("no perturbation under any multiple of the envelope destabilizes this loop",
                         where="destabilizing", expected="filters with uncertainty that couple both ways")
    # Delta_k Delta_p = -|Delta_k| R / size then has the eigenvalue -1.
    phases = -np.exp(-1j * np.angle([b, a]))
    delta = phases[:, None] * R / size
    return Destabilizing(omega, delta, 1 / size, _through(delta, omega, width, problem))


def _youla(filters: Filters, omega: Array) -> tuple[Array, Array]:
    """X̂ D_k2 and Ŷ D_k1 at frequencies [rad/s]."""
    problem = filters.problem
    return (siso(filters.X_hat, omega) * problem.two.Dk.at(omega),
            siso(filters.Y_hat, omega) * problem.one.Dk.at(omega))


def _worst_frequency(filters: Filters) -> float:
    """Where rho(|Delta_k| R) is largest [rad/s]: a fine grid, then a finer one round its maximum."""
    problem = filters.problem
    omega = problem.grid(_GRID_POINTS)
    for _ in range(2):
        sizes = radius(problem.envelope(omega), *(np.abs(entry) for entry in _youla(filters, omega)))
        best = int(np.argmax(sizes))
        worst = float(omega[best])
        omega = np.union1d(np.linspace(omega[max(best - 1, 0)], omega[min(best + 1, len(omega) - 1)], _FINER), worst)
    return worst


def _through(delta: Array, omega: float, width: float, problem: Problem) -> control.StateSpace:
    """Real stable 2x2 system with a given value at one frequency: all-pass for the phase, band-pass for the rest."""
    entries = [[_entry(delta[i, j], omega, width, problem.dt) for j in (0, 1)] for i in (0, 1)]
    flat = [entry for row in entries for entry in row]
    pick = np.array([[1, 0], [0, 1], [1, 0], [0, 1]])
    B = block_diag(*(e.B for e in flat)) @ pick
    C = np.array([[1, 1, 0, 0], [0, 0, 1, 1]]) @ block_diag(*(e.C for e in flat))
    D = np.array([[entry.D[0, 0] for entry in row] for row in entries])
    return control.StateSpace(block_diag(*(e.A for e in flat)), B, C, D, problem.dt, remove_useless_states=False)


def _entry(value: complex, omega: float, width: float, dt: float) -> control.StateSpace:
    """SISO system with this value at omega: all-pass (p - c)/(p + c) times band-pass p/(p² + 2 d p + 1).

    p = j at omega. Continuous: p = s/omega; discrete: its bilinear image, (z - 1)/(z + 1)/tan(omega dt/2).
    """
    corner = np.tan(omega * dt / 2) if dt else omega
    if not value or not 0 < corner < _FAR:  # at zero and at Nyquist frequency a real system has a real value
        return control.ss(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), [[np.real(value)]], dt)
    c = np.tan(np.angle(value) % np.pi / 2)  # (j - c)/(j + c) has the angle 2 atan c; the gain has the sign
    turn = [c] if 1 / _FAR < c < _FAR else []
    pair = -width + 1j * np.sqrt(1 - width**2)
    zeros = np.array([0.0, *turn], complex) * corner
    poles = np.array([pair, np.conj(pair), *(-root for root in turn)]) * corner
    if dt:
        zeros, poles = np.append((1 + zeros) / (1 - zeros), -1.0), (1 + poles) / (1 - poles)
    shape = Zpk(zeros, poles, 1.0, dt)
    return realize(replace(shape, gain=float(np.real(value / shape.at(np.array([omega]))[0]))))
