"""Kind "regulated": closed form of one module, the reduced equations, sampled truth, mutated and malformed files."""

from __future__ import annotations

import copy

import certificate_truth as truth
import held_truth
import numpy as np
import pytest
from held_truth import candidate
from uncertain_truth import machines, spans

from robthermal.errors import InputError
from robthermal.verification import Certificate, establish, verify

S, R, K, G, SINK, COLD = 0.0537, 4.63, 0.2968, 2.0, 298.15, 278.15


def one(top, hot, *, setpoint=COLD, rate=0.0, method="max", **evidence):
    """One module with constant S, R, K on a sink of conductance G."""
    system = {"lumps": {"hot": {"capacity": 20.0}, "cold": {"capacity": 5.0}}, "ambients": ["room"],
              "links": [{"between": ["hot", "room"], "conductance": G}],
              "modules": {"m": {"hot": "hot", "cold": "cold", "reference_temperature": 300.0,
                                "seebeck": {"value": S, "slope": 0.0}, "resistance": {"value": R, "slope": 0.0},
                                "conductance": {"value": K, "slope": 0.0}}}}
    region = {"temperature": {"hot": list(hot)}, "setpoint": {"m": [setpoint, setpoint]},
              "current": {"m": [0.0, top]}}
    given = {"max": {"weights": [1.0]}, "sum": {"weights": [1.0]}, "energy": {}, "lyapunov": {"matrix": [[1.0]]}}
    return {"system": system, "region": region, "evidence": {"method": method, "rate": rate, **given[method],
                                                             **evidence}}


def made(document, margin=None):
    return establish("regulated", **document, made_by={}, margin=margin)


def fold():
    """I* from the cubic of the errata, and the hot temperature there."""
    roots = np.roots([-2 * R * S**2, S * (5 * K * R + 4 * G * R + 2 * S**2 * COLD),
                      -2 * (K + G) * (2 * K * R + G * R + 2 * S**2 * COLD),
                      2 * G * S * ((G + 2 * K) * COLD - K * SINK)])
    current = min(root.real for root in roots if abs(root.imag) < 1e-9 and root.real > 0)
    return current, (G * SINK + K * COLD + R * current**2 / 2) / (G + K - S * current)


@pytest.mark.parametrize("method", ["max", "sum", "energy", "lyapunov"])
def test_one_module_is_certified_up_to_its_runaway_current(method):
    current, hot = fold()
    assert made(one(current * (1 - 1e-6), (hot, hot), method=method)).holds
    refused = made(one(current * (1 + 1e-6), (hot, hot), method=method))
    assert not refused.holds and method in refused.reason


def test_the_rate_is_that_of_the_linearized_hot_side():
    """-g + φ over E, φ of the errata at the ends of the box."""
    top, hot = 1.0, 330.0
    phi = -K + S * top + (R * top + S * hot) * K / (S * COLD - R * top)
    rate = (G - phi) / 20.0
    for method in ("max", "energy", "lyapunov"):
        assert made(one(top, (300.0, hot), rate=rate * (1 - 1e-9), method=method)).holds
        assert not made(one(top, (300.0, hot), rate=rate * (1 + 1e-9), method=method)).holds
    margin = made(one(top, (300.0, hot), rate=rate / 2)).margin["rate"]
    assert margin == pytest.approx(rate / 2, rel=0.01)


def test_no_claim_beyond_the_optimal_current():
    """S x_c = R I at 3.2 A, whatever the hot side."""
    document = one(S * COLD / R * 1.0001, (280.0, 281.0))
    document["system"]["links"][0]["conductance"] = 1e6
    assert "S x_c - R I" in made(document).reason
    document["region"]["current"]["m"] = [0.0, S * COLD / R * 0.99]
    assert made(document).holds


