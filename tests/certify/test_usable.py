"""The usable current against an own simulation: the machine never leaves its box with it, and does with more."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from own_simulation import Network, first_outside, switching

import robthermal as rt

LOW, HIGH = 278.15, 358.15


@pytest.fixture(scope="module")
def cooling(two):
    return rt.certify.usable_current(two, temperature=(LOW, HIGH), lower="reported")


def test_contraction_limit_of_the_how_to_burns_the_machine(two, cooling):
    """Row 1 of the table of misleading claims: 5.52 A, certificate valid, and 1227 °C after 838 s."""
    network, cold = Network(two), np.full(18, 298.15)
    contraction = rt.certify.largest_current(two, temperature=(LOW, HIGH), direction="cooling")
    times, states = network.run(cold, 2000.0, np.full(2, 0.99 * contraction.current))
    assert first_outside(times, states, 0.0, HIGH) < 60 and states.max() > 1500
    assert "contraction limit inside the box; not a limit for use" in str(contraction)
    times, states = network.run(cold, 20_000.0, np.full(2, cooling.current))
    assert states.max() < HIGH
    assert cooling.limits["contraction"].current == contraction.current > 3 * cooling.current


def test_demo_machine_stays_in_the_box_with_its_usable_current(two):
    """Row 2: 5.267 A "proven … may be used" leaves the box of 5 to 85 °C in less than a minute."""
    network, around = Network(two), {"room": (293.15, 303.15)}
    times, states = network.run(np.full(18, 298.15), 2000.0, np.full(2, 5.267))
    assert first_outside(times, states, 0.0, HIGH) < 60
    points = dict.fromkeys(two.modules, 278.15)
    found = rt.certify.usable_current(two, temperature=(LOW, HIGH), ambient=around, setpoint=points, lower="reported")
    assert found.limited_by == "runaway" and found.current < 0.981 * 1.5
    for room in around["room"]:
        _, states = network.run(np.full(18, room), 20_000.0, np.full(2, found.current), np.array([room]))
        assert states.max() < HIGH
    assert found.limits["runaway"].certificate.kind == "regulated" and found.limits["runaway"].certificate.holds


def test_what_more_current_does_below_the_runaway_bound(two):
    """As docs/explanations/limits.md says: free faces are coldest at their own I*, below the bound of set-points."""
    def cold(current):
        state = rt.thermal.steady_state(two, {"room": 298.15, **dict.fromkeys(two.modules, current)})
        return next(one for one in state.equilibria if one.stable).temperatures[two.modules["m2"].cold]

    free, held = (rt.certify.usable_current(two, temperature=(263.15, HIGH), lower="reported", setpoint=setpoint)
                  .limits["runaway"].current for setpoint in (None, dict.fromkeys(two.modules, 293.15)))
    assert (free, held) == (pytest.approx(1.476, abs=5e-4), pytest.approx(1.516, abs=5e-4))
    rising = [cold(current) for current in np.linspace(0.5, free, 6)]
    assert (np.diff(rising) < 0.0).all() and cold(held) > cold(free) == pytest.approx(273.15 - 4.8, abs=0.05)
    own = rt.thermal.fold(two, dict.fromkeys(two.modules, cold(free)), ambient={"room": 298.15}).current[-1]
    assert own.min() == pytest.approx(free, rel=0.01)
    page = (Path(__file__).resolve().parents[2] / "docs" / "explanations" / "limits.md").read_text(encoding="utf-8")
    assert "Below the runaway bound more current cools more" not in page and "1.516 A; not regulated" in page


def test_headline_of_a_small_module_is_not_its_contraction_limit():
    """Row 4: a 6.4 A module with a contraction limit of tens of amperes."""
    module = {"hot": "h", "cold": "c", "seebeck": 0.0517, "resistance": 1.99, "conductance": 0.534,
              "current_limits": (-6.4, 6.4)}  # TEC1-12706 class
    links = [{"between": ("h", "water"), "conductance": 8.0}, {"between": ("c", "water"), "conductance": 4.0}]
    system = rt.System(ambients={"water": {"temperature": 295.0}}, links=links, modules={"m": module},
                       lumps={"h": {"capacity": 40.0}, "c": {"capacity": 20.0}})
    found = rt.certify.usable_current(system, temperature=(240.0, 400.0))
    assert found.limits["contraction"].current > 50 and found.limits["rating"].current == 6.4
    assert 0 < found.current <= 6.4 and found.limited_by != "contraction"
    axes = found.plot()
    assert axes.get_xlim()[1] < 17


@pytest.mark.exhaustive
@pytest.mark.parametrize(("direction", "lower"), [("cooling", "reported"), ("cooling", "inside"), ("heating", "inside"),
                                                  ("symmetric", "inside")])
def test_nothing_leaves_the_box_at_the_headline(two, direction, lower):
    """From corners of the certified box, for constant currents and for switching, at 100 % of the headline."""
    heat, around = {"x15": (0.0, 1.0)}, {"room": (293.15, 299.15)}
    found = rt.certify.usable_current(two, temperature=(263.15, HIGH), direction=direction, lower=lower, heat=heat,
                                      ambient=around)
    assert found.holds and rt.verify(found.invariance).valid and rt.verify(found.contraction).valid
    box, network = np.array(list(found.box.values())).T, Network(two)
    assert box[1].max() <= HIGH and (lower == "reported" or box[0].min() >= 263.15)
    low, high = np.array(list(found.range.values())).T
    rng = np.random.default_rng(0)
    for room, load in product(around["room"], heat["x15"]):
        loads = np.where(np.array(list(two.lumps)) == "x15", load, 0.0)
        start = np.where(rng.random(18) < 0.5, box[0], box[1])
        for shares in ((0, 0), (1, 1), (0, 1), (0.5, 0.8)):
            _, states = network.run(start, 3000.0, low + np.array(shares) * (high - low), np.array([room]), loads)
            assert (states >= box[0] - 1e-4).all() and (states <= box[1] + 1e-4).all()
        states = switching(network, start, low, high, rng, 8, np.array([room]), loads)
        assert (states >= box[0] - 1e-4).all() and (states <= box[1] + 1e-4).all()


@pytest.mark.exhaustive
@pytest.mark.parametrize("direction", ["cooling", "heating", "symmetric"])
def test_wider_ranges_never_allow_more_current(two, direction):
    """Certificates are searched for finely enough that a proof for ranges is not found above one without them."""
    currents = []
    for width in (0.0, 1e-3, 1e-2):
        ranges = {name: (two.parameter(name) * (1 - width), two.parameter(name) * (1 + width)) for name in
                  ("modules.m1.seebeck.value", "modules.m2.resistance.value", "links.x1-room.conductance")}
        found = rt.certify.usable_current(two, temperature=(LOW, HIGH), direction=direction, lower="reported",
                                          parameters=ranges if width else None)
        assert found.holds
        currents.append(found.current)
        binding = found.limits[found.limited_by].current
        assert binding * (1 - 1e-3) <= found.current <= binding
    assert currents[1] <= 1.0003 * currents[0] and currents[2] < currents[1]


def test_runaway_bound_is_the_coldest_steady_state(two, cooling):
    network, off = Network(two), np.zeros(18)
    coldest = []
    for pattern in ((1, 1), (1, 0), (0, 1)):
        amps = np.linspace(1.2, 2.6, 15)
        faces = []
        for c in amps:
            _, states = network.run(np.full(18, 298.15), 20_000.0, c * np.array(pattern), network.ambient, off)
            faces.append(states[-1][[10, 11]])
        fit = [np.polyfit(amps - 1.9, np.array(faces)[:, k], 6) for k in (0, 1) if pattern[k]]
        coldest += [min(1.9 + r.real for r in np.roots(np.polyder(p)) if abs(r) < 0.7 and r.imag == 0) for p in fit]
    assert cooling.limits["runaway"].current == pytest.approx(min(coldest), rel=2e-3)
    assert cooling.limited_by == "runaway" and cooling.current == cooling.limits["runaway"].current


def test_bad_questions_are_refused(two):
    ask = rt.certify.usable_current
    with pytest.raises(rt.InputError, match="lump 'x1'.*excludes ambients"):
        ask(two, temperature=(300.0, HIGH))
    with pytest.raises(rt.InputError, match="excludes ambients"):
        ask(two, temperature=(LOW, HIGH), ambient={"room": (270.0, 300.0)})
    with pytest.raises(rt.InputError, match="argument lower"):
        ask(two, temperature=(LOW, HIGH), lower="open")
    with pytest.raises(rt.InputError, match="argument direction"):
        ask(two, temperature=(LOW, HIGH), direction="up")
    bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 50.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.5}])
    with pytest.raises(rt.InputError, match="no thermoelectric module"):
        ask(bar, temperature=(LOW, HIGH))


def test_no_current_is_usable_when_heat_alone_leaves_the_box(two):
    found = rt.certify.usable_current(two, temperature=(LOW, HIGH), heat={"x15": (0.0, 60.0)}, lower="reported")
    assert found.current == 0 and not found.holds and found.limited_by == "box" and found.outcome.code == "none"
    assert found.range == {"m1": (0.0, 0.0), "m2": (0.0, 0.0)}
