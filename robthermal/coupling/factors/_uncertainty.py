"""How measured plants differ from the model, as the controllers see it: the dual-Youla parameter, Evers (6.21)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..._arrays import Array
from ...errors import InputError
from ..systems import natural
from ._coprime import CoprimeFactors, coprime
from ._frf import Measured, read_plants
from ._loop import Loop

_RESONANT = 1 / np.sqrt(2)  # damping ratio below which a mode has a peak
_TURN = 0.9 * np.pi  # phase step between two frequencies beyond which turns cannot be counted


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Dual-Youla parameters of measured plants and their envelope.

    Between two frequencies the larger of the two envelope values holds; below the first and above the last the end
    value. That is an assumption about the plant, checked only as far as the grid resolves the resonances of P0.

    Parameters
    ----------
    omega : ndarray, shape (n_f,)
        Frequencies of the responses [rad/s].
    samples : ndarray, shape (n_plants, 2, 2, n_f)
        Delta_p of each measured plant (complex).
    envelope : ndarray, shape (2, 2, n_f)
        Largest magnitude over the plants.
    factors : CoprimeFactors
        Of the model and the controllers.
    radius : ndarray, shape (n_plants, 2, 2, n_f), optional
        What Delta_p can move by when the measured plant moves within its 95 % circles, each entry and frequency by
        itself; infinite where a circle holds plants that K0 does not stabilize. None without covariance.

    Examples
    --------
    >>> import control
    >>> import numpy as np
    >>> import robthermal as rt
    >>> P, C = control.tf([0.1], [1, -0.9], 0.01), control.tf([1.0], [1], 0.01)
    >>> w = np.linspace(1.0, 314.0, 50)
    >>> measured = np.zeros((2, 2, 50), dtype=complex)
    >>> measured[0, 0] = measured[1, 1] = 1.1 * P(np.exp(0.01j * w))
    >>> u = rt.coupling.dual_youla(control.FRD(measured, w), (P, P), (C, C))
    >>> u.samples.shape, bool(abs(u.envelope[0, 0, -1] - 0.1 * abs(1 + P(1)) / 2) < 0.1)
    ((1, 2, 2, 50), True)
    """

    omega: Array
    samples: Array
    envelope: Array
    factors: CoprimeFactors
    radius: Array | None = None

    def at(self, omega: ArrayLike) -> Array:
        """Envelope as the proofs use it: the larger of the two neighbors.

        Parameters
        ----------
        omega : array_like, shape (n_f,)
            Frequencies of the responses [rad/s].

        Returns
        -------
        ndarray, shape (2, 2, n_f)
        """
        right = np.searchsorted(self.omega, np.asarray(omega, dtype=float), side="left")
        exact = self.omega[np.minimum(right, len(self.omega) - 1)] == omega
        above = np.clip(np.where(exact, right + 1, right), 0, len(self.omega) - 1)
        below = np.clip(right - 1, 0, len(self.omega) - 1)
        here = np.clip(right, 0, len(self.omega) - 1)
        return np.maximum(np.maximum(self.envelope[:, :, below], self.envelope[:, :, here]), self.envelope[:, :, above])

    def with_confidence(self) -> Uncertainty:
        """The same with the 95 % confidence circles of the measurements inside the envelope.

        Give the result to `synthesize` or `evaluate` as `uncertainty`; without this call the circles are not used.

        Returns
        -------
        Uncertainty
            Unchanged when the measurements carry no covariance.

        Raises
        ------
        InputError
            Where a circle is infinite, or so large that some plant in it is not stabilized.
        """
        if self.radius is None:
            return self
        bad = ~np.all(np.isfinite(self.radius), axis=(1, 2))
        if np.any(bad):
            plant, index = np.argwhere(bad)[0]
            raise InputError(f"the confidence circle of plant {plant + 1} at {self.omega[index]:.6g} rad/s is unknown "
                             "or too large for the controllers", where="with_confidence",
                             expected="a plant that K0 stabilizes wherever it is in its circle",
                             remedy="Measure longer, or leave that frequency out.")
        return replace(self, envelope=np.max(np.abs(self.samples) + self.radius, axis=0))

    def plot(self) -> Any:
        """Magnitude of every sample and the envelope over frequency [Hz].

        Returns
        -------
        ndarray of matplotlib axes, shape (2, 2)
        """
        import matplotlib.pyplot as plt

        axes: Any = plt.subplots(2, 2, sharex=True, squeeze=False, layout="constrained")[1]
        for row, column in np.ndindex(2, 2):
            ax = axes[row, column]
            if np.any(self.envelope[row, column]):
                ax.loglog(self.omega / (2 * np.pi), np.abs(self.samples[:, row, column]).T, color="0.7", linewidth=0.8)
                ax.loglog(self.omega / (2 * np.pi), self.envelope[row, column], color="k")
            else:
                ax.set_axis_off()
            ax.set_title(f"Δp {row + 1}{column + 1}")
            ax.set_xlabel("frequency [Hz]")
        return axes


def dual_youla(P_frf: Measured, P0: Any, K0: Any) -> Uncertainty:
    """Delta_p = (Dk + P_frf Nk)⁻¹ (P_frf - P0) Dp of measured plants, Evers (6.21) corrected.

    Parameters
    ----------
    P_frf : 2x2 frequency response, or list of them
        Measured plants: python-control FRD [rad/s] or the result of rt.identify [Hz], on one frequency grid.
    P0, K0 : 2x2 StateSpace or TransferFunction, or pairs
        Model and controllers, diagonal.

    Returns
    -------
    Uncertainty
        Samples and envelope.

    Raises
    ------
    InputError
        For an unstable nominal loop, a grid too coarse for a resonance of P0 or not covering it, a measured plant
        that K0 does not stabilize, NaN or wrong shapes.

    Examples
    --------
    See :class:`Uncertainty`.

    >>> import robthermal as rt
    >>> rt.coupling.dual_youla.__name__
    'dual_youla'
    """
    return from_factors(P_frf, coprime(P0, K0), "P_frf")


