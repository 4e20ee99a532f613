"""Modules from datasheets: sheets read, inverted, compared at an operating point, written as module tables."""

from ._compare import ComparedModule as ComparedModule
from ._compare import ModuleComparison as ModuleComparison
from ._compare import WantedPoint as WantedPoint
from ._compare import checked_basis as checked_basis
from ._compare import compare_modules as compare_modules
from ._compare import wanted_in_celsius as wanted_in_celsius
from ._sheets import read_sheets as read_sheets
from ._write import write_modules as write_modules

__all__ = ["ComparedModule", "ModuleComparison", "WantedPoint", "checked_basis", "compare_modules", "read_sheets",
           "wanted_in_celsius", "write_modules"]
