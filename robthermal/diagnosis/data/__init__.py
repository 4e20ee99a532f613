"""Measured records and frequency responses, checked, and the noise in them."""

from ...fitting import Measured as Measured
from ._commands import commands as commands
from ._commands import moves as moves
from ._dataset import DataSet as DataSet
from ._frequency_data import Complex as Complex
from ._frequency_data import ResponseData as ResponseData
from ._measured import as_measured as as_measured
from ._measured import records_of as records_of
from ._measured import refuse_long as refuse_long
from ._measured import responses_of as responses_of
from ._measured import with_recorded_units as with_recorded_units
from ._measured import without_outliers as without_outliers
from ._noise_estimate import SHORTEST as SHORTEST
from ._noise_estimate import NoiseEstimate as NoiseEstimate
from ._noise_estimate import noise_floor as noise_floor
from ._record_data import RecordData as RecordData
from ._remarks import refuse_constant as refuse_constant
from ._warmest_room import warmest_rooms as warmest_rooms

__all__ = ["SHORTEST", "Complex", "DataSet", "Measured", "NoiseEstimate", "RecordData", "ResponseData", "as_measured",
           "commands", "moves", "noise_floor", "records_of", "refuse_constant", "refuse_long", "responses_of",
           "warmest_rooms", "with_recorded_units", "without_outliers"]
