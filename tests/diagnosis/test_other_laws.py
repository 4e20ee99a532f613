"""Radiation or natural convection: which law a loss has is not told where much else is left."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis import search
from robthermal.diagnosis.search import Accepted

ROOM, STEP = 295.0, 20.0
PLATE = rt.System(
    ambients={"room": {"temperature": ROOM}}, lumps={"plate": {"capacity": 200.0}},
    inputs={"heater": {"lump": "plate"}},
    links=[{"between": ("plate", "room"), "conductance": 0.15}], sensors={"T": {"lump": "plate", "noise": 0.02}},
    fit={"lumps.plate.capacity": {"lower": 50.0, "upper": 800.0},
         "links.plate-room.conductance": {"lower": 0.01, "upper": 2.0}})


def day(wandering: float) -> rt.Record:
    """A plate that radiates, and a load that wanders by so many watts, in numpy."""
    rng, n = np.random.default_rng(7), 900
    heat = np.repeat(rng.choice([0.0, 3.0, 6.0, 10.0], n // 60), 60)
    load = wandering * np.convolve(rng.standard_normal(n), np.ones(50) / 50**0.5, "same")
    T, rows = ROOM, []
    for q in heat + load:
        rows.append(T)
        for _ in range(10):
            T += 0.1 * STEP / 200.0 * (q - 0.1 * (T - ROOM) - 1.2e-9 * (T**4 - ROOM**4))
    outputs = np.array(rows)[:, None] + 0.02 * rng.standard_normal((n, 1))
    return rt.Record(sample_time=STEP, inputs=heat[:, None], outputs=outputs, input_names=["heater"],
                     output_names=["T"])


@pytest.mark.parametrize("wandering", [0.0, 1.0])
def test_the_other_law_stands_beside_a_loss_where_a_misfit_is_left(wandering: float) -> None:
    record = day(wandering)
    nominal = rt.diagnosis.refit(PLATE, record, rt.diagnosis.noise_floor(PLATE, record))
    found = search.refit_candidates(search.begin(nominal, ["radiation"])).short.entries[0]
    accepted = Accepted(nominal, best=found)
    beside = [entry.candidate.label for entry in search.other_laws(accepted, found.fit, nominal, None)]
    assert (found.fit.variance > 2.0) == bool(wandering)
    assert beside == (["natural_convection(plate, room)"] if wandering else [])
    assert not search.other_laws(accepted, found.fit, nominal, ["radiation"])  # what may not be named is not asked
