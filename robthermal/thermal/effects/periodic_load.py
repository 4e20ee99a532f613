"""A heat into a lump that comes and goes with a fixed period."""

from __future__ import annotations

import numpy as np

from ..._sine import sine
from ._builders import subtable
from ._effect import Effect, Quantity
from ._places import lumps_without
from ._response import RecordContext, Response, TrialContext, Values, Where
from ._signatures import altered, into

_CYCLES = 30  # in any record: faster ones are left to the whiteness test
_SAMPLES = 100  # of a cycle: a long record tries down to it, as a shorter one of the same sample time does
_MOST = 120  # cycles, whatever its length
_add = subtable("lumps", "periodic", ("heat", "period", "phase"), period=600.0, phase=0.0)


def _periods(context: TrialContext, where: Where) -> list[float]:
    """Half a cycle of the whole record apart: closer ones are the same to it (Davies 1977)."""
    n = len(context.x)
    cycles = min(max(_CYCLES, n // _SAMPLES), _MOST)
    return [n * context.h / (0.5 * halves) for halves in range(3, 2 * cycles)]


def _sine(record: RecordContext, where: Where, values: Values) -> Response:
    """A sine of one watt."""
    rate = 2.0 * np.pi / values["period"]
    wave = sine(len(record.time) + 1, rate * record.h, rate * record.time[0] + values["phase"])
    return into(record, {where[0]: (wave[:-1], wave[1:])})


EFFECT = Effect(
    name="periodic_load",
    rank=160,
    meaning="A heat into a lump that comes and goes with a fixed period.",
    where=("lump",),
    places=lumps_without("periodic"),
    quantities=(Quantity("heat", "W", 0.0, 1e3),
                Quantity("period", "s", 1e-3, 1e9, grid=_periods),
                Quantity("phase", "rad", -20.0, 20.0, grid=(0.0, np.pi / 2))),
    nonnegative=("period",),
    add=_add,
    signature=_sine,
    paired="phase",
    hidden=altered,
    confused_with=("hidden_mass",),
    separated_by="a longer record",
)
