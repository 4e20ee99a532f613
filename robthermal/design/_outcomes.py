"""How the design, the simulation or the proof of a loop or an observer may end."""

from __future__ import annotations

from enum import unique

from ..errors import OutcomeCode


@unique
class DesignCode(OutcomeCode):
    """Codes of the outcomes of `robthermal.design`."""

    AS_DECLARED = (True, "The declared wiring fits the data best.")
    CERTIFIED = (True, "Certified: whatever its start in the box, the loop forgets it, with limits active or not.")
    CERTIFIED_SAMPLED_MODEL = (True, "Certified for the sampled model only; of the continuous plant it is proven that "
                               "it stays in the box.")
    COLLAPSED = (True, "No limit was active in the linearized loop.")
    DESIGNED = (True, "A gain was designed; the text says what was computed for it, and what is left to prove.")
    FOUND = (True, "A set of sensors was found whose observer is certified.")
    LIMITED = (False, "A limit of a current was active: the loop is not linear there, or cannot hold its set-point.",
               "rt.design.reachable tells what it can hold with this load.")
    MARGINS = (True, "The linearized loop is stable for every plant that was computed; its margins are known.")
    MOVING = (False, "A cold face still moves towards its set-point.",
              "Simulate longer.")
    NONE = (False, "No set of sensors was certified over the box.",
            "Lower the current, or add sensors at the modules.")
    NOT_CERTIFIED = (False, "Not certified: the reason names what is not shown.",
                     "Lower the limits of the currents or the bandwidth, or narrow ambients and heats.")
    NOT_CONTRACTING = (False, "No gain was found with which the error decays over the box as fast as asked.",
                       "Lower the current, allow more time, or add sensors at the modules.")
    NOT_FOUND = (False, "No state feedback was found for all plants; the gains are those for the nominal one.",
                 "Narrow the range of the plants, or ask for less bandwidth.")
    NOT_HELD = (False, "A plant of the parameter ranges cannot hold the set-points within the limits.",
                "Move the set-points, narrow the ranges, or cool the hot side better.")
    NOT_TUNED = (False, "No bandwidth keeps the margins that were asked for.",
                 "Ask for less margin; the text says what limits the loop.")
    RAN_AWAY = (False, "The simulated machine ran away: a temperature left the sensible range.",
                "Lower the limits of the currents, the load or the bandwidth.")
    REACHABLE = (True, "The set-points can be held.")
    REVERSED = (False, "Reversed polarity fits the data better than the declared one.",
                "Swap the leads, or the sign of the current column, or hot and cold in the system file.")
    SETTLED = (True, "Every cold face stays at its set-point.")
    TUNED = (True, "The largest bandwidth that keeps the margins was found.")
    UNDECIDED = (False, "The wirings fit almost equally badly.",
                 "Step the currents further from rest, or calibrate first.")
    UNREACHABLE = (False, "These set-points cannot be held; the text says which can.",
                   "Choose set-points within it, lower the load, or cool the hot side better.")
    UNSTABLE = (False, "The linearized loop is unstable for a plant of the parameter ranges.",
                "Ask for less bandwidth, or narrow the ranges.")
