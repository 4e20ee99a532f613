"""What the design check found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._pandas import pd
from ..errors import Outcome
from ._checks import Array
from ._outcomes import SignalsCode

_SHOWN = 8  # poles in the printed table


@dataclass(frozen=True, kw_only=True, eq=False)
class DesignCheck:
    """Resolution, heat and expected variance of an experiment that has not been made.

    Parameters
    ----------
    frequencies : ndarray, shape (n_f,)
        Excited frequency lines [Hz].
    poles : ndarray, shape (n_p,)
        Poles slower than the samples [rad/s], slowest first, one of each pair.
    pole_errors : ndarray, shape (n_p, n_f)
        Error without noise for a machine with that pole alone, every input heating it alike per watt, relative to its
        response [-].
    model_errors : ndarray, shape (n_y, n_f), or None
        Error without noise for the nominal state space, the worst over the inputs, relative to the output that responds
        most to that input [-].
    tolerance : float
        Error above which a frequency counts as unresolved [-].
    noise_gain : ndarray, shape (n_u, n_f)
        Variance of G per variance of the output noise [1/unit^2]; infinite where the excitation does not determine G.
    noise : ndarray, shape (n_y,), or None
        Standard deviation of the output noise.
    response : ndarray, shape (n_y, n_u, n_f), or None
        Frequency response of the nominal model.
    mean_heat : ndarray, shape (n_u,)
        Mean heat per input [W].
    heat_range : ndarray, shape (n_u, 2)
        Lowest and highest heat per input [W].
    energy : float
        Heat of all inputs and experiments together [J].
    mean_rise : ndarray, shape (n_y,), or None
        Rise of each output in the end, by the mean of the inputs, in the unit of the outputs.
    sample_time : float
        Time between two samples [s].
    n_samples : int
        Of one experiment [samples].
    n_experiments : int
        Number of experiments [-].
    method : str
        The estimator the numbers hold for.
    """

    frequencies: Array
    poles: NDArray[np.complex128]
    pole_errors: Array
    model_errors: Array | None
    tolerance: float
    noise_gain: Array
    noise: Array | None
    response: NDArray[np.complex128] | None
    mean_heat: Array
    heat_range: Array
    energy: float
    mean_rise: Array | None
    sample_time: float
    n_samples: int
    n_experiments: int
    method: str

    @property
    def duration(self) -> float:
        """Length of one experiment [s]."""
        return self.n_samples * self.sample_time

    @property
    def unresolved(self) -> NDArray[np.bool_]:
        """Lines with an error above the tolerance, (n_f,): of the nominal state space if given, else of a pole."""
        errors = self.pole_errors if self.model_errors is None else self.model_errors
        return np.asarray((errors > self.tolerance).any(axis=0))

    @property
    def undetermined(self) -> NDArray[np.bool_]:
        """Lines at which the excitation does not determine G of some input, (n_f,)."""
        return np.asarray(np.isinf(self.noise_gain).any(axis=0))

    @property
    def resolved_from(self) -> float:
        """Frequency from which every line is resolved [Hz]; NaN if there is none."""
        return self._above(self.unresolved)

    @property
    def variance(self) -> Array | None:
        """Expected variance of G, (n_y, n_u, n_f): E|error|^2 by the noise alone; None without `noise`."""
        return None if self.noise is None else self.noise[:, None, None] ** 2 * self.noise_gain

    @property
    def relative_deviation(self) -> Array | None:
        """Root of the variance over the size of G, (n_y, n_u, n_f) [-]; None without `noise` and nominal response."""
        if self.response is None or self.variance is None:
            return None
        with np.errstate(divide="ignore"):
            return np.asarray(np.sqrt(self.variance) / np.abs(self.response))

    @property
    def table(self) -> pd.DataFrame:
        """One row per pole: time constant, its corner, from which line on it is resolved, and whether its corner is."""
        corners = np.abs(self.poles) / (2.0 * np.pi)
        resolved = np.array([self._above(errors > self.tolerance) for errors in self.pole_errors])
        return pd.DataFrame(
            {
                "time constant [s]": 1.0 / np.abs(self.poles),
                "corner [Hz]": corners,
                "resolved from [Hz]": resolved,
                "verdict": [self._verdict(c, r) for c, r in zip(corners, resolved, strict=True)],
            }
        )

    @property
    def outcome(self) -> Outcome:
        """Whether every excited line will be determined and resolved, and what to do if not."""
        f = self.frequencies
        if self.undetermined.any():
            bad = f[self.undetermined]
            text = (
                f"The excitation does not determine G of every input at {bad.size} of {f.size} lines, {bad[0]:.3g} to "
                f"{bad[-1]:.3g} Hz."
            )
            return SignalsCode.UNDETERMINED.outcome(text)
        if not self.unresolved.any():
            return SignalsCode.RESOLVED.outcome(f"All {f.size} excited lines are resolved to {self.tolerance:.0%}.")
        bad = f[self.unresolved]
        worst = 1.0 / abs(self.poles[self.pole_errors[:, self.unresolved].max(axis=1).argmax()])
        text = (
            f"{bad.size} of {f.size} excited lines are unresolved, {bad[0]:.3g} to {bad[-1]:.3g} Hz: in "
            f"{self.duration:.4g} s the time constant of {worst:.3g} s leaves an error above {self.tolerance:.0%}."
        )
        return SignalsCode.UNRESOLVED.outcome(text, remedy=self._remedy())

    def _remedy(self) -> str:
        prescribed = SignalsCode.UNRESOLVED.remedy
        if not np.isfinite(self.resolved_from):
            return f"{prescribed} Or record longer."
        return (
            f"{prescribed} Or record longer: the line resolved first, now {self.resolved_from:.3g} Hz, falls in "
            "inverse proportion to the length of the record."
        )

    def _above(self, bad: NDArray[np.bool_]) -> float:
        places = np.flatnonzero(bad)
        first = 0 if not places.size else places[-1] + 1
        return float(self.frequencies[first]) if first < self.frequencies.size else float("nan")

    def _verdict(self, corner: float, resolved: float) -> str:
        if corner > self.frequencies[-1]:
            return "above the excited band"
        if corner < self.frequencies[0]:
            return "below the excited band"
        return "resolved" if resolved <= corner else "unresolved"

    def __str__(self) -> str:
        rows = [f"Design check for {self.method}: {self.n_experiments} experiment(s) of {self.duration:.6g} s"]
        for i, ((low, high), mean) in enumerate(zip(self.heat_range, self.mean_heat, strict=True)):
            rows.append(f"input {i}: mean heat {mean:.4g} W, from {low:.4g} to {high:.4g} W")
        rows.append(f"energy of all inputs and experiments: {self.energy:.4g} J")
        if self.mean_rise is not None:
            rows.append("rise of the outputs by the mean: " + ", ".join(f"{rise:.4g}" for rise in self.mean_rise))
        if (relative := self.relative_deviation) is not None:
            rows.append("expected relative deviation of G, median and worst over the lines:")
            for o, i in np.ndindex(*relative.shape[:2]):
                rows.append(f"  output {o}, input {i}: {np.median(relative[o, i]):.2g}, {relative[o, i].max():.2g}")
        rows.append(self.table.head(_SHOWN).to_string(index=False, float_format=lambda x: f"{x:.4g}"))
        if len(self.poles) > _SHOWN:
            rows.append(f"and {len(self.poles) - _SHOWN} faster ones")
        return "\n".join([*rows, str(self.outcome)])

    def plot(self) -> NDArray[Any]:
        """Axes with the error of every pole above, the expected deviation of G below.

        Returns
        -------
        ndarray of matplotlib Axes, shape (2,)
        """
        # Imported here: matplotlib is slow to load, and most programs never draw.
        import matplotlib.pyplot as plt

        _, axes = plt.subplots(2, 1, sharex=True, layout="constrained")
        for pole, errors in zip(self.poles, self.pole_errors, strict=True):
            axes[0].loglog(self.frequencies, errors, lw=1.0, label=f"time constant {1.0 / abs(pole):.3g} s")
        if self.model_errors is not None:
            axes[0].loglog(self.frequencies, self.model_errors.max(axis=0), "k", lw=1.5, label="nominal model")
        axes[0].axhline(self.tolerance, color="black", lw=0.8, ls="--", label="tolerance")
        axes[0].set_ylabel("relative error without noise [-]")
        axes[0].legend(fontsize="small")
        relative, variance = self.relative_deviation, self.variance
        shown = relative if relative is not None else np.sqrt(self.noise_gain[None] if variance is None else variance)
        for o, i in np.ndindex(*shown.shape[:2]):
            axes[1].loglog(self.frequencies, shown[o, i], lw=1.0, label=f"output {o}, input {i}")
        of_G = "of G [output/input]" if relative is None else "of G, relative [-]"
        axes[1].set_ylabel("deviation " + ("per unit of noise [-]" if variance is None else of_G))
        axes[1].set_xlabel("frequency [Hz]")
        axes[1].legend(fontsize="small")
        return axes
