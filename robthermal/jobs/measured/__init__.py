"""Measured files for the commands: records read as asked, frequency responses, excitation.

What estimates or calibrates loads on first use (PEP 562), as in `robthermal.jobs`: commands that only read a record
need none of it.
"""

from typing import TYPE_CHECKING

from ..._first_use import names_on_first_use
from ._import import ReadTable as ReadTable
from ._import import import_reports as import_reports
from ._import import read_files as read_files
from ._import import reading_from_text as reading_from_text
from ._import import single_rows_filled as single_rows_filled

if TYPE_CHECKING:  # what type checkers and editors see of the table below
    from ._calibrate import calibrate_files as calibrate_files
    from ._calibrate import refuse_without_ranges as refuse_without_ranges
    from ._frequency import design_excitation as design_excitation
    from ._frequency import estimate_response as estimate_response
    from ._frequency import write_excitation as write_excitation
    from ._measured import read_measured as read_measured
    from ._reference import import_report_beside as import_report_beside
    from ._reference import instruments_from_text as instruments_from_text
    from ._reference import noise_from_text as noise_from_text

_HOME = {  # name: the module it lives in
    **dict.fromkeys(("design_excitation", "estimate_response", "write_excitation"), "_frequency"),
    **dict.fromkeys(("calibrate_files", "refuse_without_ranges"), "_calibrate"),
    "read_measured": "_measured",
    **dict.fromkeys(("import_report_beside", "instruments_from_text", "noise_from_text"), "_reference"),
}

__all__ = ["ReadTable", "calibrate_files", "design_excitation", "estimate_response", "import_report_beside",
           "import_reports", "instruments_from_text", "noise_from_text", "read_files", "read_measured",
           "reading_from_text", "refuse_without_ranges", "single_rows_filled", "write_excitation"]

__getattr__ = names_on_first_use(__name__, _HOME)


def __dir__() -> list[str]:
    return __all__
