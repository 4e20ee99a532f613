"""What the catalog of effects says, those of a user included."""

from __future__ import annotations

from ...thermal.effects import Effect, Quantity, effects
from ._explanation import Explanation


def explained_effects() -> dict[str, Explanation]:
    """Explanation of every effect that is registered now, by name."""
    return {name: _explained(effect) for name, effect in effects().items()}


def _explained(effect: Effect) -> Explanation:
    details = {"Acts on": effect.where, "Quantities": tuple(map(_quantity, effect.quantities)),
               "Confused with": tuple(f"{name}, at another place" if name == effect.name else name
                                      for name in effect.confused_with),
               "Told apart by": (effect.separated_by,) if effect.separated_by else ()}
    return Explanation(effect.name, "effect", (effect.meaning,),
                       {heading: texts for heading, texts in details.items() if texts},
                       "docs/explanations/effects.md")


def _quantity(quantity: Quantity) -> str:
    limits = (f"known, {quantity.lower:g}" if quantity.lower == quantity.upper else
              f"{quantity.lower:g} to {quantity.upper:g}")
    return f"{quantity.name} [{quantity.unit}], {limits}"
