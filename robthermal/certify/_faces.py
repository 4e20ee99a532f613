"""Floating-point picture of the heat through the faces of a box, as the checker of kind "invariance" bounds it.

Used to *find* boxes; the proof is the checker's. The lump is on its face, everything else anywhere in its range.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array

from ..thermal import System
from ._heaters import reference, slope_of
from ._jacobian import module_variants
from ._own_heat import leads_of, squares_of
from ._sections import Interval

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
SIGNS = (-1.0, 1.0)  # of the lower and the upper faces: outwards is down and up
_PIECES = 16  # of the checker's triangles where conduction bends the wrong way
_MARGIN = 1e-3  # W of inward heat left on every face of a box that is looked for
_MARGIN_TEMPERATURE = 2e-3  # K: times the conductance of a lump, where that is less


@dataclass(frozen=True)
class Outward:
    """Heat through every face [W] and its slopes.

    Parameters
    ----------
    heat : ndarray, shape (2 n,)
        Largest outward heat, lower faces first, plus what is kept in reserve.
    slopes : csc_array, shape (2 n, 2 n)
        Its derivatives by the outward position of every face [W/K].
    """

    heat: Array
    slopes: csc_array


@dataclass(frozen=True)
class Faces:
    """Heat through the faces of boxes of one machine, with ranges of its ambients, heats and parameters.

    Parameters
    ----------
    system : System
        System whose heat flows are bounded.
    ambient : mapping
        {ambient: (lower, upper)} [K], every ambient.
    heat : mapping
        {lump: (lower, upper)} [W].
    parameters : mapping
        {name: (lower, upper)} of uncertain numbers that the checker of boxes covers.
    reserve : float
        Share of every single heat (of a link, Peltier, Joule, conducted) by which it may be off, all at once.
    power : mapping
        {heater: (lower, upper)} of heaters that follow temperature, their power at the reference temperature [W].
    """

    system: System
    ambient: Mapping[str, Interval]
    heat: Mapping[str, Interval]
    parameters: Mapping[str, Any]
    reserve: float = 0.0
    power: Mapping[str, Any] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of lumps."""
        return len(self.system.lumps)

    @cached_property
    def surroundings(self) -> Array:
        """Lower and upper ends of the ambients, (2, n_ambients) [K]."""
        return np.array([self.ambient[name] for name in self.system.ambients], float).reshape(-1, 2).T

    def around(self, current: Mapping[str, Any], box: Array) -> Outward:
        """Outward heat on the faces of a box.

        Parameters
        ----------
        current : mapping
            {module: (lower, upper)} [A].
        box : ndarray, shape (2, n)
            Lower and upper ends [K].

        Returns
        -------
        Outward
        """
        nodes = np.concatenate([box, self.surroundings], axis=1)
        rows: list[Indices] = []
        columns: list[Indices] = []
        values: list[Array] = []
        heat = np.zeros((2, self.count))

        def add(side: int, own: Indices, flow: Array, by_own: Array, far: Indices, far_side: int,
                by_far: Array) -> None:
            np.add.at(heat[side], own, flow)
            inside = far < self.count
            rows.extend([own + side * self.count, (own + side * self.count)[inside]])
            columns.extend([own + side * self.count, (far + far_side * self.count)[inside]])
            values.extend([by_own, by_far[inside]])

        for side in (0, 1):
            self._add_links(side, nodes[side], add)
            self._add_modules(side, nodes, current, add)
            self._add_heaters(side, nodes[side], add)
            self._add_leads(side, current, heat[side])
            heat[side] += SIGNS[side] * self._loads[side] + self.reserve * np.abs(self._loads[side]) + self.margin
        shape = (2 * self.count, 2 * self.count)
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return Outward(heat.ravel(), csc_array(coo_array(entries, shape=shape)))

    def _add_links(self, side: int, nodes: Array, add: Any) -> None:
        sign, link = SIGNS[side], self._links
        own, far = nodes[link["own"]], nodes[link["far"]]
        d = far - own
        power = np.abs(d) ** link["exponent"]
        total, by_own, by_far = np.zeros_like(d), np.zeros_like(d), np.zeros_like(d)
        for name, flow, loss, gain in (("conductance", d, 1.0, 1.0),
                                       ("natural", power * d, (1 + link["exponent"]) * power, None),
                                       ("radiation", far**4 - own**4, 4 * own**3, 4 * far**3)):
            size = np.where(sign * flow >= 0, link[name][1], link[name][0])
            total += size * (sign * flow + self.reserve * np.abs(flow))
            by_own -= size * loss
            by_far += size * (loss if gain is None else gain)
        add(side, link["own"], total, by_own, link["far"], side, by_far)

    def _add_modules(self, side: int, nodes: Array, current: Mapping[str, Any], add: Any) -> None:
        for (hot, cold), variants, name in self._modules:
            for own, far, pump in ((hot, cold, 1.0), (cold, hot, -1.0)):
                found = _worst_module(variants, nodes[side, own], nodes[:, far], pump, SIGNS[side], current[name],
                                      self.reserve)
                flow, by_own, end, by_far = found
                add(side, np.array([own]), np.array([flow]), np.array([by_own]), np.array([far]), end,
                    np.array([by_far]))

    def _add_heaters(self, side: int, nodes: Array, add: Any) -> None:
        nowhere, none = np.array([self.count]), np.zeros(1)
        for lump, corners in self._heaters:
            warmer = nodes[lump] - reference(self.system)
            heats = [q * (1 + s * warmer) for q, s in corners]
            flow, (q, s) = max((SIGNS[side] * heat + self.reserve * abs(heat), pair)
                               for heat, pair in zip(heats, corners, strict=True))
            add(side, np.array([lump]), np.array([flow]), np.array([q * s]), nowhere, side, none)

    def _add_leads(self, side: int, current: Mapping[str, Any], heat: Array) -> None:
        for lump, module, resistance in leads_of(self.system, self.parameters):
            heats = np.outer(resistance, squares_of(current[module]))
            heat[self.system.lump_names.index(lump)] += np.max(SIGNS[side] * heats + self.reserve * np.abs(heats))

    @cached_property
    def _heaters(self) -> list[tuple[int, list[Interval]]]:
        """Lump, and corners (power at the reference temperature [W], slope [1/K]), of heaters that follow it."""
        found = []
        for name, powers in self.power.items():
            slope = self._range(slope_of(name), self.system.inputs[name].power_slope or 0.0)
            found.append((self.system.lump_names.index(self.system.inputs[name].lump), list(product(powers, slope))))
        return found

    @cached_property
    def margin(self) -> Array:
        """Heat kept in reserve on every lump [W]: little, and less where little flows."""
        size = np.zeros(self.count)
        np.add.at(size, self._links["own"], self._links["conductance"][1])
        for (hot, cold), variants, _ in self._modules:
            size[[hot, cold]] += variants[4].max()
        return np.where(size > 0, np.minimum(_MARGIN, _MARGIN_TEMPERATURE * size), _MARGIN)

    @cached_property
    def _loads(self) -> Array:
        loads = np.zeros((2, self.count))
        for name, pair in self.heat.items():
            loads[:, self.system.lump_names.index(name)] = pair
        return loads

    @cached_property
    def _links(self) -> dict[str, Any]:
        """Every link seen from each of its lumps: ends, and ranges of its numbers."""
        index = {name: i for i, name in enumerate((*self.system.lumps, *self.system.ambients))}
        own, far, ranges = [], [], []
        for link in self.system.links:
            gain, exponent = (link.natural.gain, link.natural.exponent) if link.natural else (0.0, 0.0)
            numbers = (self._range(f"links.{link.name}.conductance", link.conductance),
                       self._range(f"links.{link.name}.natural.gain", gain),
                       self._range(f"links.{link.name}.radiation", link.radiation or 0.0), (exponent, exponent))
            a, b = (index[name] for name in link.between)
            for first, second in ((a, b), (b, a)):
                if first < self.count:
                    own.append(first)
                    far.append(second)
                    ranges.append(numbers)
        table = np.array(ranges, float).reshape(-1, 4, 2)
        return {"own": np.array(own, np.intp), "far": np.array(far, np.intp), "conductance": table[:, 0].T,
                "natural": table[:, 1].T, "radiation": table[:, 2].T, "exponent": table[:, 3, 0]}

    def _range(self, name: str, value: float) -> Interval:
        low, high = self.parameters.get(name, (value, value))
        return float(low), float(high)

    @cached_property
    def _modules(self) -> list[tuple[tuple[int, int], Array, str]]:
        """Ends, numbers (S, S′, R, R′, K, K′ at 0 K) of all variants (6, n_variants), and name of every module."""
        index, found = self.system.lump_names.index, []
        for name, module in self.system.modules.items():
            numbers = []
            for v in module_variants(self.system, name, self.parameters):
                pairs = [(p.value - p.slope * v.reference_temperature, p.slope)
                         for p in (v.seebeck, v.resistance, v.conductance)]
                numbers.append([number for pair in pairs for number in pair])
            found.append(((index(module.hot), index(module.cold)), np.array(numbers, float).T, name))
        return found


