"""How the design of an excitation, or its check, may end."""

from __future__ import annotations

from enum import unique

from ..errors import OutcomeCode


@unique
class SignalsCode(OutcomeCode):
    """Codes of the outcomes of `robthermal.signals`."""

    DESIGNED = (True, "The excitation has the crest factors that the text states.")
    NOT_LOWER = (False, "The search for low crest factors found none below those of Schroeder phases.",
                 "Try another seed, or more lines.")
    RESOLVED = (True, "All excited lines are resolved.")
    UNDETERMINED = (False, "The excitation does not determine the response of every input at some lines.",
                    "Increase half_width, excite more lines, use fewer periods per record, or one experiment per input "
                    "(orthogonal multisines).")
    UNRESOLVED = (False, "At some excited lines a slow time constant leaves an error above the tolerance.",
                  "Estimate these lines with prescribed poles (lrmp), or leave them out.")
