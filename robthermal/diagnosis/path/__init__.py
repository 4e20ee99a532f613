"""The system linearized along a record, or beside a frequency response, and the filters that whiten residuals."""

from ._along import N_SPLINES as N_SPLINES
from ._along import Along as Along
from ._along import along as along
from ._frequency_model import AlongResponse as AlongResponse
from ._frequency_model import along_response as along_response
from ._linearized import Linearized as Linearized
from ._linearized import Unknowns as Unknowns
from ._linearized import White as White
from ._paths import linearize as linearize
from ._paths import linearized_records as linearized_records
from ._whitening import SlowNoise as SlowNoise
from ._whitening import Whitener as Whitener
from ._whitening import gathered as gathered
from ._whitening import settled_cost as settled_cost
from ._whitening import whitener as whitener

__all__ = ["Along", "AlongResponse", "Linearized", "N_SPLINES", "SlowNoise", "Unknowns", "White", "Whitener", "along",
           "along_response", "gathered", "linearize", "linearized_records", "settled_cost", "whitener"]
