"""Linearization against simulation, reduction against brute force."""

import control
import numpy as np
import pytest

import robthermal as rt


def test_small_deviations_follow_the_linear_model(full):
    inputs = {"heater": 2.0, "tem": 0.8, "room": 296.0, "sink": 290.0}
    full = full.with_parameters({"sensors.T_sample.delay": 0.0})
    (rest,) = rt.thermal.steady_state(full, inputs).equilibria
    G = rt.thermal.linearize(full, rest.temperatures, inputs, sample_time=1.0)
    assert G.input_labels == ["heater", "tem", "room", "sink"] and G.output_labels == ["T_plate", "T_sample"]
    assert G.state_labels[-1] == "T_sample_lag" and G.dt == 1.0
    rng = np.random.default_rng(0)
    du = 1e-3 * rng.standard_normal((80, 4))
    record = rt.Record(sample_time=1.0, inputs=np.array(list(inputs.values())) + du, outputs=np.zeros((80, 0)),
                       input_names=list(inputs), output_names=[])
    quiet = rt.Record(sample_time=1.0, inputs=np.tile(list(inputs.values()), (80, 1)), outputs=np.zeros((80, 0)),
                      input_names=list(inputs), output_names=[])
    moved, still = (rt.thermal.simulate(full, r, initial=rest.temperatures).outputs for r in (record, quiet))
    linear = control.forced_response(G, inputs=du.T).outputs.T
    assert np.abs(moved - still - linear).max() < 2e-3 * np.abs(linear).max()


def test_the_matrices_are_derivatives_of_the_rates(full):
    """Central differences of ẋ = E⁻¹ f(x, u); the lag of the thermometer is a state of its own."""
    inputs = {"heater": 2.0, "tem": 0.8, "room": 296.0, "sink": 290.0}
    (rest,) = rt.thermal.steady_state(full, inputs).equilibria
    A, B, states = rt.thermal.state_matrices(full, rest.temperatures, inputs)
    eq, x, u = rt.thermal.Equations(full), np.array(list(rest.temperatures.values())), np.array(list(inputs.values()))
    n, step = len(x), 1e-3
    assert states[:n] == full.lump_names and states[-1] == "T_sample_lag"
    by_x = np.array([eq.rate(x + step * e, u) - eq.rate(x - step * e, u) for e in np.eye(n)]).T / (2 * step)
    by_u = np.array([eq.rate(x, u + step * e) - eq.rate(x, u - step * e) for e in np.eye(len(u))]).T / (2 * step)
    assert np.abs(A[:n, :n] - by_x).max() < 1e-7 * np.abs(by_x).max()
    assert np.abs(B[:n] - by_u).max() < 1e-7 * np.abs(by_u).max()
    sensor = full.sensors["T_sample"]
    assert A[-1, -1] == -1 / sensor.time_constant and A[-1, states.index(sensor.lump)] == 1 / sensor.time_constant


def test_published_time_constants():
    # notes: coupled network with K = 0.2968 W/K, slowest 225 s, fastest 0.24 s
    table = rt.thermal.time_constants(rt.systems.two_module())
    assert table["time constant [s]"].iloc[0] == pytest.approx(225, rel=0.01)
    assert table["time constant [s]"].iloc[-1] == pytest.approx(0.24, rel=0.02)
    assert table["share"].between(0, 1).all()


def grid_error(G, H):
    w = np.concatenate([[0.0], np.logspace(-6, 3, 400)])
    return np.linalg.norm(G(1j * w) - H(1j * w), 2, axis=(0, 1)).max()


@pytest.mark.parametrize("method", ["balanced", "modal"])
@pytest.mark.parametrize("order", [0, 3, 8])
def test_reported_error_is_the_largest_on_a_grid(method, order):
    G = rt.thermal.linearize(rt.systems.two_module())
    r = rt.thermal.reduce(G, order=order, method=method)
    brute = grid_error(G, r.model)
    assert brute <= r.error * (1 + 1e-3) and r.error <= brute * (1 + 1e-2)
    assert r.error <= r.bound * (1 + 1e-6)
    assert r.model.nstates == order and r.model.output_labels == G.output_labels


def test_smallest_order_is_found_or_denied():
    G = rt.thermal.linearize(rt.systems.two_module())
    r = rt.thermal.reduce(G, tolerance=1.0)
    assert r.error <= 1.0 and rt.thermal.reduce(G, order=r.order - 1).error > 1.0
    denied = rt.thermal.reduce(G, tolerance=1e-12)
    assert not denied.outcome and denied.model is G and "No order below 18" in denied.outcome.text


def test_hinf_error_of_a_resonance():
    # published: SLICOT AB13DD lightly damped, 5.000000001e5 at sqrt(2)
    G = control.ss(control.tf([1.0], [1.0, 1e-6 * 2, 2.0]))
    exact = 1 / (2e-6 * np.sqrt(2 - 1e-12))
    assert rt.thermal.hinf_error(G, control.ss([], [], [], 0)) == pytest.approx(exact, rel=2e-4)


@pytest.mark.parametrize(("arguments", "message"), [
    ({}, "order or tolerance"), ({"order": 18}, "argument order"), ({"tolerance": -1.0}, "argument tolerance"),
    ({"order": 2, "method": "hankel"}, "argument method")])
def test_bad_arguments_are_refused(arguments, message):
    with pytest.raises(rt.InputError, match=message):
        rt.thermal.reduce(rt.thermal.linearize(rt.systems.two_module()), **arguments)


def test_bad_models_and_points_are_refused():
    with pytest.raises(rt.InputError, match="not stable"):
        rt.thermal.reduce(control.ss(1.0, 1.0, 1.0, 0.0), order=0)
    with pytest.raises(rt.InputError, match="continuous-time"):
        rt.thermal.reduce(control.ss(0.5, 1.0, 1.0, 0.0, 1.0), order=0)
    with pytest.raises(rt.InputError, match="in kelvin"):
        rt.thermal.linearize(rt.systems.two_module(), np.full(18, 25.0))
    with pytest.raises(rt.InputError, match="sample_time"):
        rt.thermal.linearize(rt.systems.two_module(), sample_time=-1.0)
