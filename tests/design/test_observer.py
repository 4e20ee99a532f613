"""Observers: exact model, Riccati residual, the limits of the errata, positivity, observability, placement."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import robthermal as rt

BOX = (278.15, 358.15)


def both(size):
    return {"m1": (-size, size), "m2": (-size, size)}


def test_the_model_is_the_exact_sampling(system):
    model = rt.design.observer(system, ["T6"], sample_time=1.0).model
    eq = rt.thermal.Equations(system)
    A, E = eq.A.toarray() / eq.capacity[:, None], eq.capacity
    for column in (0, 8, 12):
        heat = np.zeros(18)
        heat[column] = 1.0
        x0 = np.eye(18)[(column + 3) % 18]
        free = solve_ivp(lambda t, x: A @ x, (0, 1), x0, rtol=1e-10, atol=1e-13, method="LSODA").y[:, -1]
        forced = solve_ivp(lambda t, x, q=heat: A @ x + q / E, (0, 1), 0 * x0, rtol=1e-10, atol=1e-13,
                           method="LSODA").y[:, -1]
        np.testing.assert_allclose(model.A_d @ x0, free, atol=1e-8)
        np.testing.assert_allclose(model.Gamma @ heat, forced, atol=1e-8)
    np.testing.assert_allclose(model.Gamma, np.linalg.solve(A, model.A_d - np.eye(18)) / E, atol=1e-9)
    x, u = np.linspace(285, 320, 18), np.array([1.0, -0.5, 297.0])
    np.testing.assert_allclose(eq.A @ x + model.rest(x, u), eq.heat(x, u), atol=1e-10)


def test_the_gain_is_the_limit_of_the_kalman_recursion(system):
    obs = rt.design.observer(system, ["T6", "T16"], process_noise=0.02)
    A, C = obs.model.A_d, obs.model.C
    P, Q, R = np.eye(18), 0.02**2 * np.eye(18), 0.01**2 * np.eye(2)
    for _ in range(4000):
        L = A @ P @ C.T @ np.linalg.inv(C @ P @ C.T + R)
        P = A @ P @ A.T + Q - L @ C @ P @ A.T
    np.testing.assert_allclose(obs.gain, L, atol=1e-8)


def test_declared_disturbances_are_sampled_exactly(system):
    """Covariance over a sample, against the integral by quadrature."""
    from robthermal.design._covariances import process_covariance  # no public name: what the gain is made of

    noisy = system.model_copy(update={"lumps": {name: lump.model_copy(update={"disturbance": 0.1 * (1 + i % 3)})
                                                for i, (name, lump) in enumerate(system.lumps.items())}})
    model = rt.design.observer(noisy, ["T6"], sample_time=2.0).model
    density = np.array([lump.disturbance for lump in noisy.lumps.values()])
    short = rt.design.observer(noisy, ["T6"], sample_time=0.002).model
    Q, M = np.zeros((18, 18)), np.linalg.matrix_power(short.A_d, 1)
    state = np.eye(18)
    half = rt.design.observer(noisy, ["T6"], sample_time=0.001).model.A_d
    for _ in range(1000):
        middle = half @ state / model.equations.capacity * density
        Q += 0.002 * middle @ middle.T
        state = M @ state
    np.testing.assert_allclose(process_covariance(model, None), Q, atol=1e-5 * np.abs(Q).max())


def test_the_limits_of_the_errata(system, constant):
    """Sensors {6,7}: unstable at 5.25 A in heating with constant S, R; 3.0 to 3.8 A once S′, R′ count."""
    quiet = {"process_noise": 1e-4}
    assert rt.design.observer(constant, ["T6", "T7"], **quiet).frozen_limit(BOX, "heating") == pytest.approx(5.25, 0.01)
    for noise in (1e-2, 1e-3, 10**-3.5):
        limit = rt.design.observer(system, ["T6", "T7"], process_noise=noise).frozen_limit(BOX, "heating")
        assert 3.0 < limit < 3.8
    more = rt.design.observer(system, ["T6", "T7", "T13", "T16"], process_noise=1e-2)
    assert 4.2 < more.frozen_limit(BOX, "heating") < 4.4


def test_the_frozen_limit_is_where_the_error_starts_to_grow(system):
    """Against the derivative of the observer's own update, at the corners of the box."""
    obs = rt.design.observer(system, ["T6", "T7"], process_noise=1e-4)
    limit = obs.frozen_limit(BOX, "heating")
    for share, grows in ((0.95, False), (1.05, True)):
        worst = max(np.abs(np.linalg.eigvals(M)).max() for M in _frozen(obs, share * limit))
        assert bool(worst > 1) is grows
    with pytest.raises(rt.InputError, match="direction"):
        obs.frozen_limit(BOX, "sideways")


