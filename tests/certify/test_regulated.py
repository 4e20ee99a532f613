"""Regulated modules on the two-module set-up against the runaway limit I*, and parameter ranges in all makers."""

import numpy as np
import pytest
from scipy.sparse import csr_array

import robthermal as rt
from robthermal.errors import InputError

HELD = {"m1": 278.15, "m2": 278.15}
I_STAR = (1.503, 1.516)  # rt.certify.runaway, smallest and largest of the modules
BOTH = {"m1": (0.0, 1.2), "m2": (0.0, 1.2)}


@pytest.fixture(scope="module")
def at_fold(two):
    """Temperatures at the fold."""
    return rt.thermal.fold(two, HELD)


@pytest.fixture(scope="module")
def small():
    """Sink, module, cold plate."""
    return rt.System(
        ambients={"room": {"temperature": 298.15}},
        lumps={"sink": {"capacity": 60.0}, "hot": {"capacity": 20.0}, "cold": {"capacity": 5.0}, "plate":
               {"capacity": 30.0}},
        links=[{"between": ("sink", "room"), "conductance": 2.0}, {"between": ("sink", "hot"), "conductance": 10.0},
               {"between": ("cold", "plate"), "conductance": 2.0}, {"between": ("plate", "room"), "conductance": 0.1}],
        modules={"m": {"hot": "hot", "cold": "cold", "reference_temperature": 300.0, "seebeck": {"value": 0.0537},
                       "resistance": {"value": 4.63}, "conductance": {"value": 0.2968}}})


def star_of(g):
    """I* of the module of ``small`` on a sink of g W/K from the cubic of the errata, and its hot face there."""
    numbers = {"seebeck": 0.0537, "resistance": 4.63, "conductance": 0.2968, "sink_conductance": g,
               "sink_temperature": 298.15, "setpoint": 278.15}
    current = rt.certify._runaway.smallest_root(numbers)
    hot = (g * 298.15 + 0.2968 * 278.15 + 4.63 * current**2 / 2) / (g + 0.2968 - 0.0537 * current)
    return current, hot


def around(system, temperatures, width):
    held = {system.modules[name].cold for name in HELD}
    return {name: (T - width, T + width) for name, T in zip(system.lump_names, temperatures, strict=True)
            if name not in held}


@pytest.mark.parametrize("method", ["max", "sum"])
def test_tight_limit_is_close_to_the_runaway_current_and_never_above(two, at_fold, method):
    assert at_fold.current[-1] == pytest.approx([1.516, 1.503], abs=2e-3)
    limit = rt.certify.largest_regulated_current(two, setpoint=HELD, method=method,
                                                 temperature=around(two, at_fold.temperatures[-1], 0.5))
    assert 0.99 * I_STAR[0] < limit.current < I_STAR[1]
    assert limit.certificate.holds and rt.verify(limit.certificate).valid
    wide = rt.certify.largest_regulated_current(two, setpoint=HELD, method=method, temperature=(278.15, 328.15))
    assert 0.97 * I_STAR[0] < wide.current < limit.current


@pytest.mark.parametrize("method", rt.certify._contraction.METHODS)
def test_nothing_is_certified_at_the_fold(two, at_fold, method):
    """The box holds the fold: one frozen reduced Jacobian of it is singular."""
    top = float(at_fold.current[-1].max())
    cert = rt.certify.regulated(two, setpoint=HELD, current={"m1": (0.0, top), "m2": (0.0, top)}, method=method,
                                temperature=around(two, at_fold.temperatures[-1], 0.5))
    assert not cert.holds and cert.reason


def test_a_module_with_its_own_sink():
    """One module with constant S, R, K: I* of the cubic, for all methods, energy too because nothing else is linked."""
    system = rt.System(
        ambients={"room": {"temperature": 298.15}}, lumps={"hot": {"capacity": 20.0}, "cold": {"capacity": 5.0}},
        links=[{"between": ("hot", "room"), "conductance": 2.0}],
        modules={"m": {"hot": "hot", "cold": "cold", "reference_temperature": 300.0, "seebeck": {"value": 0.0537},
                       "resistance": {"value": 4.63}, "conductance": {"value": 0.2968}}})
    star, hot = star_of(2.0)
    for method in rt.certify._contraction.METHODS:
        limit = rt.certify.largest_regulated_current(system, setpoint={"m": 278.15}, method=method,
                                                     temperature={"hot": (hot - 0.01, hot + 0.01)})
        assert 0.98 * star < limit.current < star * 1.0001


def test_uncertain_parameters_cost_current(two):
    box = (288.15, 328.15)
    limit = rt.certify.largest_regulated_current(two, setpoint=HELD, temperature=box)
    ranges = {"modules.m1.resistance.value": (4.5, 4.8), "links.x6-x9.conductance": (12.0, 14.0),
              "lumps.x9.capacity": (0.5 * two.lumps["x9"].capacity, 2 * two.lumps["x9"].capacity)}
    robust = rt.certify.largest_regulated_current(two, setpoint=HELD, temperature=box, parameters=ranges)
    assert 0.9 * limit.current < robust.current < limit.current
    assert "'links.x6-x9.conductance' in [12, 14]" in robust.certificate.claim
    worst = two.with_parameters({"modules.m1.resistance.value": 4.8, "links.x6-x9.conductance": 12.0})
    frozen = rt.certify.largest_regulated_current(worst, setpoint=HELD, temperature=box).current
    assert 0.9 * frozen < robust.current < frozen  # one weight per lump has to serve both ends of the link


