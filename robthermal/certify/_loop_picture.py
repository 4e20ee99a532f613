"""Floating-point picture of a sampled closed loop over a box: its maps at the corners of all slopes.

Used to *find* certificates; the proof is the checker's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from ..thermal import Equations, System
from ._jacobian import box_jacobian

Array = NDArray[np.floating[Any]]
Share = tuple[Array, Array, Array]  # heats, achieved - wanted, what moves the current
_GRID = 9  # samples per temperature and current, for the range of the feedback law's slopes
_WIDER = 0.015  # of a slope of the current: the checker encloses it cell by cell


@dataclass(frozen=True)
class Maps:
    """Changes of (temperatures, controller states), at k combinations of slopes.

    Parameters
    ----------
    M : ndarray, shape (k, N, N)
        Sampled map with the modules' heat held.
    W : ndarray, shape (k, n, N)
        Speed of the temperatures at the start of the sample [1/s].
    free : ndarray, shape (k, 4m, N)
        What moves every current: its middle slopes, both faces, the wanted heat; zero where it is at a limit.
    """

    M: Array
    W: Array
    free: Array


@dataclass(frozen=True)
class Picture:
    """A loop over a box: all maps, and the bounds of what happens between the samples.

    Parameters
    ----------
    corners, real : Maps
        At the corners of the slopes' ranges; at corners of the box itself, where the slopes belong together.
    F, hold : ndarray, shape (n, n)
        Passive network [1/s] and Γ.
    capacity : ndarray, shape (n,)
        Heat capacity E of every lump [J/K].
    ports : ndarray of int
        Lumps of modules and nonlinear links.
    reach : ndarray, shape (p, 2p + 4m)
        How movement at the ports, temperatures and free currents bound the deviation from the held heats.
    """

    corners: Maps
    real: Maps
    F: Array
    hold: Array
    capacity: Array
    ports: NDArray[np.intp]
    reach: Array


@dataclass
class _Bounds:
    size: Array
    state: Array
    free: Array


def picture(system: System, section: Mapping[str, Any], region: Mapping[str, Any], pieces: int) -> Picture:
    """Picture of the loop of a certificate's sections, the current ranges cut into pieces."""
    eq = Equations(system)
    n, m = len(eq.capacity), len(system.modules)
    control = controller_matrices(section["controller"], n, m)
    T = region["sample_time"]
    F = eq.A.toarray() / eq.capacity[:, None]
    both = expm(np.block([[F, np.diag(1 / eq.capacity)], [np.zeros((n, 2 * n))]]) * T)
    blocks = box_jacobian(system, region).blocks
    ports = np.unique([node for block in blocks for node in (block.a, block.b) if node >= 0]).astype(np.intp)
    bounds = _Bounds(np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, 4 * m)))
    corners: list[list[Share]] = []
    real: list[list[Share]] = []
    for k, name in enumerate(system.modules):
        wanted = np.hstack([control["D"][k], control["C"][k]])
        module = ModulePicture(system, name, region, wanted)
        free = [piece for piece in module.pieces(pieces)]
        fixed = module.limited()
        corners.append(free + fixed)
        real.append(module.exact() + fixed)
        module.bound(bounds, k, region.get("drift"))
    for block in blocks[m:]:
        both_ends = [_heats(n, len(control["A"]), block.a, block.b, vertex) for vertex in block.vertices]
        items: list[Share] = [(heats, np.zeros(heats.shape[1]), np.zeros((0, heats.shape[1]))) for heats in both_ends]
        corners.append(items)
        real.append(items)
        stack = np.array([heats[:, :n] for heats in both_ends])
        bounds.size += np.abs(stack).max(axis=0)
        bounds.state += np.ptp(stack, axis=0)
    Gamma = both[:n, n:]
    at = np.ix_(ports, ports)
    reach = np.linalg.solve(np.eye(len(ports)) - bounds.size[at] @ Gamma[at],
                            np.hstack([bounds.size[at], bounds.state[at], bounds.free[ports]]))
    network = (F, both[:n, :n], Gamma, eq.capacity)
    return Picture(_maps(network, control, corners, m), _maps(network, control, real, m), F, Gamma, eq.capacity, ports,
                   reach)


def controller_matrices(controller: Mapping[str, Any], n: int, m: int) -> dict[str, Array]:
    """A, B, C, D, windup of a certificate's controller as arrays, empty ones in their shapes."""
    q = len(controller["A"])
    shapes = {"A": (q, q), "B": (q, n), "C": (m, q), "D": (m, n), "windup": (q, m)}
    return {key: np.array(controller[key], float).reshape(shape) for key, shape in shapes.items()}


