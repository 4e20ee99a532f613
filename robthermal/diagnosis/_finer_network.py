"""Where effects explain the records down to the noise: would a finer network do as well without any?

A misfit a little above the noise can be made up of effects that are not there. What splitting the lumps would change is
known in kind; its unknowns have unit priors, so that its evidence can be set beside that of the effects. One effect is
simpler than lumps that are all split, and keeps its name with a caveat; several are not.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..errors import Diverged, InputError
from ._judge import Judged
from ._outcomes import DiagnosisCode
from .fit import Refit, coarsened, extended, orthonormal
from .search import SearchState

_CLEAR = 45.0  # of twice the logarithm of the evidence
_FLAT = 1e-9  # relative size of a direction that counts as none


def unless_finer(judged: Judged) -> Judged:
    """No names yet where a network with its lumps split explains the records as well without effects: to be graded.

    Parameters
    ----------
    judged : Judged
        Answer with the network taken to be right; returned as it is unless effects are named on records that a finer
        network explains as well. One effect keeps its name, and what speaks against it is said.
    """
    state = judged.state
    if judged.verdict not in ("named", "ambiguous") or not state.nominal.records or not _as_well(state):
        return judged
    if len(state.rounds) == 1:
        return replace(judged, finer=(
            "A network with its lumps split explains the records about as well without this effect: the network may be "
            "too coarse instead. Refine it and diagnose again before relying on the name."))
    labels = ", ".join(round_.best.candidate.label for round_ in state.rounds)
    text = f"A network with its lumps split explains the records as well as {labels}, without any effect."
    return replace(judged, verdict="unexplained", outcome=DiagnosisCode.UNEXPLAINED.outcome(
        text, remedy="Refine the network."))


def _as_well(state: SearchState) -> bool:
    """Whether the evidence of the effects is not clearly above that of a finer network without any."""
    try:
        finer = coarsened(state.nominal)
        if not finer.structure.n_coarse:
            return False
        same = extended(state.fit, finer.structure, finer.v)  # with the filters of the effects
    except (Diverged, InputError):
        return False
    dimension = state.fit.structure.n_effects
    return same.rss + _occam(same) <= state.fit.rss + dimension * math.log(state.fit.n_readings) + _CLEAR


def _occam(finer: Refit) -> float:
    """Logarithm of the determinant of the information on the unknowns of a finer network, their priors included."""
    structure = finer.structure
    first = structure.n_parameters + structure.n_effects
    own = slice(first, first + structure.n_coarse)
    basis = orthonormal(np.delete(finer.J, np.r_[own], axis=1), _FLAT)
    J = finer.J[:, own] - basis @ (basis.T @ finer.J[:, own])
    return float(np.linalg.slogdet(J.T @ J)[1])
