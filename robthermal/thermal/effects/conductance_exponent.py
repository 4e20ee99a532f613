"""The conductance of a link follows its temperature, as that of gases, fibres and crystals does."""

from __future__ import annotations

from .._parts import Link
from .._system import System
from ._builders import Builder
from ._effect import Effect, Quantity
from ._response import Values, Where
from ._signatures import altered, by_heat

_SPAN = 80.0  # K: between 300 and 380 K the conductance of still air grows by a fifth

_MOST = 2.0  # beyond it the heat goes by radiation, whose exponent is 3


def _places(system: System) -> list[Where]:
    return [(link.name,) for link in system.links if link.conductance > 0 and link.temperature_law is None]


def _add(system: System, where: Where, values: Values) -> System:
    at = next(iter(system.ambients.values())).temperature

    def lawful(link: Link) -> Link:
        law = {"exponent": values["exponent"], "reference_temperature": at}
        return Link(**link.model_dump(exclude_unset=True) | {"name": link.name, "temperature_law": law})

    links = tuple(lawful(link) if link.name == where[0] else link for link in system.links)
    return system.model_copy(update={"links": links})


def _present(system: System, where: Where) -> bool:
    return any(link.name == where[0] and link.temperature_law is not None for link in system.links)


def _span(system: System, where: Where) -> float:
    """Over a small range it is a conductance."""
    return _SPAN


_ADD = Builder(_add, lambda system, where: {"exponent": f"links.{where[0]}.temperature_law.exponent"}, _present)

EFFECT = Effect(
    name="conductance_exponent",
    rank=127,
    meaning="The conductance of a link follows its mean temperature in kelvin, with a power of it.",
    where=("link",),
    places=_places,
    quantities=(Quantity("exponent", "-", -_MOST, _MOST, typical=1e-3),),
    add=_ADD,
    signature=by_heat(_ADD, "exponent", 1e-3),
    hidden=altered,
    span=_span,
    confused_with=("radiation", "natural_convection", "heater_power_slope"),
    separated_by="the same temperature difference across the link at two levels of temperature",
    measure="measure the temperature on both sides of {0} in steady states at two levels of temperature",
)
