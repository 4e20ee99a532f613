"""Picture of a controller from frequency responses: the sensitivity at the bins, and that of the worst plants."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._arrays import Array
from .._drawing import line_of
from ._frf_data import Discs


def draw_sensitivity(ax: Any, discs: Sequence[Discs], controllers: Sequence[Array], margin: float | None) -> Any:
    """Draw |1/(1 + GC)|: of the centers as a line, of the worst plant of every circle dotted; 1/margin dashed."""
    for k, (one, C) in enumerate(zip(discs, controllers, strict=True)):
        name = "response" if len(discs) == 1 else f"response {k}"
        distance = abs(1 + one.center * C)
        worst = distance - one.radius * abs(C)
        ax.loglog(one.omega, 1 / distance, **line_of(k), label=name)
        if one.radius.any():
            ax.loglog(one.omega, np.where(worst > 0, 1 / np.where(worst > 0, worst, 1), np.nan),
                      **line_of(k) | {"linestyle": ":"}, label=f"worst plant in the circles of {name}")
    if margin is not None:
        ax.axhline(1 / margin, color="0.5", linestyle="--", label=f"asked for: at most {1 / margin:.3g}")
    ax.set(xlabel="frequency [rad/s]", ylabel="size of the sensitivity [-]")
    ax.legend(loc="best")
    return ax
