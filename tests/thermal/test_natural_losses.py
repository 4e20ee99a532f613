"""Losses by natural convection instead of constant conductances."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt
from robthermal.errors import InputError


def machine() -> rt.System:
    return rt.System(
        ambients={"room": {"temperature": 295.0}}, lumps={name: {"capacity": 80.0} for name in ("a", "b")},
        links=[{"between": ("a", "b"), "conductance": 0.7}, {"between": ("a", "room"), "conductance": 0.4},
               {"between": ("room", "b"), "conductance": 0.2},
               {"between": ("b", "room"), "radiation": 5e-10, "name": "sky"}],
        inputs={"heater": {"lump": "a"}},
        fit={"links.a-room.conductance": {"lower": 0.1, "upper": 2.0, "sigma": 0.05},
             "links.a-b.conductance": {"lower": 0.1, "upper": 2.0}})


def test_only_constant_conductances_to_ambients_are_losses_to_change() -> None:
    assert rt.thermal.constant_losses(machine()) == ("a-room", "room-b")
    airy = rt.thermal.natural_losses(machine())
    conductances = {link.name: link.conductance for link in airy.links}
    assert conductances == {"a-b": 0.7, "a-room": 0.0, "room-b": 0.0, "sky": 0.0}
    assert rt.thermal.constant_losses(airy) == ()
    assert rt.thermal.natural_losses(machine(), ["room-b"]).parameter("links.a-room.conductance") == 0.4


def test_ranges_of_the_fit_table_go_with_the_number() -> None:
    scale = 10.0**-0.25
    airy = rt.thermal.natural_losses(machine())
    assert set(airy.fit) == {"links.a-room.natural.gain", "links.a-b.conductance"}
    one = airy.fit["links.a-room.natural.gain"]
    assert (one.lower, one.upper, one.sigma) == pytest.approx((0.1 * scale, 2.0 * scale, 0.05 * scale))
    again = rt.thermal.parse_system(rt.thermal.format_system(airy))
    assert again.parameters == pytest.approx(airy.parameters) and set(again.fit) == set(airy.fit)


@pytest.mark.parametrize("exponent", [0.25, 1.0 / 3.0])
def test_steady_heat_is_that_of_the_law(exponent: float) -> None:
    """One lump: P = G (ΔT / 10 K)^n ΔT, solved for ΔT by hand."""
    bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 10.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.4}], inputs={"q": {"lump": "bar"}})
    airy = rt.thermal.natural_losses(bar, exponent=exponent)
    n = 4000
    drive = rt.Record(sample_time=1.0, inputs=np.full(n, 9.0), outputs=np.zeros((n, 0)), input_names=["q"],
                      output_names=[])
    T = rt.thermal.trajectory(airy, drive).lumps[-1, 0]
    assert T - 295.0 == pytest.approx((9.0 * 10.0**exponent / 0.4) ** (1.0 / (1.0 + exponent)), rel=1e-6)


@pytest.mark.parametrize(("links", "said"), [(["a-b"], "'a-b' is no constant"), (["sky"], "a-room, room-b"),
                                             (["nothing"], "'nothing'")])
def test_other_links_are_refused(links: list[str], said: str) -> None:
    with pytest.raises(InputError, match=said):
        rt.thermal.natural_losses(machine(), links)
