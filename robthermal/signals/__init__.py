"""Records of measured or simulated signals: build, read, inspect, save; and excitation signals."""

from ._glitches import find_glitches as find_glitches
from ._glitches import median_filter as median_filter
from ._multisine import multisine as multisine
from ._read import read_record as read_record
from ._record import Record as Record
from ._staircase import staircase as staircase

__all__ = ["Record", "find_glitches", "median_filter", "multisine", "read_record", "staircase"]
