"""Drawing of a fit."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._celsius import ZERO_CELSIUS
from ..signals import Record
from ._score import Score

Column = tuple[Record, dict[str, NDArray[np.float64]], Score]


def draw(columns: list[Column], n_fitted: int) -> NDArray[Any]:
    """Readings above residuals, one column per record."""
    # Imported here: matplotlib is slow to load, and most programs never draw.
    import matplotlib.pyplot as plt

    size = (4.0 + 3.5 * len(columns), 5.0)
    _, axes = plt.subplots(2, len(columns), sharex="col", squeeze=False, layout="constrained", figsize=size,
                           height_ratios=(2, 1))
    for place, (record, residuals, score) in enumerate(columns):
        above, below = axes[:, place]
        for i, (name, residual) in enumerate(residuals.items()):
            above.plot(record.time, record[name] - ZERO_CELSIUS, ".", color=f"C{i}", markersize=2, alpha=0.4)
            label = f"{name}, {score.rmse[name]:.3g} K"
            above.plot(record.time, record[name] - residual - ZERO_CELSIUS, color=f"C{i}", label=label)
            below.plot(record.time, residual, color=f"C{i}", linewidth=0.7)
        above.set(title=f"{'fitted' if place < n_fitted else 'validation'}: {score.record}", ylabel="temperature [°C]")
        above.legend(fontsize="small", title="model, RMSE")
        below.set(xlabel="time [s]", ylabel="measured − model [K]")
        below.axhline(0.0, color="black", linewidth=0.5)
    grid: NDArray[Any] = axes
    return grid
