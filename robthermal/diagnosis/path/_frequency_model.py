"""A system's frequency response beside the measured one, and how it answers to parameters, effects and extra heat."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from ...errors import Diverged, InputError
from ...thermal import Input, System
from ..data import Complex, ResponseData, as_complex, as_real
from ..effects import Candidate

Array = NDArray[np.float64]
_STEP = 1e-4  # relative; the differences below are of second order
_MOST_SPLINES = 8
_PROBE = "extra heat"


@dataclass(frozen=True, eq=False)
class AlongResponse:
    """A measured frequency response and the one of a system, the counterpart of `Along`.

    Parameters
    ----------
    system : System
        Whose.
    one : ResponseData
        Measured.
    readings : ndarray, shape (2 n_b, m)
        The system's, in the form of `ResponseData.readings`.
    """

    system: System
    one: ResponseData
    readings: Array

    @property
    def h(self) -> float:
        """Sample time [s]."""
        return self.one.response.sample_time

    @property
    def span(self) -> float:
        """Longest period seen [s]."""
        return float(1.0 / self.one.frequencies[0])

    @cached_property
    def x(self) -> Array:
        """Steady state, (1, n_lumps) [K]; nominal temperatures of a linear network."""
        T = self.one.temperatures(self.system)
        room = next(iter(self.system.ambients.values())).temperature
        return np.full((1, len(self.system.lumps)), room) if T is None else T[None]

    def draw(self, ax: Any, r: Array) -> None:
        """Magnitude of a deviation (2 n_b, m) of every element against frequency."""
        for name, column in zip(self.one.sensors, np.abs(as_complex(r)).T, strict=True):
            ax.loglog(self.one.frequencies, column, linewidth=0.7, label=name)
        ax.set(xlabel="frequency [Hz]", ylabel="|measured − model|")

    def columns(self, trials: Sequence[Candidate]) -> Array:
        """Change of the response (2 n_b, m, k) per unit of size of every trial; zero for what it cannot show."""
        out = np.zeros((*self.readings.shape, len(trials)))
        for k, trial in enumerate(trials):
            if not hidden_from_response(self.system, trial):
                out[..., k] = self._column(trial)
        return out

    def _column(self, trial: Candidate) -> Array:
        size = trial.effect.size

        def at(value: float) -> Array:
            return self.one.model(trial.add(self.system, value)) if value else self.readings

        if size.name in trial.shape:  # tried at this value: the whole way there
            return (at(trial.shape[size.name]) - self.readings) / trial.shape[size.name]
        return slope(at, 0.0, size.typical, size.lower, size.upper)

    def splines(self, lump: int) -> Array:
        """Change of the response (2 n_b, m, k) by heat into one lump that follows every input by some smooth law.

        The law is a cubic spline in log frequency, real and imaginary part of each input.
        """
        probed = self.system.model_copy(update={"inputs": {
            **self.system.inputs, _PROBE: Input(lump=self.system.lump_names[lump])}})
        reach = as_complex(self.one.model(probed, (_PROBE,)))  # (n_b, n_outputs)
        basis = log_splines(self.one.frequencies)
        n, n_y, n_u, k = *reach.shape, len(self.one.inputs), basis.shape[1]
        out = np.zeros((n, n_u, n_y, n_u, k), np.complex128)
        for i in range(n_u):
            out[:, i, :, i] = reach[:, :, None] * basis[:, None]
        flat: Complex = out.reshape(n, n_u * n_y, n_u * k)
        return as_real(np.concatenate([flat, 1j * flat], axis=2))


def along_response(system: System, one: ResponseData) -> AlongResponse:
    """Response of a system at the bins of a measured one."""
    return AlongResponse(system, one, one.model(system))


def hidden_from_response(system: System, candidate: Candidate) -> str:
    """Why a frequency response cannot show an effect; empty if it can."""
    return candidate.effect.hidden(system, candidate.where)


def response_slopes(model: Callable[[Array], Array], v: Array, steps: Array, bounds: tuple[Array, Array]) -> Array:
    """Derivative (..., len(steps)) of a response by the first unknowns."""
    columns = []
    for i, step in enumerate(steps):
        def at(value: float, i: int = i) -> Array:
            moved = v.copy()
            moved[i] = value
            return model(moved)

        columns.append(slope(at, float(v[i]), float(step), float(bounds[0][i]), float(bounds[1][i])))
    return np.stack(columns, axis=-1) if columns else np.zeros((*model(v).shape, 0))


def slope(at: Callable[[float], Array], x: float, step: float, lower: float, upper: float) -> Array:
    """Derivative with an error of the order of step²; one-sided at a bound, or where the other side is impossible."""
    if x - step >= lower and x + step <= upper:
        try:
            return (at(x + step) - at(x - step)) / (2.0 * step)
        except (Diverged, InputError):
            pass
    step = step if x + 2.0 * step <= upper else -step
    return (4.0 * at(x + step) - at(x + 2.0 * step) - 3.0 * at(x)) / (2.0 * step)


def log_splines(frequencies: Array) -> Array:
    """Cubic B-splines on even knots in log frequency, (n_b, k)."""
    count = max(4, min(_MOST_SPLINES, frequencies.size // 6))
    t = np.log(frequencies)
    t = (t - t[0]) / max(t[-1] - t[0], 1e-12)
    knots = np.concatenate([[0.0] * 3, np.linspace(0.0, 1.0, count - 2), [1.0] * 3])
    return np.asarray(BSpline.design_matrix(np.minimum(t, 1.0 - 1e-12), knots, 3).toarray(), np.float64)
