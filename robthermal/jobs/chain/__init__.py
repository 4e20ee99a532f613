"""The chain of a project: identify, calibrate, diagnose, certify, design, couple, into one folder and one report."""

from ._run import NAMES as NAMES
from ._run import run_project as run_project

__all__ = ["NAMES", "run_project"]
