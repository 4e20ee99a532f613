"""Unknowns of a fit, least squares, noise levels, and the fitted structure."""

from ._descent import Point as Point
from ._descent import descend as descend
from ._exchanged import exchanged as exchanged
from ._exchanged import lag_name as lag_name
from ._exchanged import lags_of as lags_of
from ._exchanged import leaves_far_less as leaves_far_less
from ._exchanged import with_exchanged_lags as with_exchanged_lags
from ._noise_scaling import LARGEST_FACTOR as LARGEST_FACTOR
from ._noise_scaling import WIDE as WIDE
from ._noise_scaling import NoiseScaling as NoiseScaling
from ._noise_scaling import with_slow_part as with_slow_part
from ._nominal import refit as refit
from ._refit import Refit as Refit
from ._refitting import ENOUGH as ENOUGH
from ._refitting import LIMIT as LIMIT
from ._refitting import coarsened as coarsened
from ._refitting import exact as exact
from ._refitting import extended as extended
from ._refitting import filters as filters
from ._refitting import fitted as fitted
from ._refitting import only_heated as only_heated
from ._refitting import relinearized as relinearized
from ._sessions import SessionGain as SessionGain
from ._sessions import Sessions as Sessions
from ._sessions import sessions_of as sessions_of
from ._sessions import with_late_means as with_late_means
from ._structure import Structure as Structure
from ._structure import structure_of as structure_of
from ._turned import orthonormal as orthonormal
from ._turned import turned as turned
from ._unknown_ambients import FoundAmbient as FoundAmbient
from ._unknown_ambients import found_ambients as found_ambients
from ._unknown_ambients import too_warm as too_warm
from ._unknown_ambients import with_unknown_ambients as with_unknown_ambients
from ._wandering_ambients import with_random_ambients as with_random_ambients
from ._whitened import Whitened as Whitened

__all__ = ["ENOUGH", "FoundAmbient", "LARGEST_FACTOR", "LIMIT", "NoiseScaling", "Point", "Refit", "SessionGain",
           "Sessions", "Structure", "WIDE", "Whitened", "coarsened", "descend", "exact", "exchanged", "extended",
           "filters", "fitted", "found_ambients", "lag_name", "lags_of", "leaves_far_less", "only_heated",
           "orthonormal", "refit", "relinearized", "sessions_of", "structure_of", "too_warm", "turned",
           "with_exchanged_lags", "with_late_means", "with_random_ambients", "with_slow_part", "with_unknown_ambients"]
