"""Leads and contacts of a module heat a lump, with the square of the current."""

from __future__ import annotations

from itertools import product

from .._parts import Lead
from .._system import System
from ._builders import Builder, content_of
from ._effect import Effect, Quantity
from ._response import Values, Where
from ._signatures import by_heat


def _pairs(system: System) -> list[Where]:
    there = {(lead.lump, lead.module) for lead in system.leads}
    return [pair for pair in product(system.lumps, system.modules) if pair not in there]


def _add(system: System, where: Where, values: Values) -> System:
    lead = Lead(module=where[1], lump=where[0], resistance=values["resistance"])
    return System(**(content_of(system) | {"leads": (*system.leads, lead)}))


def _present(system: System, where: Where) -> bool:
    return any(lead.name == f"{where[1]}-{where[0]}" for lead in system.leads)


_ADD = Builder(_add, lambda system, where: {"resistance": f"leads.{system.leads[-1].name}.resistance"}, _present)

EFFECT = Effect(
    name="lead_heating",
    rank=70,
    meaning="Leads and contacts of a module heat a lump, with the square of the current.",
    where=("lump", "module"),
    places=_pairs,
    quantities=(Quantity("resistance", "Ω", 0.0, 100.0),),
    add=_ADD,
    signature=by_heat(_ADD, "resistance", 1e-2),
    confused_with=("joule_split", "resistance_slope"),
    separated_by="current of both signs at two amplitudes",
    measure="measure the voltage across the leads of {1} and across {1} alone",
)
