"""One sample of an observer in plain floats, operation by operation as the C source computes it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ._export_heats import DRIVE, HEATS, Row, drives, named, tables
from ._modules import Array
from ._observer_model import ObserverModel


@dataclass(frozen=True)
class ObserverRecursion:
    """x⁺ = A_d x + Γ (D [w; 1] + heats of the tables) + L (T_ref + (y - offset - T_ref)/gain - C x).

    Parameters
    ----------
    A_d, Gamma, L, D : list of list of float
        (n, n), (n, n), (n, n_sensors) and (n, n_u + 1).
    sensors : list of list of float
        Lump, offset and gain of every sensor.
    T_ref : float
        Temperature about which sensor gains act [K].
    n_ambients : int
        The last inputs are ambients.
    drives : list of list of float
        Drives that are not exactly their column.
    heats : dict
        Kind to table.
    """

    A_d: list[Row]
    Gamma: list[Row]
    L: list[Row]
    D: list[Row]
    sensors: list[Row]
    T_ref: float
    n_ambients: int
    drives: list[Row]
    heats: dict[str, list[Row]]

    @classmethod
    def of(cls, model: ObserverModel, gain: Array) -> ObserverRecursion:
        """Tables of an observer.

        Parameters
        ----------
        model : ObserverModel
            What the observer predicts with.
        gain : ndarray, shape (n_lumps, n_sensors)
            Constant gain of its correction.
        """
        eq = model.equations
        ambients = list(model.system.ambients.values())
        parts = [model.system.sensors[name] for name in model.sensors]
        sensors = [[float(i), part.offset, part.gain] for i, part in zip(model.indices(), parts, strict=True)]
        return cls(model.A_d.tolist(), model.Gamma.tolist(), gain.tolist(),
                   eq.D.toarray()[:, :eq.drives.one + 1].tolist(), sensors, ambients[0].temperature, len(ambients),
                   drives(eq), tables(eq))

    def step(self, x: Row, y: Row, u: Row) -> Row:
        """Estimate at the next sample.

        Parameters
        ----------
        x, y, u : list of float
            Estimate [K], readings [K], heaters, currents and ambients [unit, A, K].
        """
        q = self._heat(x, u)
        errors = []
        for reading, (lump, offset, gain) in zip(y, self.sensors, strict=True):
            lost = not math.isfinite(reading)  # a reading that is lost corrects nothing
            errors.append(0.0 if lost else self.T_ref + (reading - offset - self.T_ref) / gain - x[int(lump)])
        following = []
        for a, g, k in zip(self.A_d, self.Gamma, self.L, strict=True):
            total = 0.0
            for row, values in ((a, x), (g, q), (k, errors)):
                for left, right in zip(row, values, strict=True):
                    total = total + left * right
            following.append(total)
        return following

    def _heat(self, x: Row, u: Row) -> Row:
        """All heat that the linear network does not hold [W]."""
        w = [*u, 1.0]
        nodes = [*x, *u[len(u) - self.n_ambients:]]
        for row in self.drives:
            DRIVE.add(named(DRIVE, row), nodes, w, [])
        q = []
        for row in self.D:
            total = 0.0
            for left, right in zip(row, w, strict=True):
                total = total + left * right
            q.append(total)
        q += [0.0] * self.n_ambients  # what ambients get is not used
        for kind, table in self.heats.items():
            for row in table:
                HEATS[kind].add(named(HEATS[kind], row), nodes, w, q)
        return q[:len(x)]
