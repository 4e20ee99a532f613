"""One function over many cases: `robthermal.fleet`."""

from ._run import FleetRun as FleetRun
from ._run import fleet as fleet

__all__ = ["FleetRun", "fleet"]
