"""Thomson heat: current times temperature difference, the same into both faces of a module."""

from __future__ import annotations

from ._builders import numbers
from ._effect import Effect, Quantity
from ._places import modules
from ._signatures import by_heat

_add = numbers("modules", coefficient="thomson")

EFFECT = Effect(
    name="thomson",
    rank=40,
    meaning="Thomson heat: current times temperature difference, the same into both faces of a module.",
    where=("module",),
    places=modules,
    quantities=(Quantity("coefficient", "V/K", -0.1, 0.1, typical=1e-6),),
    add=_add,
    signature=by_heat(_add, "coefficient", 1e-4),
    confused_with=("seebeck_slope", "joule_split"),
    separated_by="temperature difference and current made independent, by the heater",
    measure="measure the voltage of {0} at zero current: it gives its Seebeck coefficient alone",
)
