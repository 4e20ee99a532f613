"""A set of designed experiments: the signals, and what their peaks cost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import Outcome
from ._checks import Array
from ._crest import crest_of
from ._outcomes import SignalsCode


@dataclass(frozen=True, kw_only=True, eq=False)
class Excitation:
    """Signals of all inputs, experiments and realizations.

    Parameters
    ----------
    signals : ndarray, shape (realizations, experiments, samples, inputs)
        In the units of the inputs.
    lines : tuple of ndarray
        Excited lines of each input; line k has the frequency k / (period * sample_time) [Hz].
    period : int
        Length of one period [samples].
    sample_time : float
        Time between two samples [s].
    arrangement : str
        "orthogonal", "zippered" or "independent".
    phases : str
        "random", "schroeder" or "low_crest".
    schroeder_crest_factors : ndarray, shape (inputs,)
        What Schroeder phases would reach with the same lines and amplitudes [-].
    """

    signals: Array
    lines: tuple[NDArray[np.intp], ...]
    period: int
    sample_time: float
    arrangement: str
    phases: str
    schroeder_crest_factors: Array

    def __post_init__(self) -> None:
        self.signals.setflags(write=False)

    @property
    def experiments(self) -> list[Array]:
        """Arrays (samples, inputs), one per record to be measured: realization after realization."""
        return [experiment for realization in self.signals for experiment in realization]

    @property
    def crest_factors(self) -> Array:
        """Crest factors achieved, (realizations, experiments, inputs) [-]."""
        wave = self.signals[:, :, : self.period] - self.signals[:, :, : self.period].mean(axis=2, keepdims=True)
        return np.apply_along_axis(crest_of, 2, wave)

    @property
    def outcome(self) -> Outcome:
        """Whether the phases keep the peaks below those of Schroeder phases, where that was asked for."""
        worst = self.crest_factors.max(axis=(0, 1))
        numbers = ", ".join(
            f"{a:.2f} (Schroeder {s:.2f})" for a, s in zip(worst, self.schroeder_crest_factors, strict=True)
        )
        text = f"Largest crest factor of each input: {numbers}."
        if self.phases == "low_crest" and (worst > self.schroeder_crest_factors).any():
            return SignalsCode.NOT_LOWER.outcome(text)
        if self.phases != "random" and len(self.signals) > 1:
            text += " The distortion level of a best linear approximation assumes random phases; these are not."
        return SignalsCode.DESIGNED.outcome(text)

    def __str__(self) -> str:
        realizations, experiments, samples, inputs = self.signals.shape
        rows = [
            f"{self.arrangement} multisines, {self.phases} phases: {realizations} realization(s) of {experiments} "
            f"experiment(s), {samples} samples ({samples * self.sample_time:g} s), period {self.period} samples",
            f"{'input':>5}{'lines':>8}{'lowest [Hz]':>14}{'highest [Hz]':>14}"
            f"{'min':>11}{'mean':>11}{'max':>11}{'crest':>8}",
        ]
        for i in range(inputs):
            u, f = self.signals[..., i].round(12) + 0.0, self.lines[i] / (self.period * self.sample_time)
            levels = f"{u.min():>11.4g}{u.mean().round(12) + 0.0:>11.4g}{u.max():>11.4g}"
            crest = self.crest_factors[..., i].max()
            rows.append(f"{i:>5}{f.size:>8}{f.min():>14.4g}{f.max():>14.4g}{levels}{crest:>8.2f}")
        return "\n".join([*rows, str(self.outcome)])

    def plot(self) -> NDArray[Any]:
        """Axes with one period of the first realization, one row per input.

        Returns
        -------
        ndarray of matplotlib Axes
        """
        # Imported here: matplotlib is slow to load, and most programs never draw.
        import matplotlib.pyplot as plt

        _, axes = plt.subplots(self.signals.shape[3], 1, sharex=True, squeeze=False, layout="constrained")
        time = np.arange(self.period) * self.sample_time
        for i, axis in enumerate(axes[:, 0]):
            for e, experiment in enumerate(self.signals[0]):
                axis.step(time, experiment[: self.period, i], where="post", lw=0.8, label=f"experiment {e}")
            axis.set_ylabel(f"input {i} [unit of the actuator]")
            axis.grid(True, alpha=0.3)
        axes[0, 0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=6, fontsize="small", frameon=False)
        axes[-1, 0].set_xlabel("time [s]")
        return axes[:, 0]