def _frozen(obs, current):
    """Error matrices by complex steps through the observer's own update, at corners of the box."""
    for hot in BOX:
        for cold in BOX:
            x = np.full(18, 300.0)
            x[[8, 9]], x[[10, 11]] = hot, cold
            u = obs.model.exogenous({"m1": -current, "m2": -current})
            columns = [(obs.model.predict(x + 1e-30j * e, u) - obs.gain @ (obs.model.C @ (1e-30j * e))).imag / 1e-30
                       for e in np.eye(18)]
            yield np.column_stack(columns)


@pytest.mark.exhaustive
def test_a_certificate_ends_at_the_frozen_limit(system):
    obs = rt.design.observer(system, ["T6", "T7"])
    limit = obs.frozen_limit(BOX)
    assert obs.certify(both(0.6 * limit), BOX).holds
    refused = obs.certify(both(1.02 * limit), BOX)
    assert not refused.holds and refused.reason


@pytest.mark.exhaustive
@pytest.mark.parametrize("method", ["kalman", "positive", "ekf"])
def test_estimates_converge_on_the_nonlinear_plant(system, method):
    t = np.arange(900)
    U = np.column_stack([0.8 * np.sign(np.sin(t / 60)) + 0.4, np.where(t > 300, 1.2, 0.3)])
    names = {"input_names": ["m1", "m2"], "sample_time": 1.0}
    run = rt.thermal.trajectory(system, rt.Record(inputs=U, outputs=np.zeros((900, 0)), output_names=[], **names))
    data = rt.Record(inputs=U, outputs=run.readings, output_names=list(system.sensors), **names)
    obs = rt.design.observer(system, ["T6", "T7", "T15", "T16"], method=method, current=both(1.5),
                             temperature=(270, 350))
    start = run.lumps[0] + np.where(np.arange(18) % 2, 6.0, -4.0)
    found = obs.run(data, start)
    error = np.abs(found.lumps - run.lumps).max(axis=1)
    # what is left after a step of current: its heat is held over the sample at the old temperature
    assert error[0] == pytest.approx(6.0) and error[-100:].max() < 0.15
    assert found["x11"].shape == (900,) and np.abs(found.innovation[-50:]).max() < 0.1
    assert found.plot() is not None


def test_positive_gain_keeps_the_order_of_two_estimates(system):
    box = both(1.5)
    obs = rt.design.observer(system, ["T6", "T7", "T16"], method="positive", current=box, temperature=BOX)
    assert obs.outcome and obs.gain.min() >= 0 and obs.gain.max() > 0
    assert (obs.model.A_d - obs.gain @ obs.model.C).min() >= -1e-9
    assert obs.spectral_radius(box, BOX) < 1
    u = {"m1": 0.0, "m2": 0.0}
    low, high = np.full(18, 300.0), np.full(18, 300.0) + np.linspace(0.0, 5.0, 18)
    readings = np.full(3, 302.0)
    for _ in range(50):
        low, high = obs.step(low, readings, u), obs.step(high, readings, u)
        assert (high >= low - 1e-9).all()


def test_a_positive_gain_that_cannot_contract_says_so(system):
    obs = rt.design.observer(system, ["T6", "T7"], method="positive", current=both(8.0), temperature=BOX)
    assert not obs.outcome and "lower the current" in obs.outcome.text
    hurried = rt.design.observer(system, ["T6", "T7"], method="positive", current=both(1.0), temperature=BOX,
                                 time_constant=1.0)
    assert not hurried.outcome and "the fastest is" in hurried.outcome.text
    with pytest.raises(rt.InputError, match="no box is given"):
        rt.design.observer(system, ["T6", "T7"], method="positive")


def test_the_extended_filter_is_the_kalman_filter_when_nothing_is_nonlinear(system):
    obs, ekf = (rt.design.observer(system, ["T6", "T16"], method=m) for m in ("kalman", "ekf"))
    x = np.linspace(295.0, 301.0, 18)
    off = {"m1": 0.0, "m2": 0.0}
    a, b = obs.start(x), ekf.start(x)
    for k in range(20):
        y = np.array([298.0 + 0.1 * k, 297.0])
        a, b = obs.step(a, y, off), ekf.step(b, y, off)
    np.testing.assert_allclose(ekf.estimate(b), a, atol=1e-8)
    np.testing.assert_allclose(ekf.covariance(b), ekf.first, rtol=1e-6, atol=1e-12)


