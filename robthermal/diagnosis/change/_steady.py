"""Does the size of a change stay the same over the new records, as far as it does on healthy ones?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..._distributions import f_isf
from ..effects import Candidate
from ..evidence import score_candidates, wandering
from ..fit import Refit
from ..search import Accepted, refit_short_list
from ._excess import louder
from ._parameter_change import GAIN, NAME, place_of
from ._reference import Reference
from ._scatter import ASSUMED
from ._yardstick import with_held_shape

_MANY = 10**6  # degrees of freedom of a known variance
_SURE = 0.01  # chance for a change that is as steady as on healthy records


def unsteady(fit: Refit, rounds: Sequence[Accepted], reference: Reference) -> list[str]:
    """Labels of the changes whose size moves over the new records by more than healthy records explain.

    A sensor that drifts is no offset and no capacity: either would have another size in every part of the record.
    What differs from day to day on healthy machines, the number itself, may differ as much from hour to hour.

    Parameters
    ----------
    fit : Refit
        The new records with all changes.
    rounds : sequence of Accepted
        In the order of the effects of the fit.
    reference : Reference
        What healthy records show; the same candidate is fitted to each of them.
    """
    more = louder(fit, reference.each)
    out = []
    for place, round_ in enumerate(rounds):
        seen = wandering(fit, fit.structure.column_of(place))
        healthy = _on_healthy(round_.best.candidate, reference)
        noise = 1.0 / reference.scatter.inflation
        usual = max(float(np.mean(healthy)), noise) if healthy else 1.0  # 1: the raised noise level
        freedom = (seen.segments - 1) * len(healthy) or _MANY
        expected = noise + more * (usual - noise)  # noise is no larger where the machine is hotter
        expected += _scatter_of(round_.best.candidate, reference)**2 * seen.per_variance
        if seen.segments > 1 and seen.moves > expected * f_isf(_SURE, seen.segments - 1, freedom):
            out.append(round_.best.candidate.label)
    return out


def _on_healthy(candidate: Candidate, reference: Reference) -> list[float]:
    """How far the size of a candidate moves over each of the reference records that show it."""
    out = []
    for one in reference.each:
        scores = score_candidates(one, [with_held_shape(candidate)])
        entries = refit_short_list(one, scores).entries if scores.candidates else ()
        found = [wandering(entry.fit, entry.fit.structure.column_of(0)) for entry in entries[:1]]
        out += [each.moves for each in found if each.segments > 1]
    return out


def _scatter_of(candidate: Candidate, reference: Reference) -> float:
    """Standard deviation of the size on healthy days, if it is the factor of a number of the machine; else 0."""
    if candidate.effect.name == NAME:
        at = place_of(candidate.where, reference.listed)
        return float(reference.scatter.std[at] / reference.listed.unit[at])
    return ASSUMED if candidate.effect.name == GAIN else 0.0
