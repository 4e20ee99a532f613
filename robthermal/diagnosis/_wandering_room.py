"""An ambient that no record holds, and that does not stand still: the search once more beside random states for it.

A room under air conditioning wanders by some tenths of a kelvin within minutes, and every path to it carries that into
the machine. Beside a room that stands still such a record is "unexplained", whatever else is missing. As random states
of the filter the room takes what it can have caused, which moves all lumps joined to it together; what the heaters
cause stays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..errors import Diverged, InputError
from ._judge import Judged, Progress, Validation
from .evidence import HoldOut
from .fit import Refit, wandering

_EXPLAINED = 0.49  # of the whitened excess on validation records, that names may leave: 70 % of its root


def beside_a_wandering_room(judged: Judged, again: Callable[[Refit], Judged], validation: Validation,
                            progress: Progress) -> Judged | None:
    """The answer with ambients that wander where no record holds them; None unless one was needed, and more is said.

    Parameters
    ----------
    judged : Judged
        Answer with ambients that stand still.
    again : callable
        Searches and judges from a fit of the nominal system.
    validation : Validation
        Data that no fit has seen.
    progress : callable
        Called with a sentence before the search.
    """
    still = judged.state.nominal
    if judged.verdict != "unexplained" or (moving := wandering(still)) is None:
        return None
    progress("once more, with a room that wanders")
    try:
        other = again(moving)
    except (Diverged, InputError):
        return None
    if other.verdict == "consistent":
        return replace(judged, room=f"{_wanders(moving)}, which explains these records: nothing else need be missing.")
    if other.verdict == "unexplained" or not _confirmed(other.hold_out):
        return None
    held = validation.predicted(still, other.plain or other.state.fit)  # the gap is that of the system as it was
    return replace(other, state=replace(other.state, nominal=still), hold_out=held,
                   room=f"{_wanders(other.state.fit)}; what is named is told from what the room can have done.")


def _confirmed(held: HoldOut | None) -> bool:
    """Whether data that no fit has seen are predicted, or most of what was left of them without the effects is gone."""
    return held is None or held.outcome.ok or held.excess_ratio <= _EXPLAINED


def _wanders(fit: Refit) -> str:
    names, levels = fit.unrecorded, fit.levels
    return (f"{' and '.join(names)}, which {'was' if len(names) == 1 else 'were'} not recorded, "
            f"{'is' if len(names) == 1 else 'are'} taken to wander by {levels.wander:.2g} K within "
            f"{levels.pace / 60.0:.2g} min")
