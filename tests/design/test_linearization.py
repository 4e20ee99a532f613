"""The law (5.15)-(5.18): exact, free of cancellation, inside its limits."""

import warnings
from dataclasses import replace
from decimal import Decimal, getcontext

import numpy as np
import pytest

import robthermal as rt


def faces(hot, cold):
    return {"x9": hot, "x11": cold, "x10": hot, "x12": cold}


def by_hand(system, current, hot, cold):
    """Heat into the cold lump, written out from the errata."""
    m = system.modules["m1"]
    dT = (hot + cold) / 2 - m.reference_temperature
    S, R, K = (p.value + p.slope * dT for p in (m.seebeck, m.resistance, m.conductance))
    return -S * cold * current + R * current**2 / 2 + K * (hot - cold)


def test_it_inverts_the_heat_exactly(system, law):
    for hot in np.linspace(273.15, 358.15, 6):
        for cold in np.linspace(263.15, 348.15, 6):
            at = faces(hot, cold)
            least = law.bounds(at).heat[0]
            reach = law.reach(at)
            v = least + (reach.highest[0] - least) * np.linspace(0.05, 1.0, 40) ** 2
            v = v[(v >= reach.lowest[0]) & (v <= reach.highest[0])]
            current = law.current(np.column_stack([v, v]), at)
            close = {"rtol": 1e-12, "atol": 1e-12 * abs(least)}
            np.testing.assert_allclose(by_hand(system, current[:, 0], hot, cold), v, **close)
            np.testing.assert_allclose(law.heat(current, at)[:, 1], v, **close)


def test_the_module_of_the_equations_gets_that_heat(system, law):
    """Against the network's own equations: heat into x11 without its links is v."""
    eq = rt.thermal.Equations(system)
    rng = np.random.default_rng(1)
    x = rng.uniform(285.0, 320.0, 18)
    v = np.array([-3.0, 2.5])
    u = eq.nominal()
    u[:2] = law.current(v, x)
    links = eq.A.toarray() @ x + eq.B @ u
    K = 0.2968
    into = (eq.heat(x, u) - links)[[10, 11]] + K * (x[[8, 9]] - x[[10, 11]])
    np.testing.assert_allclose(into, v, rtol=1e-11)


@pytest.mark.parametrize("q", [1e-14, -1e-10, 1e-6, -1e-3])
def test_a_tiny_heat_suffers_no_cancellation(system, law, q):
    getcontext().prec = 60
    cold = 300.0
    m = system.modules["m1"]
    dT = Decimal(cold) - Decimal(m.reference_temperature)
    S = Decimal(m.seebeck.value) + Decimal(m.seebeck.slope) * dT
    R = Decimal(m.resistance.value) + Decimal(m.resistance.slope) * dT
    a = S * Decimal(cold) / R
    exact = float(a - (a * a + 2 * Decimal(q) / R).sqrt())
    assert law.current(q, faces(cold, cold))[0] == pytest.approx(exact, rel=1e-14)
    if abs(q) < 1e-9:  # the printed form (5.16) loses its digits: this test can fail
        A = float(a)
        naive = A - np.sqrt(A * A + 2 * q / float(R))
        assert abs(naive / exact - 1) > 1e-7


def test_published_gains(law):
    """|dI/dv| .069, .138, .69, 6.9 A/W at I/I_opt = 0, .5, .9, .99 for the surrogate at 298/278 K."""
    at = faces(298.15, 278.15)
    share = np.array([0.0, 0.5, 0.9, 0.99])
    optimum = law.bounds(at).current[0]
    gain = law.gain(np.outer(share * optimum, [1, 1]), at)[:, 0]
    np.testing.assert_allclose(gain, [0.069, 0.138, 0.69, 6.9], rtol=0.01)
    wide = rt.design.feedback_linearization(law.system.model_copy(update={"modules": {
        name: m.model_copy(update={"current_limits": None}) for name, m in law.system.modules.items()}}))
    v, h = wide.heat(0.9 * optimum, at), 1e-6
    slope = (wide.current(v + h, at) - wide.current(v - h, at)) / (2 * h)
    np.testing.assert_allclose(-slope, 0.69, rtol=0.01)
    assert np.isinf(law.gain(1.01 * optimum, at)).all()


def test_bounds_are_the_minimum_of_the_heat(system, law):
    hot, cold = 310.0, 280.0
    current = np.linspace(0, 8, 800001)
    heat = by_hand(system, current, hot, cold)
    found = law.bounds(faces(hot, cold))
    assert found.heat[0] == pytest.approx(heat.min(), rel=1e-10)
    assert found.current[0] == pytest.approx(current[heat.argmin()], abs=2e-5)


