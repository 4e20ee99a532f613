"""Records of measured or simulated signals: build, read, inspect, save; excitation signals and their design check."""

from ._crest import crest_factor as crest_factor
from ._design_check import design_check as design_check
from ._design_result import DesignCheck as DesignCheck
from ._excitation import multisines as multisines
from ._excitation_noise import noise as noise
from ._excitation_noise import prbs as prbs
from ._excitation_set import Excitation as Excitation
from ._export import save_records as save_records
from ._glitches import find_glitches as find_glitches
from ._glitches import median_filter as median_filter
from ._means import as_means as as_means
from ._means import block_means as block_means
from ._multisine import multisine as multisine
from ._outcomes import SignalsCode as SignalsCode
from ._record import Record as Record
from ._shift import shift_inputs as shift_inputs
from ._staircase import staircase as staircase
from ._thermistor import Thermistor as Thermistor
from ._units import celsius_to_kelvin as celsius_to_kelvin
from ._units import kelvin_to_celsius as kelvin_to_celsius
from .importing import Declared as Declared
from .importing import Import as Import
from .importing import ImportOptions as ImportOptions
from .importing import declared as declared
from .importing import from_text as options_from_text
from .importing import inspect as inspect_file
from .importing import read_record as read_record
from .importing import read_records as read_records

__all__ = [
    "Declared",
    "DesignCheck",
    "Excitation",
    "Import",
    "ImportOptions",
    "Record",
    "SignalsCode",
    "Thermistor",
    "as_means",
    "block_means",
    "celsius_to_kelvin",
    "crest_factor",
    "declared",
    "design_check",
    "find_glitches",
    "inspect_file",
    "kelvin_to_celsius",
    "median_filter",
    "multisine",
    "multisines",
    "noise",
    "options_from_text",
    "prbs",
    "read_record",
    "read_records",
    "save_records",
    "shift_inputs",
    "staircase",
]