def test_the_reduced_equations_have_the_jacobian_of_the_proof():
    """Finite differences of the differential-algebraic equations against the Schur complement that the tests use."""
    rng = np.random.default_rng(5)
    for _ in range(5):
        document = held_truth.machine(rng)
        x, currents = next(held_truth.points(document, rng, 1))
        names, holder = list(document["system"]["lumps"]), held_truth.held(document)
        free = [k for k, name in enumerate(names) if name not in holder]
        cold = [k for k, name in enumerate(names) if name in holder]
        target = held_truth.flow(document, x, currents)[cold]
        J = held_truth.reduced(document, x, currents)
        assert len(free) > 1
        for column, j in enumerate(free):
            sides = []
            for step in (1e-4, -1e-4):
                y, now = x.copy(), dict(currents)
                y[j] += step
                for _ in range(30):  # Newton on the balances, one current each
                    left = held_truth.flow(document, y, now)[cold] - target
                    for value, module in zip(left, holder.values(), strict=True):
                        now[module] += value / held_truth.grip({**document, "region": {**document["region"],
                                                               "setpoint": {module: 0}}}, y, now)
                sides.append(held_truth.flow(document, y, now)[free])
            assert (sides[0] - sides[1]) / 2e-4 == pytest.approx(J[:, column], rel=1e-5, abs=1e-6)


@pytest.mark.exhaustive
def test_random_and_mutated_certificates_are_never_wrongly_accepted():
    rng = np.random.default_rng(2)
    accepted = refused = 0
    for k in range(48):
        document = held_truth.machine(rng, nonlinear=k % 3 == 0, extra=k % 5 == 0)
        method = ("max", "sum", "energy", "lyapunov")[k % 4]
        if method == "lyapunov":
            document["system"]["links"][0].pop("natural", None)
        document["evidence"] = candidate(document, method, float(10 ** rng.uniform(-5, -2.5)), rng)
        for changed in (document, mutated(document, rng), mutated(document, rng)):
            try:
                certificate = made(changed, margin={})
            except InputError:
                continue
            value = held_truth.violation(changed, rng, 20)
            assert not (certificate.holds and value > 1e-9), (value, changed)
            accepted += certificate.holds
            refused += value > 0
    assert accepted > 30 and refused > 30


def mutated(document, rng):
    sections = ("system", "region", "evidence")
    names = {"between", "hot", "cold", "ambients", "method"}
    numeric = [path for section in sections for path in truth.leaves(document[section], (section,))
               if path[-2] != "between" and path[-1] not in names and "ambients" not in path]
    path = numeric[int(rng.integers(len(numeric)))]
    factor = float(rng.choice([-1.0, 0.5, 0.9, 1.1, 2.0, 4.0]))
    return truth.replaced(document, path, lambda value: truth.number(value) * factor)


@pytest.mark.exhaustive
def test_pairs_of_states_approach_each_other():
    """Not only derivatives: two states with the same loads and set-points, their currents solved from the balances."""
    rng, seen = np.random.default_rng(8), 0
    for _ in range(400):
        document = held_truth.machine(rng, nonlinear=True)
        document["evidence"] = candidate(document, "max", 1e-4, rng)
        if not made(document, margin={}).holds:
            continue
        holder = held_truth.held(document)
        free = [k for k, name in enumerate(document["system"]["lumps"]) if name not in holder]
        E = np.array([lump["capacity"] for lump in document["system"]["lumps"].values()])[free]
        d = np.array(document["evidence"]["weights"])
        for x, y, currents, others in held_truth.trajectories(document, rng, 40):
            e = (x - y)[free] / d
            speed = (held_truth.flow(document, x, currents) - held_truth.flow(document, y, others))[free] / E / d
            k = int(np.argmax(np.abs(e)))
            assert np.sign(e[k]) * speed[k] <= -1e-4 * abs(e[k]) * (1 - 1e-9)
            seen += 1
        if seen >= 300:
            break
    assert seen >= 300


