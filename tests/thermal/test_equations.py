"""Equations against hand-written heat balances, and every Jacobian against complex steps or differences."""

import numpy as np
import pytest

import robthermal as rt


@pytest.fixture
def point(full):
    rng = np.random.default_rng(3)
    eq = rt.thermal.Equations(full)
    return eq, rng.uniform(280, 350, 4), np.array([2.0, 1.3, 297.0, 292.0])


def test_heat_is_the_balance_written_by_hand(point):
    eq, x, (heater, current, room, sink) = point
    plate, hot, cold, sample = x
    dT = 0.5 * (hot + cold) - 303.15
    S, R, K = 0.05 + 7e-5 * dT, 3.0 + 0.015 * dT, 0.4 + 0.001 * dT
    up, over = room - sample, plate - sample
    to_room = 0.05 * up + 0.03 * abs(up) ** 0.25 * up + 2e-10 * (room**4 - sample**4)
    shine = 0.02 * over + 0.01 * abs(over) ** 0.3 * over + 1e-10 * (plate**4 - sample**4)
    expected = [
        1.2 * (sink - plate) + 9 * (hot - plate) - shine,
        9 * (plate - hot) + S * hot * current + 0.5 * R * current**2 + K * (cold - hot),
        5 * (sample - cold) - S * cold * current + 0.5 * R * current**2 + K * (hot - cold),
        5 * (cold - sample) + to_room + shine + 0.8 * heater]
    assert eq.heat(x, [heater, current, room, sink]) == pytest.approx(expected, rel=1e-13)


def test_many_points_at_once_equal_one_by_one(point):
    eq, x, u = point
    X, U = x + np.arange(5)[:, None], u + 0.01 * np.arange(5)[:, None]
    assert eq.heat(X, U) == pytest.approx(np.array([eq.heat(a, b) for a, b in zip(X, U, strict=True)]), rel=1e-14)


def complex_step(f, z):
    columns = []
    for i in range(len(z)):
        moved = z.astype(complex)
        moved[i] += 1e-40j
        columns.append(f(moved).imag / 1e-40)
    return np.array(columns).T


def test_jacobians_equal_complex_steps(point):
    eq, x, u = point
    assert eq.jacobian(x, u).toarray() == pytest.approx(complex_step(lambda z: eq.heat(z, u), x), rel=1e-12, abs=1e-12)
    expected = complex_step(lambda z: eq.heat(x, z), u)
    assert eq.input_jacobian(x, u).toarray() == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_natural_convection_has_no_slope_at_equal_temperatures(full):
    eq = rt.thermal.Equations(full)
    x = np.full(4, 297.15)
    u = np.array([0.0, 0.0, 297.15, 297.15])
    assert np.isfinite(eq.jacobian(x, u).toarray()).all()
    for name in full.parameter_names:
        assert all(np.isfinite(heat).all() for _, heat in eq.parameter_heat(name, x, u)), name


def test_every_parameter_derivative_equals_differences_of_order_four(full, point):
    eq, x, u = point
    tested = 0
    for name in full.parameter_names:
        still = (".initial", ".disturbance", ".delay", ".time_constant")  # do not act on the heats
        if name.startswith(("sensors.", "ambients.")) or name.endswith(still):
            continue
        value = full.parameter(name)
        step = 1e-3 * abs(value) if value else 1e-3

        def rate(k, name=name, value=value, step=step):
            return rt.thermal.Equations(full.with_parameters({name: value + k * step})).rate(x, u)

        difference = (-rate(2) + 8 * rate(1) - 8 * rate(-1) + rate(-2)) / (12 * step)
        exact = np.zeros(4)
        for i, heat in eq.parameter_heat(name, x, u):
            exact[i] += heat / eq.capacity[i]
        assert exact == pytest.approx(difference, rel=1e-9, abs=1e-9 * np.abs(difference).max() + 1e-10), name
        tested += 1
    assert tested >= 20


def test_a_current_reversed_pumps_the_other_way(full):
    eq = rt.thermal.Equations(full)
    x, u = np.full(4, 297.15), np.array([0.0, 0.1, 297.15, 297.15])
    cooling = eq.heat(x, u)
    assert cooling[2] < 0 < cooling[1]  # positive current takes heat from cold and gives it to hot
    u[1] = -0.1
    assert eq.heat(x, u)[1] < 0 < eq.heat(x, u)[2]


def test_conduction_is_symmetric_and_conserves_heat():
    eq = rt.thermal.Equations(rt.systems.two_module())
    A = eq.A.toarray()
    assert np.array_equal(A, A.T)
    assert (A + np.diag(-A.sum(1))).sum() == pytest.approx(0, abs=1e-12)
    assert A.sum(1) == pytest.approx(-eq.B.toarray()[:, -1], abs=1e-12)


def test_poles_of_the_embedded_setup_match_the_published_time_constants():
    # errata notes: coupled network 225 s slowest, 0.24 s fastest
    poles = rt.systems.two_module().poles()
    assert -1 / poles[0] == pytest.approx(225, rel=0.01)
    assert -1 / poles[-1] == pytest.approx(0.24, rel=0.02)
