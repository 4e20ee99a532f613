"""Coils of a linear motor in an iron core on a cold plate, 600 cells in two dimensions, and what its drive logs.

A log has the current with its sign, a thermistor in ohms that averages the winding, and no room temperature. The
resistance of copper rises with temperature; that is what the network of three lumps lacks.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

R, ALPHA = 2.3, 0.00393  # Ω at 20 °C, 1/K of copper
STEP = 2.0  # s
SYSTEM = """
columns.coil = { column = "Current", resistance = 2.3 }
columns.T_winding = { column = "NTC", thermistor = { r0 = 10000.0, beta = 3950.0 } }
system = { name = "linear motor", temperature_unit = "degC" }
ambients = { water = { temperature = 20.0 }, room = { temperature = 22.0 } }
lumps = { winding = { capacity = 110.0 }, core = { capacity = 260.0 }, plate = { capacity = 60.0 } }
inputs.coil = { lump = "winding" }
links = [{ between = ["winding", "core"], conductance = 2.2 }, { between = ["core", "plate"], conductance = 9.0 },
         { between = ["plate", "water"], conductance = 6.0 }, { between = ["winding", "room"], conductance = 0.06 }]
[sensors]
T_winding = { lump = "winding", noise = 0.03 }
T_core = { lump = "core", noise = 0.03 }
T_plate = { lump = "plate", noise = 0.03 }
[fit]
"lumps.winding.capacity" = { lower = 40.0, upper = 250.0 }
"lumps.core.capacity" = { lower = 80.0, upper = 600.0 }
"lumps.plate.capacity" = { lower = 15.0, upper = 200.0 }
"links.winding-core.conductance" = { lower = 0.5, upper = 10.0 }
"links.core-plate.conductance" = { lower = 2.0, upper = 40.0 }
"links.plate-water.conductance" = { lower = 1.0, upper = 30.0 }
"links.winding-room.conductance" = { lower = 0.01, upper = 0.5 }
"""


class Motor:
    """Section of 30 by 20 cells, 120 mm deep.

    Parameters
    ----------
    alpha : float
        Temperature coefficient of the winding's resistance [1/K].
    """

    def __init__(self, alpha: float = ALPHA):
        rows, columns, dx, dy, depth = 20, 30, 40e-3 / 30, 1.5e-3, 0.12
        k, heat = np.full((rows, columns), 28.0), np.full((rows, columns), 3.6e6)  # laminations
        k[:3], heat[:3] = 160.0, 2.4e6  # cold plate
        slots = np.zeros(k.shape, bool)
        slots[8:, 5:12] = slots[8:, 18:25] = True
        k[slots], heat[slots] = 1.3, 2.6e6
        place = np.arange(k.size).reshape(k.shape)
        joint = np.zeros(k.shape)
        joint[2] = 1e-4  # m² K/W between plate and core
        ends, g = [], []
        for own, other, r, area in (
                (place[:, :-1], place[:, 1:], 0.5 * dx * (1 / k[:, :-1] + 1 / k[:, 1:]), dy * depth),
                (place[:-1], place[1:], 0.5 * dy * (1 / k[:-1] + 1 / k[1:]) + joint[:-1], dx * depth)):
            ends.append(np.stack([own.ravel(), other.ravel()]))
            g.append((area / r).ravel())
        (a, b), g = np.concatenate(ends, axis=1), np.concatenate(g)
        K = sparse.coo_matrix((np.concatenate([g, g]), (np.concatenate([a, b]), np.concatenate([b, a]))),
                              shape=(k.size, k.size)).tocsr()
        self.water, self.air = np.zeros(k.size), np.zeros(k.size)
        self.water[place[0]], self.air[place[-1]] = 1500.0 * dx * depth, 12.0 * dx * depth
        self.capacity, self.alpha = (heat * dx * dy * depth).ravel(), alpha
        self.share = slots.ravel() / slots.sum()
        leaving = np.asarray(K.sum(axis=1)).ravel() + self.water + self.air
        self._K = K - sparse.diags(leaving)
        self.read = np.stack([self.share, *np.eye(k.size)[[place[13, 15], place[1, 15]]]])  # the first, wound along

    def run(self, current: np.ndarray, water: np.ndarray, room: float) -> np.ndarray:
        """Temperatures at the sensors [°C], (n, 3), by implicit steps of a quarter of a sample."""
        step = STEP / 4
        lu = splu(sparse.csc_matrix(sparse.diags(self.capacity / step) - self._K))
        x, out = np.full(self.capacity.size, water[0]), []
        for ampere, T in zip(current, water, strict=True):
            out.append(self.read @ x)
            for _ in range(4):
                heat = R * (1.0 + self.alpha * (x - 20.0)) * self.share * ampere**2
                x = lu.solve(self.capacity / step * x + heat + self.water * T + self.air * room)
        return np.array(out)


def log(path: Path, motor: Motor, seed: int, n: int, water: float, room: float) -> Path:
    """A day of a machine: currents of both signs, held for three minutes, and a cooler that swings."""
    rng, k = np.random.default_rng(seed), np.arange(n)
    held = np.repeat(rng.choice([0.0, 1.5, 2.5, 3.5, 4.5, 5.5], n // 90 + 1), 90)[:n]
    current = held * np.where(k // 7 % 2, 1.0, -1.0)
    flow = water + 0.6 * np.sin(2 * np.pi * k * STEP / 2700.0) + 0.003 * np.cumsum(rng.standard_normal(n))
    T = motor.run(current, flow, room)
    ohm = 1e4 * np.exp(3950.0 * (1.0 / (T[:, 0] + 273.15) - 1.0 / 298.15)) * (1.0 + 8e-4 * rng.standard_normal(n))
    noisy = np.column_stack([T[:, 1:], flow]) + 0.03 * rng.standard_normal((n, 3))
    rows = np.column_stack([STEP * k, 1e3 * current, ohm, noisy])
    np.savetxt(path, rows, fmt="%.2f", delimiter=",", comments="",
               header="time,Current [mA],NTC [ohm],T_core [degC],T_plate [degC],water [degC]")
    return path
