"""Plants at the vertices of a hull: read, compared, and searched for a plant that no state feedback stabilizes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from .._arrays import Array
from .._checks import quoted
from .._control import control
from ..errors import InputError
from ..linear import read_plant
from ._plant import GeneralizedPlant, hidden_mode, say_mode

_MOST = 4096


@dataclass(frozen=True)
class Vertices:
    """x' = A x + B1 w + B2 u (or x+), z = C x + D1 w + D2 u; first axis: vertex."""

    A: Array
    B1: Array
    B2: Array
    C: Array
    D1: Array
    D2: Array
    dt: float

    def __len__(self) -> int:
        return len(self.A)

    @property
    def sizes(self) -> tuple[int, int, int, int]:
        """Numbers of states, disturbances, controls, performance outputs."""
        return self.A.shape[1], self.B1.shape[2], self.B2.shape[2], self.C.shape[1]

    def loops(self, F: Array) -> tuple[Array, Array]:
        """A + B2 F and C + D2 F of every vertex."""
        return self.A + self.B2 @ F, self.C + self.D2 @ F

    def measured(self, weights: Array) -> GeneralizedPlant:
        """A plant of the hull, by its weights, whose states are measured."""
        A, B1, B2, C, D1, D2 = (np.tensordot(weights, part, 1) for part in (self.A, self.B1, self.B2, self.C, self.D1,
                                                                           self.D2))
        n, w, m, _ = self.sizes
        return GeneralizedPlant(A, B1, B2, C, np.eye(n), D1, D2, np.zeros((n, w)), np.zeros((n, m)), self.dt)

    def section(self, F: Array, bounded: bool) -> dict[str, Any]:
        """Section "system" of a certificate of kind "polytope"."""
        vertices = []
        for k in range(len(self)):
            one = {"A": self.A[k], "B": np.hstack([self.B1[k], self.B2[k]]) if bounded else self.B2[k]}
            if bounded:
                one |= {"C": self.C[k], "D": np.hstack([self.D1[k], self.D2[k]])}
            vertices.append(one)
        return {"vertices": vertices, "gain": F, "sample_time": self.dt}


def read_vertices(plants: Any, n_ctrl: object, n_out: object, bounded: bool) -> Vertices:
    """Check plants at the vertices; `bounded`: whether a norm from w to z is asked for."""
    where = "argument plants"
    if isinstance(plants, control.StateSpace):
        plants = [plants]
    if not isinstance(plants, Sequence) or not 1 <= len(plants) <= _MOST:
        raise InputError(f"plants = {quoted(plants)}", where=where, expected=f"a list of 1 to {_MOST} state spaces")
    found = [read_plant(plant, f"{where}[{k}]") for k, plant in enumerate(plants)]
    first, shapes = found[0], [(len(one.A), *one.D.shape[::-1], one.dt) for one in found]
    for k, shape in enumerate(shapes):
        if shape != shapes[0]:
            raise InputError(f"plant {k} has {shape[0]} states, {shape[1]} inputs, {shape[2]} outputs, sample time "
                             f"{shape[3]:g} s; plant 0 has {shapes[0][0]}, {shapes[0][1]}, {shapes[0][2]}, "
                             f"{shapes[0][3]:g} s", where=where, expected="the same states, inputs and outputs in all")
    for k, plant in enumerate(plants):
        if isinstance(plant, control.StateSpace) and plant.state_labels != plants[0].state_labels:
            raise InputError(f"the states of plant {k} are {quoted(list(plant.state_labels))}", where=where,
                             expected=f"those of plant 0, {quoted(list(plants[0].state_labels))}")
    if not len(first.A):
        raise InputError("plants without states", where=where, expected="at least one state to feed back")
    p, m = first.D.shape
    k = _count("n_ctrl", n_ctrl, m, "inputs")
    q = p if n_out is None else _count("n_out", n_out, p, "outputs")
    if bounded and k == m:
        raise InputError(f"n_ctrl = {k}: no input is left for the disturbance w", where="argument n_ctrl",
                         expected=f"at most {m - 1} for objective \"hinf\" or \"h2\"")
    A, B, C, D = (np.array([getattr(one, key) for one in found]) for key in "ABCD")
    return Vertices(A, B[:, :, :m - k], B[:, :, m - k:], C[:, :q], D[:, :q, :m - k], D[:, :q, m - k:], first.dt)


def _count(name: str, value: object, most: int, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise InputError(f"{name} = {quoted(value)}", where=f"argument {name}", expected="a whole number")
    if not 1 <= value <= most:
        raise InputError(f"{name} = {value}: the plant has {most} {what}", where=f"argument {name}",
                         expected=f"from 1 to {most}")
    return int(value)


def blocking(vertices: Vertices, rate: float) -> str:
    """Which plant of the hull no state feedback brings to a rate, and its mode; empty where none was found."""
    n = vertices.sizes[0]
    shift, factor = (0.0, 1.0 / (1.0 - rate)) if vertices.dt else (rate, 1.0)
    for words, weights in _candidates(len(vertices)):
        A, B = np.tensordot(weights, vertices.A, 1), np.tensordot(weights, vertices.B2, 1)
        mode = hidden_mode(factor * A + shift * np.eye(n), factor * B, vertices.dt)
        if mode is not None:
            return f"{words} the input no longer reaches the mode at {say_mode(mode / factor - shift, vertices.dt)}"
    return ""


def _candidates(count: int) -> Iterator[tuple[str, Array]]:
    eye = np.eye(count)
    for k in range(count):
        yield f"at vertex {k + 1}", eye[k]
    for i, j in combinations(range(min(count, 24)), 2):
        yield f"at the mean of vertices {i + 1} and {j + 1}", (eye[i] + eye[j]) / 2
    if count > 2:
        yield "at the mean of all vertices", np.full(count, 1 / count)
