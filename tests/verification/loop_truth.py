"""Independent truth about closed loops: one sample solved numerically, its Jacobian by differences, limits by search.

Variants of the evidence: links that are uncertain, a plant with held heat, a drift; found once by rt.certify.loop,
proven by the checker from these digits, with a contraction just above the least that it proves.
"""

from __future__ import annotations

import copy

import certificate_truth as truth
import numpy as np
import small_loop
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from uncertain_truth import machines

VARIANTS = {
    "plain": ({}, {"contraction": 0.99574}),
    "uncertain": ({"parameters": {"links.sink.conductance": [1.9, 2.1], "links.leak.conductance": [0.09, 0.11]}}, {
        "matrix": [[0.42734, 0.0, 0.0], [0.0, 0.32611, -0.31563], [0.0, -0.31563, 1.0]], "weights": [0.01206, 0.04992],
        "sizes": [0.008627, 0.001118, 0.001742, 0.0001924, 1.201, 2.22e-05, 5.607e-05, 0.0003013],
        "contraction": 0.99585}),
    "drift": ({"drift": 2.0}, {
        "matrix": [[0.40665, 0.0, 0.0], [0.0, 0.25062, -0.17284], [0.0, -0.17284, 1.0]], "weights": [0.009989, 0.04127],
        "sizes": [0.000149, 0.0003553, 2.906e-09, 7.468e-09, 0.009423, 1.172e-07, 2.961e-07, 1.591e-06],
        "contraction": 0.995995}),
    "held": ({"plant": "held"}, {
        "matrix": [[0.39492, 0.0, 0.0], [0.0, 0.1796, -0.19807], [0.0, -0.19807, 1.0]], "weights": [], "sizes": [],
        "contraction": 0.9933}),
}
ROOM = {"room": 298.15}


def variant(name):
    """Return the sections of one variant."""
    region, evidence = VARIANTS[name]
    parts = small_loop.document(**copy.deepcopy(region))
    parts["evidence"] |= copy.deepcopy(evidence)
    return parts


def plants(parts, rng, count):
    """Return systems of the ranges; the system itself where nothing is uncertain."""
    found = parts["region"].get("parameters", {})
    return list(machines(parts["system"], found, rng, count)) if found else [parts["system"]]


def limited_current(parts, system, x, v):
    """Return the current that brings v into the cold face within its limits, and which limit acts (-1, 0, 1)."""
    low, high = parts["region"]["current"]["m"]
    if small_loop.achieved(system, x, low) <= v:
        return low, -1
    if small_loop.achieved(system, x, high) >= v:
        return high, 1
    for _ in range(70):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if small_loop.achieved(system, x, middle) > v else (low, middle)
    return 0.5 * (low + high), 0


def moved(parts, system, x, current):
    """Return the temperatures over one sample, (times, 2)."""
    E = np.array([lump["capacity"] for lump in system["lumps"].values()])
    T = parts["region"]["sample_time"]
    if parts["region"].get("plant", "continuous") == "held":
        passive = {**system, "modules": {"m": {**system["modules"]["m"], "seebeck": {"value": 0.0, "slope": 0.0},
                                               "conductance": {**system["modules"]["m"]["conductance"], "slope": 0.0}}}}
        F = truth.jacobian(passive, x, {"m": 0.0}) / E[:, None]
        hold = expm(np.block([[F, np.diag(1 / E)], [np.zeros((2, 4))]]) * T)[:2, 2:]
        return np.array([x, x + hold @ truth.heat(system, x, {"m": current}, ROOM)])
    return solve_ivp(lambda _, y: truth.heat(system, y, {"m": current}, ROOM) / E, (0, T), x, rtol=1e-10, atol=1e-10,
                     method="LSODA").y.T


def one_sample(parts, system, state):
    """Return the next state, which limit acts, and whether box and drift are kept on the way."""
    region, x, z = parts["region"], state[:2], state[2:]
    control = {key: np.array(rows, float) for key, rows in system["controller"].items()}
    error = x - [0.0, 295.0]
    v = float((control["C"] @ z + control["D"] @ error)[0])
    current, limit = limited_current(parts, system, x, v)
    path = moved(parts, system, x, current)
    T, _ = truth.boxes(system, region)
    kept = bool((path >= T[:, 0]).all() and (path <= T[:, 1]).all())
    kept &= bool(np.abs(path - x).max() <= region.get("drift", np.inf))
    gap = np.array([small_loop.achieved(system, x, current) - v])
    return np.concatenate([path[-1], control["A"] @ z + control["B"] @ error + control["windup"] @ gap]), limit, kept


def violation(parts, rng, count=6):
    """Return how far e'Pe of the worst sampled pair is above what is claimed: above 0 it is false.

    Pairs are near ones in the worst direction, from the Jacobian of the sample, which must lie on one piece.
    """
    P = np.array(parts["evidence"]["matrix"])
    level = parts["evidence"]["contraction"] ** 2
    least = np.linalg.eigvalsh((P + P.T) / 2)[0]
    if not least > 0 or np.abs(P - P.T).max() > 0:
        return np.inf
    worst, step = -np.inf, np.array([1e-3, 1e-3, 1e-3])
    for system in plants(parts, rng, max(1, count // 2)):
        T, _ = truth.boxes(system, parts["region"])
        for _ in range(count):
            x = T[:, 0] + np.abs(rng.choice([1e-3, 0.1, 0.5, 0.9, 0.999], 2)) * (T[:, 1] - T[:, 0])
            state = np.array([*x, rng.uniform(-12, 12)])
            base = one_sample(parts, system, state)
            sides = [[one_sample(parts, system, state + s * move) for s in (1, -1)] for move in np.diag(step)]
            if not all(found[1] == base[1] and found[2] for found in (base, *(one for pair in sides for one in pair))):
                continue
            D = np.column_stack([(one[0] - other[0]) / (2 * h) for (one, other), h in zip(sides, step, strict=True)])
            root = np.linalg.cholesky(P)
            worst = max(worst, float(np.linalg.norm(np.linalg.solve(root, D.T @ root).T, 2) ** 2 / level - 1))
    return worst
