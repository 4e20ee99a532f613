"""How the synthesis of a controller may end."""

from __future__ import annotations

from enum import unique

from ..errors import OutcomeCode


@unique
class SynthesisCode(OutcomeCode):
    """Codes of the outcomes of `robthermal.synthesis`."""

    CERTIFIED = (True, "Certified for the numbers of the controller as returned.")
    CERTIFIED_REGION = (True, "Certified for the numbers of the controller as returned, from the starts of a region "
                        "only; from others nothing is claimed.")
    AT_THE_BINS = (True, "Every plant of the confidence circles keeps the margin at the bins of the response; nothing "
                   "is claimed between them.")
    INFEASIBLE = (False, "No controller reaches what was asked for; the text says what is reached.",
                  "Ask for less, or add controls or sensors.")
    NOT_CERTIFIED = (False, "A controller was computed, but what it reaches is not proven.",
                     "Scale the plant, ask for a tolerance of 0.05, or simplify the weights.")
    NOT_FOUND = (False, "No stabilizing controller was found in any precision.",
                 "Scale the plant, and check weights with poles at or near the boundary of stability.")
    STEP = (True, "The controls of one step keep every limit over the horizon.")
    NO_STEP = (False, "From this state no controls keep every limit over the horizon; the text says which is missed.",
               "Start closer, allow more, or predict further.")
