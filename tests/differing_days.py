"""Three bodies in a row, and days of them: every conductance of a day is off by 2 %; a path from the first to the last.

Integrated exactly, by the exponential of scipy.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.linalg import expm

import robthermal as rt

H, N, ROOM, NOISE, PATH = 20.0, 500, 295.0, 0.02, 0.2
BODIES, C = ("a", "b", "sink"), np.array([60.0, 90.0, 200.0])
G = {("a", "b"): 0.8, ("b", "sink"): 1.1, ("a", "room"): 0.05, ("b", "room"): 0.08, ("sink", "room"): 0.5}
SYSTEM = rt.System(
    ambients={"room": {"temperature": ROOM}}, lumps={name: {"capacity": c} for name, c in zip(BODIES, C, strict=True)},
    links=[{"between": pair, "conductance": value} for pair, value in G.items()],
    inputs={"q_a": {"lump": "a"}, "q_b": {"lump": "b"}},
    sensors={f"T_{name}": {"lump": name, "noise": NOISE} for name in BODIES},
    fit={f"links.{'-'.join(pair)}.conductance": {"lower": value / 4.0, "upper": 4.0 * value, "sigma": 0.2 * value}
         for pair, value in G.items()})
FEW = ("heat_source", "missing_link", "missing_ambient_link", "sensor_offset", "sensor_lag")
CONTACT = "links.b-sink.conductance"


@cache
def day(seed: int, path: float = PATH, contact: float = 1.0) -> rt.Record:
    """Every conductance of the day is off by 2 %; that from b to the sink has a factor."""
    rng = np.random.default_rng(seed)
    q = np.repeat(rng.choice([0.0, 6.0, 15.0, 25.0], (N // 20, 2)), 20, axis=0)
    K = np.zeros((4, 4))
    for (one, other), value in {**G, ("a", "sink"): path}.items():
        i, j = ((*BODIES, "room").index(end) for end in (one, other))
        value *= np.exp(0.02 * rng.standard_normal()) * (contact if (one, other) == ("b", "sink") else 1.0)
        K[[i, j], [j, i]] += value
        K[[i, j], [i, j]] -= value
    step = expm(H * np.block([[K[:3] / C[:, None], np.eye(3)[:, :2] / C[:2]], [np.zeros((3, 6))]]))
    x, rows = np.r_[np.full(4, ROOM), 0.0, 0.0], []
    for power in q:
        rows.append(x[:3])
        x = step @ np.r_[x[:4], power]
    return rt.Record(sample_time=H, inputs=q, outputs=np.array(rows) + NOISE * rng.standard_normal((N, 3)),
                     input_names=["q_a", "q_b"], output_names=[f"T_{name}" for name in BODIES], start_time=1e5 * seed)
