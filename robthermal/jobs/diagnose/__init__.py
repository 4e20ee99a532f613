"""Diagnose records, and write what was found."""

from ._claims import diagnosis_claims as diagnosis_claims
from ._diagnose import Diagnosed as Diagnosed
from ._diagnose import Residuals as Residuals
from ._diagnose import ResponseResiduals as ResponseResiduals
from ._diagnose import diagnose_records as diagnose_records
from ._report import diagnosis_report as diagnosis_report
from ._report import save_diagnosis as save_diagnosis
from ._report import write_diagnosis as write_diagnosis

__all__ = ["Diagnosed", "Residuals", "ResponseResiduals", "diagnose_records", "diagnosis_claims",
           "diagnosis_report", "save_diagnosis",
           "write_diagnosis"]
