"""An answer in the names of the user's system, where losses were taken as natural convection for a comparison.

A change by a factor is the same of G in G (|ΔT| / 10 K)^n, of the gain that a system holds, and of the conductance that
the user's file has: the last one is named.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from ._changed import Compared
from ._found import Found
from .change import NAME, Convection
from .diagnosis import Diagnosis
from .effects import Candidate

Value = TypeVar("Value")
Where = tuple[str, ...]
_LABEL = re.compile(rf"{NAME}\(([^()]*)\)")


def in_own_names(found: Diagnosis, law: Convection) -> Diagnosis:
    """The answer with changes of conductances in the place of changes of the gains that took theirs.

    Parameters
    ----------
    found : Diagnosis
        Answer with `reference`, of a system with these losses.
    law : Convection
        Losses taken as natural convection.
    """
    own = law.own_names

    def where(effect: str, at: Where) -> Where:
        return tuple(own.get(name, name) for name in at) if effect == NAME else at

    def renamed(effects: tuple[Found, ...]) -> tuple[Found, ...]:
        return tuple(replace(one, where=where(one.effect, one.where)) for one in effects)

    def candidate(one: Candidate) -> Candidate:
        return replace(one, where=where(one.effect.name, one.where))

    def said(text: str) -> str:
        return _LABEL.sub(lambda label: f"{NAME}({', '.join(where(NAME, tuple(label[1].split(', '))))})", text)

    return replace(
        found, effects=renamed(found.effects), provisional=renamed(found.provisional),
        alternatives=tuple(tuple((name, where(name, at)) for name, at in others) for others in found.alternatives),
        not_testable={(name, where(name, at)): why for (name, at), why in found.not_testable.items()},
        scores=replace(found.scores, candidates=tuple(map(candidate, found.scores.candidates))),
        nearest=said(found.nearest), caveats=tuple(map(said, found.caveats)),
        outcome=replace(found.outcome, text=said(found.outcome.text)),
        reference=None if found.reference is None else _compared(found.reference, own))


def _compared(compared: Compared, own: Mapping[str, str]) -> Compared:
    def keyed(values: Mapping[str, Value]) -> dict[str, Value]:
        return {own.get(name, name): value for name, value in values.items()}

    return replace(compared, scatter=keyed(compared.scatter), deviation=keyed(compared.deviation),
                   visible=keyed(compared.visible))
