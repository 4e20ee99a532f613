"""What an observer must be able to do, and its estimates along a record."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._celsius import ZERO_CELSIUS
from .._drawing import axes_for
from ..errors import InputError
from ..signals import Record
from ._modules import Array
from ._numbers import expect
from ._observer_model import ObserverModel


@dataclass(frozen=True)
class Estimate:
    """Estimates along a record.

    Parameters
    ----------
    model : ObserverModel
        Observer model that names the lumps and sensors.
    time : ndarray, shape (n,)
        Times of the samples [s].
    lumps : ndarray, shape (n, n_lumps)
        Predicted from the samples before [K].
    innovation : ndarray, shape (n, n_sensors)
        Measured minus predicted [K].
    """

    model: ObserverModel
    time: Array
    lumps: Array
    innovation: Array

    def __getitem__(self, lump: str) -> Array:
        """Estimate of one lump [K]."""
        if lump not in self.model.system.lumps:
            raise InputError(f"no lump {lump!r}", where="estimate[...]",
                             expected="one of " + ", ".join(self.model.system.lumps))
        return self.lumps[:, self.model.system.lump_names.index(lump)]

    def plot(self, ax: Any = None) -> Any:
        """Plot all estimates [°C]; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        ax.plot(self.time, self.lumps - ZERO_CELSIUS, label=self.model.system.lump_names)
        ax.set(xlabel="time [s]", ylabel="temperature [°C]", title="estimate from " + ", ".join(self.model.sensors))
        ax.legend(fontsize="small", ncols=2)
        return ax


class Observer(ABC):
    """Estimates all lumps; its memory is one vector."""

    model: ObserverModel

    @property
    def sample_time(self) -> float:
        """[s]."""
        return self.model.sample_time

    @property
    def sensors(self) -> tuple[str, ...]:
        """What it reads."""
        return self.model.sensors

    @abstractmethod
    def start(self, temperatures: Array) -> Array:
        """Memory at the first sample, from a first guess of all lumps.

        Parameters
        ----------
        temperatures : ndarray
            First guess of all lump temperatures [K].
        """

    @abstractmethod
    def estimate(self, memory: Array) -> Array:
        """Estimate of all lumps now, before this sample's readings are used [K].

        Parameters
        ----------
        memory : ndarray
            Memory of the observer.
        """

    @abstractmethod
    def step(self, memory: Array, readings: Array, inputs: Mapping[str, float]) -> Array:
        """Memory at the next sample, from this sample's readings and held inputs.

        Parameters
        ----------
        memory : ndarray
            Memory of the observer.
        readings : ndarray
            Readings of the sensors at this sample [K].
        inputs : mapping
            Heaters, currents and ambients held over the sample, by name [unit, A, K]; off and nominal where not given.
        """

    def run(self, record: Record, initial: ArrayLike | None = None) -> Estimate:
        """Estimate along a record.

        Parameters
        ----------
        record : Record
            Currents, heaters, ambients (nominal where absent) and the sensors this observer reads.
        initial : array_like, shape (n_lumps,), optional
            First guess [K]; default every lump at its nearest reading.

        Returns
        -------
        Estimate
        """
        return _along(self, record, initial)


def _along(obs: Observer, record: Record, initial: ArrayLike | None) -> Estimate:
    model = obs.model
    expect(record, Record, "record", "rt.read_record")
    missing = [name for name in (*obs.sensors, *model.system.modules, *model.system.inputs) if name not in record]
    if missing:
        raise InputError(f"the record has no column {missing[0]!r}", where="argument record",
                         expected="the observer's sensors and every heater and current")
    if record.averaged:
        raise InputError("the readings are means over every sample", where="argument record",
                         expected="readings at the samples: a mean is half a sample late, and attenuates",
                         remedy="Log samples to see what the observer will do on the machine.")
    if abs(record.sample_time - model.sample_time) > 1e-9 * model.sample_time:
        raise InputError(f"the record is sampled every {record.sample_time:g} s", where="argument record",
                         expected=f"{model.sample_time:g} s", remedy="Design the observer for this sample time.")
    Y = np.column_stack([record[name] for name in obs.sensors])
    drive = [name for name in model.system.exogenous_names if name in record.input_names]
    U = np.column_stack([record[name] for name in drive]) if drive else np.zeros((len(Y), 0))
    memory = obs.start(_first(model, Y[0]) if initial is None else np.asarray(initial, float))
    rows = []
    for y, u in zip(Y, U, strict=True):
        rows.append(obs.estimate(memory))
        memory = obs.step(memory, y, dict(zip(drive, u.tolist(), strict=True)))
    X = np.array(rows)
    return Estimate(model, record.time, X, np.array([model.measured(y) for y in Y]) - X @ model.C.T)


def _first(model: ObserverModel, readings: Array) -> Array:
    lumps = [model.system.sensors[name].lump for name in model.sensors]
    known = dict(zip(lumps, model.measured(readings).tolist(), strict=True))
    nearest = model.system.nearest_lumps(lumps)
    mean = float(np.mean(list(known.values())))
    return np.array([known[nearest[name]] if name in nearest else mean for name in model.system.lumps])
