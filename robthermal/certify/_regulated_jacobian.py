"""Floating-point picture of the Jacobian of the lumps that are not held, modules holding the others at set-points.

With v the heat pumped, κ = (S x_h + R I)/(S x_c - R I) and k = K(x_h): a holding module adds a + (κ - 1) k to J_hh,
a = S I + S' x_h I/2 + R' I²/4 - κ (S' x_c I/2 - R' I²/4), and κ ∂(heat into c)/∂x_j to J_hj. Used to find
certificates; the proof is the checker's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from ..thermal import System
from ._jacobian import Array, Block, BoxJacobian, box_jacobian, module_variants

_POINTS = {"hot": 5, "cold": 3, "current": 33}  # samples of the box


@dataclass(frozen=True)
class _Holding:
    """A holding module: its hot lump, the ends of what it adds to J_hh, and of κ."""

    hot: int
    own: Array
    factor: Array


def regulated_jacobian(system: System, region: Mapping[str, Any]) -> BoxJacobian | None:
    """Reduced Jacobian over the box of a "regulated" certificate's region.

    Parameters
    ----------
    system : System
        System with its modules and links.
    region : mapping
        With temperature, setpoint, current and parameters.

    Returns
    -------
    BoxJacobian or None
        Of the free lumps, in file order; None where some S x_c - R I is not positive.
    """
    names = system.lump_names
    holders = {names.index(system.modules[name].cold): name for name in region["setpoint"]}
    ranges = lump_ranges(system, region)
    picture = box_jacobian(system, {**region, "temperature": ranges}, hull=True)
    holdings = {}
    for c, name in holders.items():
        holding = _holding(system, name, region, ranges)
        if holding is None:
            return None
        holdings[c] = holding
    blocks = []
    for block in _without_holders(system, picture, region["setpoint"]):
        blocks += _reduced(block, holdings)
    base = picture.base.tolil()
    for c, holding in holdings.items():
        blocks.append(_own(holding.hot, holding.own))
        row = base[[c]].tocoo()
        for j, value in zip(row.col.tolist(), row.data.tolist(), strict=True):
            if j not in holdings and value:
                blocks += _reduced(Block(c, j, np.array([[[0.0, value], [0.0, 0.0]]])), holdings)
    free = [k for k in range(len(names)) if k not in holdings]
    place = {k: i for i, k in enumerate(free)}
    moved = tuple(Block(place[b.a], place.get(b.b, -1), b.vertices) for b in blocks)
    return BoxJacobian(picture.capacity[free], csr_array(csr_array(base)[free][:, free]), moved)


def lump_ranges(system: System, region: Mapping[str, Any]) -> dict[str, Any]:
    """Temperature range of every lump, the set-point's for those held."""
    held = {system.modules[name].cold: pair for name, pair in region["setpoint"].items()}
    given = region["temperature"]
    return {name: held.get(name) or (given[name] if isinstance(given, Mapping) else given)
            for name in system.lump_names}


def _without_holders(system: System, picture: BoxJacobian, setpoint: Mapping[str, Any]) -> list[Block]:
    """Blocks but those of the holding modules, which come first in the picture, in the order of the modules."""
    return [block for k, block in enumerate(picture.blocks)
            if k >= len(system.modules) or system.module_names[k] not in setpoint]


def _holding(system: System, name: str, region: Mapping[str, Any], ranges: Mapping[str, Any]) -> _Holding | None:
    module = system.modules[name]
    boxes = {"hot": ranges[module.hot], "cold": ranges[module.cold], "current": region["current"][name]}
    hot, cold, current = (np.linspace(low, high, _POINTS[key]) for key, (low, high) in boxes.items())
    x, y, I = (g.ravel() for g in np.meshgrid(hot, cold, current))  # noqa: E741 - I is the current
    own, factor = [], []
    for variant in module_variants(system, name, region.get("parameters", {})):
        dT = 0.5 * (x + y) - variant.reference_temperature
        dS, dR = variant.seebeck.slope, variant.resistance.slope
        S, R = variant.seebeck.value + dS * dT, variant.resistance.value + dR * dT
        if (S * y - R * I).min() <= 0:
            return None
        ratio = (S * x + R * I) / (S * y - R * I)
        k = variant.conductance.value + variant.conductance.slope * (x - variant.reference_temperature)
        bend = 0.5 * dS * y * I - 0.25 * dR * I**2
        own.append(S * I + 0.5 * dS * x * I + 0.25 * dR * I**2 - ratio * bend + (ratio - 1) * k)
        factor.append(ratio)
    return _Holding(system.lump_names.index(module.hot), _ends(own), _ends(factor))


def _reduced(block: Block, holdings: Mapping[int, _Holding]) -> list[Block]:
    """A block without columns of held lumps; its held row passed on to the hot lump."""
    held = [node for node in (block.a, block.b) if node in holdings]
    if not held:
        return [block]
    if len(held) == 2 or block.b < 0:
        return []
    c, (j, line) = held[0], ((block.b, 1) if held[0] == block.a else (block.a, 0))
    h, found = holdings[c].hot, []
    for vertex, factor in product(block.vertices, holdings[c].factor):
        own, passed = vertex[line, line], factor * vertex[1 - line, line]
        found.append(own + passed if h == j else np.array([[0.0, passed], [0.0, own]]))
    return [_own(h, np.array(found)) if h == j else Block(h, j, np.array(found))]


def _own(lump: int, values: Array) -> Block:
    vertices = np.zeros((len(values), 2, 2))
    vertices[:, 0, 0] = values
    return Block(lump, -1, vertices)


def _ends(values: list[Array]) -> Array:
    return np.unique([np.min(values), np.max(values)])