def chain(*conductances, room=(0.5, 0.5, 0.5)):
    return rt.System(ambients={"room": {"temperature": 300.0}},
                     lumps={name: {"capacity": 10.0} for name in ("left", "middle", "right")},
                     links=[{"between": ("left", "middle"), "conductance": conductances[0]},
                            {"between": ("middle", "right"), "conductance": conductances[1]}]
                     + [{"between": (name, "room"), "conductance": g}
                        for name, g in zip(("left", "middle", "right"), room, strict=True)],
                     sensors={"T": {"lump": "middle", "noise": 0.01}, "T_left": {"lump": "left", "noise": 0.01}})


def test_unobservable_lumps_are_named():
    """By symmetry the middle cannot tell left from right; any asymmetry, or a sensor at the side, can."""
    assert rt.design.unobservable(chain(1.0, 1.0), ["T"]) == ("left", "right")
    assert rt.design.unobservable(chain(1.0, 1.1), ["T"]) == ()
    assert rt.design.unobservable(chain(1.0, 1.0), ["T_left"]) == ()
    with pytest.raises(rt.InputError, match="T do not see lumps left, right.*Add a sensor"):
        rt.design.observer(chain(1.0, 1.0), ["T"])
    apart = chain(0.0, 1.0)
    assert rt.design.unobservable(apart, ["T"]) == ("left",)


@pytest.mark.parametrize(("arguments", "message"), [
    ({"sensors": ["T2"]}, "no sensor 'T2'.*T1"),
    ({"sensors": "T6"}, "list of sensor names"),
    ({"sensors": []}, "list of sensor names"),
    ({"sensors": ["T6", "T6"]}, "two of the sensors"),
    ({"sensors": ["T6"], "method": "luenberger"}, "kalman"),
    ({"sensors": ["T6"], "process_noise": -1.0}, "process_noise"),
    ({"sensors": ["T6"], "sample_time": 0.0}, "sample_time"),
    ({"sensors": ["T6"], "sensor_noise": {"T7": 1.0}}, "'T6' is missing"),
])
def test_bad_arguments_are_refused(system, arguments, message):
    with pytest.raises(rt.InputError, match=message):
        rt.design.observer(system, **arguments)


def test_slow_and_noiseless_sensors_are_refused(system):
    slow = system.model_copy(update={"sensors": {"T6": system.sensors["T6"].model_copy(update={"time_constant": 5.0})}})
    with pytest.raises(rt.InputError, match="lags 5 s.*as a lump"):
        rt.design.observer(slow, ["T6"])
    silent = system.model_copy(update={"sensors": {"T6": system.sensors["T6"].model_copy(update={"noise": 0.0})}})
    with pytest.raises(rt.InputError, match="'T6' declares no noise"):
        rt.design.observer(silent, ["T6"])


def test_records_that_do_not_fit_are_refused(system):
    obs = rt.design.observer(system, ["T6"])
    record = rt.Record(sample_time=2.0, inputs=np.zeros((5, 2)), outputs=np.full((5, 1), 300.0),
                       input_names=["m1", "m2"], output_names=["T6"])
    with pytest.raises(rt.InputError, match="sampled every 2 s"):
        obs.run(record)
    with pytest.raises(rt.InputError, match="no column 'T6'"):
        obs.run(record.select(outputs=[]))


@pytest.mark.exhaustive
def test_placement_is_the_smallest_certified_set(system):
    """Up to 3.8 A: no single candidate is stable, a pair is certified."""
    box = {"current": both(3.8), "temperature": BOX, "candidates": ["T6", "T15", "T16"]}
    found = rt.design.place_sensors(system, largest=3, **box)
    assert found.outcome and found.certificate.holds and rt.verify(found.certificate).valid
    for size in range(1, len(found.sensors)):
        assert found.best[size][1] >= 1  # necessary condition fails for every smaller set
    radii = [radius for _, radius in found.best.values()]
    assert radii == sorted(radii, reverse=True) and len(found.to_frame()) == 3
    assert found.plot() is not None and found.sensors[0] in str(found)
    none = rt.design.place_sensors(system, largest=1, current=both(8.0), temperature=BOX, candidates=["T6"])
    assert not none.outcome and none.sensors == () and none.certificate is None
    with pytest.raises(rt.InputError, match="largest = 9"):
        rt.design.place_sensors(system, **{**box, "largest": 9})
