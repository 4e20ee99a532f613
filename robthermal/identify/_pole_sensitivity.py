"""What prescribed poles cost when they are not the true ones: slopes of the estimate, and a covariance with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robthermal._arrays import Array
from robthermal.errors import InputError
from robthermal.signals import Record

from .._drawing import axes_for
from ._basis import LocalBasis
from ._local import LocalEstimate
from ._lpm import estimate_locally, lpm
from ._lrmp import prepared, scaled_poles
from ._records import Spectrum, spectrum_of
from ._response import FrequencyResponse

_STEP = 1e-3  # relative change of a pole on either side, for the slopes


@dataclass(frozen=True)
class PoleSensitivity:
    """How an estimate with prescribed poles moves with its poles.

    Parameters
    ----------
    estimate : FrequencyResponse
        Estimate with the poles as given.
    polynomial : FrequencyResponse
        Estimate of the same windows without poles, by local polynomials.
    poles : ndarray of complex, shape (n_p,)
        Poles as they are used, slowest first [rad/s].
    slopes : ndarray, shape (n_directions, n_y, n_u, n_f)
        Change of G per change of a pole by its own size [unit of G]: first along the real axis, of complex poles then
        along the imaginary axis. A conjugate in the list moves with its pole.
    moved : tuple of (int, str)
        For every direction the pole, counted from 0, and "real" or "imaginary".
    """

    estimate: FrequencyResponse
    polynomial: FrequencyResponse
    poles: Array
    slopes: Array
    moved: tuple[tuple[int, str], ...]

    def covariance(self, deviation: ArrayLike) -> Array:
        """Covariance of G that uncertain poles cause, beside that of the noise, in the order of `G.covariance`.

        Parameters
        ----------
        deviation : float or array_like, shape (n_p,)
            Standard deviation of every pole relative to its size, along each axis [-].

        Returns
        -------
        numpy.ndarray, shape (n_y n_u, n_y n_u, n_f)
        """
        sizes = _deviations(deviation, len(self.poles))
        each = np.array([sizes[pole] for pole, _ in self.moved])
        n_d, n_y, n_u, n_f = self.slopes.shape
        stacked = (each[:, None, None, None] * self.slopes).transpose(0, 2, 1, 3).reshape(n_d, n_u * n_y, n_f)
        return np.einsum("daf,dbf->abf", stacked, stacked.conj())

    def with_uncertain_poles(self, deviation: ArrayLike) -> FrequencyResponse:
        """The estimate with a covariance that contains both the noise and the uncertainty of the poles.

        Parameters
        ----------
        deviation : float or array_like, shape (n_p,)
            Standard deviation of every pole relative to its size, along each axis [-].

        Returns
        -------
        FrequencyResponse
            Its circles cover where a pole moves G along a line 0.92 to 0.95 instead of 0.95.
            `joint_covariance` takes the bins as independent, although a wrong pole moves neighboring bins together.
        """
        G = self.estimate
        sizes = _deviations(deviation, len(self.poles))
        said = ", ".join(f"{100 * size:.3g}" for size in sizes)
        return G.replace(covariance=G.covariance + self.covariance(sizes), gram=None, joint=None,
                         method=f"{G.method}, poles within {said} %",
                         notes=[*G.notes, "The covariance contains the uncertainty of the poles."])

    def tolerance(self) -> Array:
        """Relative error of all poles up to which they beat the local polynomial, bin by bin, estimated.

        What moves G by as much as the polynomial estimate lies from it; at bins where that is within the circle of the
        polynomial estimate there is nothing to tell, and the number is infinite: take either.

        Returns
        -------
        numpy.ndarray, shape (n_f,)
        """
        away = np.abs(self.polynomial.response - self.estimate.response)
        told = away > self.polynomial.confidence_radius(0.95)
        moves = np.sqrt(np.sum(np.abs(self.slopes) ** 2, axis=0))
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(told, away / moves, np.inf)
        return np.asarray(ratio.min(axis=(0, 1)))

    def __str__(self) -> str:
        G, lines = self.estimate, []
        size = np.abs(G.response)
        for row, (pole, axis) in enumerate(self.moved):
            p = self.poles[pole]
            shown = f"{p.real:.4g}" if p.imag == 0.0 else f"{p:.4g}"
            share = np.max(0.1 * np.abs(self.slopes[row]) / size, axis=(0, 1))
            worst = int(np.nanargmax(share))
            beyond = np.mean((0.1 * np.abs(self.slopes[row]) > G.confidence_radius(0.95)).any(axis=(0, 1)))
            lines.append(f"pole {shown} rad/s off by 10 % ({axis}): G moves by up to {100 * share[worst]:.2g} %, at "
                         f"{G.frequencies[worst]:.3g} Hz, beyond its 95 % circle in {100 * beyond:.0f} % of the bins")
        limit = self.tolerance()
        if np.isfinite(limit).any():
            worst = int(np.argmin(limit))
            lines.append(f"poles off by more than {100 * limit[worst]:.2g} % are worse than no poles (lpm) at "
                         f"{G.frequencies[worst]:.3g} Hz")
        return "\n".join(lines)

    def plot(self, ax: Any = None) -> Any:
        """Draw what 10 % of each pole moves G by, largest over the entries, beside the 95 % circle.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.

        Returns
        -------
        matplotlib axes
        """
        ax, G = axes_for(ax), self.estimate
        size = np.abs(G.response)
        for row, (pole, axis) in enumerate(self.moved):
            p = self.poles[pole]
            shown = f"{p.real:.3g}" if p.imag == 0.0 else f"{p:.3g}"
            ax.loglog(G.frequencies, np.max(10.0 * np.abs(self.slopes[row]) / size, axis=(0, 1)),
                      label=f"pole {shown} rad/s, 10 % {axis}")
        ax.loglog(G.frequencies, 100 * np.max(G.confidence_radius(0.95) / size, axis=(0, 1)), "--",
                  label="95 % circle of the noise")
        ax.set(xlabel="frequency [Hz]", ylabel="relative to the response [%]", title="sensitivity to the poles")
        ax.legend()
        return ax


def pole_sensitivity(record: Record | Sequence[Record], poles: Any, half_width: int = 8) -> PoleSensitivity:
    """How much an estimate with prescribed poles hangs on them, and a covariance for poles that are known roughly.

    Parameters
    ----------
    record : Record or sequence of Record
        Measured inputs and outputs, as for `lrmp`.
    poles : sequence of complex, "auto", "resonant", System, or python-control model
        As for `lrmp`.
    half_width : int
        Bins on either side of the center that a window uses [-].

    Returns
    -------
    PoleSensitivity

    Raises
    ------
    InputError
        As `lrmp`.

    References
    ----------
    Evers (2021), Sec. 7.2.1; Verbeke (2019), Frequency response function estimation with local models, ch. 2.

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> rng = np.random.default_rng(2)
    >>> u, y, a = rng.normal(size=600), np.zeros(600), np.exp(-0.01)
    >>> for n in range(599):
    ...     y[n + 1] = a * y[n] + (1.0 - a) * u[n]
    >>> record = rt.Record(sample_time=1.0, inputs=u, outputs=y + 1e-4 * rng.normal(size=600), input_names=["q"],
    ...                    output_names=["T"])
    >>> found = rt.identify.pole_sensitivity(record, [-0.012])  # 20 % off
    >>> wide = found.with_uncertain_poles(0.2)
    >>> truth = (1.0 - a) / (np.exp(2j * np.pi * wide.frequencies) - a)
    >>> lowest = abs(wide.response[0, 0] - truth)[:8]
    >>> bool((lowest < wide.confidence_radius()[0, 0, :8]).all())
    True
    """
    records, basis, chosen = prepared(record, poles, half_width)
    sample_time, spectra = records[0].sample_time, [spectrum_of(r.inputs, r.outputs) for r in records]
    shown = ", ".join(f"{p.real:.4g}" if p.imag == 0.0 else f"{p:.4g}" for p in chosen)
    estimate = estimate_locally(records, basis, f"lrmp, poles {shown} rad/s, half_width {half_width}")
    slopes, moved = [], []
    for pole, axis in _directions(chosen):
        scaled = [scaled_poles(_moved(chosen, pole, axis, change), sample_time) for change in (_STEP, -_STEP)]
        forth, back = (_moved_response(spectra, basis, one) for one in scaled)
        slopes.append((forth - back) / (2 * _STEP))
        moved.append((pole, axis))
    polynomial = lpm(record, min(2, half_width), half_width)
    return PoleSensitivity(estimate, polynomial, chosen, np.array(slopes), tuple(moved))


def _directions(poles: Array) -> list[tuple[int, str]]:
    """Poles and axes along which they move; the second of a conjugate pair moves with the first."""
    found = []
    for k, pole in enumerate(poles):
        if any(abs(pole - np.conj(other)) <= 1e-12 * abs(pole) for other in poles[:k]) and pole.imag:
            continue
        found += [(k, "real")] + ([(k, "imaginary")] if pole.imag else [])
    return found


def _moved(poles: Array, pole: int, axis: str, change: float) -> Array:
    """Poles with one of them, and its conjugate, moved by a part of its size."""
    step, moved = abs(poles[pole]) * change * (1j if axis == "imaginary" else 1.0), poles.astype(complex)
    partner = np.abs(poles - np.conj(poles[pole])) <= 1e-12 * abs(poles[pole])
    moved[partner] += np.conj(step)
    moved[pole] = poles[pole] + step
    return moved


def _moved_response(spectra: Sequence[Spectrum], basis: LocalBasis, scaled: Array) -> Array:
    return LocalEstimate(spectra, replace(basis, poles=scaled)).run().response


def _deviations(given: ArrayLike, count: int) -> Array:
    try:
        found = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        found = np.array(np.nan)
    if found.shape not in ((), (count,)) or not (np.isfinite(found) & (found >= 0)).all():
        raise InputError(f"deviation has shape {found.shape} or a value that is no share", where="argument deviation",
                         expected=f"one number, or {count}, 0 or more, relative to the poles")
    return np.broadcast_to(found, (count,))
