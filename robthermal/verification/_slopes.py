"""Slopes of the links that are not linear: exact rational bounds over the temperature box."""

from __future__ import annotations

from flint import arb, fmpq

from ._fields import Interval
from ._system import Link, Region


def power(base: fmpq, exponent: fmpq) -> Interval:
    """Return rational bounds of base**exponent, base >= 0, exponent >= 0 (0**0 = 1)."""
    if exponent == 0:
        return fmpq(1), fmpq(1)
    if base == 0:
        return fmpq(0), fmpq(0)
    ball = arb(base) ** arb(exponent)
    lower = ball.lower().fmpq()
    return (lower if lower > 0 else fmpq(0)), ball.upper().fmpq()


def exchange_slope(link: Link, first: Interval, second: Interval) -> Interval:
    """Return bounds of what a link conducts beyond its conductance [W/K].

    That is the spread of an uncertain conductance and the slope gain (1 + e) |dT|^e of gain |dT|^e dT, dT between two
    intervals, at the least and the largest gain.
    """
    if not link.convects:
        return fmpq(0), link.spread
    low, high = first[0] - second[1], first[1] - second[0]
    far = max(abs(low), abs(high))
    near = fmpq(0) if low <= 0 <= high else min(abs(low), abs(high))
    factor = 1 + link.exponent
    return (link.gain * factor * power(near, link.exponent)[0],
            (link.gain + link.gain_spread) * factor * power(far, link.exponent)[1] + link.spread)


def radiation_slope(link: Link, temperature: Interval) -> Interval:
    """Return bounds of 4 c T³ at one end of a link [W/K]."""
    return (4 * link.radiation * temperature[0] ** 3,
            4 * (link.radiation + link.radiation_spread) * temperature[1] ** 3)


def least_ambient_slope(link: Link, lump: int, region: Region) -> fmpq:
    """Return the least slope of a link to an ambient of any temperature [W/K]: that of natural convection may be 0."""
    still = link.gain if link.exponent == 0 else fmpq(0)
    return link.conductance + still + radiation_slope(link, region.temperature[lump])[0]
