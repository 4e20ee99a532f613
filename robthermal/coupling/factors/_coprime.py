"""Coprime factors of plant and controller whose double matrix is unimodular, Evers (6.9)-(6.10) with integrators."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ...linear import hinf
from ...verification import Certificate
from ..systems import Response, Zpk, apart, diagonal, minus_identity, natural, realize, sample_time_of, series
from ._loop import Loop, close


@dataclass(frozen=True, eq=False)
class CoprimeFactors:
    """P0 = Np Dp⁻¹ and K0 = Nk Dk⁻¹, stable and coprime; diagonal, so right factors are left factors too.

    Normalized for use: \\|Np\\| = 1 (below the cut-off), \\|Dk\\| = 1 away from integrators.

    Parameters
    ----------
    loops : tuple of Loop
        The two subsystems (of several axes: all of them) as zeros, poles and gains.

    Examples
    --------
    >>> import control
    >>> import robthermal as rt
    >>> P, C = control.tf([1], [1, 0, 0], 0), control.tf([10, 5], [1, 8])
    >>> f = rt.coupling.coprime((P, P), (C, C), cutoff=100.0)
    >>> f.Np.nstates, bool(f.residual < 1e-9), f.bezout().holds
    (4, True, True)
    """

    loops: tuple[Loop, ...]

    @property
    def dt(self) -> float:
        """Sample time [s]; 0 in continuous time."""
        return self.loops[0].P.dt

    @property
    def Np(self) -> control.StateSpace:
        """Numerator Z of the plant."""
        return self.Z

    @property
    def Dp(self) -> control.StateSpace:
        """Denominator P0⁻¹Z of the plant."""
        return _both(loop.Q for loop in self.loops)

    @property
    def Nk(self) -> control.StateSpace:
        """Numerator of the controller."""
        return _both(loop.Nk for loop in self.loops)

    @property
    def Dk(self) -> control.StateSpace:
        """Denominator of the controller: 1 where it is stable."""
        return _both(loop.Dk for loop in self.loops)

    @property
    def Z(self) -> control.StateSpace:
        """All-pass factors (with the low-pass in continuous time)."""
        return _both(loop.Z for loop in self.loops)

    @property
    def L(self) -> control.StateSpace:
        """Stable L with L Np + W Dp = I, Evers (6.6)."""
        return _both(loop.Nk.times(_unit_inverse(loop)) for loop in self.loops)

    @property
    def W(self) -> control.StateSpace:
        """Stable W with L Np + W Dp = I, Evers (6.6)."""
        return _both(loop.Dk.times(_unit_inverse(loop)) for loop in self.loops)

    @property
    def residual(self) -> float:
        """Largest \\|L Np + W Dp - 1\\| of the realized factors over 2000 frequencies and their corners [-]."""
        omega = corner_grid([root for loop in self.loops for root in (loop.P, loop.C, loop.S)], 2000)
        L, N, W, D = (Response(system)(omega) for system in (self.L, self.Np, self.W, self.Dp))
        product = np.einsum("ijf,jkf->ikf", L, N) + np.einsum("ijf,jkf->ikf", W, D)
        return float(np.max(np.abs(product - np.eye(len(self.loops))[:, :, None])))

    def bezout(self, bound: float = 1e-6) -> Certificate:
        """Certificate that the realized factors satisfy L Np + W Dp = I + E with a norm of E below the bound.

        Below 1, I + E has a stable inverse, so the realized Np and Dp are coprime.

        Parameters
        ----------
        bound : float
            Bound of the H-infinity norm of E [-].

        Returns
        -------
        Certificate
            Of kind "hinf"; does not hold where E is larger or the proof failed.
        """
        error = minus_identity(series(self.L, self.Np), series(self.W, self.Dp))
        return hinf(error, bound=bound).certificate

    def at(self, omega: ArrayLike) -> dict[str, Array]:
        """Diagonals of the factors at frequencies.

        Parameters
        ----------
        omega : array_like, shape (n_f,)
            Frequencies of the responses [rad/s].

        Returns
        -------
        dict of ndarray, shape (n_loops, n_f)
            "Np", "Dp", "Nk", "Dk" and "P0".
        """
        names = {"Np": "Z", "Dp": "Q", "Nk": "Nk", "Dk": "Dk", "P0": "P"}
        return {name: np.stack([getattr(loop, field).at(omega) for loop in self.loops])
                for name, field in names.items()}


def coprime(P0: Any, K0: Any, cutoff: float | None = None) -> CoprimeFactors:
    """Coprime factors of two plants and their controllers; the matrix [[Dp, -Nk], [Np, Dk]] has a stable inverse.

    Parameters
    ----------
    P0, K0 : 2x2 StateSpace or TransferFunction, or pairs
        Plants and controllers, diagonal. K0 must stabilize P0 (negative feedback).
    cutoff : float, optional
        Continuous time: corner of the low-pass in Z, as :func:`inner_factor` [rad/s].

    Returns
    -------
    CoprimeFactors
        With Np = Z, Dp = P0⁻¹Z; Dk = 1 for a stable controller, else it holds the unstable poles of K0 as zeros.

    Raises
    ------
    InputError
        For an unstable loop, different sample times, or a plant with a zero on the boundary.

    Examples
    --------
    >>> import control
    >>> import robthermal as rt
    >>> P, C = control.tf([0.1], [1, -1, 0], 0.01), control.tf([1.0], [1], 0.01)
    >>> f = rt.coupling.coprime((P, P), (C, C))
    >>> bool(abs(f.Np(1j)[0, 0] / f.Dp(1j)[0, 0] - P(1j)) < 1e-12)
    True
    """
    return CoprimeFactors(loops_of(P0, K0, cutoff))


def loops_of(P0: Any, K0: Any, cutoff: float | None = None) -> tuple[Loop, Loop]:
    """The two subsystems of a plant and a controller.

    Parameters
    ----------
    P0, K0 : 2x2 LTI or pairs
        Plants and controllers.
    cutoff : float, optional
        As :func:`coprime`.
    """
    plants, controllers = diagonal(P0, "P0"), diagonal(K0, "K0")
    dt = sample_time_of({"P1": plants[0], "P2": plants[1], "C1": controllers[0], "C2": controllers[1]})
    check_cutoff(cutoff)
    return (close(plants[0], controllers[0], 1, dt, cutoff=cutoff),
            close(plants[1], controllers[1], 2, dt, cutoff=cutoff))


def check_cutoff(cutoff: float | None) -> None:
    """Refuse what is no frequency.

    Parameters
    ----------
    cutoff : float or None
        Corner of the low-pass [rad/s].
    """
    if cutoff is not None and not (np.isfinite(cutoff) and cutoff > 0):
        raise InputError(f"{cutoff!r} rad/s", where="cutoff", expected="a positive frequency [rad/s]")


def corner_grid(systems: list[Zpk], points: int, lowest: float = 1e-3) -> Array:
    """Frequencies [rad/s] that see every corner and resonance of the systems.

    Parameters
    ----------
    systems : list of Zpk
        What will be looked at.
    points : int
        Number of logarithmic points; resonances come on top.
    lowest : float
        First frequency over the slowest corner [-].
    """
    return _grid(np.concatenate([np.concatenate([s.zeros, s.poles]) for s in systems]), systems[0].dt, points, lowest)


def _grid(roots: Array, dt: float, points: int, lowest: float) -> Array:
    roots = natural(roots, dt)
    size = np.abs(roots)
    kept = np.isfinite(size) & (size > 0)
    roots, size = roots[kept], size[kept]
    slowest, fastest = (size.min(), size.max()) if len(size) else (1.0, 1.0)
    top = np.pi / dt if dt else 1e3 * fastest
    base = np.geomspace(min(lowest * slowest, 1e-3 * top), top, points)
    peaks = roots[(roots.imag > 0) & (np.abs(roots.real) < 0.3 * size)]
    widths = np.concatenate([-np.geomspace(8, 0.05, 8), [0.0], np.geomspace(0.05, 8, 8)])
    extra = (peaks.imag[:, None] + widths * np.abs(peaks.real)[:, None]).ravel()
    grid = np.concatenate([base, extra])
    return np.unique(grid[(grid > 0) & (grid <= top)])


def _unit_inverse(loop: Loop) -> Zpk:
    """1/U, U = Dp Dk + Np Nk = Q Dk / S: stable, because zeros of S are the poles of P (in Q) and of C (in Dk)."""
    return loop.S.times(loop.Q.inverse(), loop.Dk.inverse()).without_hidden()


def _both(channels: Any) -> control.StateSpace:
    return reduce(apart, [realize(channel) for channel in channels])
