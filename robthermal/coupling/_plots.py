"""Figures of a coupling design."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ._realisation import youla_parameter
from ._response import Response, siso

if TYPE_CHECKING:
    from ._filters import Filters


def draw(filters: Filters) -> Any:
    """Improvement factors, e12, and rho(|Delta_k| R) over frequency [Hz].

    Parameters
    ----------
    filters : Filters
        What is drawn.
    """
    import matplotlib.pyplot as plt

    problem = filters.problem
    omega = problem.grid(1000)
    hertz = omega / (2 * np.pi)
    _, axes = plt.subplots(3, 1, sharex=True, figsize=(7, 8))
    axes[0].loglog(hertz, np.abs(siso(filters.improvement_1, omega)), label="|1 + Y|")
    axes[0].loglog(hertz, np.abs(siso(filters.improvement_2, omega)), label="|1 + X|")
    axes[0].axhline(1.0, color="0.6", linewidth=0.8)
    before = np.hypot(np.abs(problem.one.signal.at(omega)), np.abs(problem.two.signal.at(omega)))
    after = np.hypot(np.abs(siso(filters.improvement_1, omega) * problem.one.signal.at(omega)),
                     np.abs(siso(filters.improvement_2, omega) * problem.two.signal.at(omega)))
    axes[1].loglog(hertz, before, color="0.5", linestyle="--", label="without coupling")
    axes[1].loglog(hertz, after, label="with coupling")
    delta = np.abs(np.moveaxis(Response(youla_parameter(problem, filters.X_hat, filters.Y_hat))(omega), -1, 0))
    product = delta @ np.moveaxis(problem.envelope(omega), -1, 0)
    axes[2].semilogx(hertz, np.max(np.abs(np.linalg.eigvals(product)), axis=1), label="ρ(|Δk| R)")
    axes[2].axhline(1.0, color="tab:red", linewidth=0.8)
    for ax, label in zip(axes, ("improvement [-]", "weighted e12", "robust number [-]"), strict=True):
        ax.set_ylabel(label)
        ax.legend(loc="best")
    axes[2].set_xlabel("frequency [Hz]")
    return axes