def test_no_machine_of_the_parameter_ranges_violates_an_accepted_claim():
    rng = np.random.default_rng(6)
    accepted = violated = 0
    for k in range(40):
        document = held_truth.machine(rng, extra=k % 6 == 0)
        system, method = document["system"], ("max", "sum", "energy", "lyapunov")[k % 4]
        names = ["links.c0-p0.conductance", "links.sink-room.conductance", "links.sink-h0.conductance"]
        names += [f"modules.m0.{prop}.{key}" for prop in ("seebeck", "resistance", "conductance")
                  for key in ("value", "slope")] + ["lumps.h0.capacity"] * (method != "lyapunov")
        ranges = spans(system, names, rng, 4, 0.85, 1.1)
        evidence = candidate(document, method, float(10 ** rng.uniform(-5, -3)), rng)
        cert = made({"system": system, "region": {**document["region"], "parameters": ranges}, "evidence": evidence},
                    margin={})
        worst = max(held_truth.violation({"system": other, "region": document["region"], "evidence": evidence}, rng, 8)
                    for other in machines(system, ranges, rng, 5))
        assert not (cert.holds and worst > 1e-9), (cert.claim, worst)
        accepted += cert.holds
        violated += worst > 0
    assert accepted > 8 and violated > 8


@pytest.mark.parametrize(("change", "message"), [
    ({"setpoint": {}}, "no module holds"), ({"setpoint": {"x": [278, 278]}}, "not a module"),
    ({"setpoint": None}, "object"),
    ({"setpoint": {"m": [-5, 5]}}, "absolute zero"), ({"setpoint": {"m": [280, 270]}}, "is empty"),
    ({"temperature": {"hot": [300, 310], "cold": [280, 290]}}, "is held"), ({"temperature": {}}, "missing"),
    ({"temperature": [20, 10]}, "is empty"), ({"current": {}}, "missing"),
    ({"parameters": {"links.x-y.conductance": [1, 2]}}, "no such number")])
def test_malformed_regions_are_refused(change, message):
    document = one(1.0, (300.0, 330.0))
    document["region"] = {**document["region"], **change}
    with pytest.raises(InputError, match=message):
        made(document)


@pytest.mark.parametrize(("evidence", "message"), [
    ({"method": "best"}, "method"), ({"rate": -1}, "negative"), ({"weights": [1.0, 1.0]}, "2 numbers"),
    ({"method": "lyapunov"}, "matrix"), ({"method": "lyapunov", "matrix": []}, "rows")])
def test_malformed_evidence_is_refused(evidence, message):
    document = one(1.0, (300.0, 330.0))
    document["evidence"] = {**document["evidence"], **evidence}
    with pytest.raises(InputError, match=message):
        made(document)


def test_cascades_and_shared_cold_lumps_are_refused():
    document = one(1.0, (300.0, 330.0))
    twin = copy.deepcopy(document)
    twin["system"]["modules"]["n"] = document["system"]["modules"]["m"]
    twin["region"]["current"]["n"], twin["region"]["setpoint"]["n"] = [0, 1], [COLD, COLD]
    with pytest.raises(InputError, match="two modules hold"):
        made(twin)
    twin["system"]["modules"]["n"] = {**document["system"]["modules"]["m"], "hot": "cold", "cold": "hot"}
    with pytest.raises(InputError, match="no cascades"):
        made(twin)


def test_files_sentences_and_margins(tmp_path):
    certificate = made(one(1.0, (300.0, 330.0)))
    certificate.save(tmp_path / "c.json")
    assert verify(Certificate.load(tmp_path / "c.json")).valid
    assert "'cold' held exactly at one set-point in [278.15, 278.15] K" in certificate.claim
    changes = {"claim": certificate.claim.replace("1] A", "2] A"), "region": {**certificate.region, "current":
               {"m": [0.0, 1.1]}}, "margin": {"rate": 2 * certificate.margin["rate"]}, "evidence": {
                   **certificate.evidence, "weights": [0.0]}}
    for key, value in changes.items():
        assert not verify(Certificate(**{**vars(certificate), key: value})).valid, key
