"""Below the dew point of the air, condensing water heats a lump."""

from __future__ import annotations

import numpy as np

from ._builders import subtable
from ._effect import Effect, Quantity
from ._places import lumps_without
from ._response import TrialContext, Where
from ._signatures import altered, by_heat

_add = subtable("lumps", "condensation", ("conductance", "dew_point"), dew_point=283.15)


def _dew_points(context: TrialContext, where: Where) -> list[float]:
    T = context.x[:, context.system.lump_names.index(where[0])]
    return [float(T.min() + share * np.ptp(T)) for share in (0.15, 0.3, 0.45, 0.6, 0.75)]


EFFECT = Effect(
    name="condensation",
    rank=170,
    meaning="Below the dew point of the air, condensing water heats a lump.",
    where=("lump",),
    places=lumps_without("condensation"),
    quantities=(Quantity("conductance", "W/K", 0.0, 30.0),
                Quantity("dew_point", "K", 200.0, 373.0, grid=_dew_points)),
    nonnegative=("conductance",),
    add=_add,
    signature=by_heat(_add, "conductance", 1e-3),
    hidden=altered,
    confused_with=("natural_convection", "missing_ambient_link"),
    separated_by="crossing the dew point in both directions",
)
