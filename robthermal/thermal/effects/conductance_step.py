"""The conductance of a link changes suddenly: a contact opens, a fan starts."""

from __future__ import annotations

import numpy as np

from .._system import System
from ._builders import subtable
from ._effect import Effect, Quantity
from ._response import RecordContext, Response, Values, Where
from ._signatures import altered, into, node

_N_TIMES = 30
_add = subtable("links", "step", ("relative", "time"), time=0.0)


def _places(system: System) -> list[Where]:
    return [(link.name,) for link in system.links if link.conductance > 0 and link.step is None]


def _times(record: RecordContext, where: Where) -> list[float]:
    """Times of a sudden change: never in the first or last twentieth, where nothing separates it from the start."""
    return [float(t) for t in np.linspace(record.time[0], record.time[-1], _N_TIMES + 2)[1:-1]]


def _changed(record: RecordContext, where: Where, values: Values) -> Response:
    """The link's own linear heat from that time on; the sample in which it begins counts in part."""
    link = next(link for link in record.system.links if link.name == where[0])
    (a0, a1), (b0, b1) = node(record, link.between[0]), node(record, link.between[1])
    share = link.conductance * np.clip((record.time + record.h - values["time"]) / record.h, 0.0, 1.0)
    first, last = share * (b0 - a0), share * (b1 - a1)
    return into(record, {link.between[0]: (first, last), link.between[1]: (-first, -last)})


EFFECT = Effect(
    name="conductance_step",
    rank=120,
    meaning="The conductance of a link changes suddenly: a contact opens, a fan starts.",
    where=("link",),
    places=_places,
    quantities=(Quantity("relative", "-", -1.0, 20.0),
                Quantity("time", "s", -1e12, 1e12, grid=_times)),
    add=_add,
    signature=_changed,
    hidden=altered,
    confused_with=("missing_link", "natural_convection"),
    separated_by="the same profile early and late",
)
