"""Powers of ten beside logarithmic axes as letters of the font, 10⁻³: matplotlib sets a formula for each, slowly."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from typing import Any

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def plain_powers(figure: Any) -> None:
    """Let the logarithmic axes of a matplotlib figure write their numbers without formulas."""
    # Imported here: matplotlib is slow to load, and a summary without figures does not need it.
    from matplotlib.ticker import LogFormatterMathtext

    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        for formatter in (axis.get_major_formatter(), axis.get_minor_formatter()):
            if isinstance(formatter, LogFormatterMathtext):
                vars(formatter).update(format_ticks=partial(_plain, formatter.format_ticks))


def _plain(format_ticks: Callable[[Any], list[str]], places: Any) -> list[str]:
    return [plain_power(text) for text in format_ticks(places)]


def plain_power(text: str) -> str:
    r"""A number as matplotlib writes it on a logarithmic axis, in plain letters.

    Examples
    --------
    >>> plain_power(r"$\mathdefault{10^{-3}}$"), plain_power(r"$\mathdefault{-2\times10^{12}}$"), plain_power("0.5")
    ('10⁻³', '−2×10¹²', '0.5')
    """
    inside = re.fullmatch(r"\$\\mathdefault\{(.*)\}\$", text)
    if inside is None:
        return text
    number = re.fullmatch(r"(-?)(?:([\d.]+)\\times)?([\d.]+)(?:\^\{(-?\d+)\})?", inside.group(1))
    if number is None:
        return text
    sign, factor, base, power = number.groups("")
    return "−" * bool(sign) + f"{factor}×" * bool(factor) + base + power.translate(_RAISED)
