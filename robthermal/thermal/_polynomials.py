"""Thermoelectric module from a vendor's material polynomials: scaling, and straight lines over a temperature range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike, NDArray

from .._checks import positive_number, whole_number
from ..errors import InputError
from ._checks import kelvin
from ._parts import Linear, Module

_SAMPLES = 81  # temperatures of the fit; more change its numbers by less than a tenth of its residual


@dataclass(frozen=True)
class Polynomials:
    """S, R and K of a reference module as polynomials of temperature in kelvin, lowest power first.

    Parameters
    ----------
    seebeck : tuple of float
        Coefficients of the Seebeck coefficient S [V/K], [V/K²], …
    resistance : tuple of float
        Coefficients of the electrical resistance R [Ω], [Ω/K], …
    conductance : tuple of float
        Coefficients of the thermal conductance K [W/K], [W/K²], …
    couples : int
        Couples of the reference module [-].
    i_max : float
        Its Imax [A]: the size of its legs.
    source, caveat : str
        Where the numbers come from, and what is doubtful about them.

    Examples
    --------
    >>> import robthermal as rt
    >>> S, R, K = rt.systems.ferrotec().at(308.15, couples=127, i_max=3.3)
    >>> print(f"{S:.5f} V/K, {R:.4f} Ω, {K:.4f} W/K")
    0.05385 V/K, 4.6289 Ω, 0.2952 W/K
    """

    seebeck: tuple[float, ...]
    resistance: tuple[float, ...]
    conductance: tuple[float, ...]
    couples: int
    i_max: float
    source: str
    caveat: str = ""

    def at(self, temperature: ArrayLike, *, couples: int | None = None,
           i_max: float | None = None) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """S, R and K, scaled to another number of couples and another leg size.

        S grows with the couples; R with the couples and against the leg section (∝ Imax at equal leg length);
        K with both.

        Parameters
        ----------
        temperature : array_like
            Mean temperature of the module [K].
        couples : int, optional
            Default: those of the reference module.
        i_max : float, optional
            [A]; default: that of the reference module.

        Returns
        -------
        S, R, K : ndarray
            [V/K], [Ω], [W/K].
        """
        n = (self.couples if couples is None else whole_number(couples, "couples", 1)) / self.couples
        size = (self.i_max if i_max is None else positive_number(i_max, "i_max", "A")) / self.i_max
        T = np.asarray(temperature, float)
        S, R, K = (polyval(T, c) for c in (self.seebeck, self.resistance, self.conductance))
        return S * n, R * n / size, K * n * size


@dataclass(frozen=True)
class PolynomialFit:
    """Straight lines through material polynomials.

    Parameters
    ----------
    seebeck, resistance, conductance : Linear
        [V/K], [Ω], [W/K] and their slopes per kelvin.
    reference_temperature : float
        Where the values hold [K].
    t_range : tuple of float
        Range of the fit [K].
    residuals : tuple of float
        Largest relative error over the range, of S, R and K [-].
    source : str
        Of the polynomials, with its caveat.
    """

    seebeck: Linear
    resistance: Linear
    conductance: Linear
    reference_temperature: float
    t_range: tuple[float, float]
    residuals: tuple[float, float, float]
    source: str

    def module(self, hot: str, cold: str, *, current_limits: tuple[float, float] | None = None) -> Module:
        """Module with these properties between two lumps.

        Parameters
        ----------
        hot, cold : str
            Lumps of the two faces.
        current_limits : tuple of float, optional
            Lowest and highest allowed current [A].

        Returns
        -------
        Module
        """
        return Module(hot=hot, cold=cold, seebeck=self.seebeck, resistance=self.resistance,
                      conductance=self.conductance, reference_temperature=self.reference_temperature,
                      current_limits=current_limits)

    def __str__(self) -> str:
        rows = zip(("S [V/K]", "R [Ω]", "K [W/K]"), (self.seebeck, self.resistance, self.conductance), self.residuals,
                   strict=True)
        head = f"at {self.reference_temperature:g} K, fitted over {self.t_range[0]:g} to {self.t_range[1]:g} K"
        lines = [f"{name:8} {p.value:12.5g} {p.slope:12.4g} {worst:10.2%}" for name, p, worst in rows]
        return "\n".join([head, f"{'':8} {'value':>12} {'slope [/K]':>12} {'misfit':>10}", *lines, self.source])


def module_from_polynomials(polynomials: Polynomials, *, couples: int, i_max: float,
                            t_range: tuple[float, float] = (288.15, 328.15)) -> PolynomialFit:
    """Straight lines through a vendor's polynomials, scaled to a module of another size.

    Least squares at 81 equally spaced temperatures; the values hold at the middle of the range.

    Parameters
    ----------
    polynomials : Polynomials
        For example ``rt.systems.ferrotec()``.
    couples : int
        Couples of the module [-].
    i_max : float
        Rated current Imax of the module [A].
    t_range : tuple of float
        Temperatures the straight lines must serve [K].

    Returns
    -------
    PolynomialFit

    Raises
    ------
    InputError
        Temperatures that look like Celsius, a range that does not ascend, or a property that is not positive in it.

    Examples
    --------
    >>> import robthermal as rt
    >>> fit = rt.thermal.module_from_polynomials(rt.systems.ferrotec(), couples=127, i_max=3.3)
    >>> print(fit)
    at 308.15 K, fitted over 288.15 to 328.15 K
                    value   slope [/K]     misfit
    S [V/K]      0.053743    7.421e-05      0.38%
    R [Ω]          4.6298      0.02275      0.06%
    K [W/K]       0.29678    0.0009477      1.06%
    Ferrotec, Thermoelectric Technical Reference Guide, section 11 (K: ... the vendor's page)
    """
    low, high = (kelvin(t, "argument t_range") for t in t_range)
    if not low < high:
        raise InputError(f"({low:g}, {high:g}) does not ascend", where="argument t_range",
                         expected="(lower, upper) [K]", remedy="Exchange the two.")
    T, middle = np.linspace(low, high, _SAMPLES), 0.5 * (low + high)
    curves = polynomials.at(T, couples=couples, i_max=i_max)
    S, R, K = (_line(T - middle, y, name) for y, name in zip(curves, ("S", "R", "K"), strict=True))
    worst = [float(np.abs((line.value + line.slope * (T - middle)) / y - 1).max())
             for line, y in zip((S, R, K), curves, strict=True)]
    source = polynomials.source + (f" ({polynomials.caveat})" if polynomials.caveat else "")
    return PolynomialFit(S, R, K, reference_temperature=middle, t_range=(low, high),
                         residuals=(worst[0], worst[1], worst[2]), source=source)


def _line(dT: NDArray[np.float64], y: NDArray[np.float64], name: str) -> Linear:
    if y.min() <= 0:
        raise InputError(f"{name} is not positive over the range", where="argument t_range",
                         remedy="Keep to the temperatures for which the polynomials were made.")
    slope, value = np.polyfit(dT, y, 1)
    return Linear(value=float(value), slope=float(slope))
