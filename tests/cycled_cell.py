"""A battery cell between a cold plate and a busbar under a cycler: 8 rings of 14 layers, stepped exactly.

Beside the heat of its resistance, which the log has in watts, a cell takes up or gives off heat in proportion to the
current and its sign (entropy of the reaction); some heat arises in the busbar. A network of three lumps has neither.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.linalg import expm

H, RINGS, LAYERS = 5.0, 8, 14  # s
RESISTANCE, BUSBAR, ENTROPY = 3.2e-3, 4e-4, 0.0447  # Ω, Ω, W/A
RADIUS, HEIGHT, DENSE, ACROSS, ALONG = 0.023, 0.08, 2.45e6, 1.1, 26.0  # m, m, J/K/m³, W/m/K
SYSTEM = """
columns = { Heat = "Heat(W)", Current = "Current(A)", core = "Aux_Core(C)", can = "Aux_Can(C)", bus = "Aux_Bus(C)" }
system = { name = "cell under a cycler", temperature_unit = "degC" }
ambients = { plate = { temperature = 22.0 }, chamber = { temperature = 24.0 } }
lumps = { roll = { capacity = 200.0 }, shell = { capacity = 100.0 }, busbar = { capacity = 60.0 } }
inputs.Heat = { lump = "roll" }
inputs.Current = { lump = "busbar", gain = 0.0 }
links = [{ between = ["roll", "shell"], conductance = 1.0 }, { between = ["roll", "busbar"], conductance = 1.0 },
         { between = ["roll", "plate"], conductance = 0.6 }, { between = ["shell", "chamber"], conductance = 0.25 },
         { between = ["busbar", "chamber"], conductance = 0.06 }]
[sensors]
core = { lump = "roll", noise = 0.03 }
can = { lump = "shell", noise = 0.03 }
bus = { lump = "busbar", noise = 0.03 }
[fit]
"lumps.roll.capacity" = { lower = 50.0, upper = 500.0 }
"lumps.shell.capacity" = { lower = 20.0, upper = 400.0 }
"lumps.busbar.capacity" = { lower = 20.0, upper = 200.0 }
"links.roll-shell.conductance" = { lower = 0.1, upper = 10.0 }
"links.roll-busbar.conductance" = { lower = 0.1, upper = 10.0 }
"links.roll-plate.conductance" = { lower = 0.05, upper = 5.0 }
"links.shell-chamber.conductance" = { lower = 0.05, upper = 2.0 }
"links.busbar-chamber.conductance" = { lower = 0.005, upper = 0.5 }
"""

_SHARED = 'inputs.Heat = { lump = "roll", feedthrough = { lump = "busbar", share = 0.1 } }'
WITH_HEATS = (SYSTEM.replace('{ lump = "busbar", gain = 0.0 }', '{ lump = "roll", gain = 0.04, unit = "A" }')
              .replace('inputs.Heat = { lump = "roll" }', _SHARED)) + """
"inputs.Current.gain" = { lower = 0.0, upper = 0.2 }
"inputs.Heat.gain" = { lower = 0.5, upper = 2.0, sigma = 0.1 }
"inputs.Heat.feedthrough.share" = { lower = 0.0, upper = 0.6 }
"""


def network() -> tuple[np.ndarray, np.ndarray]:
    """Rates by the temperatures of cells and busbar, and by plate, chamber, heat of the cell and of the busbar."""
    edges, dz = np.linspace(1e-3, RADIUS, RINGS + 1), HEIGHT / LAYERS
    middle, area = 0.5 * (edges[1:] + edges[:-1]), np.pi * np.diff(edges**2)
    place, n = np.arange(RINGS * LAYERS).reshape(RINGS, LAYERS), RINGS * LAYERS + 1
    A, B = np.zeros((n, n)), np.zeros((n, 4))

    def join(a: int, b: int, G: float) -> None:
        A[[a, b], [a, b]] -= G
        A[[a, b], [b, a]] += G

    def lose(a: int, ambient: int, G: float) -> None:
        A[a, a] -= G
        B[a, ambient] += G

    for i, row in enumerate(place):
        for a, b in zip(row, row[1:], strict=False):
            join(a, b, ALONG * area[i] / dz)
        lose(row[0], 0, 400.0 * area[i])
        join(row[-1], n - 1, 900.0 * area[i])
    for i in range(RINGS - 1):
        for a, b in zip(place[i], place[i + 1], strict=True):
            join(a, b, 2 * np.pi * dz * ACROSS / np.log(middle[i + 1] / middle[i]))
    for a in place[-1]:
        lose(a, 1, 22.0 * 2 * np.pi * RADIUS * dz)
    lose(n - 1, 1, 0.06)
    volume = np.repeat(area * dz, LAYERS)
    B[:-1, 2], B[-1, 3] = volume / volume.sum(), 1.0
    capacity = np.r_[DENSE * volume, 60.0]
    return A / capacity[:, None], B / capacity[:, None]


def write(path: Path, seed: int, n: int, older: float = 1.0) -> Path:
    """A log of pulses in both directions; the resistance has grown by a factor that the logger does not know."""
    rng, t = np.random.default_rng(seed), H * np.arange(n)
    pulses = np.repeat(rng.choice([-60.0, -40.0, -25.0, 0.0, 0.0, 25.0, 40.0, 60.0], n // 40 + 1), 40)[:n]
    ampere = np.where(pulses == 0.0, 0.0, pulses + 3.0 * rng.standard_normal(n))
    heat = RESISTANCE * ampere**2
    plate = 22.0 + 1.5 * np.sin(2 * np.pi * t / 3000.0)
    chamber = 24.0 + 0.007 * np.cumsum(rng.standard_normal(n))
    A, B = network()
    E = expm(np.block([[A * H, B * H], [np.zeros((4, len(A) + 4))]]))
    x, T = np.full(len(A), 24.0), np.empty((n, 3))
    drives = np.column_stack([plate, chamber, older * heat + ENTROPY * ampere, BUSBAR * ampere**2])
    middle = np.arange(RINGS * LAYERS).reshape(RINGS, LAYERS)[[0, -1], LAYERS // 2]
    for k in range(n):
        T[k] = x[[*middle, -1]]
        x = E[:-4, :-4] @ x + E[:-4, -4:] @ drives[k]
    rows = np.column_stack([t, ampere, heat, T + 0.03 * rng.standard_normal((n, 3)), plate, chamber])
    np.savetxt(path, rows, delimiter=",", comments="", fmt="%.3f",
               header="Test_Time(s),Current(A),Heat(W),Aux_Core(C),Aux_Can(C),Aux_Bus(C),plate (C),chamber (C)")
    return path