def test_a_matrix_for_regulated_modules(small):
    """Between the energy norm, which a strongly linked cold plate spoils, and the fold."""
    star, _ = star_of(1 / (1 / 2.0 + 0.1))
    request = {"setpoint": {"m": 278.15}, "temperature": (278.15, 318.15)}
    found = {method: rt.certify.largest_regulated_current(small, method=method, **request)
             for method in ("energy", "lyapunov", "max")}
    assert found["energy"].current < found["lyapunov"].current < star
    assert found["lyapunov"].current > 0.95 * star and found["max"].current > 0.95 * star
    cert = rt.certify.regulated(small, setpoint={"m": (277.0, 280.0)}, current={"m": (0.0, 1.5)}, method="lyapunov",
                                temperature=(278.15, 318.15))
    assert cert.holds and rt.verify(cert).valid


def test_one_regulated_one_with_any_current(two):
    cert = rt.certify.regulated(two, setpoint={"m1": 278.15}, current=BOTH, temperature=(278.15, 328.15))
    assert cert.holds and "current of 'm2' in [0, 1.2] A" in cert.claim


def test_beyond_the_optimal_current_the_answer_is_no(two):
    cert = rt.certify.regulated(two, setpoint=HELD, current={"m1": (0.0, 3.5), "m2": (0.0, 1.0)},
                                temperature=(278.15, 328.15))
    assert not cert.holds and "S x_c - R I" in cert.reason


@pytest.mark.parametrize(("change", "message"), [
    ({"setpoint": {}}, "no module is named"), ({"setpoint": {"m9": 278.15}}, "no module 'm9'"),
    ({"setpoint": {"m1": 5.0}}, "Celsius"), ({"current": {"m1": (0, 1)}}, "'m2' has no range"),
    ({"temperature": {"x1": (280, 300)}}, "has no range"), ({"method": "best"}, "method"),
    ({"parameters": {"links.x6-x9.conductance": (14.0, 15.0)}}, "excludes"), ({"temperature": (5, 55)}, "Celsius")])
def test_bad_ranges_are_refused(two, change, message):
    request = {"setpoint": HELD, "current": BOTH, "temperature": (278.15, 328.15), **change}
    with pytest.raises(InputError, match=message):
        rt.certify.regulated(two, **request)


def test_box_invariance_with_uncertain_parameters(two):
    request = {"current": {"m1": (0.0, 0.0), "m2": (0.0, 0.0)}, "temperature": (288.15, 308.15),
               "ambient": {"room": (293.15, 303.15)}}
    cert = rt.certify.invariance(two, **request, parameters={"links.x6-x9.conductance": (10.0, 16.0),
                                                             "modules.m1.conductance.value": (0.2, 0.4)})
    assert cert.holds and rt.verify(cert).valid and "for all values of 2 parameters: " in cert.claim


def test_observer_with_uncertain_parameters(small):
    request = {"gain": [[0.1], [0.3], [0.1], [0.0]], "sensors": ["hot"], "current": {"m": (0.0, 1.0)},
               "temperature": (278.15, 358.15)}
    cert = rt.certify.observer(small, **request, parameters={"links.sink-hot.conductance": (8.0, 12.0),
                                                             "modules.m.seebeck.value": (0.051, 0.056)})
    assert cert.holds and rt.verify(cert).valid and "the same in plant and observer" in cert.claim
    wide = rt.certify.observer(small, **request, parameters={"links.sink-hot.conductance": (1.0, 90.0)})
    assert not wide.holds and "grows" in wide.reason  # 80 W/K more, held for a second, overturn 20 J/K
    with pytest.raises(InputError, match="uncertain capacity"):
        rt.certify.observer(small, **request, parameters={"lumps.hot.capacity": (1.0, 30.0)})


def test_runaway_with_uncertain_parameters(small):
    found = rt.certify.runaway(small, setpoint={"m": 278.15}, parameters={"links.sink-room.conductance": (1.9, 2.1)})
    cert = found.certificates["m"]
    assert cert.holds and rt.verify(cert).valid and "for all values of 2 parameters: " in cert.claim
    low, high = cert.evidence["current"]
    for sink in (1.9, 2.0, 2.1):  # in series with 10 W/K: two conductances, one sink
        assert low < star_of(1 / (1 / sink + 0.1))[0] < high
    assert high - low < 0.2


def test_network_with_uncertain_conductances():
    n = 30
    A = np.diag(np.full(n - 1, 2.0), 1) + np.diag(np.full(n - 1, 2.0), -1)
    A -= np.diag(A.sum(axis=1) + 0.05)
    E = np.full(n, 3.0)
    certain, robust = (rt.certify.network(E, csr_array(A), uncertainty=u) for u in (0.0, 0.02))
    assert robust.holds and rt.verify(robust).valid
    assert 0 < robust.evidence["rate"] <= certain.evidence["rate"]
    A[np.arange(n), np.arange(n)] += 0.05
    A[0, 0] -= 1e-3  # a long chain with one weak end: factors of 2 n u swamp it
    hopeless = rt.certify.network(E, csr_array(A), uncertainty=0.5)
    assert not hopeless.holds
    for uncertainty, method in ((1.0, "max"), (-0.1, "max"), (0.1, "sum"), (float("nan"), "max")):
        with pytest.raises(InputError, match="uncertainty"):
            rt.certify.network(E, csr_array(A), uncertainty=uncertainty, method=method)
