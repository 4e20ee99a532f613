"""What the model of a thermoelectric module may lack."""

from __future__ import annotations

from itertools import product

from ...thermal import System
from . import _adding as adding
from ._catalogue_lumps import TIMES
from ._effect import Effect, Quantity, Where
from ._signatures import by_heat, hysteresis


def _modules(system: System) -> list[Where]:
    return [(name,) for name in system.modules]


def _pairs(system: System) -> list[Where]:
    there = {(lead.lump, lead.module) for lead in system.leads}
    return [pair for pair in product(system.lumps, system.modules) if pair not in there]


def _without_memory(system: System) -> list[Where]:
    return [(name,) for name, module in system.modules.items() if module.hysteresis is None]


def _sloped(what: str, unit: str, limit: float, step: float, confused: tuple[str, ...], separated: str) -> Effect:
    add = adding.slope(what)
    return Effect(f"{what}_slope", _modules, (Quantity("slope", unit, -limit, limit, typical=step),), add,
                  by_heat(add, "slope", step), confused, separated)


_thomson = adding.number("modules", {"coefficient": "thomson"})
_split = adding.number("modules", {"split": "joule_split"})
_lead = adding.by_name("lead_heating")

MODULE_EFFECTS = (
    _sloped("seebeck", "V/K²", 1e-2, 1e-6, ("thomson", "resistance_slope"),
            "two levels of mean temperature with both signs of current"),
    _sloped("resistance", "Ω/K", 1.0, 1e-4, ("lead_heating", "joule_split"),
            "two levels of mean temperature with large current"),
    _sloped("conductance", "W/K²", 0.1, 1e-5, ("missing_link", "natural_convection"),
            "a temperature difference made by the heater at zero current, and by the current"),
    Effect("thomson", _modules, (Quantity("coefficient", "V/K", -0.1, 0.1, typical=1e-6),), _thomson,
           by_heat(_thomson, "coefficient", 1e-4), ("seebeck_slope", "joule_split"),
           "temperature difference and current made independent, by the heater"),
    Effect("joule_split", _modules, (Quantity("split", "-", -0.5, 0.5),), _split, by_heat(_split, "split", 1e-2),
           ("lead_heating", "resistance_slope"), "fast current, so that the faces respond one after the other"),
    Effect("hysteresis", _without_memory,
           (Quantity("heat", "W", -100.0, 100.0), Quantity("time_constant", "s", 1e-3, 1e6, grid=TIMES)),
           adding.subtable("modules", "hysteresis"), hysteresis, ("hidden_mass", "input_offset"),
           "polarity reversals with different dwell"),
    Effect("lead_heating", _pairs, (Quantity("resistance", "Ω", 0.0, 100.0),), _lead,
           by_heat(_lead, "resistance", 1e-2), ("joule_split", "resistance_slope"),
           "current of both signs at two amplitudes"),
)
