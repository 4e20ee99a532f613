"""Kind "loop": against simulated maps of small closed loops by finite differences, mutated and malformed files."""

from __future__ import annotations

import certificate_truth as truth
import numpy as np
import pytest
from flint import arb, fmpq
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq
from small_loop import PAIR, achieved, document, made

from robthermal.errors import InputError
from robthermal.verification import Certificate, _between, _law, establish, verify
from robthermal.verification._kind import working_precision
from robthermal.verification._system import read_system


def heats(system, x, current):
    return truth.heat(system, x, {"m": current}, {"room": 298.15})


def one_sample(parts, state):
    """The sampled closed loop, solved numerically: its current from a search, not from the law's formula."""
    system, region = parts["system"], parts["region"]
    control = {key: np.array(rows, float) for key, rows in system["controller"].items()}
    x, z = state[:2], state[2:]
    reference = np.array([0.0, 295.0])
    v = float((control["C"] @ z + control["D"] @ (x - reference))[0])
    low, high = (truth.number(value) for value in region["current"]["m"])
    if achieved(system, x, low) <= v:
        current = low
    elif achieved(system, x, high) >= v:
        current = high
    else:
        a, b = low, high
        for _ in range(60):
            middle = 0.5 * (a + b)
            a, b = (middle, b) if achieved(system, x, middle) > v else (a, middle)
        current = 0.5 * (a + b)
    E = np.array([truth.number(lump["capacity"]) for lump in system["lumps"].values()])
    T = truth.number(region["sample_time"])
    end = solve_ivp(lambda _, y: heats(system, y, current) / E, (0, T), x, rtol=1e-9, atol=1e-9).y[:, -1]
    gap = np.array([achieved(system, x, current) - v])
    return np.concatenate([end, control["A"] @ z + control["B"] @ (x - reference) + control["windup"] @ gap])


def growth(parts, rng, count=25):
    """Largest ratio of e'Pe over one sample between pairs near and far, divided by the claimed one."""
    P = np.array([[truth.number(value) for value in row] for row in parts["evidence"]["matrix"]])
    c = truth.number(parts["evidence"]["contraction"])
    low, high = (truth.number(value) for value in parts["region"]["temperature"])
    inner = (high - low) / 8
    worst = 0.0
    for k in range(count):
        a = np.array([*rng.uniform(low + inner, high - inner, 2), rng.uniform(-12, 12)])
        b = a + rng.normal(0, 1, 3) * (0.01 if k % 2 else [inner / 2, inner / 2, 3.0])
        b[:2] = np.clip(b[:2], low, high)
        before, after = a - b, one_sample(parts, a) - one_sample(parts, b)
        worst = max(worst, float(after @ P @ after / (before @ P @ before)) / c**2)
    return worst


def test_certified_loop_contracts_in_simulated_pairs():
    certificate = made(document())
    assert certificate.holds and verify(certificate).valid, certificate.reason
    assert growth(document(), np.random.default_rng(1), 60) < 1


@pytest.mark.exhaustive
def test_mutated_loops_are_never_wrongly_accepted():
    rng = np.random.default_rng(2)
    numeric = [path for section in ("system", "region", "evidence") for path in
               truth.leaves(document()[section], (section,)) if not {"between", "hot", "cold", "ambients", "name",
                                                                    "plant", "pieces"} & set(path)]
    accepted = refused = 0
    for _ in range(30):
        path = numeric[int(rng.integers(len(numeric)))]
        factor = float(rng.choice([-1.0, 0.5, 0.9, 1.1, 3.0]))
        changed = truth.replaced(document(), path, lambda value, factor=factor: truth.number(value) * factor)
        try:
            certificate = made(changed)
        except InputError:
            refused += 1
            continue
        accepted += certificate.holds
        refused += not certificate.holds
        if certificate.holds:
            assert growth(changed, rng, 3) < 1, path
    assert accepted > 6 and refused > 6


