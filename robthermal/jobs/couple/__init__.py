"""Couple two controlled subsystems, from a file to certificates and report.

What is needed after the file has been read loads on first use (PEP 562), as in `robthermal.jobs`.
"""

from typing import TYPE_CHECKING

from ..._first_use import names_on_first_use
from ._file import CouplingJob as CouplingJob
from ._file import coupling_from_tables as coupling_from_tables
from ._file import read_coupling as read_coupling

if TYPE_CHECKING:  # what type checkers and editors see of the table below
    from ._couple import Coupling as Coupling
    from ._couple import couple_subsystems as couple_subsystems
    from ._report import coupling_report as coupling_report
    from ._report import save_coupling as save_coupling
    from ._report import write_coupling as write_coupling

_HOME = {  # name: the module it lives in
    **dict.fromkeys(("Coupling", "couple_subsystems"), "_couple"),
    **dict.fromkeys(("coupling_report", "save_coupling", "write_coupling"), "_report"),
}

__all__ = ["Coupling", "CouplingJob", "couple_subsystems", "coupling_from_tables", "coupling_report", "read_coupling",
           "save_coupling", "write_coupling"]

__getattr__ = names_on_first_use(__name__, _HOME)


def __dir__() -> list[str]:
    return __all__
