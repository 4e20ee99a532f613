"""A conductance to an ambient that falls because the air stands still: it grows with the difference from then on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from ...errors import Diverged, InputError
from ...thermal import Link, Natural, System, constant_losses
from ..effects import Quantity
from ..evidence import BIC_GAP
from ..fit import Refit, extended
from ..search import Entry
from ._parameter_change import NAME, SIZE, changed_by

EXPONENT = "exponent"
_LAMINAR, _STEEPEST = 0.25, 0.5  # power of the difference: where it starts, and the largest (turbulent: 1/3)
_WHOLE = 0.2  # of the logarithm of the factor: at twice that 2 % of the former law are left
_MOST = 1.0 - 1e-6  # share of the new law: a conductance stays above zero
_FALLS = -0.3  # logarithm of the factor at or below which a conductance may be that of still air


def with_still_air(entry: Entry) -> Entry:
    """The same change of a parameter where the air stands still, if that explains more; else as it was.

    Parameters
    ----------
    entry : Entry
        A candidate refitted.
    """
    candidate, structure = entry.candidate, entry.fit.structure
    place = len(structure.effects) - 1
    system = structure.system(entry.fit.v)
    if candidate.effect.name != NAME or _size(entry.fit) > _FALLS or not any(
            link.name in constant_losses(system) for link in _links_of(system, candidate.where)):
        return entry
    form = replace(candidate, shape={EXPONENT: _LAMINAR}, effect=replace(
        candidate.effect, add=_add, quantities=(
            *candidate.effect.quantities, Quantity(EXPONENT, "-", 0.0, _STEEPEST, grid=(_LAMINAR,)))))
    try:
        with_law = replace(structure, effects=(*structure.effects[:place], form))
        values = structure.quantities(entry.fit.v)
        start = with_law.carried(structure, entry.fit.v, [*values[:place], {**values[place], EXPONENT: _LAMINAR}])
        fit = extended(entry.fit, with_law, start)
    except (Diverged, InputError):  # the law runs away on these records: the constant conductance stands
        return entry
    clear = fit.rss + math.log(fit.n_readings) + BIC_GAP < entry.fit.rss and _size(fit) < _FALLS
    return replace(entry, candidate=form, fit=fit) if clear else entry


def _size(fit: Refit) -> float:
    """Logarithm of the factor that the last effect is."""
    return fit.structure.quantities(fit.v)[-1][SIZE]


def _links_of(system: System, where: tuple[str, ...]) -> list[Link]:
    """The link whose conductance alone is changed; none where other numbers change or change with it."""
    return [link for link in system.links if where == (f"links.{link.name}.conductance",)]


def _add(system: System, where: tuple[str, ...], values: Mapping[str, float]) -> System:
    """Conductance G e^s (|dT| / 10 K)^n, with a share of the former law that is gone for s < -0.4."""
    (link,) = _links_of(system, where)
    share = _MOST * -math.expm1(-(min(values[SIZE], 0.0) / _WHOLE) ** 2)
    changed = changed_by(system, where, values[SIZE] + math.log1p(-share))
    natural = Natural.as_much_as(link.conductance * math.exp(values[SIZE]) * share, values[EXPONENT])
    return changed.model_copy(update={"links": tuple(
        one.model_copy(update={"natural": natural}) if one.name == link.name else one for one in changed.links)})
