"""Records of measured or simulated signals: build, read, inspect, save; excitation signals and their design check."""

from ._crest import crest_factor as crest_factor
from ._design_check import design_check as design_check
from ._design_result import DesignCheck as DesignCheck
from ._excitation import multisines as multisines
from ._excitation_noise import noise as noise
from ._excitation_noise import prbs as prbs
from ._excitation_set import Excitation as Excitation
from ._glitches import find_glitches as find_glitches
from ._glitches import median_filter as median_filter
from ._multisine import multisine as multisine
from ._read import read_record as read_record
from ._record import Record as Record
from ._staircase import staircase as staircase
from ._units import celsius_to_kelvin as celsius_to_kelvin
from ._units import kelvin_to_celsius as kelvin_to_celsius

__all__ = [
    "DesignCheck",
    "Excitation",
    "Record",
    "celsius_to_kelvin",
    "crest_factor",
    "design_check",
    "find_glitches",
    "kelvin_to_celsius",
    "median_filter",
    "multisine",
    "multisines",
    "noise",
    "prbs",
    "read_record",
    "staircase",
]
