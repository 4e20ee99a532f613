"""The thermal system a user describes: validated, immutable, kelvin inside."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import ValidationError

from .._html import short_table
from ..errors import InputError
from ._draw_network import draw_network
from ._equations import Equations
from ._network import check_network
from ._parameters import parameters, present_effects, read_parameter, replace_parameters
from ._parts import Ambient, FitRange, Flow, Input, Lead, Link, Lump, Module, Name, Part, Sensor
from ._refusals import refusal


class System(Part):
    """A lumped thermal system: E ẋ = f(x, u), temperatures in kelvin.

    Build one from Python with keyword arguments (kelvin), or read it with `read_system`.

    Parameters
    ----------
    name : str
        Name of the system, as reports show it.
    ambients, lumps, inputs, modules, sensors : mapping
        Name to part; plain dictionaries are accepted.
    links : sequence of Link
        Heat paths between lumps, or to ambients.
    leads : sequence of Lead
        Heat of the modules' leads and contacts.
    flows : sequence of Flow
        Heat that a coolant carries from one lump to another.
    fit : mapping
        Parameter name to `FitRange`.
    temperature_unit : {"K", "degC"}
        Unit of the temperatures in the files of this system and in its records; inside, all is kelvin.
    record, columns : mapping
        How measured files of this machine are read, as in `rt.read_records`: keys of [record], and name to header.

    Raises
    ------
    InputError
        What, where, what was expected, what to do.

    Examples
    --------
    >>> import robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 298.15}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}])
    >>> bar.parameter("links.bar-room.conductance")
    0.5
    """

    name: str = "thermal system"
    temperature_unit: Literal["K", "degC"] = "K"
    ambients: dict[Name, Ambient]
    lumps: dict[Name, Lump]
    links: tuple[Link, ...] = ()
    inputs: dict[Name, Input] = {}
    modules: dict[Name, Module] = {}
    leads: tuple[Lead, ...] = ()
    flows: tuple[Flow, ...] = ()
    sensors: dict[Name, Sensor] = {}
    fit: dict[str, FitRange] = {}
    record: dict[str, Any] = {}
    columns: dict[str, Any] = {}

    def __init__(self, **data: Any):
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise refusal(error) from None
        check_network(self)

    def __repr__(self) -> str:
        tables = ("lumps", "links", "modules", "leads", "flows", "inputs", "sensors")
        counts = {table: len(getattr(self, table)) for table in tables}
        return f"<System {self.name!r}: {', '.join(f'{n} {table}' for table, n in counts.items() if n)}>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        tables = ("lumps", "links", "modules", "leads", "flows", "ambients", "inputs", "sensors")
        parts = {name: getattr(self, name) for name in tables}
        names = {name: ["-".join(one.between) for one in found] if name == "links" else list(map(str, found))
                 for name, found in parts.items()}
        rows = [(f"{len(found)} {name}", ", ".join(found)) for name, found in names.items() if found]
        return short_table(f"System {self.name}", rows)

    @property
    def lump_names(self) -> tuple[str, ...]:
        """Lumps in file order: the states."""
        return tuple(self.lumps)

    @property
    def input_names(self) -> tuple[str, ...]:
        """Heaters in file order."""
        return tuple(self.inputs)

    @property
    def module_names(self) -> tuple[str, ...]:
        """Modules in file order."""
        return tuple(self.modules)

    @property
    def ambient_names(self) -> tuple[str, ...]:
        """Ambients in file order."""
        return tuple(self.ambients)

    @property
    def sensor_names(self) -> tuple[str, ...]:
        """Sensors in file order."""
        return tuple(self.sensors)

    @property
    def thermometers(self) -> dict[str, Sensor]:
        """Sensors that measure the temperature of a lump, in file order."""
        return {name: sensor for name, sensor in self.sensors.items() if sensor.quantity == "temperature"}

    def thermometer(self, name: str, where: str) -> Sensor:
        """Sensor by name, refusing one that measures no temperature.

        Parameters
        ----------
        name : str
            Name of the sensor.
        where : str
            Argument that named it, for messages.

        Returns
        -------
        Sensor

        Raises
        ------
        InputError
            There is no such sensor, or it reads the voltage of a module.
        """
        if name not in self.sensors:
            raise InputError(f"there is no sensor {name!r}", where=where,
                             expected="some of " + (", ".join(self.thermometers) or "none: the system has no sensors"))
        sensor = self.sensors[name]
        if sensor.quantity != "temperature":
            raise InputError(f"sensor {name!r} reads the voltage of module {sensor.module!r}, not a temperature",
                             where=where,
                             expected="some of " + (", ".join(self.thermometers) or "none: there is no thermometer"),
                             remedy="Leave it out here: voltages serve simulation, calibration and diagnosis.")
        return sensor

    def prompt_thermometer(self, name: str, where: str) -> Sensor:
        """Sensor by name, refusing one that does not read the temperature of its lump at once, as observers need it.

        Parameters
        ----------
        name : str
            Name of the sensor.
        where : str
            Argument that named it, for messages.

        Returns
        -------
        Sensor

        Raises
        ------
        InputError
            There is no such sensor, it reads the voltage of a module, or it lags.
        """
        sensor = self.thermometer(name, where)
        if sensor.lag:
            raise InputError(f"sensor {name!r} lags ({sensor.lag})", where=where,
                             expected="sensors that read their lump at once, without time constant and delay",
                             remedy="Describe its mass as a lump, linked to the lump it measures, or leave it out.")
        return sensor

    @property
    def cascade(self) -> str:
        """Which module cools the hot face of which other, in words; empty where the modules stand side by side."""
        above = {module.hot: name for name, module in self.modules.items()}
        return next((f"module {name!r} cools the hot face {module.cold!r} of module {above[module.cold]!r}"
                     for name, module in self.modules.items() if module.cold in above), "")

    @property
    def sensor_units(self) -> dict[str, str]:
        """Unit of every sensor's reading inside a record: "K", or "V" for the voltage of a module."""
        return {name: sensor.unit for name, sensor in self.sensors.items()}

    @property
    def exogenous_names(self) -> tuple[str, ...]:
        """Everything that drives the system, in the order of `u`: heaters, module currents, ambients."""
        return self.input_names + self.module_names + self.ambient_names

    @property
    def current_limits(self) -> dict[str, tuple[float, float] | None]:
        """Declared current range of each module [A]."""
        return {name: module.current_limits for name, module in self.modules.items()}

    @property
    def input_limits(self) -> dict[str, tuple[float, float] | None]:
        """Declared range of each heater column [unit]."""
        return {name: heater.limits for name, heater in self.inputs.items()}

    @property
    def input_units(self) -> dict[str, str | None]:
        """Declared unit of each heater column."""
        return {name: heater.unit for name, heater in self.inputs.items()}

    @property
    def input_gains(self) -> dict[str, float]:
        """Heat of each heater per unit of its column [W/unit]."""
        return {name: heater.gain for name, heater in self.inputs.items()}

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Every number of the system that has a name, for example ``modules.m1.seebeck.slope``."""
        return tuple(self.parameters)

    @property
    def parameters(self) -> dict[str, float]:
        """Every number of the system that has a name, with its value, temperatures in kelvin."""
        return dict(parameters(self))

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the numbers, not zero, of effects beyond the plain network, for example ``modules.m1.thomson``."""
        return tuple(present_effects(self))

    def parameter(self, name: str) -> float:
        """Value of one named parameter, temperatures in kelvin.

        Parameters
        ----------
        name : str
            For example ``links.x1-x3.conductance``.

        Returns
        -------
        float

        Raises
        ------
        InputError
            If the system has no such parameter.
        """
        return read_parameter(self, name)

    def with_parameters(self, values: Mapping[str, float]) -> System:
        """Return a copy with some parameters replaced.

        Parameters
        ----------
        values : mapping of str to float
            Parameter name to new value, temperatures in kelvin.

        Returns
        -------
        System

        Raises
        ------
        InputError
            Unknown name, or a value the part refuses (a negative capacity).
        """
        return replace_parameters(self, values)

    def poles(self) -> NDArray[np.float64]:
        """Poles at rest (heaters and currents off, everything at its initial temperature), slowest first.

        Returns
        -------
        ndarray, shape (n_lumps,)
            [rad/s], real and negative: conduction is symmetric.
        """
        eq = Equations(self)
        J = eq.jacobian(eq.initial(), eq.nominal()).toarray()
        return np.sort(scipy.linalg.eigvals(J / eq.capacity[:, None]).real)[::-1]

    def nearest_lumps(self, sources: Iterable[str]) -> dict[str, str]:
        """For every lump, the source lump with the least thermal resistance to it.

        Parameters
        ----------
        sources : iterable of str
            Lumps, for example those with a sensor.

        Returns
        -------
        dict
            Lump to nearest source; a lump that no source reaches is left out.
        """
        index = {name: i for i, name in enumerate(self.lumps)}
        names, targets = list(self.lumps), [index[name] for name in sources]
        if not targets:
            return {}
        edges = [(index[a], index[b], 1.0 / max(g, 1e-12)) for a, b, g in conducting_paths(self)
                 if a in index and b in index]
        rows, columns, weights = zip(*edges, strict=True) if edges else ((), (), ())
        graph = scipy.sparse.csr_array((np.array(weights, float), (rows, columns)), shape=(len(names), len(names)))
        _, _, origin = scipy.sparse.csgraph.dijkstra(graph, directed=False, indices=targets, min_only=True,
                                                     return_predecessors=True)
        return {names[i]: names[o] for i, o in enumerate(origin) if o >= 0}

    def plot(self, ax: Any = None) -> Any:
        """Draw the network: lumps, ambients, heat paths, modules, sensors and heaters; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones of a size that holds every name.

        Raises
        ------
        InputError
            For more than 300 lumps and ambients.
        """
        return draw_network(self, ax)


def conducting_paths(system: System) -> list[tuple[str, str, float]]:
    """Both ends of every link and module, and its conductance near 300 K and a difference of 1 K [W/K]."""
    links = [(*link.between, link.conductance + (link.natural.gain if link.natural else 0.0)
              + 4 * (link.radiation or 0.0) * 300.0**3) for link in system.links]
    return links + [(m.hot, m.cold, m.conductance.value) for m in system.modules.values()]


def equations(system: System) -> Equations:
    """Equations of a system, refusing what is not one."""
    if not isinstance(system, System):
        raise InputError(f"system is a {type(system).__name__}", where="argument system",
                         expected="a robthermal.System", remedy="Read one with rt.read_system(path).")
    return Equations(system)


def build(data: Mapping[str, Any], where: str) -> System:
    """Build a system, naming `where` it came from in every refusal."""
    try:
        return System(**data)
    except InputError as error:
        raise InputError(error.what, where=f"{where} {error.where}".strip(), expected=error.expected,
                         remedy=error.remedy) from None
