"""A record as data of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...fitting import Data, Initial, Start, as_data, initial_of, start_values
from ...signals import Record
from ...thermal import System, trajectory
from ..effects import Candidate
from ._glitches import cleaned
from ._warmest_room import warmest_room

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RecordData(Data):
    """One record, the sensors of the system that it holds, and their readings [K]: a `DataSet`."""

    @property
    def certainty(self) -> float:
        """The noise of records is known: 1."""
        return 1.0

    @property
    def n_sessions(self) -> int:
        """A record is a session of its own."""
        return 1

    def model(self, system: System) -> Array:
        """As `DataSet.model`: a free run."""
        return np.asarray(trajectory(system, self.record).readings[:, self.columns], np.float64)

    def initial(self, system: System, start: Start) -> Initial:
        """As `DataSet.initial`."""
        return initial_of(system, self, start)

    def started(self, system: System, start: Initial, temperatures: Array) -> System:
        """As `DataSet.started`."""
        return system.with_parameters(start_values(start, temperatures))

    def hides(self, system: System, candidate: Candidate) -> str:
        """As `DataSet.hides`: a record may show every effect."""
        return ""

    def warmest_room(self, system: System) -> float:
        """As `DataSet.warmest_room`."""
        return warmest_room(system, self)

    def without_outliers(self, system: System, noise: Mapping[str, float]) -> RecordData:
        """As `DataSet.without_outliers`; outliers are interpolated for display."""
        found = cleaned(system, self, np.array([noise[name] for name in self.sensors]))
        return replace(self, record=found.record, readings=found.readings, missing=found.missing)

    def first(self, n: int) -> RecordData:
        """As `DataSet.first`."""
        if len(self.record) <= n:
            return self
        return replace(self, record=self.record[:n], readings=self.readings[:n],
                       missing=None if self.missing is None else self.missing[:n])


def record_data(system: System, records: Sequence[Record], where: str) -> list[RecordData]:
    """Check records, and find the sensors of the system in them.

    Parameters
    ----------
    system : System
        Model whose sensors are looked for.
    records : sequence of Record
        Measured records to check.
    where : str
        Name of the argument, for messages.
    """
    return [RecordData(one.record, one.sensors, one.columns, one.readings, one.missing)
            for one in as_data(system, records, where)]
