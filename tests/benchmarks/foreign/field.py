"""A finite-volume model: cells with capacities, conductances between them, and what heats and reads them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix, diags

Array = np.ndarray
Heat = Callable[[float, Array, Array, Array], None]  # (t, T, u, Q): adds to Q, the heat into every cell [W]


@dataclass(frozen=True)
class Legs:
    """Thermoelectric legs: a chain of cells between a cold and a hot face, with properties at each cell's temperature.

    S = S0 (1 + s (T - T0)), R and the conductance likewise; the Thomson heat is what S(T) demands.
    """

    cells: Array
    cold: int
    hot: int
    current: int
    S: float
    S_slope: float
    R: float
    R_slope: float
    T0: float

    def heat(self, T: Array, u: Array, Q: Array) -> None:
        """Joule heat in the legs and, where the current passes from S_left to S_right, - I T (S_right - S_left).

        At the faces, where S starts and ends, that is the Peltier heat; within the legs it is the Thomson heat.
        """
        current = u[self.current]
        if current == 0.0:
            return
        chain = np.concatenate([[self.cold], self.cells, [self.hot]])
        S = self.S * (1.0 + self.S_slope * (T[chain] - self.T0))
        between = np.concatenate([[0.0], 0.5 * (S[:-1] + S[1:]), [0.0]])
        Q[chain] -= current * T[chain] * np.diff(between)
        Q[self.cells] += current**2 * self.R / self.cells.size * (1.0 + self.R_slope * (T[self.cells] - self.T0))


@dataclass
class Field:
    """Cells, built up block by block.

    `zones` are the cells that the user takes for one lump; `outside` the conductances of every cell to the ambients.
    """

    ambients: tuple[str, ...]
    capacity: list[float] = field(default_factory=list)
    links: list[tuple[int, int, float]] = field(default_factory=list)
    outside: list[tuple[int, int, float]] = field(default_factory=list)
    zones: dict[str, Array] = field(default_factory=dict)
    heaters: dict[str, Array] = field(default_factory=dict)
    sensors: dict[str, Array] = field(default_factory=dict)
    legs: list[Legs] = field(default_factory=list)
    currents: tuple[str, ...] = ()

    def block(self, n: int, capacity: float) -> Array:
        """Cells that share a capacity [J/K]."""
        first = len(self.capacity)
        self.capacity += [capacity / n] * n
        return np.arange(first, first + n)

    def chain(self, n: int, capacity: float, conductance: float) -> Array:
        """A block whose cells conduct to their neighbors; the conductance is that from the first to the last."""
        cells = self.block(n, capacity)
        self.links += [(i, i + 1, conductance * (n - 1)) for i in cells[:-1]]
        return cells

    def bridge(self, a: Array, b: Array, conductance: float) -> None:
        """A path between two patches of cells, spread evenly [W/K]."""
        each = conductance / (len(a) * len(b))
        self.links += [(int(i), int(j), each) for i in a for j in b]

    def lose(self, cells: Array, ambient: str, conductance: float) -> None:
        """A path from a patch to an ambient, spread evenly [W/K]."""
        k = self.ambients.index(ambient)
        self.outside += [(int(i), k, conductance / len(cells)) for i in cells]

    @property
    def columns(self) -> list[str]:
        """Inputs of a record: heaters, currents, ambients."""
        return [*self.heaters, *self.currents, *self.ambients]

    def matrices(self) -> tuple[Array, csc_matrix, Array]:
        """Capacities (n,), heats per kelvin (n, n), and heat per unit of every column (n, columns)."""
        n = len(self.capacity)
        i, j, G = (np.array(x) for x in zip(*self.links, strict=True))
        K = coo_matrix((np.concatenate([G, G]), (np.concatenate([i, j]), np.concatenate([j, i]))), shape=(n, n)).tocsc()
        B = np.zeros((n, len(self.columns)))
        for name, share in self.heaters.items():
            B[share, self.columns.index(name)] = 1.0 / len(share)
        first = len(self.columns) - len(self.ambients)
        for cell, k, conductance in self.outside:
            B[cell, first + k] += conductance
        lost = np.asarray(K.sum(axis=1)).ravel() + B[:, first:].sum(axis=1)
        return np.array(self.capacity), (K - diags(lost)).tocsc(), B
