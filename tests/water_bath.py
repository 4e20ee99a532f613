"""A stirred bath with an open surface, in numpy: water evaporates, which no effect of the catalog says."""

from __future__ import annotations

import numpy as np

import robthermal as rt

STEP, INNER, ROOM = 60.0, 10, 295.15  # s, Euler steps a sample, K
BATH = rt.System(
    ambients={"lab": {"temperature": ROOM}},
    lumps={"water": {"capacity": 21000.0}, "block": {"capacity": 900.0}, "shell": {"capacity": 3000.0}},
    inputs={"heater": {"lump": "water"}},
    links=[{"between": ("water", "block"), "conductance": 14.0}, {"between": ("water", "shell"), "conductance": 3.0},
           {"between": ("shell", "lab"), "conductance": 1.0}, {"between": ("water", "lab"), "conductance": 0.5}],
    sensors={"Tw": {"lump": "water", "noise": 0.02}, "Tb": {"lump": "block", "noise": 0.02},
             "Ts": {"lump": "shell", "noise": 0.02}},
    fit={"lumps.water.capacity": {"lower": 1e4, "upper": 4e4}, "lumps.shell.capacity": {"lower": 500.0, "upper": 1e4},
         "links.water-block.conductance": {"lower": 1.0, "upper": 100.0},
         "links.water-shell.conductance": {"lower": 0.1, "upper": 100.0},
         "links.shell-lab.conductance": {"lower": 0.1, "upper": 10.0},
         "links.water-lab.conductance": {"lower": 0.01, "upper": 10.0}})


def pressure(kelvin: float) -> float:
    """Of saturated vapor [Pa], after Magnus."""
    celsius = kelvin - 273.15
    return 610.94 * float(np.exp(17.625 * celsius / (celsius + 243.04)))


def day(seed: int, n: int, open_surface: float = 0.045) -> rt.Record:
    """Levels of the heater for an hour each; a surface of so many m² that loses vapor to air of 45 % humidity."""
    rng = np.random.default_rng(seed)
    heat = np.repeat(rng.choice([0.0, 60.0, 150.0, 250.0, 350.0], n // 60 + 1), 60)[:n]
    lab = ROOM + 0.5 * np.sin(2 * np.pi * np.arange(n) * STEP / 2e4) + 0.01 * np.cumsum(rng.standard_normal(n))
    water, block, inner, outer, rows = ROOM, ROOM, ROOM, ROOM, []
    for q, T in zip(heat, lab, strict=True):
        rows.append((water, block, outer))
        for _ in range(INNER):
            h = STEP / INNER
            vapor = 0.13 * open_surface * max(pressure(water) - 0.45 * pressure(T), 0.0)  # W/m²/Pa
            to_block, to_inner, through = 14.0 * (water - block), 50.0 * (water - inner), 4.0 * (inner - outer)
            water, block, inner, outer = (
                water + h / 21000.0 * (q - to_block - to_inner - 1.5 * (water - T) - vapor),
                block + h / 900.0 * to_block,
                inner + h / 1500.0 * (to_inner - through), outer + h / 1500.0 * (through - 0.9 * (outer - T)))
    outputs = np.array(rows) + 0.02 * rng.standard_normal((n, 3))
    return rt.Record(sample_time=STEP, inputs=np.column_stack([heat, lab]), outputs=outputs,
                     input_names=["heater", "lab"], output_names=["Tw", "Tb", "Ts"], start_time=1e7 * seed)
