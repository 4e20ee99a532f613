"""Heat to an ambient by air that moves by itself: it grows faster than the difference."""

from __future__ import annotations

import numpy as np

from ._builders import new_link
from ._effect import Effect, Quantity
from ._places import ambient_pairs_without
from ._response import Array, Values
from ._signatures import exchanged

_add = new_link(lambda values: {"natural": {"gain": values["gain"], "exponent": values["exponent"]}},
                {"gain": "natural.gain", "exponent": "natural.exponent"}, exponent=0.25)


def _flow(Ta: Array, Tb: Array, values: Values) -> Array:
    return np.abs(Tb - Ta) ** values["exponent"] * (Tb - Ta)


EFFECT = Effect(
    name="natural_convection",
    rank=100,
    meaning="Heat to an ambient by air that moves by itself: it grows faster than the difference.",
    where=("lump", "ambient"),
    places=ambient_pairs_without("natural"),
    quantities=(Quantity("gain", "W/K^1.25", 0.0, 1e2),
                Quantity("exponent", "-", 0.25, 0.25, grid=(0.25,))),
    nonnegative=("gain", "exponent"),
    units={"gain": "W/K^(1+exponent)"},
    add=_add,
    signature=exchanged(_flow),
    confused_with=("radiation", "missing_ambient_link"),
    separated_by="small and large differences to the ambient, of both signs",
)
