"""Synthesize a controller for a plant in a file: from matrices or a frequency response to certificates and report."""

from ._file import SynthesisJob as SynthesisJob
from ._file import read_plant_file as read_plant_file
from ._synthesize import METHODS as METHODS
from ._synthesize import Synthesis as Synthesis
from ._synthesize import synthesize_plant as synthesize_plant
from ._write import write_synthesis as write_synthesis

__all__ = ["METHODS", "Synthesis", "SynthesisJob", "read_plant_file", "synthesize_plant", "write_synthesis"]
