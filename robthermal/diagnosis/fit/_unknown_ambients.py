"""Ambients that a record does not hold: an unknown of every record, beside its session gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...thermal import System
from ..data import RecordData
from ._sessions import Sessions

SIGMA = 5.0  # K: how far a room may be from what the system says


def with_unknown_ambients(sessions: Sessions, system: System, records: Sequence[RecordData]) -> Sessions:
    """Sessions whose ambients are unknown where no record holds them.

    Parameters
    ----------
    sessions : Sessions
        Gains of the records.
    system : System
        Nominal system; its temperatures are the centers of the priors.
    records : sequence of RecordData
        Records of all sessions.
    """
    names = [name for name in system.ambients
             if any(name not in one.record.input_names for one in records)]
    return replace(sessions, inputs=(*sessions.inputs, *names),
                   numbers=(*sessions.numbers, *(f"ambients.{name}.temperature" for name in names)),
                   sigma=(*sessions.sigma, *(SIGMA for _ in names)))
