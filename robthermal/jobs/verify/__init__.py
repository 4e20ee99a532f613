"""Certificate files checked again, by the second checker too."""

from ._check_files import FileCheck as FileCheck
from ._check_files import verify_files as verify_files
from ._check_files import write_checks as write_checks
from ._files import certificate_files as certificate_files
from ._second import SecondVerdict as SecondVerdict
from ._second import second_verdicts as second_verdicts

__all__ = ["FileCheck", "SecondVerdict", "certificate_files", "second_verdicts", "verify_files", "write_checks"]
