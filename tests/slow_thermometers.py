"""Two heaters that settle within 17 s, read by thermometers that take 140 s: steps of 1 s, converter steps of 0.32 K.

Its numbers are those of the emulated Temperature Control Lab board of the package tclab (J. Kantor), its steps an Euler
rule of their own: nothing of this package simulates it. A heater loses 1/20 of its excess to the room every second, a
hundredth of the difference goes to the other one, and a thermometer moves by 1/140 of what it is off. In a network with
heaters of 2 J/K that is 0.1 W/K, 0.02 W/K, and gains of 0.0699 and 0.035 W/%.
"""

from __future__ import annotations

import numpy as np

import robthermal as rt

ROOM, STEP = 294.15, 2
LOSS, PATH, LAG = 0.1, 0.02, 140.0  # W/K, W/K, s
GAINS = (2.0 * 200.0 / 5720.0, 2.0 * 100.0 / 5720.0)  # W/%


def run(percent: np.ndarray, seed: int) -> rt.Record:
    """Readings of both thermometers for heaters in percent (n, 2), held over 2 s, from rest."""
    rng = np.random.default_rng(seed)
    heaters, thermometers = np.full(2, ROOM), np.full(2, ROOM)
    readings = []
    for now in percent:
        readings.append(0.3223 * np.round((thermometers + rng.normal(0.0, 0.043, 2) - 273.15) / 0.3223) + 273.15)
        for _ in range(STEP):
            path = (heaters[::-1] - heaters) / 100.0
            change = np.array([200.0, 100.0]) * now / 5720.0 + (ROOM - heaters) / 20.0 + path
            thermometers = thermometers + (heaters - thermometers) / LAG
            heaters = heaters + change
    return rt.Record(sample_time=float(STEP), inputs=percent, outputs=np.array(readings), input_names=["Q1", "Q2"],
                     output_names=["T1", "T2"])


def staircase(n: int, seed: int, *, both: bool = True) -> np.ndarray:
    """Levels between 20 and 100 % or off, held for 40 to 200 s; the second heater may stay off."""
    rng = np.random.default_rng(seed)
    percent = np.zeros((n, 2))
    for heater in range(1 + both):
        row = 10
        while row < n:
            rows = int(rng.integers(20, 100))
            percent[row:row + rows, heater] = 0.0 if rng.random() < 0.3 else rng.uniform(20.0, 100.0)
            row += rows
    return percent


def board(*, path: bool = False, lag: float = 0.0) -> rt.System:
    """The user's network: heaters of 2 J/K, losses and gains to be estimated from what is usual for such boards."""
    fit = {f"inputs.{name}.gain": {"lower": 1e-3, "upper": 0.5} for name in ("Q1", "Q2")}
    fit |= {f"links.{name}-room.conductance": {"lower": 1e-4, "upper": 0.5} for name in ("h1", "h2")}
    links = [{"between": (name, "room"), "conductance": 0.005} for name in ("h1", "h2")]
    if path:
        links.append({"between": ("h1", "h2"), "conductance": 0.003})
        fit["links.h1-h2.conductance"] = {"lower": 1e-5, "upper": 0.5}
    if lag:
        fit |= {f"sensors.{name}.time_constant": {"lower": 1.0, "upper": 500.0} for name in ("T1", "T2")}
    own = {"time_constant": lag} if lag else {}
    return rt.System(ambients={"room": {"temperature": ROOM}}, lumps={name: {"capacity": 2.0} for name in ("h1", "h2")},
                     links=links, inputs={"Q1": {"lump": "h1", "gain": 0.0123}, "Q2": {"lump": "h2", "gain": 0.0062}},
                     sensors={"T1": {"lump": "h1", "noise": 0.1, **own}, "T2": {"lump": "h2", "noise": 0.1, **own}},
                     fit=fit)
