"""From measured data to verified certificates for thermal systems with thermoelectric modules.

The names below load their package on first use (PEP 562), so that ``import robthermal`` stays fast: pandas, matplotlib,
python-control and the solvers are imported by the packages that need them, not here.

Examples
--------
>>> import robthermal as rt
>>> rt.InputError.__name__
'InputError'
>>> "Record" in dir(rt)
True
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .errors import Diverged as Diverged
from .errors import InputError as InputError
from .errors import Outcome as Outcome

if TYPE_CHECKING:  # what type checkers and editors see of the two tables below
    from . import calibration as calibration
    from . import certify as certify
    from . import coupling as coupling
    from . import design as design
    from . import diagnosis as diagnosis
    from . import errors as errors
    from . import identify as identify
    from . import jobs as jobs
    from . import project as project
    from . import report as report
    from . import signals as signals
    from . import synthesis as synthesis
    from . import systems as systems
    from . import thermal as thermal
    from . import verification as verification
    from ._fleet import FleetRun as FleetRun
    from ._fleet import fleet as fleet
    from .calibration import calibrate as calibrate
    from .diagnosis.diagnose import diagnose as diagnose
    from .signals import Record as Record
    from .signals import read_record as read_record
    from .signals import read_records as read_records
    from .thermal import System as System
    from .thermal import read_system as read_system
    from .verification import Certificate as Certificate
    from .verification import Verdict as Verdict
    from .verification import verify as verify

_PACKAGES = ("calibration", "certify", "coupling", "design", "diagnosis", "errors", "identify", "jobs", "report",
             "signals", "synthesis", "systems", "thermal", "verification")
_FORMER = ("project",)  # names of the version before: `rt.project` is now `rt.jobs` and the packages inside

_HOME = {  # public name: the package it lives in
    "Certificate": "verification",
    "FleetRun": "_fleet",
    "Record": "signals",
    "System": "thermal",
    "Verdict": "verification",
    "calibrate": "calibration",
    "diagnose": "diagnosis",
    "fleet": "_fleet",
    "read_record": "signals",
    "read_records": "signals",
    "read_system": "thermal",
    "verify": "verification",
}

__all__ = ["Diverged", "InputError", "Outcome", "__version__", *_HOME, *_PACKAGES, *_FORMER]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(import_module(f".{_HOME[name]}", __name__), name)
    elif name in (*_PACKAGES, *_FORMER):
        value = import_module(f".{name}", __name__)
    elif name == "__version__":
        value = _version()
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)


def _version() -> str:
    # Imported here: reading package metadata is slow, and few programs ask for the version.
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("robthermal")
    except PackageNotFoundError:  # used straight from a checkout, without installation
        return "0+not.installed"
