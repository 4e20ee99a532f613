"""How large an effect may be: on a large machine larger than the catalog says."""

from __future__ import annotations

from dataclasses import replace

from ...thermal import System
from ...thermal.effects import Effect

_CAPACITY, _CONDUCTANCE = 1e3, 10.0  # J/K in all, and W/K at most, of machines that the catalog's bounds suit


def to_scale(effect: Effect, system: System) -> Effect:
    """The effect with bounds that suit the machine: those of the catalog suit one of a few kilograms and watts.

    Parameters
    ----------
    effect : Effect
        Effect of the catalog.
    system : System
        Nominal system, with the numbers of the machine.
    """
    capacity = sum(lump.capacity for lump in system.lumps.values()) / _CAPACITY
    conductance = max((link.conductance for link in system.links), default=0.0) / _CONDUCTANCE
    times = {"J/K": capacity, "W/K": conductance, "W": conductance}
    wider = tuple(replace(quantity, lower=factor * quantity.lower, upper=factor * quantity.upper)
                  if (factor := times.get(quantity.unit, 1.0)) > 1.0 else quantity for quantity in effect.quantities)
    return effect if wider == effect.quantities else replace(effect, quantities=wider)