def test_beyond_the_bound_it_stays_at_the_optimum(system):
    free = system.model_copy(update={"modules": {name: m.model_copy(update={"current_limits": None})
                                                 for name, m in system.modules.items()}})
    law = rt.design.feedback_linearization(free)
    at = faces(298.15, 278.15)
    least = law.bounds(at)
    command = law.command(np.array([[-1e6, least.heat[1]], [least.heat[0] - 1e-9, -3.0]]), at)
    np.testing.assert_allclose(command.current[:, 0], least.current[0], rtol=1e-12)
    np.testing.assert_allclose(command.heat[:, 0], least.heat[0], rtol=1e-12)
    assert command.limit.tolist() == [["optimum", ""], ["optimum", ""]]


def test_every_limit_is_kept_and_named(system):
    law = rt.design.feedback_linearization(system, current_limits={"m1": (-1.0, 1.2)}, voltage_limits=(-5.0, 6.0),
                                           slew=0.1)
    at = faces(300.0, 290.0)
    command = law.command([-20.0, -30.0], at)
    assert command.limit.tolist() == ["current", "voltage"]
    assert command.current[0] == 1.2
    assert command.voltage[1] == pytest.approx(6.0)
    np.testing.assert_allclose(command.heat, law.heat(command.current, at), rtol=1e-12)
    slow = law.command([-20.0, -30.0], at, previous=[0.5, 0.2], sample_time=2.0)
    assert slow.limit.tolist() == ["slew", "slew"]
    np.testing.assert_allclose(slow.current, [0.7, 0.4])
    np.testing.assert_allclose(slow.heat, law.heat(slow.current, at), rtol=1e-12)
    inside = law.command([-1.0, 1.0], at)
    assert not inside.saturated.any()
    np.testing.assert_array_equal(inside.heat, [-1.0, 1.0])


def test_random_commands_never_leave_the_limits(system):
    law = rt.design.feedback_linearization(system, current_limits=(-2.0, 2.5), voltage_limits=(-12.0, 12.0), slew=0.5)
    rng = np.random.default_rng(7)
    x = rng.uniform(265.0, 350.0, (5000, 18))
    v = rng.uniform(-60.0, 60.0, (5000, 2))
    last = rng.uniform(-2.0, 2.5, (5000, 2))
    command = law.command(v, x, previous=last, sample_time=1.0)
    assert command.current.min() >= -2.0 and command.current.max() <= 2.5
    assert (command.current <= law.bounds(x).current * (1 + 1e-12)).all()
    np.testing.assert_allclose(command.heat, law.heat(command.current, x), rtol=1e-9, atol=1e-9)
    free = command.limit == ""
    np.testing.assert_array_equal(command.heat[free], v[free])
    assert free.any() and set(command.limit.ravel()) >= {"", "slew", "voltage", "current"}
    low, high = law.reach(x)
    at_limit = law.command(v, x)
    assert (at_limit.heat >= low - 1e-9).all() and (at_limit.heat <= high + 1e-9).all()


def test_voltage_and_current_drive_agree(law):
    at = faces(305.0, 285.0)
    command = law.command([-4.0, 3.0], at)
    np.testing.assert_allclose(law.current_from_voltage(command.voltage, at), command.current, rtol=1e-13)


def test_arrays_mappings_and_one_module_agree(system, law):
    x = np.linspace(290.0, 310.0, 18)
    at = dict(zip(system.lump_names, x, strict=True))
    expected = law.current([-2.0, 1.0], x)
    np.testing.assert_array_equal(law.current({"m2": 1.0, "m1": -2.0}, at), expected)
    one = rt.design.feedback_linearization(system, ["m2"])
    np.testing.assert_array_equal(one.current([1.0], x), expected[1:])


def test_a_certificate_sets_the_limits(system):
    box = {"current": {"m1": (0.0, 1.5), "m2": (0.0, 1.5)}, "temperature": (278.15, 358.15)}
    proven = rt.certify.contraction(system, method="energy", **box)
    with pytest.warns(UserWarning, match="contraction limit inside the box; not a limit for use") as warned:
        law = rt.design.feedback_linearization(system, certificate=proven)
    assert warned[0].filename == __file__
    assert law.current_high.tolist() == [1.5, 1.5]
    message = r"current_limits\['m1'\].*certified range.*usable_current"
    with pytest.warns(UserWarning), pytest.raises(rt.InputError, match=message):
        rt.design.feedback_linearization(system, certificate=proven, current_limits=(0.0, 2.0))


