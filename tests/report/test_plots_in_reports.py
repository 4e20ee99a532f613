"""Plots of results as reports draw them, in their style and width: no text on another, units, legends."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import control
import matplotlib.pyplot as plt
import numpy as np
import pytest
from figures import complaints

import robthermal as rt

PLANT = control.ss([[0.0, 10.0, 2.0], [-1.0, 1.0, 0.0], [0.0, 2.0, -5.0]], [[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]],
                   [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0.0, 0.0], [0.0, 1.0], [2.0, 0.0]])


@pytest.fixture(autouse=True)
def _style() -> Iterator[None]:
    with rt.report.house_style():
        yield


@pytest.fixture(scope="module")
def machine() -> rt.System:
    return rt.System(ambients={"room": {"temperature": 295.15}},
                     lumps={"sink": {"capacity": 120.0}, "stage": {"capacity": 35.0}},
                     links=[{"between": ("sink", "room"), "conductance": 0.9},
                            {"between": ("stage", "room"), "conductance": 0.05}],
                     modules={"module_of_the_stage": rt.systems.surrogate_module("sink", "stage")})


@pytest.fixture(scope="module")
def loop(machine: rt.System) -> rt.design.ClosedLoop:
    law = rt.design.feedback_linearization(machine)
    pi = rt.design.pid(rt.design.cold_side(law), bandwidth=0.05, sample_time=1.0)
    return rt.design.simulate_loop(machine, pi, 288.15, law=law, duration=300.0)


@pytest.fixture(scope="module")
def margins(machine: rt.System) -> rt.design.LoopMargins:
    law = rt.design.feedback_linearization(machine)
    pi = rt.design.pid(rt.design.cold_side(law), bandwidth=0.05, sample_time=1.0)
    return rt.design.loop_margins(law, pi, 288.15)


def figure_of(axes: Any) -> Any:
    return np.ravel(axes)[0].figure


def test_the_step(loop: rt.design.ClosedLoop) -> None:
    assert complaints(figure_of(loop.plot())) == []


def test_bode_and_nyquist(margins: rt.design.LoopMargins) -> None:
    name, = margins.loops
    assert complaints(figure_of(margins.plot_bode(name))) == []
    assert complaints(figure_of(margins.plot_nyquist(name))) == []


@pytest.mark.parametrize("name", ["two_module", "tclab", "tclab_two_state"])
def test_networks(name: str) -> None:
    assert complaints(figure_of(getattr(rt.systems, name)().plot())) == []


def test_a_network_of_long_names() -> None:
    """Names of twenty letters, and heaters and sensors on one lump."""
    long = "cold_plate_of_detector"
    system = rt.System(ambients={"room": {"temperature": 295.15}},
                       lumps={f"{long}_{k}": {"capacity": 50.0} for k in range(5)},
                       links=[{"between": (f"{long}_{k}", f"{long}_{k + 1}" if k < 4 else "room"), "conductance": 1.0}
                              for k in range(5)],
                       inputs={"heater_of_the_detector": {"lump": f"{long}_0"}},
                       sensors={f"T_{k}": {"lump": f"{long}_{k}"} for k in range(5)})
    assert complaints(figure_of(system.plot())) == []


@pytest.mark.parametrize("synthesis", [rt.design.hinf, rt.design.h2], ids=["hinf", "h2"])
def test_syntheses(synthesis: Any) -> None:
    assert complaints(synthesis(PLANT, 1, 1).plot().figure) == []


def test_overlaps_are_seen(loop: rt.design.ClosedLoop) -> None:
    axes = loop.plot()
    axes[0].set_title("a title over the legend, as wide as the figure itself or even wider than that", loc="right")
    assert complaints(figure_of(axes))
    plt.close("all")
