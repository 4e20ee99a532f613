"""State of the search for effects: what has been accepted, what is left, and whether to look for another effect."""

from __future__ import annotations

from dataclasses import dataclass

from ..evidence import Scores
from ..fit import Refit
from ._decide import Accepted
from ._joint_check import JointCheck
from ._short_list import ShortList


@dataclass(frozen=True, eq=False, kw_only=True)
class SearchState:
    """State that every stage of the search takes and returns.

    Parameters
    ----------
    nominal : Refit
        Nominal system refitted, without any effect.
    names : tuple of str or None
        Effects to try; None for the whole catalog.
    scores : Scores
        Scores of all candidates on the nominal fit.
    fit : Refit
        Fit with all effects accepted so far.
    current : Scores
        Scores of all candidates on that fit.
    short : ShortList
        Candidates refitted last.
    rounds : tuple of Accepted
        Accepted effects, in the order of the effects of the fit.
    complete : bool
        Whether no further effect is looked for.
    misfit_left : bool
        Whether the search gave up on a large misfit: then nothing is named.
    joint : JointCheck or None
        Comparison with a selection of all effects at once; None with fewer than two effects.
    """

    nominal: Refit
    names: tuple[str, ...] | None
    scores: Scores
    fit: Refit
    current: Scores
    short: ShortList
    rounds: tuple[Accepted, ...] = ()
    complete: bool = False
    misfit_left: bool = False
    joint: JointCheck | None = None

    def __str__(self) -> str:
        lines = [f"{len(self.rounds)} effects accepted, whitened variance {self.nominal.variance:.4g} before, "
                 f"{self.fit.variance:.4g} after"]
        lines += [f"  {round_}" for round_ in self.rounds]
        if self.short.entries:
            lines.append(f"refitted last: {', '.join(entry.candidate.label for entry in self.short.entries)}")
        if self.joint is not None:
            lines.append(str(self.joint))
        lines.append("a large misfit is left" if self.misfit_left else
                     "no further effect is looked for" if self.complete else "the search goes on")
        return "\n".join(lines)
