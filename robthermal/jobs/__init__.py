"""Jobs: a project file in, calibrated model, certificates and report out.

What a user calls. What the commands use beside it, and the classes of the results, are in the packages inside. Names
load their package on first use (PEP 562), as those of `robthermal` do: a command imports what it needs.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # what type checkers and editors see of the two tables below
    from . import certify as certify
    from . import chain as chain
    from . import claims as claims
    from . import couple as couple
    from . import datasheet as datasheet
    from . import design as design
    from . import diagnose as diagnose
    from . import evidence as evidence
    from . import explanations as explanations
    from . import folder as folder
    from . import map as map
    from . import measured as measured
    from . import network as network
    from . import now as now
    from . import provenance as provenance
    from . import rebuild as rebuild
    from . import report_files as report_files
    from . import request as request
    from . import run as run
    from . import starter as starter
    from . import synthesize as synthesize
    from . import verify as verify
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
    from .explanations import explain as explain
    from .explanations import explainable as explainable
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

_PACKAGES = ("certify", "chain", "claims", "couple", "datasheet", "design", "diagnose", "evidence",
             "explanations", "folder", "map", "network", "measured", "now", "provenance", "rebuild", "report_files",
             "request", "run", "starter", "synthesize", "verify")

_HOME = {  # public name: the package inside that it lives in
    "Boxes": "request",
    "DesignRequest": "design",
    "MapRequest": "map",
    "certify_system": "certify",
    "compare_modules": "datasheet",
    "couple_subsystems": "couple",
    "demo_project": "starter",
    "design_system": "design",
    "diagnose_records": "diagnose",
    "explain": "explanations",
    "explainable": "explanations",
    "map_system": "map",
    "new_project": "starter",
    "read_coupling": "couple",
    "read_plant_file": "synthesize",
    "read_project": "request",
    "read_sheets": "datasheet",
    "rebuild_report": "rebuild",
    "run_job": "run",
    "run_project": "chain",
    "synthesize_plant": "synthesize",
    "verify_files": "verify",
    "write_certify": "certify",
    "write_coupling": "couple",
    "write_design": "design",
    "write_diagnosis": "diagnose",
    "write_job": "run",
    "write_map": "map",
    "write_modules": "datasheet",
    "write_synthesis": "synthesize",
}

__all__ = [*_HOME]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(import_module(f".{_HOME[name]}", __name__), name)
    elif name in _PACKAGES:
        value = import_module(f".{name}", __name__)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, *_PACKAGES])
