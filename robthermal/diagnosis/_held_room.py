"""A room that was not recorded, beside a machine that is only heated: when a search with the room held is wanted."""

from __future__ import annotations

from ._judge import Judged
from .fit import Refit, only_heated, too_warm

_TOO_WARM = 1.0  # K above what the readings allow: a room beside which no name stays


def asks_for_a_held_room(judged: Judged) -> bool:
    """Whether an answer does not explain the records down to the noise, or only with a room too warm for the machine.

    Where the room comes out cool enough beside the effects named, holding it below the readings would change nothing.
    Where nothing is missing the machine may have been brought in from the cold.

    Parameters
    ----------
    judged : Judged
        Answer with the room free.
    """
    if judged.verdict in ("unexplained", "consistent"):
        return judged.verdict == "unexplained"
    return too_warm(judged.plain or judged.state.fit, _TOO_WARM)


def unless_worse(free: Judged, held: Judged) -> Judged:
    """The answer with the room held, but for one without names that predicts worse than with a free room.

    Parameters
    ----------
    free, held : Judged
        Answers with the room free, and held below the coolest readings.
    """
    if free.verdict != "unexplained" or held.verdict != "unexplained" or not (free.hold_out and held.hold_out):
        return held
    return free if free.hold_out.gap.after < held.hold_out.gap.after else held


def held_alike(judged: Judged, fit: Refit) -> Refit:
    """A fit to other records, with the room held below the coolest readings where it is in an answer.

    Parameters
    ----------
    judged : Judged
        Answer with the room free or held.
    fit : Refit
        Of the nominal system, with the room free.
    """
    return only_heated(fit) if judged.state.nominal.structure.only_heated else fit
