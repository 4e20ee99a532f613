"""Measured records and frequency responses, checked, and the noise in them."""

from ._frequency_data import Complex as Complex
from ._frequency_data import Measured as Measured
from ._frequency_data import ResponseData as ResponseData
from ._frequency_data import as_measured as as_measured
from ._frequency_whitening import ResponseWhitener as ResponseWhitener
from ._frequency_whitening import as_complex as as_complex
from ._frequency_whitening import as_real as as_real
from ._glitches import without_glitches as without_glitches
from ._noise_floor import NoiseFloor as NoiseFloor
from ._noise_floor import noise_floor as noise_floor

__all__ = ["Complex", "Measured", "NoiseFloor", "ResponseData", "ResponseWhitener", "as_complex", "as_measured",
           "as_real", "noise_floor", "without_glitches"]
