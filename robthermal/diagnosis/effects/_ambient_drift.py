"""An ambient that no record holds swings or drifts: a rival of every heat that comes and goes.

The system has the ambient as a constant. To first order in its change it is a heat into every lump joined to it, in
proportion to their conductances: sines of one period and one phase, a drift being part of a long one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..._sine import sine
from ...thermal import Link, System
from ...thermal.effects import Effect, Quantity, RecordContext, Response, TrialContext, effects

AMBIENT_DRIFT = "ambient_drift"
LIKE = "periodic_load"  # the effect of the catalog that it is a rival of
_LONGER = (1.0, 2.0, 4.0, 8.0)  # periods in lengths of the record: parts of a swing, and drifts
_TYPICAL = 10.0  # K between lump and ambient: where natural convection is made linear
_WARMEST = 100.0  # K, of a swing of which a record may see a small part


def ambient_drift() -> Effect:
    """The effect; its places are all ambients, whether recorded or not.

    No ambient is a place that is joined to a lump with a periodic heat: a lump has one at most.
    """
    like = effects()[LIKE]
    return Effect(name=AMBIENT_DRIFT, where=("ambient",), places=_places, add=_add, signature=_signature,
                  meaning="An ambient that was not recorded is not the constant of the system: it swings or drifts.",
                  quantities=(Quantity("difference", "K", 0.0, _WARMEST),
                              Quantity("period", "s", 1e-3, 1e9, grid=_periods), like.quantities[2]),
                  nonnegative=like.nonnegative, paired=like.paired, hidden=like.hidden, confused_with=(LIKE,),
                  measure="record {0}")


def as_slow(effect: Effect) -> Effect:
    """A periodic heat with the trial periods of an ambient: into the only lump joined to it the two are the same.

    Parameters
    ----------
    effect : Effect
        The periodic heat of the catalog.
    """
    quantities = (replace(one, grid=_periods) if one.name == "period" else one for one in effect.quantities)
    return replace(effect, quantities=tuple(quantities))


def _places(system: System) -> list[tuple[str, ...]]:
    joined = {name: conductances(system, name) for name in system.ambients}
    return [(name,) for name, lumps in joined.items()
            if lumps and not any(system.lumps[lump].periodic for lump in lumps)]


def conductances(system: System, ambient: str) -> dict[str, float]:
    """Lumps joined to an ambient: heat into them per kelvin by which it is warmer [W/K].

    Parameters
    ----------
    system : System
        System with its links.
    ambient : str
        Name of the ambient.
    """
    found: dict[str, float] = {}
    for link in system.links:
        lumps = [end for end in link.between if end in system.lumps]
        if ambient in link.between and lumps:
            found[lumps[0]] = found.get(lumps[0], 0.0) + _slope(link, system.ambients[ambient].temperature)
    return {lump: slope for lump, slope in found.items() if slope > 0}


def _slope(link: Link, temperature: float) -> float:
    """Heat per kelvin of a link near the temperature of its ambient."""
    slope = link.conductance + 4.0 * (link.radiation or 0.0) * temperature**3
    if link.natural is None:
        return slope
    return slope + (1.0 + link.natural.exponent) * link.natural.gain * _TYPICAL**link.natural.exponent


def _periods(context: TrialContext, where: tuple[str, ...]) -> list[float]:
    """Those of a periodic heat, and longer ones: that of a room need not end within a record."""
    grid = effects()[LIKE].quantities[1].grid
    length = len(context.x) * context.h
    return [*(factor * length for factor in reversed(_LONGER)),
            *(grid(context, where) if callable(grid) else grid)]


def _add(system: System, where: tuple[str, ...], values: Mapping[str, float]) -> System:
    numbers: dict[str, float] = {}
    for lump, slope in conductances(system, where[0]).items():
        sine = {"heat": slope * values["difference"], "period": values["period"], "phase": values["phase"]}
        numbers |= {f"lumps.{lump}.periodic.{name}": value for name, value in sine.items()}
    return system.with_parameters(numbers)


def _signature(record: RecordContext, where: tuple[str, ...], values: Mapping[str, float]) -> Response:
    rate = 2.0 * np.pi / values["period"]
    wave = sine(len(record.time) + 1, rate * record.h, rate * record.time[0] + values["phase"])
    return Response(heat={record.system.lump_names.index(lump): (slope * wave[:-1], slope * wave[1:])
                          for lump, slope in conductances(record.system, where[0]).items()})
