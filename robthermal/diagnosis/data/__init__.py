"""Measured records and frequency responses, checked, and the noise in them."""

from ._dataset import DataSet as DataSet
from ._frequency_data import Complex as Complex
from ._frequency_data import ResponseData as ResponseData
from ._frequency_whitening import ResponseWhitener as ResponseWhitener
from ._frequency_whitening import as_complex as as_complex
from ._frequency_whitening import as_real as as_real
from ._measured import Measured as Measured
from ._measured import as_measured as as_measured
from ._measured import records_of as records_of
from ._measured import responses_of as responses_of
from ._measured import without_outliers as without_outliers
from ._noise_estimate import NoiseEstimate as NoiseEstimate
from ._noise_estimate import noise_floor as noise_floor
from ._record_data import RecordData as RecordData

__all__ = ["Complex", "DataSet", "Measured", "NoiseEstimate", "RecordData", "ResponseData", "ResponseWhitener",
           "as_complex", "as_measured", "as_real", "noise_floor", "records_of", "responses_of", "without_outliers"]
