"""Stage 3: where the misfit sits: lump, sensor, time, frequency, operating condition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._celsius import ZERO_CELSIUS
from ..._digits import in_table
from ..._drawing import axes_for
from ...thermal import System
from ..fit import Refit
from ._adequacy import adequacy, spline_tests

Array = NDArray[np.float64]
_BINS = 5


@dataclass(frozen=True, eq=False)
class Location:
    """Where data and simulation part.

    Parameters
    ----------
    lumps : dict
        p-value of an extra heat into every lump.
    strength : dict
        Its F statistic, which still ranks when p-values underflow.
    sensors : dict
        p-value of every sensor's whiteness.
    conditions : tuple of str
        Where in time, frequency and operating range the innovations are largest, in words.
    """

    lumps: dict[str, float]
    strength: dict[str, float]
    sensors: dict[str, float]
    conditions: tuple[str, ...]

    @property
    def lump(self) -> str:
        """Lump with the strongest evidence of an extra heat."""
        return max(self.strength, key=lambda name: self.strength[name])

    def __str__(self) -> str:
        lines = [f"{name:<16} extra heat F {self.strength[name]:>8.3g}, p {p:.2g}" for name, p in self.lumps.items()]
        lines += [f"{name:<16} whiteness p {p:.2g}" for name, p in self.sensors.items()]
        return "\n".join([*lines, *self.conditions])

    def plot(self, ax: Any = None) -> Any:
        """Bars of the F statistics; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        ax.bar(list(self.strength), list(self.strength.values()))
        ax.set(ylabel="F statistic of an extra heat [-]", yscale="log")
        return ax


def locate(fit: Refit) -> Location:
    """Locate the misfit of a refit; most trustworthy on the nominal one.

    Parameters
    ----------
    fit : Refit
        Nominal system refitted, from `refit`.

    Returns
    -------
    Location

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> heater = np.repeat([4.0, 0.0, 6.0, 2.0], 50)
    >>> drive = rt.Record(sample_time=10.0, inputs=heater, outputs=np.zeros((200, 0)), input_names=["heater"],
    ...                   output_names=[])
    >>> run = rt.thermal.simulate(bar.with_parameters({"sensors.T.time_constant": 30.0}), drive)
    >>> noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> where = rt.diagnosis.locate(rt.diagnosis.refit(bar, noisy))
    >>> where.lump, where.sensors["T"] < 0.001
    ('bar', True)
    """
    tests = spline_tests(fit)
    return Location({name: p for name, (_, p) in tests.items()}, {name: F for name, (F, _) in tests.items()},
                    adequacy(fit).sensors, (*_conditions(fit), *_bands(fit)))


def _conditions(fit: Refit) -> tuple[str, ...]:
    """The bin with the largest mean square of the innovations, for each way of looking at them."""
    paths = fit.records
    if not paths:
        return ()
    sizes = [np.mean(z**2, axis=1) for z, _ in fit.record_innovations]
    out = [_worst("time [s]", [path.time for path in paths], sizes)]
    for column, (name, unit) in enumerate(_driving_units(fit.system).items()):
        values = [path.u[:, column] for path in paths]
        if np.ptp(np.concatenate(values)) > 0:
            out.append(_worst(*_shown(fit.system, name, unit, values), sizes))
    for name in dict.fromkeys(name for path in paths for name in path.one.sensors):
        kept = [(path.one.readings[:, path.one.sensors.index(name)], size) for path, size in
                zip(paths, sizes, strict=True) if name in path.one.sensors]
        read = _shown(fit.system, name, fit.system.sensors[name].unit, [value for value, _ in kept])
        out.append(_worst(*read, [size for _, size in kept]))
    out.append(_frequency(fit))
    return tuple(out)


def _driving_units(system: System) -> dict[str, str]:
    """Unit of everything that drives the system."""
    return {name: system.input_units.get(name) or "W" if name in system.inputs else "A" if name in system.modules else
            "K" for name in system.exogenous_names}


def _shown(system: System, name: str, unit: str, values: list[Array]) -> tuple[str, list[Array]]:
    """Name with its unit, and the values in it: temperatures as in the file of the system."""
    if unit == "K" and system.temperature_unit == "degC":
        return f"{name} [°C]", [value - ZERO_CELSIUS for value in values]
    return f"{name} [{unit}]", values


def _bands(fit: Refit) -> list[str]:
    """The band with the largest misfit of every element of every frequency response, in words."""
    return [line for z, path in zip(fit.innovations(), fit.paths, strict=True) for line in path.bands(z)]


def _worst(what: str, values: list[Array], sizes: list[Array]) -> str:
    value, size = np.concatenate(values), np.concatenate(sizes)
    edges = np.unique(np.quantile(value, np.linspace(0.0, 1.0, _BINS + 1)))
    place = np.clip(np.searchsorted(edges, value, side="right") - 1, 0, max(len(edges) - 2, 0))
    means = [float(size[place == b].mean()) if np.any(place == b) else 0.0 for b in range(max(len(edges) - 1, 1))]
    worst = int(np.argmax(means))
    return (f"{what}: largest between {edges[worst]:.5g} and {edges[min(worst + 1, len(edges) - 1)]:.5g}, "
            f"{in_table(means[worst], 3)} times the noise power there")


def _frequency(fit: Refit) -> str:
    power = []
    for z, path in fit.record_innovations:
        spectrum = np.mean(np.abs(np.fft.rfft(z, axis=0)[1:]) ** 2, axis=1) / len(z)
        frequency = np.fft.rfftfreq(len(z), path.h)[1:]
        for low, high in zip(np.geomspace(frequency[0], frequency[-1], _BINS + 1)[:-1],
                             np.geomspace(frequency[0], frequency[-1], _BINS + 1)[1:], strict=True):
            inside = (frequency >= low) & (frequency <= high)
            if inside.any():
                power.append((float(spectrum[inside].mean()), float(low), float(high)))
    most, low, high = max(power)
    return f"frequency [Hz]: largest between {low:.3g} and {high:.3g}, {in_table(most, 3)} times the noise power there"
