"""Certificate files checked again, by the second checker too.

The checker loads on first use (PEP 562), as in `robthermal.jobs`: looking for the files does not need it.
"""

from typing import TYPE_CHECKING

from ..._first_use import names_on_first_use
from ._files import certificate_files as certificate_files

if TYPE_CHECKING:  # what type checkers and editors see of the table below
    from ._check_files import FileCheck as FileCheck
    from ._check_files import verify_files as verify_files
    from ._junit import write_checks as write_checks
    from ._second import SecondVerdict as SecondVerdict
    from ._second import second_verdicts as second_verdicts

_HOME = {  # name: the module it lives in
    **dict.fromkeys(("FileCheck", "verify_files"), "_check_files"),
    **dict.fromkeys(("SecondVerdict", "second_verdicts"), "_second"),
    "write_checks": "_junit",
}

__all__ = ["FileCheck", "SecondVerdict", "certificate_files", "second_verdicts", "verify_files", "write_checks"]

__getattr__ = names_on_first_use(__name__, _HOME)


def __dir__() -> list[str]:
    return __all__
