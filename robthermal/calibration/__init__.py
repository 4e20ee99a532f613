"""Parameters of a thermal system from measured records, with what the data do and do not determine."""

from ._calibrate import calibrate as calibrate
from ._estimates import Estimates as Estimates
from ._fit import Fit as Fit
from ._response_fit import ResponseFit as ResponseFit
from ._score import Score as Score
from ._whiteness import Whiteness as Whiteness

__all__ = ["Estimates", "Fit", "ResponseFit", "Score", "Whiteness", "calibrate"]
