"""Parameters of a thermal system from measured records, with what the data do and do not determine."""

from ._calibrate import calibrate as calibrate
from ._fit import Fit as Fit
from ._score import Score as Score
from ._whiteness import Whiteness as Whiteness

__all__ = ["Fit", "Score", "Whiteness", "calibrate"]
