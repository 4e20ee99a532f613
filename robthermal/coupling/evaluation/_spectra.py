"""What a coupling does, frequency by frequency: sensitivities, improvement, e12, robust number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..._arrays import Array
from ..problem import Problem, youla_parameter
from ..systems import Response, siso
from . import _plots

if TYPE_CHECKING:
    from ._filters import Filters


@dataclass(frozen=True, eq=False)
class Spectra:
    """Values at frequencies, without and with coupling; nothing is proven between them.

    Parameters
    ----------
    frequency : ndarray, shape (n_f,)
        Frequencies of the curves [Hz].
    sensitivity_before, sensitivity_after : ndarray, shape (2, n_f)
        \\|S1\\|, \\|S2\\|, and \\|(1+Y) S1\\|, \\|(1+X) S2\\| [-].
    improvement : ndarray, shape (2, n_f)
        \\|1+Y\\|, which multiplies S1, and \\|1+X\\|, which multiplies S2 [-].
    e12_before, e12_after : ndarray, shape (n_f,)
        One-sided amplitude spectral density of e12 under the disturbances, without weight [m/√Hz].
    power_before, power_after : ndarray, shape (n_f,)
        Integral of its square up to each frequency [m²].
    robust : ndarray, shape (n_f,)
        rho(\\|Delta_k\\| R); zero without uncertainty [-].
    small_gain : ndarray, shape (n_f,)
        sigma_max(Delta_k) mu(Delta_p), Evers (6.22) [-].
    proven : float
        Bound of `robust` that is proven at every frequency.

    Examples
    --------
    >>> import robthermal as rt
    >>> machine = rt.systems.scanner()
    >>> filters = rt.coupling.evaluate(machine.P1, machine.P2, machine.C1, machine.C2, X_hat=-0.1,
    ...                                disturbances=machine.disturbances)
    >>> found = rt.coupling.spectra(filters)
    >>> bool((found.improvement[0] == 1.0).all()), found.plot(["e12", "power"]).shape
    (True, (2,))
    """

    frequency: Array
    sensitivity_before: Array
    sensitivity_after: Array
    improvement: Array
    e12_before: Array
    e12_after: Array
    power_before: Array
    power_after: Array
    robust: Array
    small_gain: Array
    proven: float

    def plot(self, panels: Sequence[str] = ("sensitivity", "improvement", "e12", "power", "robust")) -> NDArray[Any]:
        """Panels over frequency [Hz], one below the other.

        Parameters
        ----------
        panels : sequence of str
            Names of the panels to draw.

        Returns
        -------
        ndarray of matplotlib axes, one per panel
        """
        return _plots.draw(self, panels)


def spectra(filters: Filters, points: int = 1000) -> Spectra:
    """Sensitivities, improvement, e12 and robust number of a coupling at many frequencies.

    Parameters
    ----------
    filters : Filters
        From `synthesize` or `evaluate`.
    points : int
        Logarithmic frequencies; corners, resonances and the measured frequencies come on top.

    Returns
    -------
    Spectra

    Examples
    --------
    See :class:`Spectra`.

    >>> import robthermal as rt
    >>> rt.coupling.spectra.__name__
    'spectra'
    """
    problem = filters.problem
    omega = problem.grid(points)
    omega = omega[omega > 0]
    factor = np.abs([siso(filters.improvement_1, omega), siso(filters.improvement_2, omega)])
    loops = np.abs([half.S.at(omega) for half in (problem.one, problem.two)])
    noise = np.abs([half.SW.at(omega) for half in (problem.one, problem.two)])
    density = np.sqrt(2 * (problem.dt or 1.0))  # one-sided; discrete noise of variance 1 has the two-sided density dt
    before, after = (density * np.linalg.norm(part, axis=0) for part in (noise, factor * noise))
    hertz = omega / (2 * np.pi)
    return Spectra(hertz, loops, factor * loops, factor, before, after, cumulative(hertz, before),
                   cumulative(hertz, after), *_robust(problem, filters, omega), filters.norms["robust"])


def cumulative(hertz: Array, density: Array) -> Array:
    """Integral of density² from zero; flat below the first frequency, trapezoids above it.

    Parameters
    ----------
    hertz : ndarray, shape (n_f,)
        Frequencies of the density [Hz].
    density : ndarray, shape (n_f,)
        Amplitude spectral density [m/√Hz].
    """
    power = density**2
    steps = 0.5 * (power[1:] + power[:-1]) * np.diff(hertz)
    return np.cumsum(np.concatenate([[power[0] * hertz[0]], steps]))


def _robust(problem: Problem, filters: Filters, omega: Array) -> tuple[Array, Array]:
    delta = np.moveaxis(Response(youla_parameter(problem, filters.X_hat, filters.Y_hat))(omega), -1, 0)
    envelope = np.moveaxis(problem.envelope(omega), -1, 0)
    # mu(Delta_p) for off-diagonal Delta_k and the worst phases: rho(R [[0, 1], [1, 0]])
    weight = _radius(envelope[:, :, ::-1])
    return _radius(np.abs(delta) @ envelope), np.linalg.norm(delta, 2, axis=(1, 2)) * weight


def _radius(matrices: Array) -> Array:
    return np.max(np.abs(np.linalg.eigvals(matrices)), axis=1)
