"""A report with every part, and odd characters in each text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from robthermal.report import (
    Claim,
    Evidence,
    Figure,
    Report,
    Section,
    Table,
    box_ranges,
    current_limits,
    measured_against_model,
)

ODD = '<script>alert("&\x00\x1b\ud800")</script> Æ €'


@pytest.fixture(scope="session")
def claim() -> Claim:
    return Claim("Contraction " + ODD, "Trajectories meet " + ODD, True, True, "m1: 0 to 1.2 A; all lumps 5 to 85 °C",
                 "rate 0.00123 1/s", "Energy norm.", file="certificates/contraction.json", seconds=0.03)


@pytest.fixture(scope="session")
def report(claim: Claim) -> Report:
    time = np.arange(0.0, 7200.0, 2.0)
    model = {"s1": 300.0 + np.sin(time / 500.0), "s$2$^": 301.0 + np.cos(time / 700.0)}
    noise = 0.05 * np.random.default_rng(7).standard_normal(time.size)
    traces = [Figure.draw(measured_against_model(time, {k: v + noise for k, v in model.items()}, model, title=name),
                          alt=f"Time plot {ODD}", caption=f"Record {name}, {ODD}") for name in ("train", "validation")]
    bars = Figure.draw(current_limits(["cooling, energy", "heating, sum", "heating, max"], [1.47, np.nan, np.inf],
                                      {"I* of m1": 2.3}), alt="Bars.", caption="Limits.")
    ranges = Figure.draw(box_ranges(["x1", "x2"], [5.0, 6.0], [60.0, 85.0]), alt="Ranges.", caption="Box.")
    names = pd.Series(["s1", ODD], dtype=object)
    table = Table(pd.DataFrame({"sensor": names, "RMSE [K]": [0.05123, np.nan]}), "Residuals " + ODD)
    sections = (Section("Model " + ODD, "One.\n\nTwo " + ODD, figures=traces, tables=(table,), anchor="model"),
                Section("Limits", "Text.", figures=(bars,), anchor="model"),
                Section("Æ", "Text.", figures=(ranges,)), Section("f1 x", "A drawing's ids begin so."))
    claims = (claim, replace(claim, title="Never left"))
    evidence = (Evidence("Contraction " + ODD, "certificates/contraction.json", "ab" * 32, "contraction",
                         "It contracts " + ODD, True, True, margins={"rate": 0.00123}, seconds=0.03,
                         assumptions=("Stays in the box " + ODD,)),
                Evidence("Never left", "certificates/box.json", "cd" * 32, "invariance", "It stays.", True, True,
                         assumptions=("Starts in the box.",)))
    provenance = {"robthermal": "0.1.0", "SHA-256 of " + ODD: "9f" * 32}
    return Report("Set-up " + ODD, "10 lumps", "SIMULATED DATA", claims, sections, provenance,
                  ("One temperature per lump " + ODD,), "today", evidence=evidence, checker="robthermal 0.1.0")


@pytest.fixture(scope="session")
def with_claim(report: Report, claim: Claim) -> Callable[..., Report]:
    """The same report with one changed claim."""
    return lambda **changes: replace(report, claims=(replace(claim, **changes),))
