"""The drawing of a system: every part is there, no text lies on another, the same drawing every time."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

import robthermal as rt
from robthermal.jobs.provenance import subtitle
from robthermal.thermal import System


def texts(ax: Any) -> dict[str, Any]:
    return {text.get_text(): text for text in ax.texts if text.get_text()}


def chain(n: int) -> System:
    return rt.System(ambients={"room": {"temperature": 295.0}}, lumps={f"x{k}": {"capacity": 10.0} for k in range(n)},
                     links=[{"between": (f"x{k}", f"x{k + 1}" if k + 1 < n else "room"), "conductance": 1.0}
                            for k in range(n)])


@pytest.fixture(scope="module")
def machine() -> System:
    return rt.systems.two_module()


def test_every_part_is_drawn_and_no_text_lies_on_another(machine: System) -> None:
    ax = machine.plot()
    drawn = texts(ax)
    assert {*machine.lumps, *machine.ambients, *machine.modules, *machine.sensors, *machine.inputs} == set(drawn)
    ax.figure.canvas.draw()
    boxes = {name: text.get_window_extent() for name, text in drawn.items()}
    for (one, first), (other, second) in combinations(boxes.items(), 2):
        assert not first.overlaps(second), (one, other)
    plt.close(ax.figure)


def test_positions_follow_the_links_and_do_not_change() -> None:
    places = []
    for _ in range(2):
        ax = chain(6).plot()
        drawn = texts(ax)
        places.append(np.array([drawn[name].get_position() for name in ("x0", "x1", "x2", "x3", "x4", "x5", "room")]))
        plt.close(ax.figure)
    np.testing.assert_array_equal(places[0], places[1])
    steps = np.linalg.norm(np.diff(places[0], axis=0), axis=1)
    assert steps.max() < 1.2 * steps.min()  # a chain is drawn as one: neighbors at one distance,
    assert np.linalg.norm(places[0][0] - places[0][-1]) > 0.9 * steps.sum()  # and stretched


def test_parts_that_touch_nothing_and_too_many_parts() -> None:
    two = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"a": {"capacity": 1.0}, "b": {"capacity": 1.0}},
                    links=[{"between": ("a", "room"), "conductance": 1.0}, {"between": ("b", "a"), "conductance": 1.0}],
                    sensors={"$T$": {"lump": "b"}})
    _, axes = plt.subplots()
    assert two.plot(axes) is axes and r"\$T\$" in texts(axes)
    plt.close(axes.figure)
    with pytest.raises(rt.InputError, match="System.plot: 302 lumps and ambients"):
        chain(301).plot()


def cooled() -> System:
    """A plate with a heater, and the speed of its fan, which is recorded and heats nothing."""
    return rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"plate": {"capacity": 10.0}},
                     links=[{"between": ("plate", "room"), "conductance": 1.0}],
                     inputs={"foil": {"lump": "plate"}, "fan": {"lump": "plate", "gain": 0.0, "unit": "rev/s"}})


def test_a_recorded_column_is_drawn_as_no_heater() -> None:
    ax = cooled().plot()
    marks = {line.get_marker() for line in ax.lines}
    names = [text.get_text() for text in ax.get_legend().get_texts()]
    assert {"^", "D"} <= marks
    assert names == ["lump", "ambient", "heat path", "heater", "recorded column that heats nothing"]
    plt.close(ax.figure)
    assert subtitle(cooled()).endswith("1 lump, 1 heater, 1 recorded column")


def test_quantities_have_the_unit_of_the_column_they_act_on() -> None:
    (driven,) = [one for one in rt.diagnosis.candidates(cooled(), ["driven_conductance"]) if "fan" in one.where]
    assert driven.effect.size.unit == "1/(rev/s)"
    offsets = {one.where: one.effect.size.unit for one in rt.diagnosis.candidates(cooled(), ["input_offset"])}
    assert offsets[("foil",)] == "W"


def test_a_coolant_that_carries_heat_is_an_arrow_downstream() -> None:
    def arrows(ax: Any) -> list[Any]:
        return [text for text in ax.texts if getattr(text, "arrow_patch", None) is not None]

    bar = chain(3)
    flow = rt.thermal.Flow(upstream="x0", downstream="x2", ambient="room", conductance=0.2)
    plain, piped = bar.plot(), rt.System(**{**dict(bar), "flows": (flow,)}).plot()
    assert len(arrows(piped)) == 1 and not arrows(plain)
    assert "coolant carries heat this way" in {text.get_text() for text in piped.get_legend().get_texts()}
    plt.close("all")
