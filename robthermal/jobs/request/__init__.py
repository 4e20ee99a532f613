"""What is asked of a job: project files and values of the command line.

What needs a calibration's results loads on first use (PEP 562), as in `robthermal.jobs`.
"""

from typing import TYPE_CHECKING

from ..._first_use import names_on_first_use
from ._schema import Boxes as Boxes
from ._schema import Gate as Gate
from ._schema import Method as Method
from ._schema import Project as Project
from ._schema import in_kelvin as in_kelvin
from ._schema import read_project as read_project
from ._stage_tables import CoupleTable as CoupleTable
from ._stage_tables import DesignTable as DesignTable
from ._stage_tables import Identification as Identification
from ._toml import Number as Number
from ._toml import Table as Table
from ._toml import read_text as read_text
from ._toml import read_toml as read_toml
from ._toml import refusal as refusal

if TYPE_CHECKING:  # what type checkers and editors see of the table below
    from ._arguments import boxes_from_text as boxes_from_text
    from ._arguments import gate_from_text as gate_from_text
    from ._arguments import point_from_text as point_from_text
    from ._arguments import ranges_from_text as ranges_from_text
    from ._calibrated import read_calibrated as read_calibrated
    from ._calibrated import write_calibrated as write_calibrated

_HOME = {  # name: the module it lives in
    **dict.fromkeys(("boxes_from_text", "gate_from_text", "point_from_text", "ranges_from_text"), "_arguments"),
    **dict.fromkeys(("read_calibrated", "write_calibrated"), "_calibrated"),
}

__all__ = ["Boxes", "CoupleTable", "DesignTable", "Gate", "Identification", "Method", "Number", "Project", "Table",
           "boxes_from_text", "gate_from_text", "in_kelvin", "point_from_text", "ranges_from_text", "read_calibrated",
           "read_project", "read_text", "read_toml", "refusal", "write_calibrated"]

__getattr__ = names_on_first_use(__name__, _HOME)


def __dir__() -> list[str]:
    return __all__
