"""How a run over many cases may end."""

from __future__ import annotations

from enum import unique

from ..errors import OutcomeCode


@unique
class FleetCode(OutcomeCode):
    """Codes of the outcomes of `robthermal._fleet`."""

    DONE = (True, "All cases are done.")
    FAILED = (False, "Some cases failed; the results of the others are there.",
              "Look at `errors`, mend these cases, and run again.")
