"""Figures of a coupling report."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..._drawing import size_of
from ...coupling import Simulation, Spectra, Uncertainty
from ...report import Figure, house_style

_PANELS = (
    ("sensitivity", "Sensitivities of both subsystems over frequency, without and with coupling.",
     "Sensitivities without coupling (dashed) and with it."),
    ("improvement", "Improvement factors over frequency.",
     "Improvement factors: below one the disturbance of that subsystem reaches e12 less than without coupling."),
    ("e12", "Amplitude spectral density of e12 over frequency, without and with coupling.",
     "Amplitude spectral density of e12, one-sided."),
    ("power", "Cumulative power of e12 over frequency, without and with coupling.",
     "Cumulative power of e12: its variance up to each frequency, integrated on the grid."),
)


_MOST = 4  # entries of Delta_p that are drawn: the largest


def spectrum_figures(found: Spectra) -> Iterator[Figure]:
    """Sensitivities, improvement factors and e12.

    Parameters
    ----------
    found : Spectra
        What is drawn.
    """
    for panel, alt, caption in _PANELS:
        yield _drawn(found, panel, alt, caption)


def robust_figure(found: Spectra) -> Figure:
    """Robust number and small gain.

    Parameters
    ----------
    found : Spectra
        What is drawn.
    """
    return _drawn(found, "robust", "Robust number and small-gain number over frequency, with the limit one.",
                  "Robust number, the spectral radius of |Δk| R with the envelope R; dotted: the bound that is proven "
                  "at every frequency. Grey: the sufficient condition of Evers (6.22), which may exceed one.")


def envelope_figure(uncertainty: Uncertainty) -> Figure:
    """Dual-Youla samples of the measured plants and their envelope; the four largest entries.

    Parameters
    ----------
    uncertainty : Uncertainty
        What is drawn.
    """
    import matplotlib.pyplot as plt

    entries = [entry for entry in np.ndindex(*uncertainty.envelope.shape[:2]) if np.any(uncertainty.envelope[entry])]
    entries = sorted(entries, key=lambda entry: -float(uncertainty.envelope[entry].max()))[:_MOST] or [(0, 0)]
    entries.sort()
    hertz = uncertainty.omega / (2 * np.pi)
    with house_style():
        axes: Any = plt.subplots(len(entries), 1, sharex=True, squeeze=False,
                                 figsize=size_of(2.2 * len(entries)))[1][:, 0]
        for ax, (row, column) in zip(axes, entries, strict=True):
            lines = ax.plot(hertz, np.abs(uncertainty.samples[:, row, column]).T, color="#888888", linewidth=0.8)
            lines[0].set_label("measured plants")
            ax.plot(hertz, uncertainty.envelope[row, column], color="black", label="envelope R")
            ax.set(xscale="log", ylabel=f"|Δp|, entry {row + 1}{column + 1}")
            if np.any(uncertainty.envelope[row, column]):
                ax.set_yscale("log")
        axes[0].legend(loc="best")
        axes[-1].set_xlabel("frequency [Hz]")
        return Figure.draw(axes[0].figure, alt="Size of the dual-Youla parameter of every measured plant, and the "
                           "envelope.", caption="Dual-Youla parameters Δp of the measured plants and their envelope R.")


def time_figure(run: Simulation) -> Figure:
    """e12 over time.

    Parameters
    ----------
    run : Simulation
        What is drawn.
    """
    with house_style():
        axes = run.plot()
        moving = ", its moving average and moving standard deviation" if run.samples else ""
        return Figure.draw(axes[0].figure, alt=f"e12{moving} over time, without and with coupling.",
                           caption=f"e12{moving}, simulated with one realization of the disturbances.")


def _drawn(found: Spectra, panel: str, alt: str, caption: str) -> Figure:
    with house_style():
        axes = found.plot([panel])
        return Figure.draw(axes[0].figure, alt=alt, caption=caption)
