"""A frequency response beside the calibrated model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Complex, Floats
from .._residual import residual
from ..fitting import MeasuredResponse, as_complex
from ..identify import FrequencyResponse
from ..thermal import System


@dataclass(frozen=True, eq=False, kw_only=True)
class ResponseComparison:
    """One frequency response, the model at the same bins, and how far they are apart.

    Parameters
    ----------
    response : FrequencyResponse
        What was measured.
    bins : ndarray of int, shape (n_b,)
        Positions of the frequencies that were used: determined, not suspect, far enough apart to be weighed together.
    outputs, inputs : tuple of str
        Channels that were used.
    measured, model : ndarray, shape (n_y, n_u, n_b)
        Both responses at those frequencies and channels [output unit / input unit].
    misfit : float
        Mean squared distance in standard deviations [-]: near 1 if the model explains the response within its noise.
    operating_point : dict
        Inputs at whose steady state the model was linearized: heaters, currents [A], ambients [K].
    """

    response: FrequencyResponse
    bins: NDArray[np.intp]
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    measured: Complex
    model: Complex
    misfit: float
    operating_point: dict[str, float]

    @property
    def frequencies(self) -> Floats:
        """Of the bins used [Hz]."""
        return np.asarray(self.response.frequencies[self.bins], np.float64)

    @property
    def residuals(self) -> Complex:
        """Measured − modelled, (n_y, n_u, n_b) [output unit / input unit]."""
        return residual(self.measured, self.model)

    def plot(self) -> NDArray[Any]:
        """Estimated response with its 95 % band, and the model on top.

        Returns
        -------
        ndarray of matplotlib.axes.Axes
            As `FrequencyResponse.plot`.
        """
        axes: NDArray[Any] = self.response.plot()
        grid = np.reshape(axes, (2 * len(self.response.output_names), len(self.response.input_names)))
        for o, name in enumerate(self.outputs):
            row = 2 * self.response.output_names.index(name)
            for i, source in enumerate(self.inputs):
                size, phase = grid[row:row + 2, self.response.input_names.index(source)]
                size.plot(self.frequencies, np.abs(self.model[o, i]), "k--", linewidth=1.0, label="model")
                phase.plot(self.frequencies, np.degrees(np.angle(self.model[o, i])), "k--", linewidth=1.0)
                size.legend(fontsize="small")
        return axes

    def to_dict(self) -> dict[str, Any]:
        """Channels, number of frequencies, misfit and operating point, ready for JSON.

        Returns
        -------
        dict
        """
        return {"method": self.response.method, "outputs": list(self.outputs), "inputs": list(self.inputs),
                "n_frequencies": int(self.bins.size), "misfit": self.misfit, "operating_point": self.operating_point}

    def __str__(self) -> str:
        return (f"{', '.join(self.outputs)} from {', '.join(self.inputs)}: {self.bins.size} frequencies, misfit "
                f"{self.misfit:.3g} (1 is noise alone)")


def comparison_of(system: System, one: MeasuredResponse) -> ResponseComparison:
    """Response of a system beside a measured one."""
    readings = one.model(system)
    misfit = float(np.mean(one.white(residual(one.readings, readings)) ** 2))
    return ResponseComparison(
        response=one.response, bins=one.index, outputs=one.outputs, inputs=one.inputs,
        measured=_by_channel(one, one.readings), model=_by_channel(one, readings), misfit=misfit,
        operating_point=one.operating_point)


def _by_channel(one: MeasuredResponse, readings: Floats) -> Complex:
    """Columns of G stacked, (2 n_b, m), to (n_y, n_u, n_b)."""
    out: Complex = as_complex(readings).reshape(-1, len(one.inputs), len(one.outputs)).transpose(2, 1, 0)
    return out
