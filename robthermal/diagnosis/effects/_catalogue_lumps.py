"""Heat and mass that a lump may have beside what the model says."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...thermal import System
from . import _adding as adding
from ._effect import Effect, Quantity, Where
from ._signatures import by_heat, hidden_mass, periodic

if TYPE_CHECKING:
    from ..path import Along

TIMES = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0)  # s, what the record resolves of them
_FASTEST = 30  # periods in a record: faster ones are left to the whiteness test


def _lumps(system: System) -> list[Where]:
    return [(name,) for name in system.lumps]


def _quiet(system: System) -> list[Where]:
    return [(name,) for name, lump in system.lumps.items() if lump.periodic is None]


def _dry(system: System) -> list[Where]:
    return [(name,) for name, lump in system.lumps.items() if lump.condensation is None]


def _open(system: System) -> list[Where]:
    """Lumps with a path of their own to an ambient."""
    ends = {end for link in system.links if set(link.between) & set(system.ambients) for end in link.between}
    return [(name,) for name in system.lumps if name in ends]


def _periods(path: Along, where: Where) -> list[float]:
    """Half a cycle of the whole record apart: closer ones are the same to it (Davies 1977)."""
    length = len(path.x) * path.h
    return [length / (0.5 * halves) for halves in range(3, 2 * _FASTEST)]


def _dew_points(path: Along, where: Where) -> list[float]:
    T = path.x[:, path.system.lump_names.index(where[0])]
    return [float(T.min() + share * np.ptp(T)) for share in (0.15, 0.3, 0.45, 0.6, 0.75)]


_heat = adding.number("lumps", {"heat": "heat"})
_gradient = adding.number("lumps", {"difference": "gradient"})
_condensation = adding.subtable("lumps", "condensation")

LUMP_EFFECTS = (
    Effect("heat_source", _lumps, (Quantity("heat", "W", -1e3, 1e3),), _heat, by_heat(_heat, "heat", 1.0),
           ("ambient_gradient", "sensor_self_heating", "input_offset"), "inputs off, another ambient temperature"),
    Effect("ambient_gradient", _open, (Quantity("difference", "K", -100.0, 100.0),), _gradient,
           by_heat(_gradient, "difference", 1.0), ("heat_source", "sensor_offset"),
           "an ambient sensor beside the lump"),
    Effect("hidden_mass", _lumps,
           (Quantity("capacity", "J/K", 0.0, 1e5), Quantity("time_constant", "s", 1e-3, 1e6, grid=TIMES)),
           adding.hidden_mass, hidden_mass, ("sensor_lag", "missing_link"),
           "frequencies a decade around 1/time_constant"),
    Effect("periodic_load", _quiet,
           (Quantity("heat", "W", 0.0, 1e3), Quantity("period", "s", 1e-3, 1e9, grid=_periods),
            Quantity("phase", "rad", -20.0, 20.0, grid=(0.0, np.pi / 2))),
           adding.subtable("lumps", "periodic"), periodic, ("hidden_mass",), "a longer record", paired="phase"),
    Effect("condensation", _dry,
           (Quantity("conductance", "W/K", 0.0, 1e3), Quantity("dew_point", "K", 200.0, 373.0, grid=_dew_points)),
           _condensation, by_heat(_condensation, "conductance", 1e-3), ("natural_convection", "missing_ambient_link"),
           "crossing the dew point in both directions"),
)
