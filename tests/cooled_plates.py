"""Three plates of twenty cells in a row over one channel: water passes A, B and C, and every cell warms it."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

import robthermal as rt

H, CELLS, FILM = 4.0, 20, 14.0  # s; W/K from a plate to the water along it
CAPACITY = np.array([220.0, 180.0, 260.0])  # J/K


def rate(T: np.ndarray, water: float, room: float, q1: float, q2: float, flow: float) -> np.ndarray:
    """Rate of every cell [K/s]; `flow` is the heat capacity of the water that passes in a second [W/K]."""
    cells, into = T.reshape(3, CELLS), np.zeros((3, CELLS))
    taken = flow * (1.0 - np.exp(-FILM / CELLS / flow))
    for plate in range(3):
        for cell in range(CELLS):
            heat = taken * (cells[plate, cell] - water)
            water += heat / flow
            into[plate, cell] -= heat
        along = 60.0 * np.diff(cells[plate])
        into[plate, :-1] += along
        into[plate, 1:] -= along
        into[plate] -= 0.4 / CELLS * (cells[plate] - room)
    for plate in (0, 1):
        heat = 0.25 * (cells[plate + 1].mean() - cells[plate].mean()) / CELLS
        into[plate] += heat
        into[plate + 1] -= heat
    into[0] += q1 / CELLS
    into[1] += q2 / CELLS
    return np.asarray((into / (CAPACITY[:, None] / CELLS)).ravel())


def record(seed: int, n: int, flow: float) -> rt.Record:
    """Random levels of two heaters, recorded water and room, readings with 10 mK of noise."""
    rng, zero = np.random.default_rng(seed), np.zeros(3 * CELLS)
    room = 293.0 + 0.5 * np.cumsum(rng.normal(0.0, 0.02, n))
    water = 291.0 + np.sin(np.arange(n) * H / 900.0 + rng.uniform(0.0, 6.0)) + np.cumsum(rng.normal(0.0, 0.01, n))
    heat = [np.repeat(rng.uniform(0.0, most, n // 40 + 1), 40)[:n] for most in (120.0, 90.0)]
    U = np.column_stack([water, room, *heat])
    A = np.stack([rate(one, 0.0, 0.0, 0.0, 0.0, flow) for one in np.eye(zero.size)], axis=1)
    B = np.stack([rate(zero, *one, flow) for one in np.eye(4)], axis=1)
    E = expm(H * np.block([[A, B], [np.zeros((4, zero.size + 4))]]))
    T, means = np.full(zero.size, 292.0), np.empty((n, 3))
    for k in range(n):
        means[k] = T.reshape(3, CELLS).mean(axis=1)
        T = E[:zero.size, :zero.size] @ T + E[:zero.size, zero.size:] @ U[k]
    return rt.Record(sample_time=H, inputs=np.column_stack([*heat, water, room]), output_names=["TA", "TB", "TC"],
                     outputs=means + 0.01 * rng.normal(size=means.shape), input_names=["q1", "q2", "water", "room"])


def system(coolant: tuple[str, ...]) -> rt.System:
    """What a user declares: three lumps, their losses to the water and the room, thin webs between them."""
    links = [(plate, "water", 10.0) for plate in "ABC"] + [(plate, "room", 0.4) for plate in "ABC"]
    links += [("A", "B", 0.25), ("B", "C", 0.25)]
    fit = {f"lumps.{plate}.capacity": {"lower": 50.0, "upper": 800.0} for plate in "ABC"}
    fit |= {f"links.{plate}-water.conductance": {"lower": 1.0, "upper": 50.0} for plate in "ABC"}
    fit |= {f"links.{pair}.conductance": {"lower": 0.05, "upper": 1.0} for pair in ("A-B", "B-C")}
    return rt.System(ambients={"water": {"temperature": 291.0, "coolant": coolant}, "room": {"temperature": 293.0}},
                     lumps=dict(zip("ABC", ({"capacity": 220.0}, {"capacity": 180.0}, {"capacity": 260.0}),
                                    strict=True)),
                     links=[{"between": (a, b), "conductance": G} for a, b, G in links],
                     inputs={"q1": {"lump": "A"}, "q2": {"lump": "B"}},
                     sensors={f"T{plate}": {"lump": plate, "noise": 0.01} for plate in "ABC"}, fit=fit)
