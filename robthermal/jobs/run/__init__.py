"""The main job: records, calibrated model, certificates, verdict, report."""

from ._facts import DataFacts as DataFacts
from ._facts import DiagnosisFacts as DiagnosisFacts
from ._facts import data_facts as data_facts
from ._facts import diagnosis_facts as diagnosis_facts
from ._gate import applied as applied
from ._gate import claim_reasons as claim_reasons
from ._gate import data_reasons as data_reasons
from ._job import calibrated as calibrated
from ._job import doubted_claims as doubted_claims
from ._job import job_records as job_records
from ._job import run_job as run_job
from ._label import project_label as project_label
from ._misfit import Misfit as Misfit
from ._result import Calibrated as Calibrated
from ._result import Comparison as Comparison
from ._result import JobResult as JobResult
from ._sections import comparison_section as comparison_section
from ._sections import first_section as first_section
from ._sections import misfit_table as misfit_table
from ._sections import parameter_section as parameter_section
from ._sections import response_sections as response_sections
from ._tables import import_table as import_table
from ._tables import parameter_table as parameter_table
from ._tables import residual_table as residual_table
from ._write import write_job as write_job

__all__ = ["Calibrated", "Comparison", "DataFacts", "DiagnosisFacts", "JobResult", "Misfit", "applied", "calibrated",
           "claim_reasons", "comparison_section", "data_facts", "data_reasons", "diagnosis_facts", "doubted_claims",
           "first_section", "import_table", "job_records", "misfit_table", "parameter_section", "parameter_table",
           "project_label", "residual_table", "response_sections", "run_job", "write_job"]
