"""Every code of an outcome, from the enums of the packages."""

from __future__ import annotations

from ..._fleet import FleetCode
from ...calibration import CalibrationCode
from ...certify import CertifyCode
from ...coupling import CouplingCode
from ...design import DesignCode
from ...diagnosis import DiagnosisCode
from ...errors import OutcomeCode
from ...identify import IdentifyCode
from ...signals import SignalsCode
from ...synthesis import SynthesisCode
from ...thermal import ThermalCode
from .._outcomes import JobsCode

_ENUMS: tuple[type[OutcomeCode], ...] = (SignalsCode, IdentifyCode, ThermalCode, CalibrationCode, CertifyCode,
                                         CouplingCode, SynthesisCode, DesignCode, DiagnosisCode, FleetCode, JobsCode)


def outcome_codes() -> dict[str, tuple[OutcomeCode, ...]]:
    """Codes of all outcomes, with what each package means by them.

    Returns
    -------
    dict of str to tuple of OutcomeCode
        By code, in alphabetical order.

    Examples
    --------
    >>> from robthermal.jobs.explanations import outcome_codes
    >>> any(code.ok for code in outcome_codes()["not_certified"])
    False
    """
    found: dict[str, list[OutcomeCode]] = {}
    for member in (member for enum in _ENUMS for member in enum):
        found.setdefault(member.code, []).append(member)
    return {code: tuple(found[code]) for code in sorted(found)}


def package_of(code: OutcomeCode) -> str:
    """Package that a code belongs to, as users call it.

    Parameters
    ----------
    code : OutcomeCode
        Member of the enum of a package.
    """
    return type(code).__module__.split(".")[1].removeprefix("_")
