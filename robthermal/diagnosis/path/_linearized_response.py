"""A system's frequency response beside the measured one, and how it answers to parameters, effects and extra heat."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._residual import residual
from ...errors import Diverged, InputError
from ...fitting import ResponseWhitener, as_complex, as_real
from ...thermal import Input, System
from ..data import Complex, ResponseData
from ..effects import Candidate
from ._coarseness import coarse_names
from ._heat_splines import cubic_splines
from ._linearized import Unknowns

Array = NDArray[np.float64]
_STEP = 1e-4  # relative; the differences below are of second order
_MOST_SPLINES = 8
_BANDS = 5
_PROBE = "extra heat"


@dataclass(frozen=True, eq=False)
class LinearizedResponse:
    """A measured frequency response and the one of a system, the counterpart of `LinearizedRecord`.

    Parameters
    ----------
    system : System
        System whose response it is.
    one : ResponseData
        Measured frequency response.
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

    @property
    def in_time(self) -> bool:
        """A frequency response."""
        return False

    @cached_property
    def residual(self) -> Array:
        """Measured − modelled, (2 n_b, m)."""
        return residual(self.one.readings, self.readings)

    def coarse_columns(self, base: System) -> Array:
        """As `Linearized.coarse_columns`: a response has none."""
        return np.zeros((*self.readings.shape, len(coarse_names(base))))

    def refined(self, columns: Array, b: Array) -> LinearizedResponse:
        """As `Linearized.refined`: as it is."""
        return self

    def white(self, noise: Callable[..., Any]) -> ResponseWhitener:
        """As `Linearized.white`: estimated with the response."""
        return self.one.white

    def bands(self, z: Array) -> list[str]:
        """As `Linearized.bands`: the band with the largest misfit of every element."""
        power = (z**2).reshape(2, -1, z.shape[1]).mean(axis=0)
        return [_worst(name, self.one.frequencies, column)
                for name, column in zip(self.one.sensors, power.T, strict=True)]

    def noise_windows(self, block: Array) -> Iterator[tuple[ResponseData, Array]]:
        """As `Linearized.noise_windows`: window by window."""
        rows = block.reshape(2, len(self.one.index), -1, block.shape[1])
        for places in self.one.windows:
            yield self.one, rows[:, places].reshape(-1, block.shape[1])

    def slopes(self, unknowns: Unknowns) -> Array:
        """As `Linearized.slopes`: differences of second order."""
        n = unknowns.steps.size
        out = np.zeros((*self.one.readings.shape, unknowns.v.size))
        out[..., :n] = response_slopes(lambda moved: self.one.model(unknowns.system(moved)), unknowns.v,
                                       unknowns.steps, unknowns.bounds)
        return out

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
        ax.set(xlabel="frequency [Hz]", ylabel="|measured − model| [output/input]")

    def columns(self, trials: Sequence[Candidate]) -> Array:
        """Change of the response (2 n_b, m, k) per unit of size of every trial; zero for what it cannot show."""
        out = np.zeros((*self.readings.shape, len(trials)))
        for k, trial in enumerate(trials):
            if not self.one.hides(self.system, trial):
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
        """Change of the response (2 n_b, m, k) by heat into one lump that follows every input smoothly.

        The heat is a cubic spline in log frequency, real and imaginary part of each input.
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


def linearized_response(system: System, one: ResponseData) -> LinearizedResponse:
    """Response of a system at the bins of a measured one."""
    return LinearizedResponse(system, one, one.model(system))


def _worst(name: str, frequencies: Array, power: Array) -> str:
    edges = np.geomspace(frequencies[0], frequencies[-1] * (1 + 1e-12), _BANDS + 1)
    place = np.clip(np.searchsorted(edges, frequencies, side="right") - 1, 0, _BANDS - 1)
    means = [float(power[place == b].mean()) if np.any(place == b) else 0.0 for b in range(_BANDS)]
    worst = int(np.argmax(means))
    return (f"{name}: largest between {edges[worst]:.3g} and {edges[worst + 1]:.3g} Hz, {means[worst]:.3g} times the "
            "noise power there")


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
    return cubic_splines(t, count)
