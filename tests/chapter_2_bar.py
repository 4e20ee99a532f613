"""The bar of Evers (2021), chapter 2, by finite volumes and scipy alone: Ø25 × 250 mm, aluminium, POM, aluminium.

Two heaters at the ends, five thermometers, a film coefficient that depends on the temperature of the place.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

import robthermal as rt

DIAMETER, LENGTH, SLICE = 0.025, 0.25, 0.010  # [m]
SECTION, PERIMETER = np.pi * DIAMETER**2 / 4, np.pi * DIAMETER
SURFACE = PERIMETER * LENGTH + 2 * SECTION  # round the bar and on both ends [m²]
ALUMINIUM, POM = (167.0, 2700.0 * 896.0), (0.32, 1410.0 * 1470.0)  # W/(m K), J/(m³ K)
AT = np.array([0.015, 0.105, 0.145, 0.185, 0.235])  # thermometers [m]
LAW = (3.0, 2.0, 0.25)  # a [W/(m² K)], b [W/(m² K^1.25)], c [-]
ROOM = 295.15
CELLS = 125  # of 2 mm: the slice has five


def film(excess: np.ndarray, law: tuple[float, float, float] = LAW) -> np.ndarray:
    """h(ΔT) [W/(m² K)]."""
    return law[0] + law[1] * np.abs(excess) ** law[2]


@cache
def cells() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Centers [m], heat capacities [J/K], conductances to the next cell [W/K], surfaces [m²]."""
    dx = LENGTH / CELLS
    center = (np.arange(CELLS) + 0.5) * dx
    slice_ = np.abs(center - LENGTH / 2) < SLICE / 2
    k, volumetric = (np.where(slice_, pom, metal) for metal, pom in zip(ALUMINIUM, POM, strict=True))
    between = SECTION / (dx / 2 / k[:-1] + dx / 2 / k[1:])
    surface = np.full(CELLS, PERIMETER * dx)
    surface[[0, -1]] += SECTION
    return center, volumetric * SECTION * dx, between, surface


def rates(heat: float, second: float, air: float, law: tuple[float, float, float]) -> Callable[..., np.ndarray]:
    """Right-hand side of the cells' temperatures [K/s]."""
    _, capacity, between, surface = cells()

    def f(_: float, T: np.ndarray) -> np.ndarray:
        flow = between * np.diff(T)
        q = -surface * film(T - air, law) * (T - air)
        q[:-1] += flow
        q[1:] -= flow
        q[0] += heat
        q[-1] += second
        return q / capacity
    return f


def later(T: np.ndarray, span: float, *right: object) -> np.ndarray:
    """Temperatures of the cells after a span of constant inputs [s]; `right` as of `rates`."""
    return solve_ivp(rates(*right), (0.0, span), T, method="LSODA", rtol=1e-7, atol=1e-8, lband=1, uband=1).y[:, -1]


def recorded(heat: np.ndarray, second: float, room: np.ndarray, readings: np.ndarray, sample_time: float) -> rt.Record:
    return rt.Record(sample_time=sample_time, inputs=np.column_stack([heat, np.full(heat.size, second), room]),
                     outputs=readings, input_names=["u1", "u2", "room"],
                     output_names=[f"T{i + 1}" for i in range(AT.size)])


def staircase(levels: tuple[float, ...], hold: int, *, sample_time: float = 300.0, second: float = 0.0,
              swing: float = 0.0, noise: float = 0.0, law: tuple[float, float, float] = LAW,
              seed: int = 0) -> rt.Record:
    """Record of a staircase of the first heater [W]; the room swings by day, both are held between the samples."""
    heat = np.repeat(levels, hold)
    time = sample_time * np.arange(heat.size)
    room = ROOM + swing * np.sin(2 * np.pi * time / 86400.0)
    T, readings = np.full(CELLS, ROOM), np.empty((heat.size, AT.size))
    for n in range(heat.size):
        readings[n] = np.interp(AT, cells()[0], T)
        T = later(T, sample_time, heat[n], second, room[n], law)
    scatter = noise * np.random.default_rng(seed).standard_normal(readings.shape)
    return recorded(heat, second, room, readings + scatter, sample_time)


def model(film_coefficient: float, pom: float = POM[0]) -> rt.System:
    """The bar in lumps of the package: 12 + 5 + 12; the room's links are films of one coefficient."""
    a = rt.thermal.Assembly()
    a.ambient("room", ROOM)
    sides = {"area": SECTION, "perimeter": PERIMETER, "convection": film_coefficient, "ambient": "room"}
    half = {"length": (LENGTH - SLICE) / 2, "material": "aluminium 6061", "lumps": 12, **sides}
    left = a.rod("left", **half)
    middle = a.rod("pom", length=SLICE, material=rt.thermal.Material("POM", pom, 1410.0, 1470.0), lumps=5, **sides)
    right = a.rod("right", **half)
    a.join(left[-1], middle[0])
    a.join(middle[-1], right[0])
    ends = [{"between": (lump, "room"), "name": f"end {lump}", "conductance": film_coefficient * SECTION}
            for lump in (left[0], right[-1])]
    edge = (LENGTH - SLICE) / 2
    lumps = [left[int(x * 100)] if x < edge else right[int((x - edge - SLICE) * 100)] for x in AT]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # Biot number across the slice: 0.16, and the slice is 4 % of all
        return a.system(name="bar", links=ends, inputs={"u1": {"lump": left[0]}, "u2": {"lump": right[-1]}},
                        sensors={f"T{i + 1}": {"lump": lump, "noise": 0.01} for i, lump in enumerate(lumps)})
