"""The former name of `robthermal.jobs`, kept for one version: its names are now there and in the packages inside."""

from .jobs.certify import certify_system as certify_system
from .jobs.certify import write_certify as write_certify
from .jobs.claims import Certification as Certification
from .jobs.claims import Checked as Checked
from .jobs.claims import GateCode as GateCode
from .jobs.couple import Coupling as Coupling
from .jobs.couple import CouplingJob as CouplingJob
from .jobs.couple import couple_subsystems as couple_subsystems
from .jobs.couple import read_coupling as read_coupling
from .jobs.couple import write_coupling as write_coupling
from .jobs.design import ControllerDesign as ControllerDesign
from .jobs.design import DesignRequest as DesignRequest
from .jobs.design import design_from_text as design_from_text
from .jobs.design import design_system as design_system
from .jobs.design import write_design as write_design
from .jobs.diagnose import Diagnosed as Diagnosed
from .jobs.diagnose import Residuals as Residuals
from .jobs.diagnose import ResponseResiduals as ResponseResiduals
from .jobs.diagnose import diagnose_records as diagnose_records
from .jobs.diagnose import write_diagnosis as write_diagnosis
from .jobs.explanations import Explanation as Explanation
from .jobs.explanations import explain as explain
from .jobs.explanations import explainable as explainable
from .jobs.folder import check_free as check_free
from .jobs.folder import output_folder as output_folder
from .jobs.map import MapRequest as MapRequest
from .jobs.map import map_from_text as map_from_text
from .jobs.map import map_system as map_system
from .jobs.map import write_map as write_map
from .jobs.measured import calibrate_files as calibrate_files
from .jobs.measured import design_excitation as design_excitation
from .jobs.measured import estimate_response as estimate_response
from .jobs.measured import import_reports as import_reports
from .jobs.measured import read_files as read_files
from .jobs.measured import read_measured as read_measured
from .jobs.measured import reading_from_text as reading_from_text
from .jobs.measured import write_excitation as write_excitation
from .jobs.rebuild import rebuild_report as rebuild_report
from .jobs.request import Boxes as Boxes
from .jobs.request import Gate as Gate
from .jobs.request import Project as Project
from .jobs.request import boxes_from_text as boxes_from_text
from .jobs.request import point_from_text as point_from_text
from .jobs.request import read_project as read_project
from .jobs.run import Comparison as Comparison
from .jobs.run import JobResult as JobResult
from .jobs.run import Misfit as Misfit
from .jobs.run import run_job as run_job
from .jobs.run import write_job as write_job
from .jobs.starter import demo_project as demo_project
from .jobs.starter import new_project as new_project
from .jobs.verify import FileCheck as FileCheck
from .jobs.verify import SecondVerdict as SecondVerdict
from .jobs.verify import certificate_files as certificate_files
from .jobs.verify import second_verdicts as second_verdicts
from .jobs.verify import verify_files as verify_files
from .jobs.verify import write_checks as write_checks

__all__ = ["Boxes", "Certification", "Checked", "Comparison", "ControllerDesign", "Coupling", "CouplingJob",
           "DesignRequest", "Diagnosed", "Explanation", "FileCheck", "Gate", "GateCode", "JobResult", "MapRequest",
           "Misfit", "Project", "Residuals", "ResponseResiduals", "SecondVerdict", "boxes_from_text", "calibrate_files",
           "certificate_files", "certify_system", "check_free", "couple_subsystems", "demo_project",
           "design_excitation", "design_from_text", "design_system", "diagnose_records", "estimate_response", "explain",
           "explainable", "import_reports", "map_from_text", "map_system", "new_project", "output_folder",
           "point_from_text", "read_coupling", "read_files", "read_measured", "read_project", "reading_from_text",
           "rebuild_report", "run_job", "second_verdicts", "verify_files", "write_certify", "write_checks",
           "write_coupling", "write_design", "write_diagnosis", "write_excitation", "write_job", "write_map"]
