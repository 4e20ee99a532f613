"""A box is found without any current too: rounding in the test of the slopes must not look like a fold."""

from __future__ import annotations

import robthermal as rt


def test_a_box_is_found_without_current() -> None:
    """Sink to a colder ambient than the room: faces held at the end of the ambients give exact zeros in the test."""
    system = rt.System(
        ambients={"room": {"temperature": 295.15}, "water": {"temperature": 291.15}},
        lumps={"plate": {"capacity": 110.0}, "cold": {"capacity": 9.0}, "hot": {"capacity": 9.0},
               "sink": {"capacity": 180.0}},
        links=[{"between": ("plate", "cold"), "conductance": 4.0}, {"between": ("hot", "sink"), "conductance": 6.0},
               {"between": ("sink", "water"), "conductance": 10.0},
               {"between": ("plate", "room"), "conductance": 0.15}],
        inputs={"load": {"lump": "plate", "limits": (0.0, 5.0)}},
        modules={"m1": {"hot": "hot", "cold": "cold", "seebeck": {"value": 0.0508, "slope": 9e-5},
                        "resistance": {"value": 1.98, "slope": 0.009}, "conductance": {"value": 0.5},
                        "reference_temperature": 298.15}})
    ambient = {"room": (291.15, 301.15), "water": (288.15, 295.15)}
    hottest = []
    for high in (0.0, 0.01, 1.0):
        found = rt.certify.runaway_free(system, current={"m1": (0.0, high)}, ambient=ambient)
        assert found.holds
        hottest.append(max(pair[1] for pair in found.temperature.values()))
    assert hottest[0] <= hottest[1] < hottest[2]
