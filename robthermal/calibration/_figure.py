"""Drawing of a fit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._celsius import ZERO_CELSIUS
from .._drawing import line_of
from ..signals import Record
from ._score import Score

Column = tuple[Record, dict[str, NDArray[np.float64]], Score]
_SHOWN = {"K": ("temperature [°C]", ZERO_CELSIUS), "V": ("voltage [V]", 0.0)}


def draw(columns: list[Column], n_fitted: int, units: Mapping[str, str]) -> NDArray[Any]:
    """Readings above residuals, one column per record; voltages below temperatures, on axes of their own."""
    # Imported here: matplotlib is slow to load, and most programs never draw.
    import matplotlib.pyplot as plt

    present = {units.get(name, "K") for _, residuals, _ in columns for name in residuals}
    kinds = [unit for unit in _SHOWN if unit in present] or ["K"]
    size = (3.0 + 5.0 * len(columns), 5.0 * len(kinds))
    _, axes = plt.subplots(2 * len(kinds), len(columns), sharex="col", squeeze=False, layout="constrained",
                           figsize=size, height_ratios=(2, 1) * len(kinds))
    for place, (record, residuals, score) in enumerate(columns):
        for row, unit in enumerate(kinds):
            above, below = axes[2 * row:2 * row + 2, place]
            own = {name: residual for name, residual in residuals.items() if units.get(name, "K") == unit}
            _pair(above, below, record, own, score, unit)
        title = f"{'fitted' if place < n_fitted else 'validation'}: {score.record}"
        axes[0, place].set(title=title)
        axes[-1, place].set(xlabel="time [s]")
    grid: NDArray[Any] = axes
    return grid


def _pair(above: Any, below: Any, record: Record, residuals: Mapping[str, NDArray[np.float64]], score: Score,
          unit: str) -> None:
    """Readings of one unit, and their residuals below."""
    label, zero = _SHOWN[unit]
    for i, (name, residual) in enumerate(residuals.items()):
        line = line_of(i)
        above.plot(record.time, record[name] - zero, ".", color=line["color"], markersize=2, alpha=0.4)
        above.plot(record.time, record[name] - residual - zero, **line,
                   label=f"{name}, {score.rmse[name]:.3g} {unit}")
        below.plot(record.time, residual, color=line["color"], linewidth=0.7)
    above.set(ylabel=label)
    if residuals:
        above.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize="small",
                     title="model, RMSE")  # beside the curves, on none of them
    below.set(ylabel=f"measured − model [{unit}]")
    below.axhline(0.0, color="black", linewidth=0.5)
