"""Numbers as text, rounded to a stated side: what is said of a proven range is never more than what is proven."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_DOWN, ROUND_FLOOR, Context, Decimal
from math import isfinite, isnan

LARGEST, LEAST = Decimal(10**6), Decimal("1e-4")  # sizes that are written without an exponent


def upwards(value: float, digits: int) -> str:
    """`value` with so many digits, never smaller than it is.

    Parameters
    ----------
    value : float
        Number to be written.
    digits : int
        Significant digits, at most.

    Examples
    --------
    >>> upwards(1.23456789, 4), upwards(-1.23456789, 4)
    ('1.235', '-1.234')
    """
    return _rounded(_converted(value), digits, ROUND_CEILING)


def probability(p: float) -> str:
    """``p = ...`` with two digits, or a bound where it is too small to be computed.

    Parameters
    ----------
    p : float
        Probability [-].

    Examples
    --------
    >>> probability(0.031), probability(0.0)
    ('p = 0.031', 'p < 1e-16')
    """
    return f"p = {p:.2g}" if p >= 1e-16 else "p < 1e-16"


def chance(p: float) -> str:
    """A probability for a cell of a table: three digits, a bound where it is too small to be computed, a dash for none.

    Parameters
    ----------
    p : float
        Probability [-].

    Examples
    --------
    >>> chance(0.0312), chance(0.0), chance(float("nan"))
    ('0.0312', '< 1e-16', '–')
    """
    return "–" if isnan(p) else f"{p:.3g}" if p >= 1e-16 else "< 1e-16"


def downwards(value: float, digits: int) -> str:
    """`value` with so many digits, never larger than it is.

    Parameters
    ----------
    value : float
        Number to be written.
    digits : int
        Significant digits, at most.

    Examples
    --------
    >>> downwards(1.23456789, 4), downwards(-1.23456789, 4)
    ('1.234', '-1.235')
    """
    return _rounded(_converted(value), digits, ROUND_FLOOR)


def towards_zero(value: float, digits: int) -> str:
    """`value` with so many digits, its size never larger than it is.

    Parameters
    ----------
    value : float
        Number to be written.
    digits : int
        Significant digits, at most.

    Examples
    --------
    >>> towards_zero(1.41159, 4), towards_zero(-1.41159, 4)
    ('1.411', '-1.411')
    """
    return _rounded(Decimal(repr(float(value))), digits, ROUND_DOWN)


def inward(low: float, high: float, digits: int = 6) -> str:
    """A range in words that is not wider than the range.

    Parameters
    ----------
    low, high : float
        Ends of the range.
    digits : int
        Significant digits of each end, at most.

    Examples
    --------
    >>> inward(0.0, 1.23456789, 4)
    '0 to 1.234'
    """
    return f"{upwards(low, digits)} to {downwards(high, digits)}"


def outward(low: float, high: float, digits: int = 6) -> str:
    """A range in words that is not narrower than the range.

    Parameters
    ----------
    low, high : float
        Ends of the range.
    digits : int
        Significant digits of each end, at most.

    Examples
    --------
    >>> outward(0.0, 1.23456789, 4)
    '0 to 1.235'
    """
    return f"{downwards(low, digits)} to {upwards(high, digits)}"


def in_table(value: float, digits: int) -> str:
    """`value` for a cell of a table: nearest, large ones without an exponent, a dash where there is none.

    Parameters
    ----------
    value : float
        Number to be written.
    digits : int
        Significant digits.

    Examples
    --------
    >>> in_table(86400.0, 3), in_table(0.12345, 3), in_table(float("nan"), 3)
    ('86400', '0.123', '–')
    """
    if isnan(value):
        return "–"
    if isfinite(value) and 10.0 ** digits <= abs(value) < 1e9:
        return f"{value:.0f}"  # 86400, not 8.64e+04
    return f"{value:.{digits}g}"


def _converted(value: float) -> Decimal:
    """Twelve digits: those after them are of a conversion from kelvin."""
    return Decimal(f"{float(value):.12g}")


def _rounded(number: Decimal, digits: int, direction: str) -> str:
    found = Context(prec=digits, rounding=direction).create_decimal(number).normalize()
    return f"{found:f}" if abs(found) < LARGEST and (not found or abs(found) >= LEAST) else str(found)
