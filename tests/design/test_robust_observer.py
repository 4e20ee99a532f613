"""Observers from a matrix inequality: over the whole box, against brute force, refusals, sensors that would help."""

from itertools import product

import numpy as np
import pytest

import robthermal as rt

BOX = (278.15, 358.15)


def heating(system, size):
    return dict.fromkeys(system.modules, (-size, 0.0))


def frozen(obs, currents, temperatures, rng, count):
    """Error matrices at random points of the box, by the model's own slopes."""
    model, n = obs.model, len(obs.model.A_d)
    for _ in range(count):
        x = rng.uniform(*temperatures, n)
        u = model.exogenous({name: rng.choice([low, high, rng.uniform(low, high)])
                             for name, (low, high) in currents.items()})
        yield model.A_d - obs.gain @ model.C + model.Gamma @ model.rest_slope(x, u)


@pytest.fixture(scope="module")
def strong(system):
    """On the two sensors with which the Kalman observer is unstable at this current."""
    return rt.design.observer(system, ["T6", "T7"], method="lmi", current=heating(system, 5.25), temperature=BOX)


@pytest.mark.exhaustive
def test_it_holds_where_the_kalman_observer_is_unstable(system, strong):
    box = heating(system, 5.25)
    kalman = rt.design.observer(system, ["T6", "T7"])
    assert kalman.spectral_radius(box, BOX) > 1 and not kalman.certify(box, BOX).holds
    assert strong.outcome and strong.spectral_radius(box, BOX) < 1
    proof = strong.certify(box, BOX)
    assert proof.holds and rt.verify(proof).valid


def test_the_frozen_limit_lies_beyond_the_current_it_was_made_for(system, strong):
    kalman = rt.design.observer(system, ["T6", "T7"]).frozen_limit(BOX, "heating")
    assert strong.frozen_limit(BOX, "heating") > max(5.25, 2 * kalman)


@pytest.mark.exhaustive
def test_errors_die_out_under_arbitrary_switching(system, strong):
    """Brute force: products of error matrices at random points, currents jumping, not one frozen matrix at a time."""
    rng = np.random.default_rng(1)
    worst = np.eye(18)
    for M in frozen(strong, heating(system, 5.25), BOX, rng, 3000):
        worst = M @ worst
    assert np.abs(worst).max() < 1e-3


def small(**module):
    table = {"hot": "h", "cold": "c", "reference_temperature": 300.0, "seebeck": {"value": 0.05, "slope": 8e-5},
             "resistance": {"value": 4.0, "slope": 0.02}, "conductance": {"value": 0.3, "slope": 1e-3}, **module}
    return rt.System(ambients={"room": {"temperature": 298.0}}, modules={"m": table},
                     lumps={"h": {"capacity": 20.0}, "c": {"capacity": 5.0}, "plate": {"capacity": 60.0}},
                     links=[{"between": ("h", "room"), "conductance": 0.7}, {"between": ("c", "plate"),
                            "conductance": 0.5}, {"between": ("plate", "room"), "conductance": 0.06}],
                     sensors={"Th": {"lump": "h", "noise": 0.01}, "Tc": {"lump": "c", "noise": 0.01},
                              "Tp": {"lump": "plate", "noise": 0.01}})


@pytest.mark.parametrize("tau", [None, 40.0, 15.0])
def test_the_promised_decay_is_kept_and_proven(tau):
    system = small()
    box = {"m": (-3.0, 2.0)}
    obs = rt.design.observer(system, ["Tc"], method="lmi", current=box, temperature=(270.0, 340.0), time_constant=tau)
    assert obs.outcome
    promised = float(obs.outcome.text.split("at least by ")[1].split(" per sample")[0])
    assert promised < (1 if tau is None else np.exp(-1 / tau) + 1e-7)
    assert obs.spectral_radius(box, (270.0, 340.0)) <= promised
    proof = obs.certify(box, (270.0, 340.0))
    assert proof.holds and rt.verify(proof).valid


def test_no_gain_is_promised_where_none_exists():
    """Whatever the gain, an error in the lumps that a frozen matrix makes grow unseen cannot be stopped."""
    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(8):
        system = small(seebeck={"value": 0.05, "slope": rng.uniform(-2e-4, 2e-4)})
        size, sensor = float(rng.uniform(1.0, 40.0)), str(rng.choice(["Th", "Tp"]))
        box = {"m": (-size, size)}
        obs = rt.design.observer(system, [sensor], method="lmi", current=box, temperature=(270.0, 340.0))
        radius = max(np.abs(np.linalg.eigvals(M)).max() for M in frozen(obs, box, (270.0, 340.0), rng, 60))
        assert not (obs.outcome and radius >= 1)
        seen.add(bool(obs.outcome))
    assert seen == {True, False}


def test_the_gain_is_the_nearest_to_the_kalman_gain_that_keeps_half_of_the_margin():
    from robthermal.design._error_box import blocks
    from robthermal.design._robust_gain import find_norm, nearest_gain

    system = small()
    kalman = rt.design.observer(system, ["Tc"])
    model, root = kalman.model, np.sqrt(kalman.model.equations.capacity)[:, None]
    norm = find_norm(model, blocks(system, {"m": (-3.0, 2.0)}, (270.0, 340.0)), np.exp(-1 / 15))
    central = norm.central_gain() / root
    gain, left = nearest_gain(norm, model, kalman.gain)
    assert left >= 0.5 * norm.left(norm.central_gain()) > 0
    assert np.linalg.norm(gain - kalman.gain) < np.linalg.norm(central - kalman.gain)
    closer = gain + 0.01 * (kalman.gain - gain)
    assert norm.left(root * closer) < 0.5 * norm.left(norm.central_gain())  # no nearer one on the way
    np.testing.assert_allclose(nearest_gain(norm, model, central)[0], central, rtol=1e-4)  # good enough: kept


