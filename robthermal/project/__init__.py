"""Jobs: a project file in, calibrated model, certificates and report out."""

from ._arguments import boxes_from_text as boxes_from_text
from ._arguments import certificate_files as certificate_files
from ._arguments import point_from_text as point_from_text
from ._check_files import FileCheck as FileCheck
from ._check_files import verify_files as verify_files
from ._check_files import write_checks as write_checks
from ._checked import Certification as Certification
from ._checked import Checked as Checked
from ._claims import certify_system as certify_system
from ._codes import GateCode as GateCode
from ._couple import Coupling as Coupling
from ._couple import couple_subsystems as couple_subsystems
from ._couple_file import CouplingJob as CouplingJob
from ._couple_file import read_coupling as read_coupling
from ._couple_report import write_coupling as write_coupling
from ._demo import demo_project as demo_project
from ._design import ControllerDesign as ControllerDesign
from ._design import design_system as design_system
from ._design_report import write_design as write_design
from ._design_request import DesignRequest as DesignRequest
from ._design_request import design_from_text as design_from_text
from ._diagnose import Diagnosed as Diagnosed
from ._diagnose import Residuals as Residuals
from ._diagnose import ResponseResiduals as ResponseResiduals
from ._diagnose import diagnose_records as diagnose_records
from ._diagnose_report import write_diagnosis as write_diagnosis
from ._explain import Explanation as Explanation
from ._explain import explain as explain
from ._explain import explainable as explainable
from ._folder import check_free as check_free
from ._folder import output_folder as output_folder
from ._frequency import calibrate_files as calibrate_files
from ._frequency import design_excitation as design_excitation
from ._frequency import estimate_response as estimate_response
from ._frequency import read_measured as read_measured
from ._frequency import write_excitation as write_excitation
from ._import import import_reports as import_reports
from ._import import read_files as read_files
from ._import import reading_from_text as reading_from_text
from ._job import run_job as run_job
from ._job_result import Comparison as Comparison
from ._job_result import JobResult as JobResult
from ._map import MapRequest as MapRequest
from ._map import map_from_text as map_from_text
from ._map import map_system as map_system
from ._map import write_map as write_map
from ._misfit import Misfit as Misfit
from ._rebuild import rebuild_report as rebuild_report
from ._schema import Boxes as Boxes
from ._schema import Gate as Gate
from ._schema import Project as Project
from ._schema import read_project as read_project
from ._second import SecondVerdict as SecondVerdict
from ._second import second_verdicts as second_verdicts
from ._starter import new_project as new_project
from ._write import write_certify as write_certify
from ._write import write_job as write_job

__all__ = ["Boxes", "Certification", "Checked", "Comparison", "ControllerDesign", "Coupling", "CouplingJob",
           "DesignRequest", "Diagnosed", "Explanation", "FileCheck", "Gate", "GateCode", "JobResult", "MapRequest",
           "Misfit", "Project", "Residuals", "ResponseResiduals", "SecondVerdict", "boxes_from_text",
           "calibrate_files", "certificate_files", "certify_system", "check_free", "couple_subsystems",
           "demo_project", "design_excitation", "design_from_text", "design_system", "diagnose_records",
           "estimate_response", "explain", "explainable", "import_reports", "map_from_text", "map_system",
           "new_project", "output_folder", "point_from_text", "read_coupling", "read_files", "read_measured",
           "read_project", "reading_from_text", "rebuild_report", "run_job", "second_verdicts", "verify_files",
           "write_certify", "write_checks", "write_coupling", "write_design", "write_diagnosis", "write_excitation",
           "write_job", "write_map"]
