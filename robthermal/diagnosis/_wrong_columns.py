"""Whether a wrong sign or two exchanged columns explain the records better than what was found.

Docs: Measured files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from ..fitting import misread
from ..signals import Record
from ..thermal import System
from ._judge import Judged
from ._outcomes import DiagnosisCode
from .data import responses_of
from .fit import Refit


def asked_of_columns(judged: Judged, system: System, noise: Mapping[str, float],
                     refitted: Callable[[list[Record]], Refit]) -> Judged:
    """Withdraw names where the system alone, with a sign turned or columns exchanged, is clearly better; and say so.

    Returned as it is where nothing is missing, where that is no better, and beside frequency responses.

    Parameters
    ----------
    judged : Judged
        Answer of the search.
    system : System
        As the file describes it.
    noise : mapping
        Standard deviation of the sensors [K or V].
    refitted : callable
        Fits the nominal system to other records.
    """
    nominal, found = judged.state.nominal, judged.plain or judged.state.fit
    if judged.verdict == "consistent" or not nominal.records or responses_of(nominal.structure.data):
        return judged
    said = misread(system, [path.one for path in nominal.records], nominal.rms, found.rms, noise,
                   lambda one: refitted(one).rms)
    if not said:
        return judged
    text = f"{said} Then diagnose again."
    return replace(judged, verdict="unexplained", evidence=(), plain=None, means=text,
                   outcome=DiagnosisCode.UNEXPLAINED.outcome(
                       "No name: a log read otherwise explains the records better.",
                       remedy="Compare its columns with the machine."))