def test_a_certificate_is_no_authority_before_it_is_proven(system, tmp_path):
    """A hand-edited file that the checker rejects, and an honest certificate of another machine."""
    box = {"current": {"m1": (0.0, 1.0), "m2": (0.0, 1.0)}, "temperature": (278.15, 358.15)}
    path = tmp_path / "contraction.json"
    rt.certify.contraction(system, method="energy", **box).save(path)
    path.write_text(path.read_text().replace("1.0", "9.0"))
    with pytest.raises(rt.InputError, match="not valid: the claim is not the one the data give"):
        rt.design.feedback_linearization(system, certificate=rt.Certificate.load(path))
    for name, factor in (("lumps.x1.capacity", 1 + 1e-12), ("modules.m1.seebeck.value", 0.99)):
        other = system.with_parameters({name: system.parameter(name) * factor})
        proven = rt.certify.contraction(other, method="energy", **box)
        with pytest.warns(UserWarning, match="not a limit for use"):
            law = rt.design.feedback_linearization(other, certificate=proven)
        assert law.current_high.tolist() == [1.0, 1.0]
        with pytest.raises(rt.InputError, match="about another machine"):
            rt.design.feedback_linearization(system, certificate=proven)
    invariant = rt.certify.invariance(system, ambient={"room": (293.15, 303.15)}, **box)
    with pytest.raises(rt.InputError, match="not a contraction certificate that holds"):
        rt.design.feedback_linearization(system, certificate=invariant)


def test_a_usable_current_sets_the_limits(system):
    usable = rt.certify.usable_current(system, direction="cooling", temperature=(268.15, 358.15),
                                       ambient={"room": (296.15, 300.15)})
    assert usable.holds
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # the currents of a usable current are for use: nothing to warn of
        law = rt.design.feedback_linearization(system, certificate=usable)
    assert law.current_high.tolist() == [usable.current] * 2 and law.current_low.tolist() == [0.0, 0.0]
    wider = replace(usable, range={name: (0.0, 2 * usable.current) for name in usable.range})
    with pytest.raises(rt.InputError, match="exceeds the currents of its certificate"):
        rt.design.feedback_linearization(system, certificate=wider)
    with pytest.raises(rt.InputError, match="contraction: the certificate is about another machine"):
        rt.design.feedback_linearization(system.with_parameters({"lumps.x1.capacity": 41.0}), certificate=usable)


@pytest.mark.parametrize(("arguments", "message"), [
    ({"modules": ["m3"]}, "no module 'm3'.*m1, m2"),
    ({"modules": []}, "at least one module"),
    ({"current_limits": (-4.0, 4.0)}, "exceeds the range in the system file.*Lower them"),
    ({"current_limits": (0.5, 1.0)}, "lower <= 0 <= upper"),
    ({"current_limits": {"m9": (-1.0, 1.0)}}, "'m9' is not driven here"),
    ({"slew": -1.0}, "slew"),
])
def test_bad_arguments_are_refused(system, arguments, message):
    with pytest.raises(rt.InputError, match=message):
        rt.design.feedback_linearization(system, **arguments)


def test_bad_temperatures_are_refused(system, law):
    with pytest.raises(rt.InputError, match="kelvin.*273.15"):
        law.current(0.0, faces(25.0, 20.0))
    with pytest.raises(rt.InputError, match="every lump of the system"):
        law.current(0.0, np.full(17, 300.0))
    with pytest.raises(rt.InputError, match="no temperature for lump 'x10'"):
        law.current(0.0, {"x9": 300.0, "x11": 300.0})
    with pytest.raises(rt.InputError, match="kelvin"):
        law.current(0.0, faces(np.nan, 300.0))
    with pytest.raises(rt.InputError, match="sample_time"):
        rt.design.feedback_linearization(system, slew=1.0).command(0.0, faces(300.0, 300.0), previous=0.0)
    steep = system.with_parameters({"modules.m1.resistance.slope": -0.2})
    with pytest.raises(rt.InputError, match="R of module 'm1' is -.*slope is too steep"):
        rt.design.feedback_linearization(steep).current(0.0, np.full(18, 340.0))


def test_a_system_without_modules_is_refused():
    with pytest.raises(rt.InputError, match="no thermoelectric module"):
        rt.design.feedback_linearization(rt.systems.tclab())
