"""Floating-point picture of a sampled loop whose plant moves between the samples; with an observer or not.

(x, I, w) are changes of temperatures, held currents and what is constant until the next sample (estimates, controller
states): K makes them from (x, w) at a sample, A moves them on (docs/explanations/loops.md). Used to find certificates;
the proof is the checker's.
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
from ._loop_picture import ModulePicture, controller_matrices

Array = NDArray[np.floating[Any]]
Channel = tuple[Array, Array, Array]  # B (d, r), S (k, d), corners D (v, r, k): the sum of B D S is added


@dataclass(frozen=True)
class Case:
    """One combination of free and limited modules.

    Parameters
    ----------
    own : ndarray of int
        Its places in (x, all currents, w).
    end : ndarray of int
        Places of (x, w) in its (x, I, w).
    A, K : ndarray
        Common parts of the flow and of the sample.
    flow, sample : tuple of Channel
        What modules and links that are not linear add, at the corners of their slopes.
    """

    own: NDArray[np.intp]
    end: NDArray[np.intp]
    A: Array
    K: Array
    flow: tuple[Channel, ...]
    sample: tuple[Channel, ...]

    def corners(self) -> tuple[Array, Array]:
        """A and K at all joint corners."""
        return _joint(self.A, self.flow), _joint(self.K, self.sample)


@dataclass(frozen=True)
class _Mode:
    """A module with free or limited current: slopes [J, b] of the plant, (v, 2, 3), and of the law, (v, 3, 3)."""

    free: bool
    flow: Array
    law: Array


class Builder:
    """A loop over the box of a certificate's sections, case by case."""

    def __init__(self, system: System, section: Mapping[str, Any], region: Mapping[str, Any]):
        self.eq = Equations(system)
        self.n, self.m = len(self.eq.capacity), len(system.modules)
        self.control = controller_matrices(section["controller"], self.n, self.m)
        self.seen = "gain" in section
        self.law = self.n if self.seen else 0  # where the temperatures begin that the feedback law reads
        self.width = self.law + self.n + len(self.control["A"])
        self.time = region["sample_time"]
        self.links = box_jacobian(system, region).blocks[self.m:]
        self.wanted = [np.hstack([np.zeros(self.law), self.control["D"][k], self.control["C"][k]])
                       for k in range(self.m)]
        self.modules = [ModulePicture(system, name, region, self.wanted[k]) for k, name in enumerate(system.modules)]
        if self.seen:
            n, E = self.n, self.eq.capacity
            both = expm(np.block([[self.eq.A.toarray() / E[:, None], np.diag(1 / E)], [np.zeros((n, 2 * n))]])
                        * self.time)
            self.passive, self.hold = both[:n, :n], both[:n, n:]
            self.gain = np.zeros((n, n))  # L C
            for column, sensor in zip(np.array(section["gain"], float).T, section["sensors"], strict=True):
                self.gain[:, system.lump_names.index(sensor["lump"])] += column * sensor["gain"]

    def scale(self) -> Array:
        """Units of (x, all currents, w): √E for temperatures, for the others what moves as much heat as one kelvin."""
        root = np.sqrt(self.eq.capacity)
        heat = np.abs(self.control["D"]).max(initial=0.0) or 1.0
        per_kelvin = root.mean() / heat
        currents = [np.abs(module.control_points(module.current)[:, 1, 2]).max() * per_kelvin
                    for module in self.modules]
        states = np.abs(self.control["C"]).max(axis=0, initial=0.0)
        return np.concatenate([root, currents, *([root] if self.seen else []),
                               np.where(states > 0, states, heat) * per_kelvin])

    def merged(self) -> Case:
        """One case that contains all others: every current may be free or limited."""
        modes = []
        for k in range(self.m):
            own = self._modes(k, 1)
            modes.append(_Mode(True, own[0].flow,
                               np.concatenate([mode.law for mode in own])))
        return self._case(tuple(modes))

    def cases(self, pieces: int) -> list[Case]:
        """Every combination of free modules, in a piece of their currents, and limited ones, in the checker's order."""
        return [self._case(chosen) for chosen in product(*(self._modes(k, pieces) for k in range(self.m)))]

    def _modes(self, k: int, pieces: int) -> list[_Mode]:
        module = self.modules[k]
        low, high = module.current
        marks = np.linspace(low, high, pieces + 1)
        found = []
        for pair in zip(marks[:-1], marks[1:], strict=True) if low < high else ():
            found.append(_Mode(True, module.control_points(pair), module.free_corners(pair, heat=self.seen)))
        for current in sorted({low, high}):
            found.append(_Mode(False, module.control_points((current, current)), module.limited_corners(current)))
        return found

    def _case(self, modes: tuple[_Mode, ...]) -> Case:
        n, m, control = self.n, self.m, self.control
        free = [k for k in range(m) if modes[k].free]
        rest = self.width - n
        size, first = n + len(free) + rest, self.width - len(control["A"])
        after = np.r_[0:n, n + len(free):size]  # place of (x, w) in (x, I, w)
        A, K = np.zeros((size, size)), np.zeros((size, self.width))
        A[:n, :n] = self.eq.A.toarray() / self.eq.capacity[:, None]
        K[:n, :n] = np.eye(n)
        K[after[first:], first:] = control["A"]
        K[after[first:], self.law:self.law + n] += control["B"]
        if self.seen:
            K[after[n:2 * n], n:2 * n] = self.passive - self.gain
            K[after[n:2 * n], :n] = self.gain
        flow, sample = [], []
        for k, mode in enumerate(modes):
            faces = [self.modules[k].h, self.modules[k].c]
            inputs, law = np.zeros((size, 3)), np.zeros((3, self.width))
            law[[0, 1], [self.law + face for face in faces]] = 1.0
            law[2] = self.wanted[k]
            outputs = np.zeros((3, size))
            outputs[[0, 1], faces] = 1.0
            if mode.free:
                outputs[2, n + free.index(k)] = inputs[n + free.index(k), 0] = 1.0
            inputs[after[first:], 2] = control["windup"][:, k]
            if self.seen:  # heat_h is a channel; heat_c = wanted + gap
                inputs[after[n:2 * n], 1] = self.hold[:, faces[0]]
                inputs[after[n:2 * n], 2] += self.hold[:, faces[1]]
                K[after[n:2 * n]] += np.outer(self.hold[:, faces[1]], self.wanted[k])
                exchange = self.modules[k].exchange @ law[:2]
                K[after[n:2 * n]] += self.hold[:, faces] @ exchange
            used = np.abs(inputs).max(axis=0) > 0
            flow.append((self._heats(size, faces), outputs[:2 + mode.free], mode.flow[:, :, :2 + mode.free]))
            if used.any():
                sample.append((inputs[:, used], law, np.unique(mode.law[:, used], axis=0)))
        for link in self.links:
            nodes = [node for node in (link.a, link.b) if node >= 0]
            seen = np.zeros((len(nodes), self.width))
            seen[range(len(nodes)), [self.law + node for node in nodes]] = 1.0
            slopes = link.vertices[:, :len(nodes), :len(nodes)]
            flow.append((self._heats(size, nodes), np.eye(size)[nodes], slopes))
            if self.seen:
                into = np.zeros((size, len(nodes)))
                into[after[n:2 * n]] = self.hold[:, nodes]
                sample.append((into, seen, slopes))
        own = np.r_[0:n, [n + k for k in free], n + m:n + m + rest].astype(np.intp)
        return Case(own, after, A, K, tuple(flow), tuple(sample))

    def _heats(self, size: int, nodes: list[int]) -> Array:
        into = np.zeros((size, len(nodes)))
        into[nodes, range(len(nodes))] = 1 / self.eq.capacity[nodes]
        return into


def _joint(base: Array, channels: tuple[Channel, ...]) -> Array:
    parts = [[B @ one @ S for one in D] for B, S, D in channels]
    return np.array([base + sum(chosen, np.zeros_like(base)) for chosen in product(*parts)])

