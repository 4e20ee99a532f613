"""How measured plants differ from the model, as the controllers see it: the dual-Youla parameter, Evers (6.21)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..._arrays import Array
from ...errors import InputError
from ..systems import natural
from ._coprime import CoprimeFactors
from ._frf import Measured, MeasuredPlants, label, read_plants
from ._matrix_factors import MatrixFactors
from ._winding import MeasuredLoop, expect_beyond_crossover, expect_joined, undecided

_RESONANT = 1 / np.sqrt(2)  # damping ratio below which a mode has a peak


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
    factors : CoprimeFactors or MatrixFactors
        Of the model and the controllers.
    radius : ndarray, shape (n_plants, 2, 2, n_f), optional
        What Delta_p can move by when the measured plant moves within its circles, which hold the true values of all
        entries, frequencies and plants at once with probability `confidence`. None without covariance.
    confidence : float, optional
        Probability that all true values are in their circles; None without covariance.
    left_out : ndarray, shape (n_out,)
        Frequencies below the first of `omega` that were measured but not used: an infinite circle, or plants in it that
        make det(I + P K0) zero [rad/s]. The model error assumed there is that at the first frequency.

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
    factors: CoprimeFactors | MatrixFactors
    radius: Array | None = None
    confidence: float | None = None
    left_out: Array = field(default_factory=lambda: np.zeros(0))

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
        """The same with the confidence circles of the measurements inside the envelope.

        Give the result to `synthesize` or `evaluate` as `uncertainty`; without this call the circles are not used.

        Returns
        -------
        Uncertainty
            Unchanged when the measurements carry no covariance.
        """
        if self.radius is None:
            return self
        return replace(self, envelope=np.max(np.abs(self.samples) + self.radius, axis=0))

    def without_confidence(self) -> Uncertainty:
        """The same with the measured values alone in the envelope.

        Returns
        -------
        Uncertainty
        """
        return replace(self, envelope=np.max(np.abs(self.samples), axis=0))

    def plot(self) -> NDArray[Any]:
        """Magnitude of every sample and the envelope over frequency [Hz].

        Returns
        -------
        ndarray of matplotlib axes, shape (2, 2); of matrices, one for every entry
        """
        import matplotlib.pyplot as plt

        rows, columns = self.envelope.shape[:2]
        axes: Any = plt.subplots(rows, columns, sharex=True, squeeze=False, layout="constrained")[1]
        for row, column in np.ndindex(rows, columns):
            ax = axes[row, column]
            if np.any(self.envelope[row, column]):
                ax.loglog(self.omega / (2 * np.pi), np.abs(self.samples[:, row, column]).T, color="0.7", linewidth=0.8)
                ax.loglog(self.omega / (2 * np.pi), self.envelope[row, column], color="k")
                ax.set(xlabel="frequency [Hz]", ylabel="magnitude [-]", title=f"Δp {row + 1}{column + 1}")
            else:  # the entry is zero in every sample: no curve
                ax.set_axis_off()
                ax.text(0.5, 0.5, f"Δp {row + 1}{column + 1} = 0", transform=ax.transAxes, ha="center", va="center")
        return axes


def from_factors(plants: Measured, factors: CoprimeFactors, where: str, confidence: float = 0.95,
                 measured_in_closed_loop: bool = False) -> Uncertainty:
    """The same with factors at hand, of any number of loops.

    Parameters
    ----------
    plants : square frequency response, or list of them
        Measured plants; one input and output per loop.
    factors : CoprimeFactors
        Of model and controllers.
    where : str
        Name of the argument, for messages.
    confidence : float
        Joint probability of the circles, as in `dual_youla`.
    measured_in_closed_loop : bool
        Whether K0 ran during the measurement, as in `dual_youla`.
    """
    loops, size = factors.loops, len(factors.loops)
    measured = read_plants(plants, loops[0].P.dt, where, size, confidence)
    diag = _diagonals(factors, measured.omega, where)
    P, radius = (np.moveaxis(part, -1, 1) for part in (measured.response, measured.radius))  # (n_plants, n_f, 2, 2)
    left = np.linalg.inv(diag["Dk"] + P @ diag["Nk"])
    samples = left @ (P - diag["P0"]) @ diag["Dp"]
    loop = loop_change(left, radius, diag)
    first = first_decided(np.any(np.isnan(loop), axis=(0, 2, 3)), measured, where)
    omega, out = measured.omega[first:], measured.omega[:first]
    for number, one in enumerate(loops, 1):
        expect_grid(omega, one.P.poles, one.P.dt, number, where)
    if not measured_in_closed_loop:
        if first:
            expect_joined(loops, out, omega[0], where)
        expect_beyond_crossover(loops, float(omega[-1]), where)
        kept = {name: part[first:] for name, part in diag.items()}
        for k, covered in enumerate(measured.covered):
            ratios, swings = _ratios(P[k, first:], loop[k, first:], kept)
            MeasuredLoop(omega, ratios, swings, covered, label(where, k, len(P))).expect_stable()
    samples, radius, loop = samples[:, first:], radius[:, first:], loop[:, first:]
    circles = None
    if measured.covered.any():
        kept = {name: part[first:] for name, part in diag.items()}
        bound = circle_bound(left[:, first:], radius, loop, kept, samples)
        circles = np.moveaxis(bound, 1, -1)
    samples = np.moveaxis(samples, 1, -1)
    return Uncertainty(omega, samples, np.max(np.abs(samples), axis=0), factors, circles,
                       confidence if circles is not None else None, out)


def _diagonals(factors: CoprimeFactors, omega: Array, where: str) -> dict[str, Array]:
    """Factors at the frequencies as diagonal matrices (n_f, n, n)."""
    f = factors.at(omega)
    if not np.all(np.isfinite(f["P0"])):
        at_pole = omega[~np.all(np.isfinite(f["P0"]), axis=0)][0]
        raise InputError(f"frequency {at_pole:.6g} rad/s is a pole of the model", where=where,
                         expected="frequencies at which P0 is finite", remedy="Leave that frequency out.")
    unit = np.eye(len(factors.loops))[:, :, None]
    return {name: np.moveaxis(value[:, None, :] * unit, -1, 0) for name, value in f.items()}


def loop_change(left: Array, radius: Array, diag: dict[str, Array]) -> Array:
    """Bound |L| r |Nk| of L dP Nk, L = (Dk + P Nk)⁻¹, for every plant in the circles; NaN where a bin is undecided.

    det(I + (P + dP) K0) = det(I + P K0) det(I + L dP Nk), which is not zero if the bound's spectral radius is below 1.
    """
    known = np.all(np.isfinite(radius), axis=(2, 3))
    bound = np.abs(left) @ np.where(known[:, :, None, None], radius, 0.0) @ np.abs(diag["Nk"])
    known &= np.max(np.abs(np.linalg.eigvals(bound)), axis=2) < 1
    return np.where(known[:, :, None, None], bound, np.nan)


def first_decided(undecided_bins: Array, measured: MeasuredPlants, where: str) -> int:
    """Place of the first decided bin; undecided ones above it are refused, above the last decided one too.

    Below, the relative error of a model is the smaller the lower the frequency, up to drift; above, it grows with every
    mode that the model lacks, so the last value of the envelope is no bound to assume unasked.
    """
    omega, decided = measured.omega, np.flatnonzero(~undecided_bins)
    reason = "a confidence circle that is infinite, or holds plants that make det(I + P K0) zero"
    if len(decided) < 2:
        raise undecided(omega, where, f"{len(omega) - len(decided)} of {len(omega)} have {reason}", True)
    first, last = int(decided[0]), int(decided[-1])
    between = first + np.flatnonzero(undecided_bins[first:last])
    if len(between):
        raise undecided(omega[between], where, f"{len(between)} of them have {reason}, between decided bins", True)
    if last + 1 < len(omega):
        end = omega[last] / (2 * np.pi)
        raise undecided(omega[last + 1:], where, f"all {len(omega) - last - 1} above {end:.4g} Hz have {reason}", True,
                        f"Or end the response at {end:.4g} Hz (band of robthermal frf): then the model error above is "
                        "assumed to be that at its last bin.")
    return first


def _ratios(P: Array, loop: Array, diag: dict[str, Array]) -> tuple[Array, Array]:
    """det(I + P K0)/det(I + P0 K0) and how far its phase may turn, (n_series, n_f): loop by loop if P is diagonal.

    Every eigenvalue of E = L dP Nk is at most the spectral radius of the bound M = `loop`, so each turns det(I + E) by
    its arcsine at most; and |log det(I + E)| <= -log det(I - M), by the series of both.
    """
    measured, model = diag["Dk"] + P @ diag["Nk"], diag["Dk"] + diag["P0"] @ diag["Nk"]
    apart = ~np.eye(P.shape[-1], dtype=bool)
    if not np.any(P[:, apart]) and not np.any(loop[:, apart]):
        own = (np.diagonal(part, axis1=1, axis2=2).T for part in (measured, model, loop))
        top, bottom, bound = own
        return top / bottom, np.arcsin(bound.real)
    rho = np.max(np.abs(np.linalg.eigvals(loop)), axis=1)
    swing = np.minimum(P.shape[-1] * np.arcsin(rho), -np.log(np.linalg.det(np.eye(P.shape[-1]) - loop)))
    return (np.linalg.det(measured) / np.linalg.det(model))[None], swing[None]


def circle_bound(left: Array, radius: Array, loop: Array, diag: dict[str, Array], samples: Array) -> Array:
    """Bound of the change of Delta_p for every |dP| <= radius, not to first order only.

    The change is (I + L dP Nk)⁻¹ L dP (Dp - Nk Delta) with L = (Dk + P Nk)⁻¹, exactly; entry by entry the inverse is
    at most (I - |L| radius |Nk|)⁻¹, whose Neumann series converges where the bin is decided.
    """
    size = np.abs(left) @ radius
    return np.linalg.solve(np.eye(len(loop[0, 0])) - loop, size @ np.abs(diag["Dp"] - diag["Nk"] @ samples))


def expect_grid(omega: Array, poles: Array, dt: float, number: int, where: str) -> None:
    """Refuse a grid that steps over a resonance of the model.

    Parameters
    ----------
    omega : ndarray
        Frequencies of the measurement [rad/s].
    poles : ndarray of complex
        Poles of the plant.
    dt : float
        Sample time [s]; 0 in continuous time.
    number : int
        Of the plant, for messages.
    where : str
        Name of the argument, for messages.
    """
    modes = natural(poles, dt)
    nyquist = np.pi / dt if dt else np.inf
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
