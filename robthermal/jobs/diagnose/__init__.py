"""Diagnose records, and write what was found."""

from ._diagnose import Diagnosed as Diagnosed
from ._diagnose import Residuals as Residuals
from ._diagnose import ResponseResiduals as ResponseResiduals
from ._diagnose import diagnose_records as diagnose_records
from ._report import write_diagnosis as write_diagnosis

__all__ = ["Diagnosed", "Residuals", "ResponseResiduals", "diagnose_records", "write_diagnosis"]
