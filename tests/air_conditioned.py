"""Two heated blocks on a plate in a room under air conditioning, integrated by a matrix exponential.

The room is a sawtooth of random periods, smoothed, and drifts; whether the record holds it can be chosen.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

import robthermal as rt

Array = NDArray[np.float64]
STEP, N, NOISE, ROOM = 4.0, 1500, 0.05, 295.0
PATH, MASS, SHARE = 0.08, 60.0, 0.1  # W/K between the blocks, J/K behind the plate, of heater 1 into the plate


def air(rng: np.random.Generator, n: int, swing: float) -> Array:
    """Distance of the room from 295 K [K]."""
    wanted: list[float] = []
    sign, room, out = 1.0, 0.0, np.zeros(n)
    while len(wanted) < n:
        wanted += [sign] * int(rng.uniform(360.0, 900.0) / STEP)
        sign = -sign
    for k in range(n):
        room += (wanted[k] - room) * STEP / 400.0
        out[k] = room
    return out / np.ptp(out) * 2.0 * swing + rng.uniform(-1.0, 1.0) * swing * np.arange(n) / n


def day(seed: int, hidden: str, *, swing: float = 0.6, recorded: bool = False) -> rt.Record:
    """One record; `hidden` is "path", "mass", "share" or "nothing"."""
    rng = np.random.default_rng(seed)
    q = np.column_stack([np.repeat(rng.choice([0.0, 4.0, 8.0, 12.0], N // 50), 50),
                         np.repeat(rng.choice([0.0, 3.0, 6.0, 10.0], N // 75), 75)])
    room, capacity = ROOM + air(rng, N, swing), np.array([80.0, 60.0, 400.0, MASS])
    G, to_room = np.zeros((4, 4)), np.array([0.1, 0.1, 1.2, 0.0])
    joined = {(0, 1): PATH if hidden == "path" else 0.0, (0, 2): 0.8, (1, 2): 0.6,
              (2, 3): MASS / 150.0 if hidden == "mass" else 0.0}
    for (a, b), g in joined.items():
        G[[a, b], [b, a]] += g
        G[[a, b], [a, b]] -= g
    heats = np.zeros((4, 2))
    heats[0, 0], heats[1, 1] = 1.0, 1.0
    if hidden == "share":
        heats[[0, 2], 0] = 1.0 - SHARE, SHARE
    A = (G - np.diag(to_room)) / capacity[:, None]
    B = np.column_stack([heats, to_room]) / capacity[:, None]
    M = expm(np.block([[A, B], [np.zeros((3, 7))]]) * STEP)[:4]
    T, rows = np.full(4, room[0]), []
    for k in range(N):
        rows.append(T[:3])
        T = M @ np.concatenate([T, q[k], room[k:k + 1]])
    inputs = np.column_stack([q, room]) if recorded else q
    return rt.Record(sample_time=STEP, inputs=inputs, outputs=np.array(rows) + NOISE * rng.standard_normal((N, 3)),
                     input_names=["q1", "q2", "room"][:inputs.shape[1]], output_names=["T1", "T2", "Tp"],
                     name=f"{hidden} {seed}")


def model() -> rt.System:
    """The user's network, its numbers some way off."""
    links = {("a", "p"): 0.88, ("b", "p"): 0.54, ("p", "room"): 1.32, ("a", "room"): 0.1, ("b", "room"): 0.1}
    capacities = {"a": 84.0, "b": 57.0, "p": 430.0}
    fit = {f"lumps.{name}.capacity": (value, 5.0, 0.2) for name, value in capacities.items()}
    fit |= {f"links.{a}-{b}.conductance": (value, 10.0, 0.4) for (a, b), value in links.items()}
    return rt.System(
        ambients={"room": {"temperature": ROOM}}, inputs={"q1": {"lump": "a"}, "q2": {"lump": "b"}},
        lumps={name: {"capacity": value} for name, value in capacities.items()},
        links=[{"between": pair, "conductance": value} for pair, value in links.items()],
        sensors={name: {"lump": lump, "noise": NOISE} for name, lump in (("T1", "a"), ("T2", "b"), ("Tp", "p"))},
        fit={name: {"lower": value / most, "upper": value * most, "sigma": share * value}
             for name, (value, most, share) in fit.items()})