def _worst_module(variants: Array, own: float, far: Array, pump: float, sign: float, current: Any,
                  reserve: float) -> tuple[float, float, int, float]:
    """Largest outward heat into one face of a module, its slopes, and the partner's end at which it is."""
    S0, S1, R0, R1, K0, K1 = variants[:, :, None, None]
    temperature, square, end = _candidates(far, bends=bool((sign * variants[5] < 0).any()))
    T, T2 = temperature[None, :, None], square[None, :, None]
    S, R = S0 + 0.5 * S1 * (own + T), R0 + 0.5 * R1 * (own + T)
    conducted = K0 * (T - own) + 0.5 * K1 * (T2 - own * own)
    low, high = current
    with np.errstate(divide="ignore", invalid="ignore"):  # a peak inside the range, where sign R < 0 bends down
        top = np.nan_to_num(np.clip(-pump * S * own / R, low, high), nan=low)
    amps = np.concatenate([np.full_like(top, low), np.full_like(top, high), np.full_like(top, np.clip(0.0, low, high)),
                           top], axis=2)
    peltier, joule = pump * S * own * amps, 0.5 * R * amps * amps
    flow = sign * (conducted + peltier + joule) + reserve * (np.abs(conducted) + np.abs(peltier) + np.abs(joule))
    v, k, i = np.unravel_index(int(np.argmax(flow)), flow.shape)
    I, t = amps[v, k, i], temperature[k]  # noqa: E741 - I is the current
    s1, r1, k0, k1 = variants[1, v], variants[3, v], variants[4, v], variants[5, v]
    shared = 0.5 * pump * s1 * own * I + 0.25 * r1 * I * I
    by_own = -k0 - k1 * own + pump * S[v, k, 0] * I + shared
    by_far = 0.0 if end[k] < 0 else sign * SIGNS[end[k]] * (k0 + k1 * t + shared)
    return float(flow[v, k, i]), float(by_own), max(int(end[k]), 0), float(by_far)


def _candidates(far: Array, bends: bool) -> tuple[Array, Array, Indices]:
    """Points (T, T²) of the partner that the checker looks at, and which end they are (-1: none)."""
    if not bends or far[0] == far[1]:
        return far, far**2, np.array([0, 1], np.intp)
    marks = np.linspace(far[0], far[1], _PIECES + 1)
    middle = 0.5 * (marks[:-1] + marks[1:])
    return (np.concatenate([far, middle]), np.concatenate([far**2, marks[:-1] * marks[1:]]),
            np.array([0, 1] + [-1] * _PIECES, np.intp))
