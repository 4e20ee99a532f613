"""Effects that a finer network explains away in training, where they alone predict the validation data.

What a finer network would change has many unknowns, so that it can fit a body that loses heat somewhere else, along one
record. Data that no fit has seen refute it then, and not the effect.
"""

from __future__ import annotations

from dataclasses import replace

from ..errors import Diverged, InputError
from ._judge import Judged, Validation
from ._lasting import lasting
from ._rivals import at_neighboring_lumps, with_rivals
from .evidence import Gap, expected_rms, left
from .fit import Refit, coarsened, exact
from .search import SearchState

_CLOSED = 0.95  # of the excess mean square, that an effect removes which needs no finer network
_REFUTED = 2.0  # times the excess whitened variance of validation data that the effect leaves beside a finer network


def predicting_alone(state: SearchState, finer: Refit, validation: Validation) -> SearchState | None:
    """The effects found with the network as it is, with their rivals, where they alone predict; else None.

    A rival that leaves more could not be named itself, and is none, but for the same path at a neighboring lump.

    Parameters
    ----------
    state : SearchState
        Search with the network taken to be right.
    finer : Refit
        A finer network without any effect.
    validation : Validation
        Data that no fit has seen.
    """
    if validation.data is None or not state.rounds:
        return None
    nominal = state.nominal
    kept, found = lasting(replace(state, misfit_left=False), nominal, validation)
    if not found or not (_closes(kept.fit, nominal, validation) and _refutes(kept.fit, finer, validation)):
        return None
    listed = with_rivals(kept, nominal, validation)
    return at_neighboring_lumps(replace(listed, rounds=tuple(
        replace(round_, contenders=tuple(entry for entry in round_.contenders
                                         if _closes(entry.fit, nominal, validation))) for round_ in listed.rounds)))


def saying_so(judged: Judged) -> Judged:
    """A name that a finer network explains away in training says so; any other answer is returned as it is.

    Parameters
    ----------
    judged : Judged
        Verdict on what `predicting_alone` found.
    """
    if judged.verdict not in ("named_with_remainder", "ambiguous"):
        return judged
    text = (f"{judged.outcome.text} A network with its lumps split would explain the training records without it, and "
            "fails on the validation records.")
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


def _refutes(fit: Refit, finer: Refit, validation: Validation) -> bool:
    """Whether validation data are predicted much worse by a finer network than by one with the effects."""
    try:
        held = validation.predicted(finer, coarsened(fit))
    except (Diverged, InputError):
        return False
    return held is not None and held.variance_before - 1.0 > _REFUTED * max(held.variance_after - 1.0, 1.0)
