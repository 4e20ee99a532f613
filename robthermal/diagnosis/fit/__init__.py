"""Unknowns of a fit, least squares, noise levels, and the fitted structure."""

from ._descent import Point as Point
from ._descent import descend as descend
from ._levels import LARGEST_FACTOR as LARGEST_FACTOR
from ._levels import WIDE as WIDE
from ._levels import Levels as Levels
from ._levels import with_slow_part as with_slow_part
from ._refit import Refit as Refit
from ._refitting import ENOUGH as ENOUGH
from ._refitting import LIMIT as LIMIT
from ._refitting import extended as extended
from ._refitting import filters as filters
from ._refitting import fitted as fitted
from ._refitting import refit as refit
from ._refitting import relinearised as relinearised
from ._sessions import SessionGain as SessionGain
from ._structure import Structure as Structure
from ._whitened import Whitened as Whitened

__all__ = ["ENOUGH", "LARGEST_FACTOR", "LIMIT", "Levels", "Point", "Refit", "SessionGain", "Structure", "WIDE",
           "Whitened", "descend", "extended", "filters", "fitted", "refit", "relinearised", "with_slow_part"]
