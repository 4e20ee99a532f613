"""The claims of a report's first screen."""

from __future__ import annotations

from collections.abc import Sequence

from ...report import Claim
from ._checked import Checked
from ._words import claim_of


def required_claims(checked: Sequence[Checked], usable: bool = False) -> tuple[Claim, ...]:
    """Required claims, for the first screen; the others are in the table of certificates.

    Parameters
    ----------
    checked : sequence of Checked
        Certificates with their checks.
    usable : bool, optional
        Whether their currents are inside the usable range.
    """
    return tuple(claim_of(one.file, one.certificate, one.verdict, title=one.title, breaks=one.breaks, usable=usable)
                 for one in checked if one.required)
