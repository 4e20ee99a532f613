"""Where nothing explains the records: is it only that the declared noise is too small, or too large?"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from ..errors import Diverged
from ._adequacy import Adequacy, adequacy
from ._levels import LIMIT, WIDE
from ._refit import Refit, fitted
from ._score import Scores, promising, score


def with_wider_noise(nominal: Refit, effects: Iterable[str] | None) -> tuple[Refit, Scores, Adequacy] | None:
    """The nominal fit with noise levels up to 2.2 times off, if that leaves nothing to explain; else None.

    Asked last: levels that may change so much would also swallow small physics, so that a name is never looked for with
    them. What they cannot swallow is a large misfit.

    Parameters
    ----------
    nominal : Refit
        Without any effect.
    effects : iterable of str, optional
        Catalogue.
    """
    try:
        fit = fitted(nominal.structure, nominal.v, nominal.floor, replace(nominal.levels, limit=WIDE))
    except Diverged:
        return None
    factors = [fit.levels.disturbance, *fit.levels.noise.values()]
    if all(1.0 / LIMIT <= factor <= LIMIT for factor in factors):
        return None
    scores = score(fit, effects)
    checks = adequacy(fit)
    return None if promising(fit, scores) or not checks.outcome.ok else (fit, scores, checks)
