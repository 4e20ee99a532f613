"""One sample of the coupling in sections, operation by operation as the C source computes it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ._sections import paths, sections

if TYPE_CHECKING:
    from ..evaluation import Filters


@dataclass
class Chain:
    """Sections in series, transposed direct form II.

    Parameters
    ----------
    rows : list of list of float
        b0 b1 b2 a1 a2 of each section.
    """

    rows: list[list[float]]
    states: list[list[float]] = field(init=False)

    def __post_init__(self) -> None:
        self.states = [[0.0, 0.0] for _ in self.rows]

    @property
    def direct(self) -> float:
        """Output per input of the same sample."""
        return float(np.prod([row[0] for row in self.rows]))

    def look(self, x: float) -> float:
        """Output of this sample for an input, the states left alone."""
        for row, z in zip(self.rows, self.states, strict=True):
            x = row[0] * x + z[0]
        return x

    def step(self, x: float) -> float:
        """Output of this sample for an input, and on to the next sample."""
        for (b0, b1, b2, a1, a2), z in zip(self.rows, self.states, strict=True):
            y = b0 * x + z[0]
            z[0] = b1 * x - a1 * y + z[1]
            z[1] = b2 * x - a2 * y
            x = y
        return x


class Recursion:
    """e to e+ and to what is added to the outputs of C1, C2: u1 = C1 e1+ + (P1⁻¹X) e2+.

    The free filter of X drives both Z1 (for e+) and Q1 = P1⁻¹Z1 (for u1).

    Parameters
    ----------
    filters : Filters
        Discrete time, short enough for sections.
    """

    def __init__(self, filters: Filters):
        sections(filters)  # refuses filters whose sections would not be accurate
        found = paths(filters)
        tables = {"X_hat": found["X"][0], "Z1": found["X"][1], "Q1": found["X_input"][1],
                  "Y_hat": found["Y"][0], "Z2": found["Y"][1], "Q2": found["Y_input"][1]}
        self.chains = {name: Chain(np.delete(table, 3, axis=1).tolist()) for name, table in tables.items()}
        c = self.chains
        self.direct = c["X_hat"].direct * c["Z1"].direct, c["Y_hat"].direct * c["Z2"].direct

    def step(self, e1: float, e2: float, on: bool) -> tuple[float, float, float, float]:
        """One sample.

        Parameters
        ----------
        e1, e2 : float
            Errors r - y.
        on : bool
            Whether the filters get an input.

        Returns
        -------
        tuple of float
            e1+, e2+, and what is added to u1, u2.
        """
        c, gate = self.chains, 1.0 if on else 0.0
        dx, dy = gate * self.direct[0], gate * self.direct[1]
        f1 = e1 + c["Z1"].look(c["X_hat"].look(0.0))  # e1+ = f1 + dx e2+, e2+ = f2 + dy e1+
        f2 = e2 + c["Z2"].look(c["Y_hat"].look(0.0))
        p1 = (f1 + dx * f2) / (1.0 - dx * dy)
        p2 = (f2 + dy * f1) / (1.0 - dx * dy)
        x, y = c["X_hat"].step(gate * p2), c["Y_hat"].step(gate * p1)
        c["Z1"].step(x)
        c["Z2"].step(y)
        return p1, p2, c["Q1"].step(x), c["Q2"].step(y)
