"""A mass hangs on a lump behind a conductance, and is seen only by its delay."""

from __future__ import annotations

import numpy as np

from .._parts import Lump
from .._system import System
from ._builders import Builder, free_name, joined
from ._effect import Effect, Quantity
from ._places import lumps
from ._response import RecordContext, Response, Values, Where
from ._signatures import TIMES, follow, into

_TINY = 1e-6  # of its lump's capacity: a hidden mass that is not there yet


def _name(system: System, where: Where) -> str:
    return free_name(f"{where[0]}_hidden", system.lumps)


def _add(system: System, where: Where, values: Values) -> System:
    """A lump of that capacity behind conductance capacity / time_constant."""
    name, own = _name(system, where), system.lumps[where[0]]
    capacity = max(values["capacity"], 1e-9)  # a lump of no capacity is no lump
    lump = Lump(capacity=capacity) if own.initial is None else Lump(capacity=capacity, initial=own.initial)
    with_lump = system.model_copy(update={"lumps": {**system.lumps, name: lump}})
    return joined(with_lump, (where[0], name), conductance=capacity / values["time_constant"])


def _names(system: System, where: Where) -> dict[str, str]:
    return {"capacity": f"lumps.{system.lump_names[-1]}.capacity",
            "time_constant": f"links.{system.links[-1].name}.conductance"}


def _usual(system: System, where: Where) -> dict[str, float]:
    return {"capacity": _TINY * system.lumps[where[0]].capacity, "time_constant": 60.0}


_ADD = Builder(_add, _names, lambda system, where: f"{where[0]}_hidden" in system.lumps, _usual)


def _following(record: RecordContext, where: Where, values: Values) -> Response:
    """Heat (T_hidden - T) / τ per unit of capacity, T_hidden following T."""
    T, tau = record.x[:, record.system.lump_names.index(where[0])], values["time_constant"]
    flow = (follow(T, tau, record.h) - T) / tau
    return into(record, {where[0]: (flow, np.concatenate([flow[1:], flow[-1:]]))})


EFFECT = Effect(
    name="hidden_mass",
    rank=150,
    meaning="A mass hangs on a lump behind a conductance, and is seen only by its delay.",
    where=("lump",),
    places=lumps,
    quantities=(Quantity("capacity", "J/K", 0.0, 1e5),
                Quantity("time_constant", "s", 1e-3, 1e7, grid=TIMES)),
    nonnegative=("capacity", "time_constant"),
    add=_ADD,
    signature=_following,
    confused_with=("sensor_lag", "missing_link"),
    separated_by="frequencies a decade around 1/time_constant",
)
