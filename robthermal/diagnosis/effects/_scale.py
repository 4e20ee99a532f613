"""How large an effect may be: on a large machine larger than the catalog says."""

from __future__ import annotations

from dataclasses import replace

from ...thermal import System
from ...thermal.effects import Effect, Quantity

_TIMES = 100.0  # the largest of a machine's own numbers: beyond it a new one is none of the machine's
_LIFT = 100.0  # K: what a heat may change


def to_scale(effect: Effect, system: System) -> Effect:
    """The effect with bounds that suit the machine: those of the catalog suit one of a few kilograms and watts.

    Parameters
    ----------
    effect : Effect
        Effect of the catalog.
    system : System
        Nominal system, with the numbers of the machine.
    """
    capacity = _TIMES * sum(lump.capacity for lump in system.lumps.values())
    conductance = _TIMES * max((link.conductance for link in system.links), default=0.0)
    least = {"J/K": capacity, "W/K": conductance, "W": _LIFT * conductance / _TIMES}
    wider = tuple(_widened(quantity, least.get(quantity.unit, 0.0)) for quantity in effect.quantities)
    return effect if wider == effect.quantities else replace(effect, quantities=wider)


def _widened(quantity: Quantity, least: float) -> Quantity:
    """The quantity with bounds no narrower than this; a sign that is impossible stays impossible."""
    upper = max(quantity.upper, least) if quantity.upper > 0 else quantity.upper
    lower = min(quantity.lower, -least) if quantity.lower < 0 else quantity.lower
    return replace(quantity, lower=lower, upper=upper)
