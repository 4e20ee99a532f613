"""Functions that worker processes import."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np

import robthermal as rt


def coldest(case):
    """A thermal number: the coldest reading of a bar with random heat."""
    bar = rt.System(ambients={"room": {"temperature": 300.0}}, lumps={"bar": {"capacity": 100.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.5, "natural": {"gain": 0.05}}],
                    inputs={"heater": {"lump": "bar"}})
    heat = np.random.default_rng(case["seed"]).standard_normal((20, 1)) - case["load"]
    record = rt.Record(sample_time=10.0, inputs=heat, outputs=np.zeros((20, 0)), input_names=["heater"],
                       output_names=[])
    return float(rt.thermal.simulate(bar, record)["bar"].min())


def fragile(x):
    """Refuses 1, breaks at 2."""
    if x == 1:
        raise rt.InputError("x is 1", where="argument x", expected="another number", remedy="Change it.")
    return x * x / (x - 2) * (x - 2) if x == 2 else x * x


def gap(x):
    """Says whose result it is; breaks at 0."""
    return {"path": str(x), "gap": 1 / x}


def recorded(trace, x):
    """Leaves a line for every call."""
    with Path(trace).open("a") as file:
        file.write(f"{x}\n")
    return x * x


def slow_square(seconds, trace, x):
    """Leaves the process that did the work."""
    time.sleep(seconds)
    with Path(trace).open("a") as file:
        file.write(f"{os.getpid()}\n")
    return x * x