def _heats(n: int, q: int, a: int, b: int, slopes: Array) -> Array:
    heats = np.zeros((n, n + q))
    nodes = [a] if b < 0 else [a, b]
    heats[np.ix_(nodes, nodes)] = slopes[:len(nodes), :len(nodes)]
    return heats


class ModulePicture:
    """Slopes of one module: free or limited current."""

    def __init__(self, system: System, name: str, region: Mapping[str, Any], wanted: Array):
        part = system.modules[name]
        box, names = region["temperature"], system.lump_names
        self.part, self.wanted, self.n = part, wanted, len(names)
        self.h, self.c = names.index(part.hot), names.index(part.cold)
        self.hot, self.cold = ((box[face] if isinstance(box, Mapping) else box) for face in (part.hot, part.cold))
        self.current = region["current"][name]
        drive = self.law(*self.grid(tuple(self.current), _GRID))[1]
        self.middle = 0.5 * (drive.min(axis=0) + drive.max(axis=0))
        self.exchange = part.conductance.value * np.array([[1.0, -1.0], [-1.0, 1.0]])

    def slopes(self, h: Array, c: Array, current: Array) -> tuple[Array, Array]:
        """J, (..., 2, 2), and b = ∂(heats)/∂I, (..., 2), faces in the order hot, cold."""
        p = self.part
        dT = 0.5 * (h + c) - p.reference_temperature
        S, R, K = (q.value + q.slope * dT for q in (p.seebeck, p.resistance, p.conductance))
        pump, joule, bend = 0.5 * p.seebeck.slope * current, 0.25 * p.resistance.slope * current**2, \
            0.5 * p.conductance.slope * (h - c)
        J = np.stack([np.stack([-K - bend + S * current + pump * h + joule, K - bend + pump * h + joule], -1),
                      np.stack([K + bend - pump * c + joule, -K + bend - S * current - pump * c + joule], -1)], -2)
        return J, np.stack([S * h + R * current, R * current - S * c], -1)

    def law(self, h: Array, c: Array, current: Array) -> tuple[Array, Array]:
        """(a_h, a_c, k) and (g_h, g_c, g_v) of the free current."""
        J, b = self.slopes(h, c, current)
        k = b[..., 0] / b[..., 1]
        free = np.stack([J[..., 0, 0] - k * J[..., 1, 0], J[..., 0, 1] - k * J[..., 1, 1], k], -1)
        return free, np.stack([-J[..., 1, 0], -J[..., 1, 1], np.ones_like(k)], -1) / b[..., 1:]

    def grid(self, current: Any, count: int) -> tuple[Array, ...]:
        """Points of the box."""
        axes = [np.linspace(pair[0], pair[1], count) for pair in (self.hot, self.cold, current)]
        return tuple(axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))

    def pieces(self, count: int) -> list[Share]:
        """Corners of the slopes of the free current, piece by piece."""
        low, high = self.current
        marks = np.linspace(low, high, count + 1)
        found = []
        for a, b in zip(marks[:-1], marks[1:], strict=True) if low < high else []:
            free, _ = self.law(*self.grid((a, b), _GRID))
            wider = _WIDER * np.ptp(free, axis=0)
            ranges = zip(free.min(axis=0) - wider, free.max(axis=0) + wider, strict=True)
            found += [self._free(np.array(corner)) for corner in product(*ranges)]
        return found

    def exact(self) -> list[Share]:
        """Free current at corners of the box."""
        if self.current[0] == self.current[1]:
            return []
        return [self._free(free) for free in self.law(*self.grid(tuple(self.current), 2))[0]]

    def limited(self) -> list[Share]:
        """Current at its limits."""
        J, _ = self.slopes(*self.grid(tuple(self.current), 2))
        size = len(self.wanted)
        found: list[Share] = []
        for slopes in J:
            achieved = np.zeros(size)
            achieved[[self.h, self.c]] = slopes[1]
            heats = _heats(self.n, size - self.n, self.h, self.c, slopes + self.exchange)
            found.append((heats, achieved - self.wanted, np.zeros((4, size))))
        return found

    def _free(self, slopes: Array) -> tuple[Array, Array, Array]:
        heats = _heats(self.n, len(self.wanted) - self.n, self.h, self.c, self.exchange)
        heats[self.h] += slopes[2] * self.wanted
        heats[self.h, [self.h, self.c]] += slopes[:2]
        heats[self.c] += self.wanted
        faces = np.eye(len(self.wanted))[[self.h, self.c]]
        movers = np.vstack([faces, self.wanted])
        return heats, np.zeros(len(self.wanted)), np.vstack([self.middle @ movers, movers])

    def control_points(self, current: tuple[float, float]) -> Array:
        """[J, b] at points whose hull has all of the box, (k, 2, 3): Bernstein's, for degree two in each of h, c, I."""
        marks = [np.array([low, 0.5 * (low + high), high]) for low, high in (self.hot, self.cold, current)]
        J, b = self.slopes(*np.meshgrid(*marks, indexing="ij"))
        values = np.concatenate([J + self.exchange, b[..., None]], axis=-1)
        for axis in range(3):
            low, middle, high = (np.take(values, k, axis) for k in range(3))
            chord, control = 0.5 * (low + high), 2 * middle - 0.5 * (low + high)
            straight = np.abs(control - chord).max() <= 1e-10 * np.abs(values).max()
            values = np.stack([low, high] if straight else [low, control, high], axis)
        return np.unique(values.reshape(-1, 2, 3), axis=0)

    def free_corners(self, current: tuple[float, float], *, heat: bool) -> Array:
        """Slopes of (current, heat_h, achieved - wanted) by (x_h, x_c, v) where the current is free, (k, 3, 3)."""
        free, moves = self.law(*self.grid(current, _GRID))
        slopes = np.hstack([moves, free]) if heat else moves
        wider = _WIDER * np.ptp(slopes, axis=0)
        found = []
        for corner in product(*zip(slopes.min(axis=0) - wider, slopes.max(axis=0) + wider, strict=True)):
            rows = np.zeros((3, 3))
            rows[:len(corner) // 3] = np.array(corner).reshape(-1, 3)
            found.append(rows)
        return np.array(found)

    def limited_corners(self, current: float) -> Array:
        """The same at a limit."""
        J, _ = self.slopes(*self.grid((current, current), 2))
        found = np.zeros((len(J), 3, 3))
        found[:, 1, :2], found[:, 2, :2], found[:, 2, 2] = J[:, 0], J[:, 1], -1.0
        return np.unique(found, axis=0)

    def bound(self, bounds: _Bounds, k: int, drift: float | None) -> None:
        """Add how large the slopes are, and how far they can change within a sample."""
        corners = self.grid(tuple(self.current), _GRID)
        J, b = self.slopes(*corners)
        moves = [min(pair[1] - pair[0], np.inf if drift is None else drift) for pair in (self.hot, self.cold)]
        slope, drive = np.zeros((2, 2)), np.zeros(2)
        for axis, move in enumerate(moves):  # J and b are polynomials: differences over one kelvin will do here
            other = [corners[0] + (axis == 0), corners[1] + (axis == 1), corners[2]]
            J1, b1 = self.slopes(*other)
            slope += move * np.abs(J1 - J).max(axis=0)
            drive += move * np.abs(b1 - b).max(axis=0)
        g = np.concatenate([[1.0], np.abs(self.law(*corners)[1] - self.middle).max(axis=0)
                            + _WIDER * np.abs(self.middle)])
        at = np.ix_([self.h, self.c], [self.h, self.c])
        bounds.size[at] += np.abs(J + self.exchange).max(axis=0)
        bounds.state[at] += slope
        bounds.free[[self.h, self.c], 4 * k:4 * k + 4] += np.outer(drive, g)


def _maps(network: tuple[Array, Array, Array, Array], control: Mapping[str, Array],
          shares: list[list[Share]], m: int) -> Maps:
    F, passive, Gamma, capacity = network
    n, size = len(F), len(F) + len(control["A"])
    wide = np.zeros((n, size - n))
    M, W, free = [], [], []
    for chosen in product(*shares):
        heats = sum((share[0] for share in chosen), np.zeros((n, size)))
        gap = np.array([share[1] for share in chosen[:m]])
        M.append(np.vstack([np.hstack([passive, wide]) + Gamma @ heats,
                            np.hstack([control["B"], control["A"]]) + control["windup"] @ gap]))
        W.append(np.hstack([F, wide]) + heats / capacity[:, None])
        free.append(np.vstack([share[2] for share in chosen[:m]]))
    return Maps(np.array(M), np.array(W), np.array(free))
