"""All candidates of a diagnosis in one table, each with the reason why it was taken or not."""

from __future__ import annotations

import numpy as np

from ..._digits import chance
from ..._pandas import pd
from ...diagnosis import Diagnosis

NOT_NEEDED = "not needed: no more than noise"
_SURE = 0.01  # family-wise
_ALIKE = 0.5  # cosine of the signatures after the nominal parameters


def ranking(found: Diagnosis) -> pd.DataFrame:
    """Candidates, the accepted first, then by statistic.

    Parameters
    ----------
    found : Diagnosis
        What was found.
    """
    scores = found.scores
    rows = [{"candidate": candidate.label, "F": float(scores.statistic[i]), "p": chance(float(scores.p_value[i])),
             "size": float(scores.size[i]), "± std": float(scores.std[i]), "limit": float(scores.limit[i]),
             "unit": candidate.effect.size.unit, "answer": _reason(found, i)}
            for i, candidate in enumerate(scores.candidates)]
    taken = [effect.label for effect in found.effects]
    rows.sort(key=lambda row: (_place(str(row["candidate"]), taken), -float(str(row["F"]))))
    return pd.DataFrame(rows)


def _place(label: str, taken: list[str]) -> int:
    return taken.index(label) if label in taken else len(taken)


def _reason(found: Diagnosis, i: int) -> str:
    scores, candidate = found.scores, found.scores.candidates[i]
    for effect, others in zip(found.effects, found.alternatives, strict=True):
        if (effect.effect, effect.where) == candidate.key:
            return f"accepted, ΔBIC {effect.delta_bic:.0f}"
        if candidate.key in others:
            return f"these records cannot tell it from {effect.label}"
    if any(other.key == candidate.key for other in found.ruled_out):
        return "the records fitted alone do not exclude it; together with them, the validation records could"
    if any((effect.effect, effect.where) == candidate.key for effect in found.provisional):
        return "helps, but does not explain everything"
    if candidate.key in found.not_testable:
        return f"not testable: {found.not_testable[candidate.key]}"
    if scores.p_value[i] >= _SURE:
        return NOT_NEEDED
    if not scores.possible[i]:
        return "the size it would need is not possible"
    return _behind(found, i)


def _behind(found: Diagnosis, i: int) -> str:
    """Significant on its own, yet not accepted."""
    labels = [candidate.label for candidate in found.scores.candidates]
    accepted = [effect.label for effect in (found.effects or found.provisional) if effect.label in labels]
    if not accepted:
        return "too little: ΔBIC not above 10"
    cosines = [abs(float(found.scores.confusion[i, labels.index(label)])) for label in accepted]
    best = int(np.argmax(cosines))
    alike = f", which it resembles (cosine {cosines[best]:.2f})" if cosines[best] > _ALIKE else ""
    return f"explains less than {accepted[best]}{alike}"