def from_factors(plants: Measured, factors: CoprimeFactors, where: str) -> Uncertainty:
    """The same with factors at hand, of any number of loops.

    Parameters
    ----------
    plants : square frequency response, or list of them
        Measured plants; one input and output per loop.
    factors : CoprimeFactors
        Of model and controllers.
    where : str
        Name of the argument, for messages.
    """
    size = len(factors.loops)
    omega, measured, radius = read_plants(plants, factors.loops[0].P.dt, where, size)
    for number, loop in enumerate(factors.loops, 1):
        _expect_resolved(omega, loop, number, where)
    f = factors.at(omega)
    if not np.all(np.isfinite(f["P0"])):
        at_pole = omega[~np.all(np.isfinite(f["P0"]), axis=0)][0]
        raise InputError(f"frequency {at_pole:.6g} rad/s is a pole of the model", where=where,
                         expected="frequencies at which P0 is finite", remedy="Leave that frequency out.")
    diag = {name: np.moveaxis(value[:, None, :] * np.eye(size)[:, :, None], -1, 0) for name, value in f.items()}
    P = np.moveaxis(measured, -1, 1)  # (n_plants, n_f, 2, 2)
    for index in range(len(P)):
        _expect_stabilized(P[index], diag, where if len(P) == 1 else f"{where}[{index}]")
    left = np.linalg.inv(diag["Dk"] + P @ diag["Nk"])
    samples = left @ (P - diag["P0"]) @ diag["Dp"]
    circles = None
    if radius is not None:
        circles = np.moveaxis(_circles(left, np.moveaxis(radius, -1, 1), diag, samples), 1, -1)
    samples = np.moveaxis(samples, 1, -1)
    return Uncertainty(omega, samples, np.max(np.abs(samples), axis=0), factors, circles)


def _circles(left: Array, radius: Array, diag: dict[str, Array], samples: Array) -> Array:
    """Bound of the change of Delta_p for every |dP| <= radius, not to first order only.

    The change is (I + L dP Nk)⁻¹ L dP (Dp - Nk Delta) with L = (Dk + P Nk)⁻¹, exactly; entry by entry the inverse is
    at most (I - |L| radius |Nk|)⁻¹ where that Neumann series converges.
    """
    known = np.all(np.isfinite(radius), axis=(2, 3))
    size = np.abs(left) @ np.where(known[:, :, None, None], radius, 0.0)
    loop = size @ np.abs(diag["Nk"])
    known &= np.max(np.abs(np.linalg.eigvals(loop)), axis=2) < 1
    loop[~known] = 0.0
    found = np.linalg.solve(np.eye(len(loop[0, 0])) - loop, size @ np.abs(diag["Dp"] - diag["Nk"] @ samples))
    return np.where(known[:, :, None, None], found, np.inf)


def _expect_resolved(omega: Array, loop: Loop, number: int, where: str) -> None:
    """Refuse a grid that steps over a resonance of the model."""
    modes = natural(loop.P.poles, loop.P.dt)
    nyquist = np.pi / loop.P.dt if loop.P.dt else np.inf
    for mode in modes[(modes.imag > 0) & (modes.imag < 0.999 * nyquist)]:
        size, damping = abs(mode), -mode.real / abs(mode)
        if damping >= _RESONANT or size >= nyquist:
            continue
        if not omega[0] <= size <= omega[-1]:
            raise InputError(f"frequencies {omega[0]:.6g} to {omega[-1]:.6g} rad/s do not cover the resonance of "
                             f"P{number} at {size:.6g} rad/s", where=where, expected="a grid that covers it",
                             remedy="Measure there.")
        right = int(np.clip(np.searchsorted(omega, size), 1, len(omega) - 1))
        spacing, width = omega[right] - omega[right - 1], 2 * max(damping, 0.0) * size
        if spacing > width * (1 + 1e-9):
            raise InputError(f"spacing of {spacing:.4g} rad/s at the resonance of P{number} at {size:.6g} rad/s",
                             where=where, expected=f"at most its half-power width, {width:.4g} rad/s",
                             remedy="Measure with a finer grid there (a longer record).")


def _expect_stabilized(P: Array, diag: dict[str, Array], where: str) -> None:
    """Refuse a measured plant whose loop with K0 winds otherwise round the origin than that of the model."""
    ratio = np.linalg.det(diag["Dk"] + P @ diag["Nk"]) / np.linalg.det(diag["Dk"] + diag["P0"] @ diag["Nk"])
    closed = np.concatenate([ratio, ratio[::-1].conj()])  # negative frequencies, joined by straight lines at the ends
    steps = np.angle(np.roll(closed, -1) / closed)
    inner = np.abs(np.angle(ratio[1:] / ratio[:-1]))
    turns = round(float(np.sum(steps)) / (2 * np.pi))
    if turns:
        raise InputError(f"the controllers do not stabilize this measured plant: det(I + P_frf K0) encircles the "
                         f"origin {abs(turns)} more time{'s' * (abs(turns) > 1)} than det(I + P0 K0)", where=where,
                         expected="a plant that K0 stabilizes (it was measured in closed loop)",
                         remedy="Check sign, units (rad/s, Hz) and the order of inputs and outputs.")
    if np.max(inner, initial=0.0) > _TURN:
        raise InputError("the phase of det(I + P_frf K0) jumps by more than 160 degrees between two frequencies",
                         where=where, expected="a grid on which encirclements can be counted",
                         remedy="Measure with a finer grid, or with less noise.")
