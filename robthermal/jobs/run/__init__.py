"""The main job: records, calibrated model, certificates, verdict, report."""

from ._job import run_job as run_job
from ._misfit import Misfit as Misfit
from ._result import Comparison as Comparison
from ._result import JobResult as JobResult
from ._write import write_job as write_job

__all__ = ["Comparison", "JobResult", "Misfit", "run_job", "write_job"]
