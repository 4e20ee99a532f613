"""Drawings of a frequency response: Bode with confidence band, coherence, transient."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from robthermal.errors import InputError

if TYPE_CHECKING:
    from ._response import FrequencyResponse

KINDS = ("bode", "coherence", "transient")


def draw(result: FrequencyResponse, kind: str, p: float) -> Any:
    """Axes with the drawing asked for."""
    if kind not in KINDS:
        raise InputError(f"kind is {kind!r}", where="kind", expected=f"one of {', '.join(map(repr, KINDS))}")
    # Imported here: matplotlib is slow to load, and most programs draw nothing.
    from matplotlib import pyplot

    if kind == "bode":
        shape = (2 * len(result.output_names), len(result.input_names))
        _, axes = pyplot.subplots(*shape, sharex=True, squeeze=False, layout="constrained")
        _bode(result, axes, p)
    else:
        _, grid = pyplot.subplots(len(result.output_names), 1, sharex=True, squeeze=False, layout="constrained")
        axes = grid[:, 0]
        (_coherence if kind == "coherence" else _transient)(result, axes)
    for axis in np.atleast_2d(axes)[-1]:
        axis.set_xlabel("frequency [Hz]")
    return axes


def _bode(result: FrequencyResponse, axes: Any, p: float) -> None:
    radius, f = result.confidence_radius(p), result.frequencies
    for o, output in enumerate(result.output_names):
        for i, name in enumerate(result.input_names):
            G, r = result.response[o, i], radius[o, i]
            size = np.abs(G)
            above, below = axes[2 * o, i], axes[2 * o + 1, i]
            above.loglog(f, size, lw=1.0)
            # The lower edge of a circle that contains zero is zero: cut, so that a logarithmic axis can show the rest.
            lower = np.maximum(size - r, 1e-3 * size)
            above.fill_between(f, lower, np.where(np.isfinite(r), size + r, np.nan), alpha=0.3, label=f"{p:.0%} region")
            above.loglog(f[result.suspect], size[result.suspect], "x", ms=4, label="suspect")
            phase = np.degrees(np.angle(G))
            with np.errstate(invalid="ignore", divide="ignore"):
                spread = np.degrees(np.arcsin(np.minimum(r / size, 1.0)))
            below.semilogx(f, phase, lw=1.0)
            below.fill_between(f, phase - spread, phase + spread, alpha=0.3)
            above.set_title(f"{name} to {output}", fontsize="small")
            above.set_ylabel("|G| [output/input]")
            below.set_ylabel("phase [deg]")
    axes[0, 0].legend(fontsize="small")


def _coherence(result: FrequencyResponse, axes: Any) -> None:
    for o, output in enumerate(result.output_names):
        axes[o].semilogx(result.frequencies, result.coherence[o], lw=1.0)
        axes[o].set_ylim(0.0, 1.05)
        axes[o].set_ylabel(f"coherence of {output} [-]")


def _transient(result: FrequencyResponse, axes: Any) -> None:
    for o, output in enumerate(result.output_names):
        axes[o].loglog(result.frequencies, np.abs(result.transient[o]), lw=1.0, label="transient")
        axes[o].loglog(result.frequencies, np.sqrt(result.noise_variance[o]), lw=1.0, label="noise")
        axes[o].set_ylabel(f"{output} [output unit]")
        axes[o].legend(fontsize="small")
