"""The system linearized along a record, or beside a frequency response, and the filters that whiten residuals."""

from ._along import Along as Along
from ._along import along as along
from ._frequency_model import AlongResponse as AlongResponse
from ._frequency_model import along_response as along_response
from ._frequency_model import hidden_from_response as hidden_from_response
from ._frequency_model import response_slopes as response_slopes
from ._whitening import SlowNoise as SlowNoise
from ._whitening import Whitener as Whitener
from ._whitening import gathered as gathered
from ._whitening import settled_cost as settled_cost
from ._whitening import whitener as whitener

__all__ = ["Along", "AlongResponse", "SlowNoise", "Whitener", "along", "along_response", "gathered",
           "hidden_from_response", "response_slopes", "settled_cost", "whitener"]
