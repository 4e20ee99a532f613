"""Observer certificates against frozen spectral radii, the errata's unstable observer and simulated errors."""

from itertools import product

import numpy as np
import pytest
from module_systems import constant
from scipy.integrate import quad_vec
from scipy.linalg import expm, solve_discrete_are

import robthermal as rt

BOX = (278.15, 358.15)


def sampled(system, Ts):
    """A_d, Γ and E⁻¹A, Γ by quadrature of exp(E⁻¹A s)E⁻¹."""
    eq = rt.thermal.Equations(system)
    F = eq.A.toarray() / eq.capacity[:, None]
    hold, _ = quad_vec(lambda s: expm(F * s), 0, Ts, epsabs=1e-10)
    return expm(F * Ts), hold / eq.capacity, eq


def reads(system, sensors):
    C = np.zeros((len(sensors), len(system.lumps)))
    for row, name in enumerate(sensors):
        lump = system.sensors[name].lump if name in system.sensors else name
        C[row, system.lump_names.index(lump)] = 1.0
    return C


def kalman(system, sensors, Ts=1.0, q=1e-3, r=0.01):
    A_d, _, _ = sampled(system, Ts)
    C = reads(system, sensors)
    n, R = len(A_d), r**2 * np.eye(len(C))
    P = solve_discrete_are(A_d.T, C.T, q**2 * np.eye(n), R)
    return A_d @ P @ C.T @ np.linalg.inv(C @ P @ C.T + R)


def radius(system, L, sensors, span, Ts=1.0):
    """Largest spectral radius of A_d − LC + Γ ∂f/∂x frozen at the vertices of the box."""
    A_d, hold, eq = sampled(system, Ts)
    C, worst = reads(system, sensors), 0.0
    faces = [system.lump_names.index(face) for m in system.modules.values() for face in (m.hot, m.cold)]
    for T in product(BOX, repeat=len(faces)):
        for currents in product(sorted(set(span)), repeat=len(system.modules)):
            x, u = np.full(len(system.lumps), 300.0), eq.nominal()
            x[faces] = T
            u[:len(currents)] = currents
            J = (eq.jacobian(x, u) - eq.A).toarray()
            worst = max(worst, np.abs(np.linalg.eigvals(A_d - L @ C + hold @ J)).max())
    return worst


def certify(system, L, sensors, span, **more):
    return rt.certify.observer(system, gain=L, sensors=sensors, current=dict.fromkeys(system.modules, span),
                               temperature=BOX, **more)


def test_unstable_observer_of_the_errata_is_refused(two):
    """(5.44) "certifies" 61 A on sensors {6, 7}; the observer is unstable at 5.25 A when heating."""
    for system in (two, constant(two)):
        L = kalman(system, ["T6", "T7"])
        cert = certify(system, L, ["T6", "T7"], (-6.5, 0.0))
        assert radius(system, L, ["T6", "T7"], (-6.5, 0.0)) > 1
        assert cert.holds is False and not rt.verify(cert).valid
        assert "grows by" in cert.reason and "x12" in cert.reason  # says where to add sensors


@pytest.mark.exhaustive
@pytest.mark.parametrize("sensors", [["T6", "T7"], ["T6", "T7", "T13", "T16"]])
def test_ninety_five_per_cent_of_the_frozen_limit(two, sensors):
    L = kalman(two, sensors)
    low, high = 0.0, 10.0
    while high - low > 0.03:
        middle = (low + high) / 2
        low, high = (middle, high) if radius(two, L, sensors, (-middle, 0.0)) < 1 else (low, middle)
    cert = certify(two, L, sensors, (-0.95 * low, 0.0))
    assert cert.holds and rt.verify(cert).valid
    assert radius(two, L, sensors, (-0.95 * low, 0.0)) <= float(cert.evidence["contraction"]) < 1
    assert not certify(two, L, sensors, (-1.01 * high, 0.0)).holds


