"""The thesis's bounds against the errata's table, and limit maps against single computations."""

import numpy as np
import pytest

import robthermal as rt


# errata and research note D(ii): (T_h, T_c) to the correct interval, and the printed one
@pytest.mark.parametrize(("hot", "cold", "lower", "upper"), [
    (298, 278, -3.80, 3.29), (298, 298, -3.39, 3.39), (298, 318, -3.06, 3.52), (298, 358, -2.58, 3.88)])
def test_bounds_of_the_thesis_corrected(two, hot, cold, lower, upper):
    bounds = rt.certify.thesis_bounds(two, hot, cold)
    for name in ("m1", "m2"):
        assert bounds.lower[name] == pytest.approx(lower, abs=0.006)
        assert bounds.upper[name] == pytest.approx(upper, abs=0.006)
        assert bounds.printed[name][0] == pytest.approx(-upper, abs=0.006)
        assert bounds.decay[name] == pytest.approx((0.3126, 0.02646), rel=1e-3)


def test_bounds_are_the_roots_of_the_derivative(two):
    """V̇₂ of (5.30) with f of the module itself, at the two currents."""
    hot, cold = np.meshgrid([290.0, 330.0], [270.0, 300.0, 340.0])
    bounds = rt.certify.thesis_bounds(two, hot, cold)
    module = two.modules["m1"]
    for current in (bounds.lower["m1"], bounds.upper["m1"]):
        offset = (hot + cold) / 2 - module.reference_temperature
        S, R, K = (p.value + p.slope * offset for p in (module.seebeck, module.resistance, module.conductance))
        into_hot = S * hot * current + R * current**2 / 2 + K * (cold - hot)
        into_cold = -S * cold * current + R * current**2 / 2 + K * (hot - cold)
        least = bounds.decay["m1"]
        value = -least[0] * hot**2 - least[1] * cold**2 + 2 * hot * into_hot + 2 * cold * into_cold
        assert np.abs(value).max() < 1e-6
    assert bounds.table().shape == (12, 7)


def test_bounds_refuse_what_they_do_not_cover(two):
    with pytest.raises(rt.InputError, match="argument hot"):
        rt.certify.thesis_bounds(two, 25.0, 298.0)
    link = rt.thermal.Link(between=("x9", "x11"), conductance=0.1)
    with pytest.raises(rt.InputError, match="links connect"):
        rt.certify.thesis_bounds(two.model_copy(update={"links": (*two.links, link)}), 298.0, 298.0)


def test_map_agrees_with_single_computations(two):
    found = rt.certify.limit_map(two, ambient=[298.15], setpoint=[278.15, 283.15], load=[0.0, 5.0],
                                 temperature=(273.15, 358.15), jobs=1)
    data = found.data.set_index(["setpoint [K]", "load [W]"])
    contraction = rt.certify.largest_current(two, temperature=(273.15, 358.15), direction="cooling")
    assert (data["contraction [A]"] == contraction.current).all()
    single = rt.certify.usable_current(two, temperature=(273.15, 358.15), lower="reported",
                                       setpoint=dict.fromkeys(two.modules, 278.15))
    assert data.loc[(278.15, 0.0), "usable [A]"] == pytest.approx(single.current, rel=1e-6)
    assert all(box.invariance.holds and box.contraction.holds for box in found.boxes.values())
    assert (data["usable [A]"] < data["runaway [A]"]).all()
    # errata: I* = 1.51 A at 5 °C; 5 W per module cannot be held at 10 °C
    assert data.loc[(278.15, 0.0), "runaway [A]"] == pytest.approx(1.51, rel=0.01)
    assert np.isnan(data.loc[(283.15, 5.0), "needed [A]"]) and not data.loc[(283.15, 5.0), "allowed"]
    state = rt.thermal.steady_state(two, {"room": 298.15}, setpoint=dict.fromkeys(two.modules, 278.15))
    needed = max(state.equilibria[0].currents.values())
    assert data.loc[(278.15, 0.0), "needed [A]"] == pytest.approx(needed) and data.loc[(278.15, 0.0), "allowed"]
    assert found.outcome.code == "mapped"


@pytest.mark.parametrize(("arguments", "message"), [
    ({"ambient": [25.0]}, "argument ambient"), ({"load": []}, "argument load"), ({"setpoint": [np.nan]}, "setpoint"),
    ({"jobs": 0}, "argument jobs")])
def test_bad_maps_are_refused(two, arguments, message):
    good = {"ambient": [298.15], "setpoint": [283.15], "load": [0.0], "temperature": (273.15, 358.15)}
    with pytest.raises(rt.InputError, match=message):
        rt.certify.limit_map(two, **{**good, **arguments})


def test_plots_show_every_curve(two):
    bounds = rt.certify.thesis_bounds(two, 298.0, np.linspace(278, 358, 9))
    axes = bounds.plot({"I*": 1.51, "certified": 2.72})
    assert len(axes.lines) == 5
