"""Effects that do not last beside a finer network, where they alone do nearly all that is to be done, or far more.

What a finer network would change has many unknowns, which can fit a body that loses heat somewhere else. An effect that
needs none of them, and takes nearly all of the error off data that no fit has seen, is the better explanation. Where a
finer network leaves much more of the training records than the effects do, it explains nothing away.

What is coarse in a network shows as heat that is stored elsewhere, or comes late, and hardly as a path of heat: a mass
or a lag has to do more than other effects.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from ..errors import Diverged, InputError
from ._judge import Judged, Validation
from ._lasting import lasting
from ._rivals import CLOSED_SQUARE, at_neighboring_lumps, with_rivals
from .evidence import Gap, expected_rms, left
from .fit import Refit, coarsened, exact
from .search import SearchState

_CLOSED = 0.92  # of the excess mean square, that an effect removes which needs no finer network
_CLOSED_BY_PATHS = 0.85  # the same, where none of the effects stores heat or is late
_STORING = ("hidden_mass", "path_mass", "sensor_lag", "input_lag", "input_delay")
_MISFIT = 2.0  # whitened variance that a finer network leaves, to explain nothing away
_RENEWED = 3  # times
_FAR_LESS = 0.5  # of the excess mean square that it leaves: no more may be left by the effects


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
    kept = lasting(replace(state, misfit_left=False), nominal, validation)
    if not kept.rounds:
        return None
    share = CLOSED_SQUARE if leaves_far_more(finer, kept.fit) else _needed(kept)
    if not _closes(kept.fit, nominal, validation, share):
        return None
    listed = with_rivals(kept, nominal, validation)
    return at_neighboring_lumps(replace(listed, rounds=tuple(
        replace(round_, contenders=tuple(entry for entry in round_.contenders
                                         if _closes(entry.fit, nominal, validation, share)))
        for round_ in listed.rounds)), validation)


def _needed(state: SearchState) -> float:
    """Share of the excess mean square that these effects have to remove where a finer network would, too."""
    storing = any(round_.best.candidate.effect.name in _STORING for round_ in state.rounds)
    return _CLOSED if storing else _CLOSED_BY_PATHS


def closing(state: SearchState, validation: Validation) -> bool:
    """Whether all effects found with the network as it is close the gap of training and validation records together.

    Parameters
    ----------
    state : SearchState
        Search with the network taken to be right.
    validation : Validation
        Data that no fit has seen.
    """
    return bool(state.rounds) and validation.data is not None and _closes(state.fit, state.nominal, validation, _CLOSED)


def leaves_far_more(finer: Refit, fit: Refit) -> bool:
    """Whether a finer network without effects leaves a misfit, and far more of the training records than a fit does.

    Parameters
    ----------
    finer : Refit
        A finer network without any effect.
    fit : Refit
        With effects, and the network as it is.
    """
    plain = exact(fit)
    noise = expected_rms(plain) ** 2

    def more(one: Refit) -> bool:
        return one.variance > _MISFIT and plain.rms**2 - noise < _FAR_LESS * (one.rms**2 - noise)

    for _ in range(_RENEWED):  # what a finer network changes is linearized where it is fitted
        if not more(finer):
            return False
        finer = finer.kept("renewed", partial(coarsened, finer))
    return more(finer)


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
    plain, more = exact(judged.state.fit), f"with {finer.structure.n_coarse} more unknowns"
    split = (f"A network with its lumps split, {more}, leaves {finer.rms:.2g} {finer.unit} of the training records, "
             f"against {plain.rms:.2g} {plain.unit}." if leaves_far_more(finer, judged.state.fit) else
             f"A network with its lumps split would explain the training records without it, {more}.")
    text = f"{judged.outcome.text} {split}"
    return replace(judged, outcome=replace(judged.outcome, text=text))


def _closes(fit: Refit, nominal: Refit, validation: Validation, share: float) -> bool:
    """Whether this share of the excess mean square is gone, on training and on validation records."""
    bare, plain = exact(nominal), exact(fit)
    gaps = [Gap(bare.rms, plain.rms, expected_rms(plain))]
    try:
        held = validation.predicted(bare, plain)
    except (Diverged, InputError):  # a model that runs away predicts nothing
        return False
    gaps += [] if held is None else [held.gap]
    return all(left(gap).share_explained >= share for gap in gaps)