def test_errors_of_the_nonlinear_observer_shrink_as_claimed(two):
    """Two runs of the very recursion, plant model and observer, with currents and temperatures from the box."""
    sensors, span = ["T6", "T7"], (-2.0, 3.0)
    L = kalman(two, sensors)
    cert = certify(two, L, sensors, span)
    assert cert.holds
    A_d, hold, eq = sampled(two, 1.0)
    C, P, rng = reads(two, sensors), np.array(cert.evidence["matrix"]), np.random.default_rng(1)
    factor = float(cert.evidence["contraction"])
    for _ in range(300):
        x, z = rng.uniform(*BOX, (2, 18))
        u = eq.nominal()
        u[:2] = rng.uniform(*span, 2)
        heat = [eq.heat(v, u) - eq.A @ v - eq.B @ u for v in (x, z)]  # all that is not the passive network
        after = A_d @ (x - z) + hold @ (heat[0] - heat[1]) - L @ C @ (x - z)
        before = x - z
        assert after @ P @ after <= factor**2 * (before @ P @ before) * (1 + 1e-9)


def random_case(rng):
    n = int(rng.integers(2, 5))
    module = {"hot": "x0", "cold": "x1", "reference_temperature": 300.0,
              "seebeck": {"value": 0.05, "slope": rng.uniform(-3e-4, 3e-4)},
              "resistance": {"value": 3.0, "slope": rng.uniform(-0.03, 0.03)},
              "conductance": {"value": 0.3, "slope": rng.uniform(-2e-3, 2e-3)}}
    links = [{"between": (f"x{i}", f"x{int(rng.integers(i))}"), "conductance": rng.uniform(0.5, 3)}
             for i in range(2, n)]
    links += [{"between": (f"x{i}", "room"), "conductance": rng.uniform(0.05, 1)} for i in range(n)]
    return rt.System(ambients={"room": {"temperature": 298.0}}, modules={"m": module}, links=links,
                     lumps={f"x{i}": {"capacity": rng.uniform(2, 50)} for i in range(n)})


def test_never_certified_where_a_frozen_matrix_is_unstable():
    rng = np.random.default_rng(7)
    seen = set()
    for _ in range(35):
        system, Ts = random_case(rng), float(rng.choice([0.5, 1.0, 5.0]))
        L = rng.uniform(-0.3, 0.9, (len(system.lumps), 1))
        span = (0.0, float(rng.uniform(1, 15)))
        cert = certify(system, L, ["x0"], span, sample_time=Ts)
        unstable = radius(system, L, ["x0"], span, Ts) >= 1
        assert not (cert.holds and unstable), cert.claim
        assert rt.verify(cert).valid == cert.holds
        seen.add((cert.holds, bool(unstable)))
    assert {(True, False), (False, True)} <= seen


@pytest.mark.exhaustive
def test_eighteen_lumps_on_two_sensors(two):
    cert = certify(two, kalman(two, ["T6", "T7"]), ["T6", "T7"], (-1.0, 1.5))
    assert cert.holds and rt.verify(cert).valid


def lagging(system):
    return system.with_parameters({"sensors.T6.time_constant": 5.0})


@pytest.mark.parametrize(("arguments", "message"), [
    ({"gain": np.zeros((18, 3))}, "argument gain"), ({"gain": np.full((18, 2), np.nan)}, "not finite"),
    ({"sensors": ["T6", "T99"]}, "no sensor or lump 'T99'"), ({"sensors": "T6"}, "not a list of names"),
    ({"sample_time": 0.0}, "argument sample_time"), ({"sample_time": True}, "argument sample_time"),
    ({"current": {"m1": (0, 1)}}, "'m2' has no range"), ({"temperature": (5.0, 85.0)}, "degrees Celsius")])
def test_bad_observers_are_refused(two, arguments, message):
    good = {"gain": np.zeros((18, 2)), "sensors": ["T6", "T7"], "current": {"m1": (0, 1), "m2": (0, 1)},
            "temperature": BOX}
    with pytest.raises(rt.InputError, match=message):
        rt.certify.observer(two, **{**good, **arguments})


def test_lagging_sensors_are_refused(two):
    with pytest.raises(rt.InputError, match="lags"):
        certify(lagging(two), np.zeros((18, 1)), ["T6"], (0.0, 1.0))
