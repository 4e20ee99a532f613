"""Drawings of what a model leaves unexplained, before and after it was changed: over time, over frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ._style import canvas, house_style, legend_above, look, plain
from ._traces import thin, time_unit


def residuals_before_after(time: ArrayLike, before: Mapping[str, ArrayLike], after: Mapping[str, ArrayLike], *,
                           noise: float = 0.0, title: str = "", unit: str = "K", order: Sequence[str] = ()) -> Any:
    """Draw residuals of the same readings for two models, one below the other and on one scale; equal ones once.

    Parameters
    ----------
    time : array_like
        Times of the samples [s].
    before, after : mapping
        {sensor: measured − model} [unit], of the same sensors.
    noise : float, optional
        Band of twice this size [unit]; none by default.
    title : str, optional
        Heading of the drawing.
    unit : str, optional
        Unit of the readings: "K", or "V" of voltages.
    order : sequence of str, optional
        All sensors of the machine, so that each has one color in every figure; default: those drawn.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        No sensors, different sensors, arrays of different length.

    Examples
    --------
    >>> import robthermal as rt
    >>> figure = rt.report.residuals_before_after([0.0, 1.0], {"T1": [1.0, 2.0]}, {"T1": [0.1, -0.1]})
    >>> [axes.get_title(loc="left") for axes in figure.axes]
    ['before', 'after']
    """
    t = np.asarray(time, dtype=float)
    _check(t, before, after, "residuals_before_after", "sensors")
    scale, shown = time_unit(t)
    with house_style():
        pairs = _panels(before, after)
        figure, axes = canvas(0.6 + 1.9 * len(pairs), len(pairs), sharex=True, sharey=True, squeeze=False)
        for ax, (what, residuals) in zip(axes[:, 0], pairs, strict=True):
            for name, values in residuals.items():
                color, dashes = look(name, list(residuals), order)
                ax.plot(*thin(t / scale, np.asarray(values, dtype=float)), color=color, linestyle=dashes, linewidth=0.8,
                        label=plain(name))
            if noise > 0:
                ax.axhspan(-2 * noise, 2 * noise, color="#888888", alpha=0.25, linewidth=0)
            ax.set(ylabel=f"measured −\nmodel [{unit}]", title=what)
            ax.margins(x=0.01)
        legend_above(figure, axes[0, 0].get_lines(), title)
        axes[-1, 0].set(xlabel=f"time [{shown}]")
    return figure


def spectra_before_after(frequency: ArrayLike, before: Mapping[str, ArrayLike], after: Mapping[str, ArrayLike], *,
                         unit: str, title: str = "", order: Sequence[str] = ()) -> Any:
    """Draw the size of residuals over frequency for two models, one below the other and on one scale; equal ones once.

    Parameters
    ----------
    frequency : array_like
        Frequencies of the spectra [Hz].
    before, after : mapping
        {channel: size} of the same channels.
    unit : str
        Of the sizes.
    title : str, optional
        Heading of the drawing.
    order : sequence of str, optional
        All sensors of the machine, so that each has one color in every figure; default: those drawn.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        No channels, different channels, arrays of different length.

    Examples
    --------
    >>> import robthermal as rt
    >>> figure = rt.report.spectra_before_after([0.1, 0.2], {"T1": [1.0, 2.0]}, {"T1": [0.1, 0.1]}, unit="K/√Hz")
    >>> [axes.get_title(loc="left") for axes in figure.axes]
    ['before', 'after']
    """
    f = np.asarray(frequency, dtype=float)
    _check(f, before, after, "spectra_before_after", "channels")
    with house_style():
        pairs = _panels(before, after)
        figure, axes = canvas(0.6 + 2.1 * len(pairs), len(pairs), sharex=True, sharey=True, squeeze=False)
        for ax, (what, sizes) in zip(axes[:, 0], pairs, strict=True):
            for name, values in sizes.items():
                color, dashes = look(name, list(sizes), order)
                ax.loglog(f, np.asarray(values, dtype=float), color=color, linestyle=dashes, linewidth=0.8,
                          label=plain(name))
            ax.set(ylabel=f"|measured −\nmodel| [{unit}]", title=what)
        legend_above(figure, axes[0, 0].get_lines(), title)
        axes[-1, 0].set(xlabel="frequency [Hz]")
    return figure


def _panels(before: Mapping[str, ArrayLike], after: Mapping[str, ArrayLike]
            ) -> list[tuple[str, Mapping[str, ArrayLike]]]:
    """Titles and curves of the panels: one, without a title, where the model did not change."""
    if all(np.array_equal(np.asarray(before[name]), np.asarray(after[name])) for name in before):
        return [("", before)]
    return [("before", before), ("after", after)]


def _check(x: Any, before: Mapping[str, ArrayLike], after: Mapping[str, ArrayLike], where: str, what: str) -> None:
    if not before or list(before) != list(after):
        raise InputError(f"{what} {list(before)} before and {list(after)} after", where=where,
                         expected=f"the same {what}, at least one")
    for name, values in [*before.items(), *after.items()]:
        if np.shape(values) != x.shape:
            raise InputError(f"{name!r} has shape {np.shape(values)}", where=where,
                             expected=f"one value per sample, shape {x.shape}")