@pytest.mark.exhaustive
def test_sensors_that_would_help_are_named(system):
    box = {"current": heating(system, 5.25), "temperature": BOX}
    poor = rt.design.observer(system, ["T6"], method="lmi", **box)
    assert poor.outcome.code == "not_contracting"
    helpful = poor.outcome.text.split("With one of ")[1].split(" added")[0].split(", ")
    assert "T7" in helpful and "T6" not in helpful
    for name in (helpful[0], helpful[-1]):  # it is true: with it there is a gain
        assert rt.design.observer(system, ["T6", name], method="lmi", **box).outcome
    few = system.model_copy(update={"sensors": {name: system.sensors[name] for name in ("T6", "T7")}})
    none = rt.design.observer(few, ["T6"], method="lmi", current=heating(system, 60.0), temperature=BOX)
    assert not none.outcome and "place_sensors(…, keep=[…])" in none.outcome.text


def test_placement_extends_the_sensors_that_are_there():
    system = small()
    box = {"current": {"m": (-12.0, 0.0)}, "temperature": (270.0, 340.0)}
    found = rt.design.place_sensors(system, keep=["Th"], largest=2, method="lmi", **box)
    assert found.outcome and found.sensors[0] == "Th" and all("Th" in names for names, _ in found.best.values())
    with pytest.raises(rt.InputError, match="largest = 1.*2 to 3"):
        rt.design.place_sensors(system, keep=["Th", "Tc"], largest=1, **box)


def test_a_sensor_with_a_gain_is_certified_as_it_is_used():
    """The observer undoes the sensor's gain; the certificate's sensor reads it: the error must be one and the same."""
    system, box = small(), {"m": (-3.0, 2.0)}
    turned = system.with_parameters({"sensors.Tc.gain": 3.0})
    plain, other = (rt.design.observer(s, ["Tc"], method="lmi", current=box, temperature=(270.0, 340.0),
                                       sensor_noise=0.01) for s in (system, turned))
    np.testing.assert_allclose(plain.gain, other.gain)
    proofs = [obs.certify(box, (270.0, 340.0)) for obs in (plain, other)]
    assert all(proof.holds for proof in proofs)
    assert proofs[0].evidence["contraction"] == pytest.approx(proofs[1].evidence["contraction"], abs=1e-6)


@pytest.mark.parametrize(("arguments", "message"), [
    ({}, "no box is given"),
    ({"current": {"m1": (0, 1)}, "temperature": BOX}, "'m2' has no range"),
    ({"current": 3.0, "temperature": BOX}, "argument current"),
    ({"current": {"m1": (0, 1), "m2": (0, 1)}, "temperature": (310.0, 350.0)},
     "excludes the equilibrium: lump 'x1' settles at 298.15 K with m1 at 0 A.*Widen the box"),
    ({"current": {"m1": (0, 1), "m2": (0, 1)}, "temperature": BOX, "time_constant": -1.0}, "time_constant"),
])
def test_bad_boxes_are_refused(system, arguments, message):
    with pytest.raises(rt.InputError, match=message):
        rt.design.observer(system, ["T6"], method="lmi", **arguments)


def test_boxes_without_the_equilibrium_are_refused_everywhere(system):
    away = {"current": {"m1": (0.0, 0.5), "m2": (0.0, 0.5)}, "temperature": (310.0, 350.0)}
    with pytest.raises(rt.InputError, match="argument temperature: the box .* excludes the equilibrium"):
        rt.design.place_sensors(system, **away)
    with pytest.raises(rt.InputError, match="argument certificate: the box .* excludes the equilibrium"):
        rt.design.feedback_linearization(system, certificate=rt.certify.contraction(system, method="energy", **away))


def test_every_corner_of_the_hull_is_covered():
    """The multipliers speak for all joint corners: e'Pe falls at each of them, by brute force."""
    from robthermal.design._error_box import blocks  # no public name: the corners themselves
    from robthermal.design._robust_gain import find_norm

    system = rt.systems.two_module()
    obs = rt.design.observer(system, ["T6", "T7"])
    found = blocks(system, heating(system, 3.0), BOX)
    norm = find_norm(obs.model, found, 1.0)
    root = np.sqrt(obs.model.equations.capacity)
    L = norm.central_gain() / root[:, None]
    left = norm.left(norm.central_gain())
    assert 0 < left < 1 and norm.left(0 * norm.central_gain()) < left
    for corner in product(*(block.hull for block in found)):
        F = np.zeros((18, 18))
        for block, own in zip(found, corner, strict=True):
            F[np.ix_([block.a, block.b], [block.a, block.b])] += own
        M = (obs.model.A_d - L @ obs.model.C + obs.model.Gamma @ F) * root[:, None] / root
        assert np.linalg.eigvalsh(norm.matrix - M.T @ norm.matrix @ M)[0] >= 0.9 * left
