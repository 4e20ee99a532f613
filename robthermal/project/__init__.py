"""Jobs: a project file in, calibrated model, certificates and report out."""

from ._arguments import boxes_from_text as boxes_from_text
from ._arguments import certificate_files as certificate_files
from ._claims import Certification as Certification
from ._claims import Checked as Checked
from ._claims import certify_system as certify_system
from ._demo import demo_project as demo_project
from ._folder import check_free as check_free
from ._folder import output_folder as output_folder
from ._frequency import design_excitation as design_excitation
from ._frequency import estimate_response as estimate_response
from ._frequency import write_excitation as write_excitation
from ._job import Comparison as Comparison
from ._job import JobResult as JobResult
from ._job import run_job as run_job
from ._schema import Boxes as Boxes
from ._schema import Project as Project
from ._schema import read_project as read_project
from ._write import write_certify as write_certify
from ._write import write_job as write_job

__all__ = ["Boxes", "Certification", "Checked", "Comparison", "JobResult", "Project", "boxes_from_text",
           "certificate_files", "certify_system", "check_free", "demo_project", "design_excitation",
           "estimate_response", "output_folder", "read_project", "run_job", "write_certify", "write_excitation",
           "write_job"]
