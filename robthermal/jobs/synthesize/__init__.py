"""Synthesize a controller for a plant in a file: from matrices or a frequency response to certificates and report.

All but the names of the methods loads on first use (PEP 562), as in `robthermal.jobs`.
"""

from typing import TYPE_CHECKING

from ..._first_use import names_on_first_use
from ._methods import METHODS as METHODS

if TYPE_CHECKING:  # what type checkers and editors see of the table below
    from ._file import SynthesisJob as SynthesisJob
    from ._file import read_plant_file as read_plant_file
    from ._synthesize import Synthesis as Synthesis
    from ._synthesize import synthesize_plant as synthesize_plant
    from ._write import write_synthesis as write_synthesis

_HOME = {  # name: the module it lives in
    "Synthesis": "_synthesize",
    "SynthesisJob": "_file",
    "read_plant_file": "_file",
    "synthesize_plant": "_synthesize",
    "write_synthesis": "_write",
}

__all__ = ["METHODS", "Synthesis", "SynthesisJob", "read_plant_file", "synthesize_plant", "write_synthesis"]

__getattr__ = names_on_first_use(__name__, _HOME)


def __dir__() -> list[str]:
    return __all__
