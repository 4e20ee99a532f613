"""What the model of a thermoelectric module may lack."""

from __future__ import annotations

from functools import partial

from ..thermal import System
from . import _adding as adding
from ._effect import Effect, Quantity, Where
from ._signatures import Values, by_heat


def _modules(system: System) -> list[Where]:
    return [(name,) for name in system.modules]


def _slope(system: System, where: Where, values: Values, what: str) -> System:
    return adding.slope(system, where, what, values["slope"])


def _sloped(what: str, unit: str, limit: float, step: float, confused: tuple[str, ...], separated: str) -> Effect:
    add = partial(_slope, what=what)
    return Effect(f"{what}_slope", _modules, (Quantity("slope", unit, -limit, limit, typical=step),), add,
                  by_heat(add, "slope", step), confused, separated)


MODULE_EFFECTS = (
    _sloped("seebeck", "V/K^2", 1e-2, 1e-6, ("thomson", "resistance_slope"),
            "two levels of mean temperature with both signs of current"),
    _sloped("resistance", "ohm/K", 1.0, 1e-4, ("lead_heating", "joule_split"),
            "two levels of mean temperature with large current"),
    _sloped("conductance", "W/K^2", 0.1, 1e-5, ("missing_link", "natural_convection"),
            "a temperature difference made by the heater at zero current, and by the current"),
)
