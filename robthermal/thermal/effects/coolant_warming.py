"""A coolant gets warm at the lumps that it passes, and brings heat to those downstream."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

from .._parts import Flow
from .._system import System
from ._builders import Builder, free_name
from ._effect import Effect, Quantity
from ._response import Values, Where
from ._signatures import by_heat


def _places(system: System) -> Iterator[Where]:
    """Ambients that flow past two lumps or more."""
    return ((name,) for name, ambient in system.ambients.items()
            if len(ambient.coolant) > 1 and not _present(system, (name,)))


def _taken(system: System, ambient: str) -> dict[str, float]:
    """Conductance of every lump to the coolant that reaches it, in the order of the flow [W/K]."""
    return {lump: sum(link.conductance for link in system.links if set(link.between) == {lump, ambient})
            for lump in system.ambients[ambient].coolant}


def _carried(taken: Mapping[str, float], warming: float) -> Iterator[tuple[str, str, float]]:
    """Upstream and downstream lump, and heat per kelvin that the first is warmer than the entering coolant [W/K].

    Of a difference to the coolant that reaches lump i the share warming G_i is in the coolant that leaves it.
    """
    share = {lump: min(warming * G, 1.0) for lump, G in taken.items()}
    order = list(taken)
    for (i, upstream), (k, downstream) in combinations(enumerate(order), 2):
        left = share[upstream]
        for lump in order[i + 1:k]:
            left *= 1.0 - share[lump]
        yield upstream, downstream, taken[downstream] * left


def _add(system: System, where: Where, values: Values) -> System:
    taken = {flow.name for flow in system.flows}
    flows = list(system.flows)
    for upstream, downstream, conductance in _carried(_taken(system, where[0]), values["warming"]):
        name = free_name(f"{upstream}-{downstream}", taken, " ")
        flows.append(Flow(upstream=upstream, downstream=downstream, ambient=where[0], conductance=conductance,
                          name=name))
        taken.add(name)
    return system.model_copy(update={"flows": tuple(flows)})


def _names(system: System, where: Where) -> dict[str, str]:
    """The first flow has the size; the others follow it."""
    first = next(flow for flow in system.flows if flow.ambient == where[0])
    return {"warming": f"flows.{first.name}.conductance"}


def _present(system: System, where: Where) -> bool:
    return any(flow.ambient == where[0] for flow in system.flows)


_ADD = Builder(_add, _names, _present)

EFFECT = Effect(
    name="coolant_warming",
    rank=95,
    meaning="A coolant gets warm at the lumps that it passes, and brings heat to those downstream.",
    where=("ambient",),
    places=_places,
    quantities=(Quantity("warming", "K/W", 0.0, 1e3, typical=1e-6),),
    nonnegative=("warming",),
    add=_ADD,
    signature=by_heat(_ADD, "warming", 1e-6),
    confused_with=("missing_link", "input_feedthrough"),
    separated_by="heat into the lump downstream alone, and into the one upstream alone",
    measure="measure the temperature of {0} between the lumps that it passes",
)
