"""One sample at a time: the plant of a closed loop."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from .._checks import positive_number
from ..errors import Diverged, InputError
from ._checks import by_lump, kelvin
from ._drive import settle
from ._equations import Equations
from ._exponential import Integrator
from ._parts import Input
from ._schedule import one_sample
from ._sensors import read_sensors
from ._simulate import is_small
from ._steady import exogenous_point
from ._system import System, equations
from ._terms import Array


class Stepper:
    """A nonlinear system, simulated one sample at a time with held inputs.

    Parameters
    ----------
    system : System
        What to simulate.
    sample_time : float
        Time between two samples [s].
    initial : array_like or mapping of lump to float, optional
        Temperatures at the start [K]; default the system's initial ones.
    loads : iterable of str, optional
        Lumps that get an extra heat load [W].
    tolerance : float, optional
        Accepted truncation of the heats per step, as a temperature [K].

    Attributes
    ----------
    state : ndarray
        Lump temperatures [K], then those of lagged sensors [K], then energy meters [J].
    time : float
        Time reached by the simulation [s].

    Raises
    ------
    InputError
        A network too large for the dense method, a sensor with a pure delay when its reading is asked, Celsius.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 300.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}})
    >>> plant = rt.thermal.Stepper(bar, 10.0)
    >>> bool(np.allclose(plant.step({"heater": 1.0}), 300 + 2 * (1 - np.exp(-10.0 * 0.5 / 100))))
    True
    """

    def __init__(self, system: System, sample_time: float, *, initial: ArrayLike | Mapping[str, float] | None = None,
                 loads: Iterable[str] = (), tolerance: float = 1e-4):
        self.system, self.loads = system, tuple(loads)
        for lump in self.loads:
            if lump not in system.lumps:
                raise InputError(f"there is no lump {lump!r}", where="argument loads",
                                 expected="some of " + ", ".join(system.lumps))
        extra = {f"load on {lump}": Input(lump=lump) for lump in self.loads}
        self._eq = equations(system.model_copy(update={"inputs": {**system.inputs, **extra}}))
        if not is_small(self._eq):
            raise InputError(f"a network of {len(system.lumps)} lumps", where="argument system",
                             expected="a few hundred at most", remedy="Reduce the model first (rt.thermal.reduce).")
        self.sample_time = positive_number(sample_time, "sample_time", "s")
        for name in system.effects:
            if name.endswith(("drive.delay", "step.relative")):
                raise InputError(f"{name} when stepping", where="argument system",
                                 expected="no delayed input and no conductance step",
                                 remedy="Simulate a whole record (rt.thermal.simulate), or leave the effect out.")
        self._integrator = Integrator(self._eq, (self.sample_time,), tolerance)
        start = _start(self._eq, initial)
        self.state = np.zeros(self._integrator.nz)
        self.state[:len(start)] = start
        self._w = self._eq.drives(self._eq.nominal())
        settle(self._eq, self._integrator.layout, self.state, self._w, 0.0)
        self.time = 0.0

    @property
    def lumps(self) -> Array:
        """Lump temperatures now [K]."""
        return self.state[:len(self.system.lumps)].copy()

    @property
    def readings(self) -> Array:
        """Noise-free readings of all sensors now [K, or V]; see `undelayed`."""
        for name, sensor in self.system.sensors.items():
            if sensor.delay:
                raise InputError(f"sensor {name!r} has a delay of {sensor.delay:g} s", where="argument system",
                                 expected="sensors without pure delay when stepping",
                                 remedy="Describe it by a time constant.")
        return self.undelayed

    @property
    def undelayed(self) -> Array:
        """Noise-free readings of all sensors now, as if none had a pure delay [K]; voltages at the currents of the
        last step [V]."""
        return read_sensors(self._eq, self.state[None], None, (self._w[None], self._w[None]), self.sample_time)[0]

    def step(self, inputs: Mapping[str, float] | None = None, load: Mapping[str, float] | None = None) -> Array:
        """Advance one sample.

        Parameters
        ----------
        inputs : mapping, optional
            Heaters [unit], module currents [A] and ambients [K] by name, held; default off and nominal.
        load : mapping of lump to float, optional
            Heat into the lumps named at construction [W]; default 0.

        Returns
        -------
        ndarray, shape (n_lumps,)
            Temperatures at the end of the sample [K].

        Raises
        ------
        Diverged
            When the temperatures leave every sensible range.
        """
        for lump in load or {}:
            if lump not in self.loads:
                raise InputError(f"lump {lump!r} was not named in loads", where="argument load",
                                 expected="some of " + (", ".join(self.loads) or "none"))
        named = {f"load on {lump}": heat for lump, heat in (load or {}).items()}
        u = exogenous_point(self._eq, {**(inputs or {}), **named})
        try:
            self.state = self._integrator.run(self.state, one_sample(self._eq, u, self.sample_time)).z[-1]
        except Diverged as error:  # its clock starts anew at every step
            why = str(error).partition(": ")[2]
            raise Diverged(f"the simulation runs away at {self.time:.6g} s: {why}", time=self.time) from None
        self.time += self.sample_time
        self._w = self._eq.drives(u)
        return self.lumps


def _start(eq: Equations, initial: ArrayLike | Mapping[str, float] | None) -> Array:
    if initial is None:
        return eq.initial()
    if isinstance(initial, Mapping):
        initial = by_lump(initial, eq.system.lump_names, "initial")
    x = np.asarray(initial, float)
    if x.shape != eq.capacity.shape:
        raise InputError(f"initial has shape {x.shape}", where="argument initial",
                         expected=f"{eq.capacity.size} temperatures [K], one per lump")
    return np.array([kelvin(value, f"argument initial, lump {name!r}")
                     for name, value in zip(eq.system.lump_names, x, strict=True)])
