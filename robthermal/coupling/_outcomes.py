"""How a synthesis, an evaluation or a bound of mu may end."""

from __future__ import annotations

from enum import unique

from ..errors import OutcomeCode


@unique
class CouplingCode(OutcomeCode):
    """Codes of the outcomes of `robthermal.coupling`."""

    AXIS = (False, "Not everything that was asked holds for every axis.",
            "See the outcome of that axis.")
    GAP = (True, "Lower and upper bound of mu differ.",
           "Design with the upper bound.")
    INFEASIBLE = (False, "No coupling filter meets the limits.",
                  "Relax the limit, raise order, or ask for less margin. Both filters are zero.")
    LIMIT = (False, "Proven stable, but not within what was asked.",
             "Relax that limit, raise order, or ask for less margin.")
    MET = (True, "Lower and upper bounds meet.")
    NOMINAL = (True, "Proven stable for the model; no uncertainty was given.")
    NOT_PROVEN = (False, "Numbers only: nothing was proven.",
                  "Relax the limits by a percent, or reduce the order of the system and try again.")
    NOT_REDUCED = (None, "No shorter filters lose less than the tolerance and keep what was asked: the filters are as "
                   "they were.",
                   "Raise the tolerance, or keep the order.")
    NOT_ROBUST = (False, "The loop is stable for the model, but not proven stable for every plant under the envelope.",
                  "Make X_hat and Y_hat smaller where robust >= 1 (see worst_frequency), or couple one way only.")
    NOT_STABLE = (False, "Internal stability is not proven.",
                  "Give better scaled or better conditioned models.")
    ROBUST = (True, "Proven stable for every plant under the envelope.")
