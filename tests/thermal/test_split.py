"""A lump split in two: against networks integrated by a matrix exponential, and the limit of one lump."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import robthermal as rt

ROOM = 300.0
BLOCK = rt.System(
    ambients={"room": {"temperature": ROOM}},
    lumps={"block": {"capacity": 200.0, "heat": 3.0, "disturbance": 0.2}, "plate": {"capacity": 150.0}},
    links=[{"between": ("block", "plate"), "conductance": 1.5}, {"between": ("block", "room"), "conductance": 0.2},
           {"between": ("plate", "room"), "conductance": 0.8}],
    inputs={"q": {"lump": "block"}}, sensors={"T_block": {"lump": "block"}, "T_plate": {"lump": "plate"}},
    fit={"lumps.block.capacity": {"lower": 50.0, "upper": 800.0, "sigma": 20.0},
         "links.block-plate.conductance": {"lower": 0.2, "upper": 9.0}})
N, H = 200, 5.0
HEATER = np.repeat([5.0, 0.0, 10.0, 2.0], N // 4)


def simulated(system: rt.System) -> np.ndarray:
    drive = rt.Record(sample_time=H, inputs=HEATER, outputs=np.zeros((N, 0)), input_names=["q"], output_names=[])
    return rt.thermal.simulate(system, drive, initial=dict.fromkeys(system.lumps, ROOM)).outputs


def exact(A: np.ndarray, b: np.ndarray, heat: np.ndarray, seen: list[int]) -> np.ndarray:
    """Excess temperatures of C ẋ = A x + b q + heat, exact for held inputs; A, b and heat by capacity already."""
    n = len(A)
    M = expm(np.block([[A, b[:, None], heat[:, None]], [np.zeros((2, n + 2))]]) * H)[:n]
    x, out = np.zeros(n), []
    for q in HEATER:
        out.append(ROOM + x[seen])
        x = M @ np.array([*x, q, 1.0])
    return np.array(out)


def test_halves_are_the_network_written_by_hand() -> None:
    """Heater on the first half, sensor and plate on the other; half of the heat and of the room's path each."""
    split = rt.thermal.split_lump(BLOCK, "block", ["sensors.T_block", "lumps.plate"], conductance=0.7)
    C = np.array([100.0, 150.0, 100.0])[:, None]
    A = np.array([[-0.7 - 0.1, 0.0, 0.7], [0.0, -1.5 - 0.8, 1.5], [0.7, 1.5, -0.7 - 1.5 - 0.1]]) / C
    truth = exact(A, np.array([0.01, 0.0, 0.0]), np.array([0.015, 0.0, 0.015]), [2, 1])
    assert np.abs(simulated(split.system) - truth).max() < 1e-6
    assert split.system.sensors["T_block"].lump == split.other == "block_2"


def test_a_large_conductance_is_one_lump() -> None:
    whole = simulated(BLOCK)
    errors = [np.abs(simulated(rt.thermal.split_lump(BLOCK, "block", ["sensors.T_block"], conductance=G).system)
                     - whole).max() for G in (10.0, 100.0, 1000.0)]
    assert errors[0] > 0.1 and errors[1] == pytest.approx(0.1 * errors[0], rel=0.2) and errors[2] < 0.02 * errors[0]


def test_what_is_shared_is_shared() -> None:
    split = rt.thermal.split_lump(BLOCK, "block")
    system = split.system
    assert all(system.parameter(a) == system.parameter(b) for a, b in split.twins.items()
               if a in system.parameters and b in system.parameters)
    assert sum(system.lumps[name].disturbance ** 2 for name in ("block", "block_2")) == pytest.approx(0.04)
    ranges = system.fit
    assert (ranges["lumps.block.capacity"].lower, ranges["lumps.block.capacity"].sigma) == (25.0, 10.0)
    assert ranges["links.block-plate.conductance"].upper == 9.0
    assert system.parameter(split.conductance) == 2 * 1.5  # twice that to its neighbor
    assert ranges[split.conductance].lower < 3.0 < ranges[split.conductance].upper


def test_every_way_is_another_network() -> None:
    ways = list(rt.thermal.ways_to_split(BLOCK, "block"))
    assert len(ways) == len(set(ways)) == 4  # of 2³ halves of plate, heater, sensor: but for their order
    runs = [simulated(rt.thermal.split_lump(BLOCK, "block", way, conductance=0.5).system) for way in ways]
    assert all(np.abs(a - b).max() > 1e-3 for i, a in enumerate(runs) for b in runs[:i])


def test_a_module_and_radiation_are_split() -> None:
    system = rt.systems.two_module()
    hot = system.modules["m1"].hot
    split = rt.thermal.split_lump(system, hot, ["modules.m1"])
    assert split.system.modules["m1"].hot == split.other
    warm = rt.thermal.add_effect(BLOCK, "radiation", ["block", "room"], {"coefficient": 2e-9}).system
    halves = rt.thermal.split_lump(warm, "block").system
    assert [link.radiation for link in halves.links if link.radiation] == [1e-9, 1e-9]
    assert len({link.name for link in halves.links}) == len(halves.links)


@pytest.mark.parametrize(("lump", "moved", "conductance", "words"), [
    ("blok", [], None, "there is no lump 'blok'"), ("block", ["sensors.T_plate"], None, "is not attached"),
    ("block", [], -1.0, "conductance is -1")])
def test_bad_input(lump: str, moved: list[str], conductance: float | None, words: str) -> None:
    with pytest.raises(rt.InputError, match=words):
        rt.thermal.split_lump(BLOCK, lump, moved, conductance=conductance)
