"""Effects that a finer network explains away, where they alone do nearly all that is to be done.

What a finer network would change has many unknowns, which can fit a body that loses heat somewhere else. An effect that
needs none of them, and takes nearly all of the error off data that no fit has seen, is the better explanation.
"""

from __future__ import annotations

from dataclasses import replace

from ..errors import Diverged, InputError
from ._judge import Judged, Validation
from ._lasting import lasting
from ._rivals import at_neighboring_lumps, with_rivals
from .evidence import Gap, expected_rms, left
from .fit import Refit, exact
from .search import SearchState

_CLOSED = 0.92  # of the excess mean square, that an effect removes which needs no finer network


def predicting_alone(state: SearchState, validation: Validation) -> SearchState | None:
    """The effects found with the network as it is, with their rivals, where they alone predict; else None.

    A rival that leaves more could not be named itself, and is none, but for the same path at a neighboring lump.

    Parameters
    ----------
    state : SearchState
        Search with the network taken to be right.
    validation : Validation
        Data that no fit has seen.
    """
    if validation.data is None or not state.rounds:
        return None
    nominal = state.nominal
    kept = lasting(replace(state, misfit_left=False), nominal, validation)
    if not kept.rounds or not _closes(kept.fit, nominal, validation):
        return None
    listed = with_rivals(kept, nominal, validation)
    return at_neighboring_lumps(replace(listed, rounds=tuple(
        replace(round_, contenders=tuple(entry for entry in round_.contenders
                                         if _closes(entry.fit, nominal, validation))) for round_ in listed.rounds)))


def saying_so(judged: Judged, finer: Refit) -> Judged:
    """A name that a finer network explains away in training says so; any other answer is returned as it is.

    Parameters
    ----------
    judged : Judged
        Verdict on what `predicting_alone` found.
    finer : Refit
        A finer network without any effect.
    """
    if judged.verdict not in ("named_with_remainder", "ambiguous"):
        return judged
    text = (f"{judged.outcome.text} A network with its lumps split would explain the training records without it, with "
            f"{finer.structure.n_coarse} more unknowns.")
    return replace(judged, outcome=replace(judged.outcome, text=text))


def _closes(fit: Refit, nominal: Refit, validation: Validation) -> bool:
    """Whether nearly all of the excess mean square is gone, on training and on validation records."""
    bare, plain = exact(nominal), exact(fit)
    gaps = [Gap(bare.rms, plain.rms, expected_rms(plain))]
    try:
        held = validation.predicted(bare, plain)
    except (Diverged, InputError):  # a model that runs away predicts nothing
        return False
    gaps += [] if held is None else [held.gap]
    return all(left(gap).share_explained >= _CLOSED for gap in gaps)
