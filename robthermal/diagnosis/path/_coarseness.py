"""What a finer network would change: the error of lumping, as changes of the readings with known natural sizes.

A lump stands for a body with temperatures of its own. To first order a finer network differs from it in four ways,
each linear in a number b that is of the order of 1 (docs/explanations/diagnosis_remainder.md):

- part of the capacity along a link moves with the mean of both ends: heat b g (d/dt)(T_b - T_a), g a quarter of the
  capacity that belongs to the link;
- a heater sits between two lumps: b/4 of its heat enters the neighbor;
- a sensor sits between two lumps, or where heat flows through its lump: b/4 of the difference, or b flow / G;
- a sensor does not see its lump's mean while that changes: b C/(4 G) dT/dt.

G is the conductance within a lump, twice that to all its neighbors. A lump without neighbors has none: it is not known.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...thermal import System
from ...thermal.effects import RecordContext, Response

Array = NDArray[np.float64]
_SHARE = 0.25  # of a difference, of a heat, of a capacity: half a lump away is 0.5


def coarse_names(base: System) -> list[str]:
    """What every column stands for, in words.

    Parameters
    ----------
    base : System
        Network without added effects.
    """
    near, far = _conductances(base)
    out = [f"capacity between {a} and {b}" for a, b in _pairs(near)]
    out += [f"place of heater {name} toward {b}" for name, one in base.inputs.items() for b in near[one.lump]]
    for name, a in _read(base).items():
        if any(near[a].values()):
            out += [f"place of sensor {name} toward {b}" for b in [*near[a], *far[a]]]
            out += [f"place of sensor {name} near heater {q}" for q, one in base.inputs.items() if one.lump == a]
            out.append(f"lag of sensor {name} within {a}")
    return out


def coarse_responses(path: RecordContext, base: System) -> Iterator[Response]:
    """Every way in which the network may be too coarse along a record, b = 1, in the order of `coarse_names`.

    Parameters
    ----------
    path : RecordContext
        Model beside a record; it may have more lumps than the network.
    base : System
        Network without added effects.
    """
    near, far = _conductances(base)
    at = {name: path.system.lump_names.index(name) for name in base.lumps}
    u = {name: path.u[:, k] for k, name in enumerate(path.system.exogenous_names)}
    T, rate, C = path.x, (path.end - path.x) / path.h, path.equations.capacity

    def heat(into: str, out_of: str, q: Array) -> Response:
        return Response(heat={at[into]: (q, q), at[out_of]: (-q, -q)})

    def reading(sensor: str, change: Array) -> Response:
        out = np.zeros(path.readings.shape)
        out[:, path.system.sensor_names.index(sensor)] = change
        return Response(reading=out)

    for a, b in _pairs(near):
        share = _SHARE * min(C[at[a]] / len(near[a]), C[at[b]] / len(near[b]))
        yield heat(a, b, share * (rate[:, at[a]] - rate[:, at[b]]))
    for name, one in base.inputs.items():
        for b in near[one.lump]:
            yield heat(b, one.lump, _SHARE * one.gain * u[name])
    for name, a in _read(base).items():
        if not any(near[a].values()):  # nothing is conducted within: joined by radiation or air alone
            continue
        inside, own = 2.0 * sum(near[a].values()), T[:, at[a]]
        for b in near[a]:
            yield reading(name, _SHARE * (T[:, at[b]] - own))
        for room, G in far[a].items():
            yield reading(name, G / inside * (u[room] - own))
        for q, one in base.inputs.items():
            if one.lump == a:
                yield reading(name, _before(one.gain * u[q]) / inside)
        yield reading(name, -C[at[a]] * _SHARE / inside * _before(rate[:, at[a]]))


def _read(base: System) -> dict[str, str]:
    """The lump of every thermometer."""
    return {name: base.sensors[name].lump for name in base.thermometers}


def _before(held: Array) -> Array:
    """What was held until the sample is read."""
    return np.concatenate([held[:1], held[:-1]])


def _conductances(base: System) -> tuple[dict[str, dict[str, float]], dict[str, dict[str, float]]]:
    """Of every lump to its neighbors, and to ambients [W/K]."""
    near: dict[str, dict[str, float]] = {name: {} for name in base.lumps}
    far: dict[str, dict[str, float]] = {name: {} for name in base.lumps}
    for link in base.links:
        for a, b in (link.between, link.between[::-1]):
            if a in near:
                table = near[a] if b in near else far[a]
                table[b] = table.get(b, 0.0) + link.conductance
    return near, far


def _pairs(near: dict[str, dict[str, float]]) -> list[tuple[str, str]]:
    return list(dict.fromkeys((min(a, b), max(a, b)) for a in near for b in near[a]))
