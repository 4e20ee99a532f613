"""Boxes that are never left: found for networks whose losses bend, and proven."""

import numpy as np
import pytest

import robthermal as rt


def bent_network(rng: np.random.Generator) -> rt.System:
    """A chain with a module, natural convection and radiation everywhere."""
    n = int(rng.integers(2, 6))

    def natural(exponent: float) -> dict[str, float]:
        return {"gain": rng.uniform(0, 0.3), "exponent": exponent}

    links = [{"between": (f"x{i}", f"x{i + 1}"), "conductance": rng.uniform(0.1, 2), "natural": natural(0.25)}
             for i in range(n - 1)]
    links += [{"between": (f"x{i}", "room"), "conductance": rng.uniform(0.01, 1), "natural": natural(0.3),
               "radiation": rng.uniform(0, 2e-9)} for i in range(n)]
    module = {"hot": "x0", "cold": f"x{n - 1}", "seebeck": {"value": 0.05, "slope": 1e-4},
              "resistance": {"value": 3.0, "slope": 0.01}, "conductance": {"value": 0.3, "slope": 0.0},
              "reference_temperature": 300.0}
    return rt.System(ambients={"room": {"temperature": 295.0}}, links=links, modules={"m": module},
                     lumps={f"x{i}": {"capacity": 10.0} for i in range(n)})


def test_boxes_of_networks_with_bent_losses_are_proven() -> None:
    rng = np.random.default_rng(0)
    for _ in range(3):
        system, power = bent_network(rng), float(rng.uniform(1, 50))
        found = rt.certify.runaway_free(system, current={"m": (-0.5, 1.0)}, ambient={"room": (285.0, 300.0)},
                                        heat={"x0": (0.0, power)})
        assert found.invariance.holds, found.invariance.reason
        heated = {"x0": power}
        for current in (-0.5, 1.0):
            steady = rt.thermal.steady_state(system, {"m": current, "room": 300.0}, heat=heated)
            state = steady.equilibria[0].temperatures
            assert all(low <= state[name] <= high for name, (low, high) in found.temperature.items())


def test_an_input_that_heats_nothing_needs_no_limits() -> None:
    """The speed of a fan, recorded beside a heater: gain 0, no limits."""
    system = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 50.0}},
                       links=[{"between": ("bar", "room"), "conductance": 0.5}],
                       inputs={"fan": {"lump": "bar", "gain": 0.0}, "foil": {"lump": "bar", "limits": (0.0, 10.0)}})
    assert rt.certify.heater_heat(system) == {"bar": (0.0, 10.0)}
    found = rt.certify.runaway_free(system, current={}, ambient={"room": (290.0, 300.0)})
    assert found.invariance.holds and found.temperature["bar"][1] >= 300.0 + 10.0 / 0.5  # steady state by hand
    with pytest.raises(rt.InputError, match="heater 'fan' has no limits"):
        rt.certify.heater_heat(system, {"inputs.fan.gain": (0.0, 1.0)})


def test_heat_that_is_stated_counts_for_its_lump_alone() -> None:
    """A project that stated the heat of one lump had all other heaters off, without a word."""
    system = rt.System(ambients={"room": {"temperature": 295.0}},
                       lumps={"bar": {"capacity": 50.0}, "plate": {"capacity": 50.0}},
                       links=[{"between": ("bar", "room"), "conductance": 0.5},
                              {"between": ("bar", "plate"), "conductance": 0.5}],
                       inputs={"foil": {"lump": "bar", "limits": (0.0, 10.0)},
                               "lamp": {"lump": "plate", "gain": 2.0, "limits": (0.0, 3.0)},
                               "spare": {"lump": "bar"}})
    stated = rt.certify.heater_heat(system, stated={"bar": (0.0, 4.0)})
    assert stated == {"bar": (0.0, 4.0), "plate": (0.0, 6.0)}  # spare, without limits, heats the bar alone
    with pytest.raises(rt.InputError, match="heater 'spare' has no limits"):
        rt.certify.heater_heat(system, stated={"plate": (0.0, 4.0)})
    with pytest.raises(rt.InputError, match="barr"):
        rt.certify.heater_heat(system, stated={"barr": (0.0, 4.0)})
