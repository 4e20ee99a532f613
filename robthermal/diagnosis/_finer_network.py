"""Where several effects explain the records down to the noise: would a finer network do as well without any?

A misfit a little above the noise can be made up of effects that are not there. One effect is simpler than lumps that
are all split; several are not. What splitting the lumps would change is
known in kind; its unknowns have unit priors, so that its evidence can be set beside that of the effects.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..errors import Diverged, InputError
from ._judge import Judged
from ._outcomes import DiagnosisCode
from .fit import Refit, coarsened, extended, orthonormal

_CLEAR = 45.0  # of twice the logarithm of the evidence
_FLAT = 1e-9  # relative size of a direction that counts as none


def unless_finer(judged: Judged) -> Judged:
    """No name yet where a network with its lumps split explains the records as well without effects: to be graded.

    Parameters
    ----------
    judged : Judged
        Answer with the network taken to be right; returned as it is unless several effects are named on records.
    """
    state = judged.state
    if judged.verdict not in ("named", "ambiguous") or len(state.rounds) < 2 or not state.nominal.records:
        return judged
    try:
        finer = coarsened(state.nominal)
        if not finer.structure.n_coarse:
            return judged
        same = extended(state.fit, finer.structure, finer.v)  # with the filters of the effects
    except (Diverged, InputError):
        return judged
    dimension = state.fit.structure.n_effects
    if state.fit.rss + dimension * math.log(state.fit.n_readings) + _CLEAR < same.rss + _occam(same):
        return judged
    labels = ", ".join(round_.best.candidate.label for round_ in state.rounds)
    text = f"A network with its lumps split explains the records as well as {labels}, without any effect."
    return replace(judged, verdict="unexplained", outcome=DiagnosisCode.UNEXPLAINED.outcome(
        text, remedy="Refine the network."))


def _occam(finer: Refit) -> float:
    """Logarithm of the determinant of the information on the unknowns of a finer network, their priors included."""
    structure = finer.structure
    first = structure.n_parameters + structure.n_effects
    own = slice(first, first + structure.n_coarse)
    basis = orthonormal(np.delete(finer.J, np.r_[own], axis=1), _FLAT)
    J = finer.J[:, own] - basis @ (basis.T @ finer.J[:, own])
    return float(np.linalg.slogdet(J.T @ J)[1])
