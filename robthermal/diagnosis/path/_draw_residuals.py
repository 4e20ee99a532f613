"""Residuals of a record against time: temperatures on the axes given, voltages on a second one at the right."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def draw_residuals(ax: Any, time: Array, residuals: Array, units: Mapping[str, str]) -> None:
    """Draw residuals, every unit on an axis of its own.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Axes to draw on.
    time : ndarray, shape (n,)
        Time of every sample [s].
    residuals : ndarray, shape (n, n_sensors)
        Measured − modelled, in the unit of each sensor.
    units : mapping
        Unit of every sensor, "K" or "V", in the order of the columns.
    """
    main, *others = dict.fromkeys(sorted(units.values()))
    axes = {main: ax} | {unit: ax.twinx() for unit in others}
    for i, (name, unit) in enumerate(units.items()):
        (line,) = axes[unit].plot(time, residuals[:, i], linewidth=0.7, color=f"C{i}", label=name)
        if unit != main:
            line.set_linestyle("--")
            ax.plot([], [], "--", linewidth=0.7, color=f"C{i}", label=f"{name} [{unit}], right")
    for unit, own in axes.items():
        own.set(ylabel=f"measured − model [{unit}]")
    ax.set(xlabel="time [s]")
