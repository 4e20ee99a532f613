"""How a certificate, a limit or a map may end."""

from __future__ import annotations

from enum import unique

from ..errors import OutcomeCode


@unique
class CertifyCode(OutcomeCode):
    """Codes of the outcomes of `robthermal.certify`."""

    CERTIFIED = (True, "Certified. A limit found by contraction is a contraction limit inside the box; not a limit for "
                 "use.")
    FOUND = (True, "The runaway current was found, as the fold of the network and in closed form.")
    MAPPED = (True, "There are conditions that need no more than the usable current.")
    NONE = (False, "No current is usable, or no condition of the map needs as little as the usable current.",
            "Widen the stated box, narrow ambients and heats, or improve the heat sink.")
    NOT_CERTIFIED = (False, "Not certified: the reason names what is not shown.",
                     "Narrow the currents, ambients, heats or temperatures, or improve the heat sink.")
    USABLE = (True, "There is a usable current, the same in every module; the text names what limits it.")
