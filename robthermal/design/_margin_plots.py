"""Pictures of loop transfers: Bode with margins, Nyquist with the circle of the modulus margin."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._drawing import axes_for
from ._margins import Margins
from ._modules import Array

_BEHIND: dict[str, Any] = {"color": "0.75", "linewidth": 0.7, "zorder": 1}


def plot_bode(frequency: Array, nominal: np.ndarray, corners: Sequence[np.ndarray], found: Margins,
              color: str = "C0") -> NDArray[Any]:
    """Gain and phase, corner plants in gray behind; two matplotlib axes.

    Parameters
    ----------
    frequency : ndarray
        Angular frequencies of the responses [rad/s].
    nominal : ndarray
        Loop transfer of the nominal plant.
    corners : sequence of ndarray
        Loop transfers of the corner plants.
    found : Margins
        Margins of the nominal plant.
    color : str, optional
        Color of the nominal plant, that of its module in other figures.
    """
    from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

    _, axes = plt.subplots(2, sharex=True, layout="constrained")
    for curve in corners:
        axes[0].loglog(frequency, np.abs(curve), **_BEHIND)
        axes[1].semilogx(frequency, _phase(curve), **_BEHIND)
    axes[0].loglog(frequency, np.abs(nominal), color=color, zorder=2)
    axes[1].semilogx(frequency, _phase(nominal), color=color, zorder=2)
    axes[0].axhline(1.0, color="k", linewidth=0.8)
    axes[1].axhline(-180.0, color="k", linewidth=0.8)
    if np.isfinite(found.crossover):
        for ax in axes:
            ax.axvline(found.crossover, color="k", linestyle=":", linewidth=0.8)
        axes[1].annotate(f"phase {found.phase:.3g}°, delay {found.delay:.3g} s", (found.crossover, -180.0),
                         textcoords="offset points", xytext=(-4, 4), ha="right")
    turn = np.flatnonzero(np.diff(np.sign(_phase(nominal) + 180.0)))
    if len(turn) and np.isfinite(found.gain):
        k = turn[0]
        axes[0].plot([frequency[k]] * 2, [np.abs(nominal[k]), 1.0], "k-", linewidth=0.8)
        axes[0].annotate(f"gain × {found.gain:.3g}", (frequency[k], 1.0), textcoords="offset points",
                         xytext=(-4, 4), ha="right")
    axes[0].set(ylabel="|L| [-]")
    axes[1].set(ylabel="phase [deg]", xlabel="frequency [rad/s]")
    return axes


def plot_nyquist(nominal: np.ndarray, corners: Sequence[np.ndarray], modulus: float, ax: Any = None,
                 color: str = "C0") -> Any:
    """Loop transfers in the complex plane near -1, with the circle none of them enters; one matplotlib axes.

    Parameters
    ----------
    nominal : ndarray
        Loop transfer of the nominal plant.
    corners : sequence of ndarray
        Loop transfers of the corner plants.
    modulus : float
        Smallest modulus margin, the radius of the circle.
    ax : matplotlib axes, optional
        Axes to draw into; default new ones.
    color : str, optional
        Color of the nominal plant, that of its module in other figures.
    """
    ax = axes_for(ax)
    for curve in corners:
        ax.plot(curve.real, curve.imag, **_BEHIND)
    ax.plot(nominal.real, nominal.imag, color=color, zorder=2)
    turn = np.linspace(0.0, 2 * np.pi, 200)
    ax.plot(-1 + modulus * np.cos(turn), modulus * np.sin(turn), "k--", linewidth=0.8,
            label=f"modulus margin {modulus:.3g}")
    ax.plot(-1, 0, "k+")
    ax.set(xlim=(-3.0, 1.5), ylim=(-3.0, 1.0), xlabel="Re L [-]", ylabel="Im L [-]", aspect="equal")
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)  # above the curves, on none of them
    return ax


def _phase(curve: np.ndarray) -> Array:
    """Continuous phase, which starts in (-360, 0] [deg]."""
    phase = np.degrees(np.unwrap(np.angle(curve)))
    return np.asarray(phase - 360.0 * np.ceil(phase[0] / 360.0) if phase[0] > 0 else phase)
