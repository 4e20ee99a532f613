"""Small observed machines, and the matrix of one sample of their error from a matrix exponential and complex steps."""

from __future__ import annotations

import copy

import certificate_truth as truth
import numpy as np
from scipy.linalg import expm

ROD = {"lumps": {"rod": {"capacity": 10.0}}, "ambients": ["room"], "modules": {},
       "links": [{"between": ["rod", "room"], "conductance": 0.5}]}


def rod(gain, contraction, sample_time=2.0, sensor_gain=1.0):
    return {"system": {**ROD, "gain": [[gain]], "sensors": [{"name": "T", "lump": "rod", "gain": sensor_gain}]},
            "region": {"temperature": [280.0, 350.0], "current": {}, "sample_time": sample_time},
            "evidence": {"matrix": [[3.0]], "contraction": contraction}}


def machine(rng):
    system = truth.random_system(rng, modules=1, nonlinear=False, wild=True)
    n = len(system["lumps"])
    lump = list(system["lumps"])[int(rng.integers(n))]
    gain = np.round(rng.uniform(-0.2, 0.6, (n, 1)), 3)
    region = {**truth.box(system, float(rng.uniform(0.5, 4.0))), "sample_time": float(rng.choice([0.5, 2.0, 10.0]))}
    return {"system": {**system, "gain": gain.tolist(), "sensors": [lump]}, "region": region}


def error_matrix(document, x, currents, nominal=None):
    """M in floats, from the heat flows by complex step; ``nominal`` gives A_d and Γ."""
    system, Ts = document["system"], truth.number(document["region"]["sample_time"])
    E = np.array([truth.number(lump["capacity"]) for lump in system["lumps"].values()])
    n, names = len(E), list(system["lumps"])
    flat = copy.deepcopy(nominal or system)
    for module in flat["modules"].values():
        for key in ("seebeck", "resistance", "conductance"):
            module[key] = {"value": module[key]["value"], "slope": 0.0}
    passive = truth.jacobian(flat, np.full(n, 300.0), dict.fromkeys(currents, 0.0))
    full = expm(np.block([[passive / E[:, None], np.diag(1 / E)], [np.zeros((n, 2 * n))]]) * Ts)
    C = np.zeros((len(system["sensors"]), n))
    for row, lump in enumerate(system["sensors"]):
        C[row, names.index(lump)] = 1.0
    L = np.array([[truth.number(value) for value in row] for row in system["gain"]])
    return full[:n, :n] - L @ C + full[:n, n:] @ (truth.jacobian(system, x, currents) - passive)
