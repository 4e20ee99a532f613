"""Drawings of limits, boxes and load curves. Arrays in, matplotlib figure out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._drawing import COLORS
from ..errors import InputError
from ._style import canvas, house_style, plain

_DASHES = ("--", ":", "-.", (0, (5, 1)), (0, (1, 1)))
_MOST_BARS = 40  # more names than this cannot be read; a band over the index can
_MOST_STEPS = 700  # of that band; each is the lowest and highest of its lumps


def current_limits(names: Sequence[str], values: ArrayLike, lines: Mapping[str, float] | None = None) -> Any:
    """Draw current limits as bars, with other limits as lines across them.

    Parameters
    ----------
    names : sequence of str
        Method and direction of every bar.
    values : array_like
        Currents [A]. NaN: nothing was proven. Infinite: no limit was found.
    lines : mapping, optional
        {name: current} drawn as vertical lines [A], for example I* and the declared limit.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        Not one value per name.

    Examples
    --------
    >>> import robthermal as rt
    >>> figure = rt.report.current_limits(["cooling, energy"], [1.47], {"I* of m1": 2.3})
    >>> figure.axes[0].get_xlabel()
    'current [A]'
    """
    (currents,) = _columns("current_limits", names, values=values)
    across = {name: float(value) for name, value in (lines or {}).items() if np.isfinite(value)}
    finite = currents[np.isfinite(currents)]
    right = 1.18 * max([*np.abs(finite), *map(abs, across.values())], default=1.0) or 1.0
    with house_style():
        figure, axes = canvas(_height(len(names)) + 0.18 * len(across))
        rows = np.arange(len(names))
        axes.barh(rows, np.where(np.isfinite(currents), currents, np.where(currents > 0, right, 0.0)), height=0.62,
                  color=COLORS[0], alpha=0.85)
        for row, value in zip(rows, currents, strict=True):
            place = min(value, 0.9 * right) if np.isfinite(value) else 0.0
            axes.annotate(_amount(value), (max(place, 0.0), row), xytext=(4, 0), textcoords="offset points",
                          va="center", fontsize=8.0, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8})
        for i, (name, value) in enumerate(across.items()):
            axes.axvline(value, color=COLORS[1 + i % 3], linestyle=_DASHES[i % len(_DASHES)],
                         label=plain(f"{name}: {value:.3g} A"))
        _names(axes, names)
        axes.set(xlabel="current [A]", xlim=(min(0.0, *finite, 0.0), right))
        if across:
            figure.legend(loc="outside upper right", ncols=2)
    return figure


def box_ranges(names: Sequence[str], low: ArrayLike, high: ArrayLike, unit: str = "°C") -> Any:
    """Draw the range of every lump; of more than 40 lumps as a band.

    Parameters
    ----------
    names : sequence of str
        Names of the lumps.
    low, high : array_like
        Ends of the ranges [unit].
    unit : str, optional
        For the axis.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        Not one range per name, or a range that ends before it begins.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.report.box_ranges(["x1", "x2"], [10.0, 12.0], [40.0, 60.0]).axes[0].get_xlabel()
    'temperature [°C]'
    """
    bottom, top = _columns("box_ranges", names, low=low, high=high)
    if not np.all(bottom <= top):
        first = int(np.argmin(bottom <= top))
        raise InputError(f"the range of {names[first]!r} is {bottom[first]:g} to {top[first]:g}", where="box_ranges",
                         expected="low ≤ high, both numbers")
    with house_style():
        if len(names) > _MOST_BARS:
            figure, axes = canvas(3.0)
            parts = np.array_split(np.arange(len(names)), min(len(names), _MOST_STEPS))
            axes.fill_between([part[0] for part in parts], [bottom[part].min() for part in parts],
                              [top[part].max() for part in parts], step="post", color=COLORS[0], alpha=0.5)
            axes.set(xlabel="lump, in the order of the file", ylabel=f"temperature [{unit}]")
            return figure
        figure, axes = canvas(_height(len(names)))
        axes.barh(np.arange(len(names)), top - bottom, left=bottom, height=0.5, color=COLORS[0], alpha=0.85)
        for row, ends in enumerate(zip(bottom, top, strict=True)):
            for value, side, shift in zip(ends, ("right", "left"), (-3, 3), strict=True):
                axes.annotate(f"{value:.1f}", (value, row), xytext=(shift, 0), textcoords="offset points", ha=side,
                              va="center", fontsize=8.0)
        _names(axes, names)
        axes.set(xlabel=f"temperature [{unit}]")
        axes.use_sticky_edges = False  # room for the numbers beside the bars
        axes.margins(x=0.14)
    return figure


def load_curve(curves: Mapping[str, tuple[ArrayLike, ArrayLike]], folds: Mapping[str, tuple[float, float]]) -> Any:
    """Draw the heat a module takes from its cold face against its current, with the fold marked.

    Parameters
    ----------
    curves : mapping
        {module: (currents [A], heat from the cold face [W])}.
    folds : mapping
        {module: (I* [A], q* [W])}.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        Currents and loads of different length, a fold of an unknown module.

    Examples
    --------
    >>> import robthermal as rt
    >>> figure = rt.report.load_curve({"m1": ([0.0, 1.0, 2.0], [0.0, 3.0, 4.0])}, {"m1": (2.0, 4.0)})
    >>> figure.axes[0].get_ylabel()
    'heat from the cold face [W]'
    """
    unknown = sorted(set(folds) - set(curves))
    if unknown:
        raise InputError(f"folds has {unknown[0]!r}, which has no curve", where="load_curve",
                         expected=f"among {', '.join(curves)}")
    with house_style():
        figure, axes = canvas(3.4)
        for i, (name, (current, load)) in enumerate(curves.items()):
            x, y = np.asarray(current, dtype=float), np.asarray(load, dtype=float)
            if x.shape != y.shape or x.ndim != 1:
                raise InputError(f"curve {name!r} has {x.shape} currents and {y.shape} loads", where="load_curve",
                                 expected="two sequences of one length")
            fold = f": fold at I* = {folds[name][0]:.3g} A, q* = {folds[name][1]:.3g} W" if name in folds else ""
            axes.plot(x, y, color=COLORS[i % len(COLORS)], label=plain(name) + fold)
        for i, at in enumerate(folds.values()):
            axes.plot(*at, "os^Dv"[i % 5], color="black", markersize=5)
        axes.set(xlabel="current [A]", ylabel="heat from the cold face [W]")
        axes.legend(loc="lower right")
    return figure


def _columns(where: str, names: Sequence[str], **columns: ArrayLike) -> list[NDArray[np.float64]]:
    arrays = []
    for key, values in columns.items():
        array = np.asarray(values, dtype=float)
        if array.shape != (len(names),) or not len(names):
            raise InputError(f"{key} has shape {array.shape} for {len(names)} names", where=where,
                             expected="one value per name, and at least one")
        arrays.append(array)
    return arrays


def _amount(value: float) -> str:
    if np.isnan(value):
        return "nothing proven"
    return f"{value:.3g} A" if np.isfinite(value) else "no limit found"


def _height(rows: int) -> float:
    return 1.0 + 0.26 * rows


def _names(axes: Any, names: Sequence[str]) -> None:
    axes.set_yticks(np.arange(len(names)), [plain(name) for name in names])
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)
