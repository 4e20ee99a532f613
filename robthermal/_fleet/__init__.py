"""One function over many cases: `robthermal.fleet`."""

from ._outcomes import FleetCode as FleetCode
from ._run import FleetRun as FleetRun
from ._run import fleet as fleet

__all__ = ["FleetCode", "FleetRun", "fleet"]
