"""Where everything stands in the state of a simulation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ._equations import Equations


@dataclass(frozen=True)
class Layout:
    """State z = [lumps, lagged sensors, lagged drives, memories, periodic loads (sine, cosine), integrals, meters].

    The integrals are those of what thermometers read, where readings are means over a sample. The meters feed nothing
    back. They integrate the heat received from every ambient, the electrical energy of every module, the heat of every
    heater, and that of all other sources, so that the balance of a simulation can be checked.

    Parameters
    ----------
    eq : Equations
        Equations of the system whose states are laid out.
    """

    eq: Equations

    @cached_property
    def sensors(self) -> dict[str, int]:
        """State of every sensor with a lag."""
        lags = [name for name, sensor in self.eq.system.sensors.items() if sensor.time_constant > 0]
        return {name: len(self.eq.system.lumps) + i for i, name in enumerate(lags)}

    @cached_property
    def drives(self) -> dict[int, int]:
        """State of every column of w with a lag."""
        first = len(self.eq.system.lumps) + len(self.sensors)
        lags = [column for column, drive in self.eq.drives.of.items() if drive.time_constant > 0]
        return {column: first + i for i, column in enumerate(lags)}

    @cached_property
    def memories(self) -> dict[str, int]:
        """State of every module with a hysteresis."""
        first = len(self.eq.system.lumps) + len(self.sensors) + len(self.drives)
        return {name: first + i for i, name in enumerate(self.eq.drives.signs)}

    @cached_property
    def periodic(self) -> dict[str, int]:
        """First of the two states, sine and cosine, of every lump with a periodic load."""
        first = len(self.eq.system.lumps) + len(self.sensors) + len(self.drives) + len(self.memories)
        loaded = [name for name, lump in self.eq.system.lumps.items() if lump.periodic is not None]
        return {name: first + 2 * i for i, name in enumerate(loaded)}

    @cached_property
    def sources(self) -> dict[str, int]:
        """State that every thermometer reads: its lag if it has one, else its lump."""
        return {name: self.sensors.get(name, self.eq.index[sensor.lump])
                for name, sensor in self.eq.system.thermometers.items()}

    @cached_property
    def integrals(self) -> dict[int, int]:
        """Of the states that thermometers read to their integrals over time; none where readings are at once."""
        first = self._n_without_integrals
        read = sorted(set(self.sources.values())) if self.eq.averaged else []
        return {source: first + i for i, source in enumerate(read)}

    @cached_property
    def _n_without_integrals(self) -> int:
        return (len(self.eq.system.lumps) + len(self.sensors) + len(self.drives) + len(self.memories)
                + 2 * len(self.periodic))

    @cached_property
    def n_free(self) -> int:
        """Number of states before the meters."""
        return self._n_without_integrals + len(self.integrals)

    @property
    def ambient_meters(self) -> slice:
        """Heat received from every ambient [J]."""
        return slice(self.n_free, self.n_free + len(self.eq.system.ambients))

    @property
    def module_meters(self) -> slice:
        """Electrical energy taken up by every module [J]."""
        first = self.ambient_meters.stop
        return slice(first, first + len(self.eq.system.modules))

    @property
    def heater_meters(self) -> slice:
        """Heat of every heater [J]."""
        first = self.module_meters.stop
        return slice(first, first + len(self.eq.system.inputs))

    @property
    def source_meter(self) -> int:
        """Heat of all other sources [J]."""
        return self.heater_meters.stop

    @property
    def size(self) -> int:
        """Number of states."""
        return self.source_meter + 1


def lagged(eq: Equations) -> list[str]:
    """Sensors with a lag: each has a state of its own."""
    return list(Layout(eq).sensors)
