"""The conductance of a link grows with a current or with a recorded force or fan speed."""

from __future__ import annotations

from collections.abc import Iterator

from .._parts import Link
from .._system import System
from ._builders import Builder
from ._effect import Effect, Quantity
from ._response import Values, Where
from ._signatures import altered, by_heat


def _places(system: System) -> Iterator[Where]:
    """Contacts of a module with its own current; every link with a column that heats nothing: a force, a fan speed."""
    recorded = [name for name, part in system.inputs.items() if not part.gain]
    for link in system.links:
        if link.conductance > 0 and link.follow is None:
            own = [name for name, part in system.modules.items() if {part.hot, part.cold} & set(link.between)]
            yield from ((link.name, column) for column in (*own, *recorded))


def _add(system: System, where: Where, values: Values) -> System:
    def followed(link: Link) -> Link:
        content = link.model_dump(exclude_unset=True) | {"name": link.name}
        return Link(**content | {"follow": {"column": where[1], "relative": values["relative"]}})

    links = tuple(followed(link) if link.name == where[0] else link for link in system.links)
    return system.model_copy(update={"links": links})


def _present(system: System, where: Where) -> bool:
    return any(link.name == where[0] and link.follow is not None for link in system.links)


_ADD = Builder(_add, lambda system, where: {"relative": f"links.{where[0]}.follow.relative"}, _present)

EFFECT = Effect(
    name="driven_conductance",
    rank=125,
    meaning="The conductance of a link grows with a current or with a recorded force or fan speed.",
    where=("link", "input or module"),
    places=_places,
    quantities=(Quantity("relative", "1/unit", 0.0, 1e3, typical=1e-6),),
    nonnegative=("relative",),
    add=_ADD,
    signature=by_heat(_ADD, "relative", 1e-4),
    hidden=altered,
    confused_with=("seebeck_slope", "conductance_slope", "missing_link"),
    separated_by="the same temperature difference across the link at small and at large values of the column",
    measure="measure the temperature on both sides of {0} in steady states at two values of {1}",
)