@pytest.mark.parametrize(("path", "value"), [
    (("system", "controller", "D"), [[0.0, -40.0]]), (("system", "controller", "B"), [[0.0, 0.01]]),
    (("system", "controller", "windup"), [[2.5]]), (("system", "controller", "D"), [[0.0, 1.0]]),
    (("region", "sample_time"), 60.0), (("region", "current"), {"m": [-3.0, 0.5]}),
    (("region", "current"), {"m": [-0.2, 6.0]}), (("region", "temperature"), [150.0, 450.0]),
    (("system", "modules", "m", "seebeck"), {"value": 0.05, "slope": 5e-3}),
    (("system", "modules", "m", "resistance"), {"value": -4.0, "slope": 0.0}),
    (("system", "modules", "m", "conductance"), {"value": -0.3, "slope": 0.0}),
    (("system", "links"), [{"between": ["cold", "room"], "conductance": 0.1}]),
    (("evidence", "contraction"), 0.9), (("evidence", "weights"), [1.0, 1.0]), (("evidence", "weights"), []),
    (("evidence", "matrix"), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]),
    (("evidence", "matrix"), [[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])])
def test_what_must_not_be_certified(path, value):
    certificate = made(truth.replaced(document(), path, lambda _: value))
    assert not certificate.holds and certificate.reason


def test_sizes_that_do_not_bound_are_refused():
    """The multipliers are evidence: too small a size would hide what happens between the samples."""
    for k in (0, 1, 4, 5, 6, 7):
        parts = document()
        parts["evidence"]["sizes"][k] = 1e-12
        assert "do not bound" in made(parts).reason


def machine():
    system = read_system(PAIR)
    return system, system.modules[0]


def test_slopes_of_the_law_are_enclosed():
    """Finite differences of the current found by search, against the balls."""
    _, module = machine()
    T, span = (fmpq(285), fmpq(310)), (fmpq(-1, 5), fmpq(1, 2))
    balls = [(float(ball.lower()), float(ball.upper())) for ball in _law.free_slopes(module, T, T, span)]
    assert len(balls) == 6
    rng, step = np.random.default_rng(5), 1e-4
    for _ in range(40):
        x, current = rng.uniform(285.01, 309.99, 2), rng.uniform(-0.19, 0.49)
        v = achieved(PAIR, x, current)
        points = [(x + [step, 0], v), (x + [0, step], v), (x, v + step)]
        far = [(x - [step, 0], v), (x - [0, step], v), (x, v - step)]
        currents = [[brentq(lambda c, y=y, w=w: achieved(PAIR, y, c) - w, -1.0, 1.5, xtol=1e-14) for y, w in side]
                    for side in (points, far)]
        g = (np.array(currents[0]) - currents[1]) / (2 * step)
        alone = {**PAIR, "links": []}
        into = [[truth.heat(alone, y, {"m": c}, {"room": 300.0})[0] for (y, _), c in zip(side, own, strict=True)]
                for side, own in zip((points, far), currents, strict=True)]
        slopes = np.concatenate([(np.array(into[0]) - into[1]) / (2 * step), g])
        for value, (low, high) in zip(slopes, balls, strict=True):
            assert low - 1e-4 <= value <= high + 1e-4


@pytest.mark.parametrize("drift", [None, 4.0])
def test_changes_within_a_sample_are_bounded_and_reached(drift):
    """|J|, J(x) - J(y) and b(x) - b(y) of random pairs of the box never exceed the bounds, and come near them."""
    _, module = machine()
    T, span = (fmpq(285), fmpq(310)), (fmpq(-1, 5), fmpq(1, 2))
    found = _law.variation(module, T, T, span, None if drift is None else fmpq(4))
    near = np.zeros(10)
    rng = np.random.default_rng(6)
    alone = {**PAIR, "links": []}

    def slopes(x, current):
        J = truth.jacobian(alone, x, {"m": current})
        b = [(p - q) / 2e-4 for p, q in zip(*(truth.heat(alone, x, {"m": current + d}, {}) for d in (1e-4, -1e-4)),
                                            strict=True)]
        return J + 0.3 * np.array([[1, -1], [-1, 1]]), np.array(b)

    for _ in range(1500):
        x, current = rng.choice([285.0, 310.0, 297.0], 2), rng.choice([-0.2, 0.1, 0.5])
        y = np.clip(x + (rng.choice([-25.0, 25.0], 2) if drift is None else rng.choice([-drift, drift], 2)), 285, 310)
        (J, b), (other, c) = slopes(x, current), slopes(y, current)
        bounds = np.array([*np.ravel(found.size), *np.ravel(found.slope), *found.drive], dtype=object).astype(float)
        values = np.abs(np.concatenate([J.ravel(), (J - other).ravel(), b - c]))
        assert (values <= bounds * (1 + 1e-6) + 1e-9).all()
        near = np.maximum(near, values / bounds)
    assert (near > 0.9).all(), near


