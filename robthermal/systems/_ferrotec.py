"""Ferrotec's material polynomials, and the surrogate of the thesis module derived from them."""

from __future__ import annotations

from ..thermal import Linear, Module, Polynomials


def ferrotec() -> Polynomials:
    """Ferrotec's polynomials for S, R and K of a module of 71 couples and 6 A.

    The row for S was read in a stored copy of Ferrotec's text, the rows for R and K in public transcriptions. These
    conflict in the coefficient of T² of K: -8.64864e-6 here, -8.74864e-6 elsewhere, 3.1 % of K at 300 K. The value
    used here gives ZT = 0.66, which is plausible; check the vendor's page before relying on K.

    Returns
    -------
    Polynomials

    References
    ----------
    Ferrotec, Thermoelectric Technical Reference Guide, section 11.

    Examples
    --------
    >>> import robthermal as rt
    >>> S, R, K = rt.systems.ferrotec().at(300.15)
    >>> print(f"{S:.6f} V/K, {R:.5f} Ω, {K:.5f} W/K, Z = {S**2 / (R * K):.2e} 1/K")
    0.029743 V/K, 1.36733 Ω, 0.29313 W/K, Z = 2.21e-03 1/K
    """
    return Polynomials(
        seebeck=(1.33450e-2, -5.37574e-5, 7.42731e-7, -1.27141e-9),
        resistance=(2.08317, -1.98763e-2, 8.53832e-5, -9.03143e-8),
        conductance=(4.76218e-1, -3.89821e-6, -8.64864e-6, 2.20869e-8),
        couples=71, i_max=6.0,
        source="Ferrotec, Thermoelectric Technical Reference Guide, section 11",
        caveat="K: transcriptions conflict by 3.1 % at 300 K; check the vendor's page")


def surrogate_module(hot: str, cold: str, current_limits: tuple[float, float] | None = (-3.3, 3.3)) -> Module:
    """Stand-in for the modules of the two-module setup: 127 couples, 3.3 A, linear in temperature.

    The thesis prints no module numbers. This is Ferrotec's polynomials scaled to 127 couples and 3.3 A, fitted by
    straight lines over 288.15-328.15 K around 308.15 K; K is held constant, as in the thesis (the fit's slope of K is
    9.477e-4 W/K²: build it with `robthermal.thermal.module_from_polynomials` where it matters).

    Parameters
    ----------
    hot, cold : str
        Lumps of the two faces.
    current_limits : tuple of float, optional
        Lowest and highest allowed current [A].

    Returns
    -------
    Module

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.systems.surrogate_module("x9", "x11") == rt.systems.two_module().modules["m1"]
    True
    """
    return Module(hot=hot, cold=cold, seebeck=Linear(value=0.053743, slope=7.421e-5),
                  resistance=Linear(value=4.6298, slope=0.022751), conductance=Linear(value=0.2968),
                  reference_temperature=308.15, current_limits=current_limits)
