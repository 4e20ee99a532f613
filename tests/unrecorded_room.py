"""A block on a plate, integrated by a matrix exponential; its room may not be recorded, and not stand still."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

import robthermal as rt

STEP, N, NOISE, ROOM = 5.0, 300, 0.05, 295.0
C_BLOCK, C_PLATE, BETWEEN, PLATE_ROOM, BLOCK_ROOM = 200.0, 150.0, 1.4, 0.85, 0.4  # J/K and W/K
TIME = STEP * np.arange(2 * N)  # of both records


def stepped(seed: int) -> np.ndarray:
    """Heater power [W], in steps of 100 s."""
    return 0.2 * np.repeat(np.random.default_rng(seed).choice([0.0, 20.0, 50.0, 100.0], 2 * N // 20), 20)


def records(*, room: np.ndarray | float = ROOM, heat: np.ndarray | float = 0.0, both: bool = False,
            recorded: bool = False, seed: int = 1) -> list[rt.Record]:
    """Two records in a row; `heat` [W] goes into the plate; `both`: the block loses heat to the room too."""
    rng, q = np.random.default_rng(seed), stepped(seed)
    room, heat = np.broadcast_to(room, TIME.size), np.broadcast_to(heat, TIME.size)
    g = BLOCK_ROOM if both else 0.0
    capacity = np.array([C_BLOCK, C_PLATE])[:, None]
    A = np.array([[-BETWEEN - g, BETWEEN], [BETWEEN, -BETWEEN - PLATE_ROOM]]) / capacity
    B = np.array([[1.0, g, 0.0], [0.0, PLATE_ROOM, 1.0]]) / capacity
    M = expm(np.block([[A, B], [np.zeros((3, 5))]]) * STEP)[:2]
    out = []
    for k in (0, N):
        T, readings = np.full(2, room[k]), []
        for u in np.column_stack([q, room, heat])[k:k + N]:
            readings.append(T)
            T = M @ [*T, *u]
        inputs = {"q": q[k:k + N], "room": room[k:k + N]} if recorded else {"q": q[k:k + N]}
        out.append(rt.Record(sample_time=STEP, inputs=np.column_stack(list(inputs.values())),
                             outputs=np.array(readings) + NOISE * rng.standard_normal((N, 2)),
                             input_names=list(inputs), output_names=["T_block", "T_plate"], start_time=TIME[k]))
    return out


def model(*, both: bool = False) -> rt.System:
    """The user's network: all numbers some way off, and a room of 295 K."""
    links = [{"between": ("block", "plate"), "conductance": 1.5}, {"between": ("plate", "room"), "conductance": 0.8}]
    fit = {"lumps.block.capacity": {"lower": 50.0, "upper": 800.0},
           "links.plate-room.conductance": {"lower": 0.1, "upper": 5.0},
           "links.block-plate.conductance": {"lower": 0.2, "upper": 10.0}}
    if both:
        links.append({"between": ("block", "room"), "conductance": 0.35})
        fit["links.block-room.conductance"] = {"lower": 0.05, "upper": 3.0}
    return rt.System(ambients={"room": {"temperature": ROOM}}, links=links, inputs={"q": {"lump": "block"}}, fit=fit,
                     lumps={"block": {"capacity": C_BLOCK}, "plate": {"capacity": C_PLATE}},
                     sensors={f"T_{name}": {"lump": name, "noise": NOISE} for name in ("block", "plate")})


def names(found: rt.diagnosis.Diagnosis) -> list[set[tuple[str, tuple[str, ...]]]]:
    """Every accepted effect with what the records cannot distinguish from it."""
    return [{(one.effect, one.where), *others} for one, others in zip(found.effects, found.alternatives, strict=True)]
