"""A module between two lumps with an integrating controller: its closed loop and evidence that proves it."""

from __future__ import annotations

import copy

import certificate_truth as truth

from robthermal.verification import establish

PAIR = {"name": "pair", "lumps": {"hot": {"capacity": 50.0}, "cold": {"capacity": 20.0}}, "ambients": ["room"],
        "links": [{"name": "sink", "between": ["hot", "room"], "conductance": 2.0},
                  {"name": "leak", "between": ["cold", "room"], "conductance": 0.1}],
        "modules": {"m": {"hot": "hot", "cold": "cold", "seebeck": {"value": 0.05, "slope": 1e-4},
                          "resistance": {"value": 4.0, "slope": 0.01}, "conductance": {"value": 0.3, "slope": 0.0},
                          "reference_temperature": 298.15}},
        "controller": {"A": [[1.0]], "B": [[0.0, -0.01]], "C": [[1.0]], "D": [[0.0, -1.0]], "windup": [[0.01]]}}
BOX = {"temperature": [285.0, 310.0], "current": {"m": [-0.2, 0.5]}, "sample_time": 1.0, "plant": "continuous"}
# found once by rt.certify.loop; whatever its origin, the checker proves it from these digits
EVIDENCE = {"matrix": [[0.37022, 0.0, 0.0], [0.0, 0.30188, -0.30392], [0.0, -0.30392, 1.0]], "pieces": 1,
            "contraction": 0.996, "weights": [0.009261, 0.04508],
            "sizes": [0.0001626, 0.0003877, 4.955e-07, 1.273e-06, 1.322, 2.379e-05, 5.672e-05, 0.0003181]}


def document(**changes):
    return {"system": copy.deepcopy(PAIR), "region": {**copy.deepcopy(BOX), **changes},
            "evidence": copy.deepcopy(EVIDENCE)}


def made(parts, margin=None):
    return establish("loop", **parts, made_by={}, margin={} if margin is None else margin)


def achieved(system, x, current):
    """Heat into the cold face, with the module alone."""
    alone = {**system, "links": []}
    return truth.heat(alone, x, {"m": current}, {"room": 298.15})[1]
