"""Floating-point picture of the Jacobian over a box: a base network plus a few 2x2 blocks with vertices.

Used to *find* certificates; the proof is the checker's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ..thermal import Equations, System
from ._heaters import slope_of

Array = NDArray[np.float64]
_CURRENTS = 9  # samples of a current range where the blocks are not convex in it


@dataclass(frozen=True)
class Block:
    """Entries [[aa, ab], [ba, bb]] of one module, nonlinear link or heater at its vertices; b is -1 for no lump.

    Parameters
    ----------
    a, b : int
        Indices of the two lumps.
    vertices : ndarray, shape (n_vertices, 2, 2)
        ∂(heat into row lump)/∂(column temperature) [W/K].
    """

    a: int
    b: int
    vertices: NDArray[np.float64]


@dataclass(frozen=True)
class BoxJacobian:
    """J = base + blocks; E ẋ = f.

    Parameters
    ----------
    capacity : ndarray, shape (n,)
        Heat capacity E of every lump [J/K].
    base : csr_array, shape (n, n)
        Conductance matrix of the linear links [W/K].
    blocks : tuple of Block
        Modules (with all of their conductance), nonlinear links, heaters that follow temperature.
    """

    capacity: NDArray[np.float64]
    base: csr_array
    blocks: tuple[Block, ...]


def box_jacobian(system: System, region: Mapping[str, Any], *, hull: bool = False) -> BoxJacobian:
    """Picture of a system over the box of a certificate's region.

    ``hull`` takes the corners of the triangle around the curve (I, I²) instead of points of it, as the checker does
    for a full matrix P. Uncertain capacities enter at their upper end, uncertain links as a block, uncertain modules as
    more vertices, heaters whose power follows temperature as blocks.
    """
    parameters = region.get("parameters", {})
    worst = system.with_parameters(
        {name: high for name, (_, high) in parameters.items() if name.startswith("lumps.")}
        | {name: low for name, (low, _) in parameters.items() if name.startswith("links.")})
    eq = Equations(worst)
    index = {name: i for i, name in enumerate(system.lumps)}
    box = region["temperature"]
    ranges = {name: box[name] if isinstance(box, Mapping) else box for name in system.lumps}
    ends = {name: [a.temperature] * 2 for name, a in system.ambients.items()} | ranges
    base = eq.A.tolil()
    blocks: list[Block] = []
    for name, module in worst.modules.items():
        h, c, K = index[module.hot], index[module.cold], module.conductance.value
        base[h, h] += K
        base[c, c] += K
        base[h, c] -= K
        base[c, h] -= K
        variants, current = module_variants(worst, name, parameters), region["current"][name]
        points = _hull(current) if hull else _points(variants, current)
        vertices = [_module_vertices(variant, ranges[module.hot], ranges[module.cold], points) for variant in variants]
        blocks.append(Block(h, c, np.concatenate(vertices)))
    for link in worst.links:
        a, b = link.between if link.between[0] in index else link.between[::-1]
        low, high = parameters.get(f"links.{link.name}.conductance", (0.0, 0.0))
        if high > low:
            spread = (high - low) * np.array([[-1.0, 1.0], [1.0, -1.0]])
            blocks.append(Block(index[a], index.get(b, -1), np.stack([0.0 * spread, spread])))
        if link.natural is not None or link.radiation is not None:
            slopes = _link_vertices(link, ends[a], ends[b], parameters, ambient=b not in index)
            blocks.append(Block(index[a], index.get(b, -1), slopes))
    for name, powers in region.get("power", {}).items():
        heater = system.inputs[name]
        slopes = parameters.get(slope_of(name), (heater.power_slope,))
        rises = np.unique([q * s for q, s in product(powers, slopes)])
        blocks.append(Block(index[heater.lump], -1, rises[:, None, None] * np.array([[1.0, 0.0], [0.0, 0.0]])))
    return BoxJacobian(eq.capacity, csr_array(base), tuple(blocks))


def module_variants(system: System, name: str, parameters: Mapping[str, Any]) -> list[Any]:
    """A module at every combination of the ends of its uncertain parameters; its heat is affine in each of them."""
    own = {key: sorted(set(pair)) for key, pair in parameters.items() if key.startswith(f"modules.{name}.")}
    return [system.with_parameters(dict(zip(own, values, strict=True))).modules[name]
            for values in product(*own.values())]


def _points(variants: list[Any], current: list[float]) -> Array:
    """Points (I, I²) of a range: many where the blocks are not convex in the current."""
    low, high = current
    concave = any(module.resistance.slope < 0 for module in variants)
    currents = np.linspace(low, high, _CURRENTS) if concave else np.unique([low, high, np.clip(0.0, low, high)])
    return np.stack([currents, currents**2], -1)


def _hull(current: list[float]) -> Array:
    """Corners of the triangle around the curve (I, I²): its ends, and where their tangents meet."""
    low, high = current
    corners = [[low, low**2], [high, high**2], [0.5 * (low + high), low * high]]
    return np.array(corners if low < high else corners[:1])


def _module_vertices(module: Any, hot: list[float], cold: list[float], points: Array) -> Array:
    Th, Tc, at = (g.ravel() for g in np.meshgrid(np.unique(hot), np.unique(cold), np.arange(len(points)),
                                                 indexing="ij"))
    I, square = points[at.astype(int)].T  # noqa: E741 - I is the current
    dT = 0.5 * (Th + Tc) - module.reference_temperature
    S, dS = module.seebeck.value + module.seebeck.slope * dT, module.seebeck.slope
    dR, dK = module.resistance.slope, module.conductance.slope
    K = module.conductance.value + dK * dT
    joule, bend = 0.25 * dR * square, 0.5 * dK * (Th - Tc)
    hh, hc = -K - bend + S * I + 0.5 * dS * Th * I + joule, K - bend + 0.5 * dS * Th * I + joule
    cc, ch = -K + bend - S * I - 0.5 * dS * Tc * I + joule, K + bend - 0.5 * dS * Tc * I + joule
    return np.stack([np.stack([hh, hc], -1), np.stack([ch, cc], -1)], -2)


def _link_vertices(link: Any, a: list[float], b: list[float], parameters: Mapping[str, Any],
                   ambient: bool) -> NDArray[np.float64]:
    """Slopes at the ends of their ranges; towards an ambient of unknown temperature natural convection may vanish."""
    own = (link.natural.gain if link.natural else 0.0), link.radiation or 0.0
    gains, coefficients = (parameters.get(f"links.{link.name}.{key}", (value, value))
                           for key, value in zip(("natural.gain", "radiation"), own, strict=True))
    exponent = link.natural.exponent if link.natural else 0.0
    apart = np.array([a[0] - b[1], a[1] - b[0]])
    largest = np.abs(apart).max()
    smallest = 0.0 if ambient or apart[0] <= 0 <= apart[1] else np.abs(apart).min()
    vertices = []
    for dT, gain in zip((smallest, largest), gains, strict=True):
        g = gain * (1 + exponent) * dT**exponent
        for c, Ta, Tb in product(np.unique(coefficients), np.unique(a), np.unique(b)):
            ra, rb = 4 * c * Ta**3, 4 * c * Tb**3
            vertices.append([[-g - ra, g + rb], [g + ra, -g - rb]])
    return np.array(vertices)
