"""Panels of a coupling design over frequency."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._drawing import size_of
from ...errors import InputError

if TYPE_CHECKING:
    from ._spectra import Spectra

_DASHED = {"color": "0.5", "linestyle": "--"}
_SMALLEST = 1e-4  # robust number; below, nothing can be learnt


def draw(found: Spectra, panels: Sequence[str]) -> Any:
    """Panels one below the other, over frequency [Hz].

    Parameters
    ----------
    found : Spectra
        What is drawn.
    panels : sequence of str
        Names of panels.
    """
    import matplotlib.pyplot as plt

    unknown = [name for name in panels if name not in _PANELS]
    if unknown or not panels:
        raise InputError(f"panels = {list(panels)!r}", where="plot", expected=f"some of {', '.join(_PANELS)}")
    axes: Any = plt.subplots(len(panels), 1, sharex=True, squeeze=False, figsize=size_of(2.6 * len(panels)),
                             layout="constrained")[1][:, 0]
    for ax, name in zip(axes, panels, strict=True):
        _PANELS[name](ax, found)
        ax.legend(loc="best")
    axes[-1].set_xlabel("frequency [Hz]")
    return axes


def _sensitivity(ax: Any, found: Spectra) -> None:
    names = ("S1", "(1+Y) S1"), ("S2", "(1+X) S2")
    for k, (before, after) in enumerate(names):
        ax.loglog(found.frequency, found.sensitivity_before[k], color=f"C{k}", linestyle="--", label=before)
        ax.loglog(found.frequency, found.sensitivity_after[k], color=f"C{k}", label=after)
    ax.set_ylabel("sensitivity [-]")


def _improvement(ax: Any, found: Spectra) -> None:
    for curve, name in zip(found.improvement, ("|1 + Y|, on S1", "|1 + X|, on S2"), strict=True):
        ax.loglog(found.frequency, curve, label=name)
    ax.axhline(1.0, **_DASHED, linewidth=0.8)
    ax.set_ylabel("improvement [-]")


def _e12(ax: Any, found: Spectra) -> None:
    ax.loglog(found.frequency, found.e12_before, **_DASHED, label="without coupling")
    ax.loglog(found.frequency, found.e12_after, label="with coupling")
    ax.set_ylabel("e12 [m/√Hz]")


def _power(ax: Any, found: Spectra) -> None:
    ax.semilogx(found.frequency, found.power_before, **_DASHED, label="without coupling")
    ax.semilogx(found.frequency, found.power_after, label="with coupling")
    ax.set_ylabel("cumulative power\nof e12 [m²]")


def _robust(ax: Any, found: Spectra) -> None:
    for curve, name, style in ((found.small_gain, "σ(Δk) μ(Δp), Evers (6.22)", {**_DASHED, "linestyle": "-"}),
                               (found.robust, "ρ(|Δk| R)", {})):
        if np.any(curve > 0):
            ax.loglog(found.frequency, curve, label=name, **style)
    if 0 < found.proven < np.inf:
        ax.axhline(found.proven, color="C2", linestyle=":", label=f"proven: {found.proven:.3g}")
    ax.axhline(1.0, color="C1", linewidth=0.8, label="limit")
    ax.set_ylim(bottom=max(ax.get_ylim()[0], _SMALLEST))
    ax.set_ylabel("robust number [-]")


_PANELS: dict[str, Callable[[Any, Any], None]] = {"sensitivity": _sensitivity, "improvement": _improvement, "e12": _e12,
                                                  "power": _power, "robust": _robust}
