"""The system linearized along a record, or beside a frequency response, and the filters that whiten residuals."""

from ._averaged import AveragedRecord as AveragedRecord
from ._averaged import averaged_record as averaged_record
from ._coarseness import coarse_names as coarse_names
from ._heat_splines import N_SPLINES as N_SPLINES
from ._heat_splines import heat_splines as heat_splines
from ._late_means import LATE_MEANS as LATE_MEANS
from ._linearize import linearize as linearize
from ._linearize import linearized_record as linearized_record
from ._linearize import linearized_records as linearized_records
from ._linearized import Linearized as Linearized
from ._linearized import Unknowns as Unknowns
from ._linearized import White as White
from ._linearized_record import LinearizedRecord as LinearizedRecord
from ._linearized_response import LinearizedResponse as LinearizedResponse
from ._linearized_response import linearized_response as linearized_response
from ._random_ambients import RandomAmbients as RandomAmbients
from ._riccati import settled as settled
from ._whitening import SlowNoise as SlowNoise
from ._whitening import Whitener as Whitener
from ._whitening import gathered as gathered
from ._whitening import heat_spread as heat_spread
from ._whitening import settled_cost as settled_cost
from ._whitening import whitener as whitener

__all__ = ["AveragedRecord", "LATE_MEANS", "Linearized", "LinearizedRecord", "LinearizedResponse", "N_SPLINES",
           "SlowNoise", "Unknowns", "RandomAmbients", "White", "Whitener", "averaged_record", "coarse_names",
           "gathered", "heat_splines", "heat_spread", "linearize", "linearized_record", "linearized_records",
           "linearized_response", "settled", "settled_cost", "whitener"]
