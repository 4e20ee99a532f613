"""Where nothing explains the records: is it only that the noise is not what was declared?"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from ...errors import Diverged
from ..evidence import Adequacy, Scores, adequacy, promising, score
from ..fit import LARGEST_FACTOR, WIDE, NoiseScaling, Refit, fitted, with_slow_part

Answer = tuple[Refit, Scores, Adequacy]


def with_wider_noise(nominal: Refit, effects: Iterable[str] | None, slow: bool = True) -> Answer | None:
    """The nominal fit with noise unlike the declared one, if that leaves nothing to explain; else None.

    First levels up to 2.2 times off; then a slow part of the sensors' noise, at most as large as the declared noise,
    with levels as near as ever. Asked last: such noise would also absorb small physics, so that a name is never looked
    for with it. What it cannot absorb is a large misfit.

    Parameters
    ----------
    nominal : Refit
        Without any effect.
    effects : iterable of str, optional
        Effects of the catalog to try.
    slow : bool
        Whether to ask the second question too.
    """
    effects = None if effects is None else list(effects)
    return _with_wide_levels(nominal, effects) or (_with_slow_part(nominal, effects) if slow else None)


def _with_wide_levels(nominal: Refit, effects: list[str] | None) -> Answer | None:
    fit = _refitted(nominal, replace(nominal.levels, limit=WIDE))
    if fit is None:
        return None
    factors = [fit.levels.disturbance, *fit.levels.noise.values()]
    near = all(1.0 / LARGEST_FACTOR <= factor <= LARGEST_FACTOR for factor in factors)
    return None if near else _if_nothing_left(fit, effects)


def _with_slow_part(nominal: Refit, effects: list[str] | None) -> Answer | None:
    levels = with_slow_part(nominal.records, nominal.floor, nominal.levels) if nominal.records else None
    fit = None if levels is None else _refitted(nominal, levels)
    return None if fit is None else _if_nothing_left(fit, effects)


def _refitted(nominal: Refit, levels: NoiseScaling) -> Refit | None:
    try:
        return fitted(nominal.structure, nominal.v, nominal.floor, levels)
    except Diverged:
        return None


def _if_nothing_left(fit: Refit, effects: list[str] | None) -> Answer | None:
    checks = adequacy(fit)
    if not checks.outcome.ok:
        return None
    scores = score(fit, effects)
    return None if promising(fit, scores) else (fit, scores, checks)