def test_sampled_network_and_gramians_by_quadrature():
    system, module = machine()
    with working_precision():
        links = {(0, 0): fmpq(-2), (1, 1): fmpq(-1, 10)}
        found = _between.sample(system, links, fmpq(3))
        bounds = _between.Bounds([[fmpq(1, 50)] * 2] * 2, [[arb(0.1)] * 2] * 2, [[arb(0.2)] * 4] * 2)
        weights, sizes = [fmpq(1), fmpq(2)], [fmpq(k + 30) for k in range(8)]
        between = _between.deviation(found, [0, 1], system.capacity, fmpq(3), bounds, weights, sizes)
    F = np.array([[-2.3, 0.3], [0.3, -0.4]]) / [[50.0], [20.0]]
    s = (np.arange(3000) + 0.5) * 1e-3
    grown = np.array([expm(F * t) for t in s])
    hold = np.cumsum(grown, axis=0) * 1e-3 - grown * 5e-4
    scatter = sum(np.einsum("ta,tb->ab", g := grown[:, :, j] / E, g) * 1e-3 / w
                  for j, (E, w) in enumerate(((50.0, 1.0), (20.0, 2.0))))
    moved = sum(np.einsum("ta,tb->ab", hold[:, j], hold[:, j]) * 1e-3 * w for j, w in enumerate((30.0, 31.0)))
    for ball, value in ((found.passive, expm(3 * F)), (found.hold, hold[-1] / [50.0, 20.0]),
                        (between.scatter, scatter), (between.moved, moved)):
        np.testing.assert_allclose([[float(x) for x in row] for row in ball.tolist()], value, rtol=2e-3)


def test_another_sentence_or_a_larger_margin_is_rejected():
    certificate = made(document())
    for words, other in (("continuously", "slowly"), ("1 s", "2 s"), ("0.5]", "0.6]")):
        changed = Certificate(**{**vars(certificate), "claim": certificate.claim.replace(words, other)})
        assert changed.claim != certificate.claim and not verify(changed).valid
    larger = Certificate(**{**vars(certificate), "margin": {"contraction": 0.05}})
    assert "stored margin" in verify(larger).reason


def test_saved_and_loaded_certificate_is_the_same(tmp_path):
    certificate = establish("loop", **document(), made_by={})
    certificate.save(tmp_path / "loop.json")
    loaded = Certificate.load(tmp_path / "loop.json")
    assert loaded.claim == certificate.claim and verify(loaded).valid


def test_drift_is_part_of_the_claim():
    assert "moves a face of a module by more than 2 K" in made(document(drift=2.0)).claim
    assert made(document(drift=2.0)).holds  # asks less: the same evidence proves it


@pytest.mark.parametrize(("path", "value", "message"), [
    (("system", "controller"), None, "controller"), (("system", "controller", "A"), [[1.0, 0.0]], "numbers"),
    (("system", "controller", "windup"), [], "rows"), (("region", "plant"), "frozen", "plant"),
    (("region", "sample_time"), 0.0, "positive"), (("region", "drift"), -1.0, "negative"),
    (("region", "slew"), 1.0, "unknown key"), (("evidence", "pieces"), 1.5, "pieces"),
    (("evidence", "pieces"), 0, "pieces"), (("evidence", "contraction"), 1.1, "at most 1"),
    (("evidence", "matrix"), [[1.0]], "rows"), (("system", "modules"), {}, "in the system|no module")])
def test_malformed_loops_are_refused(path, value, message):
    parts = document()
    place = parts
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(InputError, match=message):
        made(parts)
