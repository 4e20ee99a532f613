"""Couple two controlled subsystems, from a file to certificates and report."""

from ._couple import Coupling as Coupling
from ._couple import couple_subsystems as couple_subsystems
from ._file import CouplingJob as CouplingJob
from ._file import coupling_from_tables as coupling_from_tables
from ._file import read_coupling as read_coupling
from ._report import coupling_report as coupling_report
from ._report import save_coupling as save_coupling
from ._report import write_coupling as write_coupling

__all__ = ["Coupling", "CouplingJob", "couple_subsystems", "coupling_from_tables", "coupling_report", "read_coupling",
           "save_coupling", "write_coupling"]
