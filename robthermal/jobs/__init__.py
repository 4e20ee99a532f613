"""Jobs: a project file in, calibrated model, certificates and report out.

What a user calls. What the commands use beside it, and the classes of the results, are in the packages inside.
"""

from . import measured as measured  # of the commands
from .certify import certify_system as certify_system
from .certify import write_certify as write_certify
from .chain import run_project as run_project
from .couple import couple_subsystems as couple_subsystems
from .couple import read_coupling as read_coupling
from .couple import write_coupling as write_coupling
from .datasheet import compare_modules as compare_modules
from .datasheet import read_sheets as read_sheets
from .datasheet import write_modules as write_modules
from .design import DesignRequest as DesignRequest
from .design import design_system as design_system
from .design import write_design as write_design
from .diagnose import diagnose_records as diagnose_records
from .diagnose import write_diagnosis as write_diagnosis
from .explain import explain as explain
from .explain import explainable as explainable
from .map import MapRequest as MapRequest
from .map import map_system as map_system
from .map import write_map as write_map
from .rebuild import rebuild_report as rebuild_report
from .request import Boxes as Boxes
from .request import read_project as read_project
from .run import run_job as run_job
from .run import write_job as write_job
from .starter import demo_project as demo_project
from .starter import new_project as new_project
from .synthesize import read_plant_file as read_plant_file
from .synthesize import synthesize_plant as synthesize_plant
from .synthesize import write_synthesis as write_synthesis
from .verify import verify_files as verify_files

__all__ = ["Boxes", "DesignRequest", "MapRequest", "certify_system", "compare_modules", "couple_subsystems",
           "demo_project", "design_system", "diagnose_records", "explain", "explainable", "map_system", "new_project",
           "read_coupling", "read_project", "read_sheets", "rebuild_report", "run_job", "run_project", "verify_files",
           "write_certify", "write_coupling", "write_design", "write_diagnosis", "write_job", "write_map",
           "write_modules"]
__all__ += ["read_plant_file", "synthesize_plant", "write_synthesis"]
