"""Drawing of a fit."""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._celsius import ZERO_CELSIUS
from .._drawing import line_of
from ..signals import Record
from ._score import Score

Column = tuple[Record, dict[str, NDArray[np.float64]], Score]
_ABREAST = (3, 2)  # names of sensors in one line of the legend: of one record, of several side by side
_SHOWN = {"K": ("temperature [°C]", ZERO_CELSIUS), "V": ("voltage [V]", 0.0)}


def draw(columns: list[Column], n_fitted: int, units: Mapping[str, str]) -> NDArray[Any]:
    """Readings above residuals, one column per record; voltages below temperatures, on axes of their own."""
    # Imported here: matplotlib is slow to load, and most programs never draw.
    import matplotlib.pyplot as plt

    present = {units.get(name, "K") for _, residuals, _ in columns for name in residuals}
    kinds = [unit for unit in _SHOWN if unit in present] or ["K"]
    abreast = _ABREAST[len(columns) > 1]
    legend = 0.2 * ceil(max((len(residuals) for _, residuals, _ in columns), default=0) / abreast)
    size = (max(6.4, 4.4 * len(columns)), (4.6 + legend) * len(kinds))  # inch
    _, axes = plt.subplots(2 * len(kinds), len(columns), sharex="col", squeeze=False, layout="constrained",
                           figsize=size, height_ratios=(2, 1) * len(kinds))
    for place, (record, residuals, score) in enumerate(columns):
        for row, unit in enumerate(kinds):
            above, below = axes[2 * row:2 * row + 2, place]
            own = {name: residual for name, residual in residuals.items() if units.get(name, "K") == unit}
            title = f"{'fitted' if place < n_fitted else 'validation'}: {score.record}" if row == 0 else ""
            _pair(above, below, record, own, score, unit, title, abreast)
        axes[-1, place].set(xlabel="time [s]")
    grid: NDArray[Any] = axes
    return grid


def _pair(above: Any, below: Any, record: Record, residuals: Mapping[str, NDArray[np.float64]], score: Score,
          unit: str, title: str, abreast: int) -> None:
    """Readings of one unit under their title and legend, and their residuals below."""
    label, zero = _SHOWN[unit]
    for i, (name, residual) in enumerate(residuals.items()):
        line = line_of(i)
        above.plot(record.time, record[name] - zero, ".", color=line["color"], markersize=2, alpha=0.4)
        above.plot(record.time, record[name] - residual - zero, **line,
                   label=f"{name}, {score.rmse[name]:.3g} {unit}")
        below.plot(record.time, residual, color=line["color"], linewidth=0.7)
    above.set(ylabel=label)
    if residuals:
        above.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, fontsize="small", borderaxespad=0.2,
                     ncols=min(len(residuals), abreast), columnspacing=1.0, handlelength=1.4, alignment="left",
                     title=f"{title}\nmodel, RMSE" if title else "model, RMSE")  # above the curves, on none of them
    else:
        above.set(title=title)
    below.set(ylabel=f"measured − model [{unit}]")
    below.axhline(0.0, color="black", linewidth=0.5)
