"""Drawing of measured and simulated temperatures over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._celsius import ZERO_CELSIUS
from .._residual import residual as residual_of
from ..errors import InputError
from ._style import canvas, house_style, legend_above, look, plain

_BINS = 400  # per trace: finer than a printed page resolves, small enough for a page with many figures

Array = NDArray[np.float64]


def measured_against_model(time: ArrayLike, measured: Mapping[str, ArrayLike], model: Mapping[str, ArrayLike], *,
                           residual: bool = True, title: str = "", unit: str = "K",
                           order: Sequence[str] = ()) -> Any:
    """Draw readings, the model's answer, and their difference.

    Parameters
    ----------
    time : array_like
        Times of the samples [s].
    measured : mapping
        {sensor: readings} [K]; NaN leaves a gap.
    model : mapping
        {sensor: simulated readings} [K], for the same sensors.
    residual : bool, optional
        Whether the residual, measured − modelled, is drawn below.
    title : str, optional
        Heading of the drawing.
    unit : str, optional
        Unit of all readings: "K", drawn in °C, or "V".
    order : sequence of str, optional
        All sensors of the machine, so that each has one color in every figure; default: those drawn.

    Returns
    -------
    matplotlib.figure.Figure
        Long records are thinned to the lowest and highest value of every 1/400 of the time, so no peak is lost.

    Raises
    ------
    InputError
        No sensors, a sensor without a model, arrays of different length.

    Examples
    --------
    >>> import robthermal as rt
    >>> figure = rt.report.measured_against_model([0.0, 1.0], {"T1": [300.0, 301.0]}, {"T1": [300.1, 300.9]})
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['temperature [°C]', 'measured −\\nmodel [K]']
    """
    t = np.asarray(time, dtype=float)
    pairs = _pairs(t, measured, model)
    scale, time_name = time_unit(t)
    zero, label = (ZERO_CELSIUS, "temperature [°C]") if unit == "K" else (0.0, f"voltage [{unit}]")
    with house_style():
        figure, axes = canvas(4.4 if residual else 3.0, 2 if residual else 1, sharex=True, squeeze=False,
                              height_ratios=(2, 1) if residual else None)
        above, below = axes[0, 0], axes[-1, 0]
        for name, (data, answer) in pairs.items():
            color, dashes = look(name, list(pairs), order)
            _dots(above, *thin(t / scale, data - zero), color)
            above.plot(*thin(t / scale, answer - zero), dashes, color=color, linewidth=1.0, label=plain(name))
            if residual:
                below.plot(*thin(t / scale, residual_of(data, answer)), dashes, color=color, linewidth=0.8)
        above.set(ylabel=label, title=plain(title))
        _legend(figure, above)
        if residual:
            below.axhline(0.0, color="black", linewidth=0.6)
            below.set(ylabel=f"measured −\nmodel [{unit}]")
            figure.align_ylabels()
        below.set(xlabel=f"time [{time_name}]")
        below.margins(x=0.01)
    return figure


def _dots(axes: Any, time: Array, values: Array, color: str) -> None:
    """Dots as one path of zero-length strokes: a fifth of the size that one marker element per dot has."""
    # Imported here: matplotlib is slow to load, and a summary without figures does not need it.
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    good = np.isfinite(values)
    points = np.repeat(np.column_stack([time[good], values[good]]), 2, axis=0)
    path = Path(points, np.tile([Path.MOVETO, Path.LINETO], int(good.sum())))
    path.should_simplify = False  # it would remove the strokes
    axes.add_patch(PathPatch(path, fill=False, edgecolor=color, linewidth=4.5, alpha=0.3, capstyle="round"))


def thin(time: Array, values: Array) -> tuple[Array, Array]:
    """Lowest and highest finite value of every bin, in their order; short traces are left as they are.

    A bin with no finite value keeps one NaN, so that gaps stay gaps.
    """
    if values.size <= 2 * _BINS:
        return time, values
    keep = []
    for part in np.array_split(np.arange(values.size), _BINS):
        good = part[np.isfinite(values[part])]
        keep += sorted({good[values[good].argmin()], good[values[good].argmax()]}) if good.size else [part[0]]
    return time[keep], values[keep]


def _legend(figure: Any, axes: Any) -> None:
    # Grey stand-ins say once what dots and lines are; the colors name the sensors. Above the title, never on the data.
    kinds = [axes.plot([], [], ".", color="#888888", markersize=8.0, alpha=0.6, label="measured")[0],
             axes.plot([], [], "-", color="#888888", linewidth=1.0, label="model")[0]]
    lines = [line for line in axes.get_lines() if not line.get_label().startswith("_") and line not in kinds]
    legend_above(figure, [*kinds, *lines])


def _pairs(
    time: Array, measured: Mapping[str, ArrayLike], model: Mapping[str, ArrayLike]
) -> dict[str, tuple[Array, Array]]:
    if time.ndim != 1 or time.size < 2 or not np.all(np.diff(time) > 0):
        raise InputError("time is not an increasing sequence", where="measured_against_model",
                         expected="at least two increasing times")
    if not measured:
        raise InputError("measured is empty", where="measured_against_model", expected="at least one sensor")
    pairs = {}
    for name, values in measured.items():
        if name not in model:
            raise InputError(f"model has no {name!r}", where="measured_against_model",
                             expected=f"the sensors {', '.join(measured)}", remedy="Simulate the same sensors.")
        pair = np.asarray(values, dtype=float), np.asarray(model[name], dtype=float)
        for kind, array in zip(("measured", "model"), pair, strict=True):
            if array.shape != time.shape:
                raise InputError(f"{kind} {name!r} has shape {array.shape}", where="measured_against_model",
                                 expected=f"one value per time, shape {time.shape}")
        pairs[name] = pair
    return pairs


def time_unit(time: Array) -> tuple[float, str]:
    """Seconds in the unit that suits a record, and its name."""
    span = float(time[-1] - time[0])
    if span > 4 * 3600.0:
        return 3600.0, "h"
    return (60.0, "min") if span > 600.0 else (1.0, "s")
