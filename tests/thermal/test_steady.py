"""Steady states, load curves and folds against closed forms and simulation."""

import numpy as np
import pytest

import robthermal as rt
from robthermal.certify._runaway import smallest_root

S, R, K = 0.053202, 4.4469, 0.2968  # surrogate module, S and R at 300.15 K: the published folds are for these


def single(g=0.689, g_cold=0.05, w=298.0):
    """One module with constant properties on a heat sink g."""
    return rt.System(ambients={"w": {"temperature": w}}, lumps={"h": {"capacity": 10.0}, "c": {"capacity": 5.0}},
                     links=[{"between": ("h", "w"), "conductance": g}, {"between": ("c", "w"), "conductance": g_cold}],
                     modules={"m": {"hot": "h", "cold": "c", "seebeck": S, "resistance": R, "conductance": K}})


@pytest.mark.parametrize(("g", "published"), [(0.25, (0.73, -0.31)), (0.5, (1.25, 2.02)), (0.689, (1.54, 3.76)),
                                               (1.0, (1.89, 6.14)), (2.0, (2.46, 10.6)), (5.0, (2.94, 14.9))])
def test_fold_of_one_module_is_the_root_of_the_cubic(g, published):
    curve = rt.thermal.fold(single(g), {"m": 278.0})
    exact = smallest_root({"seebeck": S, "resistance": R, "conductance": K, "sink_conductance": g,
                           "sink_temperature": 298.0, "setpoint": 278.0})
    assert curve.current[-1, 0] == pytest.approx(exact, rel=1e-5)
    assert curve.current[-1, 0] <= exact
    assert (curve.current[-1, 0], curve.load[-1, 0]) == pytest.approx(published, rel=0.02, abs=0.02)


def test_only_a_part_that_is_drawn_has_a_name():
    """Up to its fold a load curve is stable: the legend names nothing else."""
    drawn = rt.thermal.fold(single(), {"m": 278.0}).plot()
    assert [text.get_text() for text in drawn.get_legend().get_texts()] == ["m, stable"]
    beyond = rt.thermal.load_curve(single(), {"m": 278.0}, np.linspace(0.0, 6.0, 40)[:, None]).plot()
    assert [text.get_text() for text in beyond.get_legend().get_texts()] == ["m, stable", "m, runs away"]


def test_load_is_stationary_at_the_fold():
    curve = rt.thermal.load_curve(single(), {"m": 278.0}, np.linspace(1.2, 1.8, 601))
    top = curve.load[:, 0].argmax()
    assert curve.current[top, 0] == pytest.approx(rt.thermal.fold(single(), {"m": 278.0}).current[-1, 0], abs=1e-3)
    assert (curve.slowest[:top] < 0).all() and (curve.slowest[top + 2:] > 0).all()


def test_load_beyond_the_fold_has_no_equilibrium_and_below_it_has_two():
    # load on the cold lump: what the fold takes, less what leaks in from the ambient
    limit = rt.thermal.fold(single(), {"m": 278.0}).load[-1, 0] - 0.05 * (298 - 278)
    below = rt.thermal.steady_state(single(), setpoint={"m": 278.0}, heat={"c": limit - 0.01})
    assert [e.stable for e in below.equilibria] == [True, False]
    above = rt.thermal.steady_state(single(), setpoint={"m": 278.0}, heat={"c": limit + 0.01})
    assert not above.equilibria and not above.outcome and "above q*" in above.outcome.text


def test_an_equilibrium_where_more_current_heats_is_not_stable():
    found = rt.thermal.steady_state(rt.systems.two_module(), setpoint={"m1": 278.15}).equilibria
    assert [e.stable for e in found] == [True, False]
    assert found[0].currents["m1"] < 1 and found[1].currents["m1"] > 3


def test_modules_on_separate_sinks_have_their_own_limits():
    a, b = single(0.689), single(2.0)
    both = rt.System(ambients=a.ambients, lumps={"h1": {"capacity": 10.0}, "c1": {"capacity": 5.0},
                                                 "h2": {"capacity": 10.0}, "c2": {"capacity": 5.0}},
                     links=[{"between": ("h1", "w"), "conductance": 0.689},
                            {"between": ("h2", "w"), "conductance": 2.0},
                            {"between": ("c1", "c2"), "conductance": 0.3}],
                     modules={"m1": {"hot": "h1", "cold": "c1", "seebeck": S, "resistance": R, "conductance": K},
                              "m2": {"hot": "h2", "cold": "c2", "seebeck": S, "resistance": R, "conductance": K}})
    end = rt.thermal.fold(both, {"m1": 278.0, "m2": 278.0}).current[-1]
    expected = [rt.thermal.fold(s, {"m": 278.0}).current[-1, 0] for s in (a, b)]
    assert end == pytest.approx(expected, rel=1e-6)


def test_set_point_case_of_the_errata():
    cold = {"m1": 283.15, "m2": 283.15}
    load = {"x11": 5.0, "x12": 5.0}
    assert not rt.thermal.steady_state(rt.systems.two_module(), setpoint=cold, heat=load).equilibria
    held = rt.thermal.steady_state(rt.systems.two_module(), {"m1": 1.55, "m2": 1.55}, heat=load)
    (only,) = held.equilibria
    assert only.stable
    assert only.temperatures["x11"] - 273.15 == pytest.approx(11.7, abs=0.3)
    away = rt.thermal.steady_state(rt.systems.two_module(), {"m1": 3.294, "m2": 3.294}, heat=load)
    assert away.equilibria[0].temperatures["x9"] - 273.15 > 135  # published: 142 °C when the simulation ended


def test_steady_state_is_where_the_simulation_ends(full):
    inputs = {"heater": 2.0, "tem": 0.8, "room": 296.0, "sink": 290.0}
    (only,) = rt.thermal.steady_state(full, inputs).equilibria
    n = 400
    record = rt.Record(sample_time=20.0, inputs=np.tile(list(inputs.values()), (n, 1)), outputs=np.zeros((n, 0)),
                       input_names=list(inputs), output_names=[])
    assert rt.thermal.trajectory(full, record).lumps[-1] == pytest.approx(list(only.temperatures.values()), abs=1e-6)


def test_currents_that_run_away_have_no_equilibrium():
    none = rt.thermal.steady_state(rt.systems.two_module(), {"m1": -3.3, "m2": -3.3})
    assert not none.outcome and "runaway" in none.outcome.text and 0.3 < none.reached < 1


@pytest.mark.parametrize(("arguments", "message"), [
    ({"inputs": {"m9": 1.0}}, "'m9' is not a heater"),
    ({"setpoint": {"m1": 5.0}}, "Add 273.15"),
    ({"inputs": {"m1": 1.0}, "setpoint": {"m1": 283.15}}, "a current and a set-point"),
    ({"heat": {"nowhere": 1.0}}, "argument heat"),
    ({"heat": {"x1": "2 W"}}, "a lump and a finite number"),
    ({"inputs": {"m1": "1 A"}}, "a finite number"),
])
def test_bad_arguments_are_refused(arguments, message):
    with pytest.raises(rt.InputError, match=message):
        rt.thermal.steady_state(rt.systems.two_module(), **arguments)
