"""How the making, reduction or steady state of a model may end."""

from __future__ import annotations

from enum import unique

from ..errors import OutcomeCode


@unique
class ThermalCode(OutcomeCode):
    """Codes of the outcomes of `robthermal.thermal`."""

    AGREES = (True, "Vmax and Qmax of the datasheet agree.")
    CLOSED = (True, "The rows close to rounding.")
    DISAGREES = (False, "The two inversions of the datasheet differ by more than 10 %.",
                 "Check t_hot and the gas of the rating, then measure one of them, or let calibration decide between "
                 "both sets.")
    FOUND = (True, "There are steady states; the text says how many of them are stable.")
    HELD = (True, "The module holds the load at these temperatures.")
    NONE = (False, "There is no steady state.",
            "Raise the set-point, lower the load or the currents, or cool the hot side better.")
    NOT_HELD = (False, "The module cannot hold the load at these temperatures.",
                "Lower the load or the temperature difference, take a better heat sink, a larger module or several.")
    NOT_REDUCIBLE = (False, "No smaller model meets the tolerance: every state matters.",
                     "Accept a larger error or keep the full model.")
    REDUCED = (True, "The model was reduced; the error of the smaller one is stated.")
    ROUNDED = (True, "Small row sums of the imported matrix were taken as rounding and removed.")
    UNCHECKED = (True, "Without Qmax nothing checks the sheet against itself.")
