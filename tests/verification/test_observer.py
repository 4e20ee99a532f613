"""Kinds "observer" and "gain": closed forms, sampled truth, mutated files, malformed files."""

from __future__ import annotations

import math

import certificate_truth as truth
import numpy as np
import pytest
from flint import arb, arb_mat
from observer_truth import ROD, error_matrix, machine, rod
from uncertain_truth import machines, names_of, spans

from robthermal.errors import InputError
from robthermal.verification import Certificate, establish, verify
from robthermal.verification._corners import is_positive


def made(document, kind="observer", margin=None):
    return establish(kind, **document, made_by={}, margin=margin)


def test_one_lump_shrinks_by_the_exponential():
    """M = exp(-g T/E) - l: the certificate holds exactly above |M|."""
    for gain, sensor in ((0.2, 1.0), (1.5, 1.0), (0.5, 2.0)):
        M = abs(math.exp(-0.5 * 2.0 / 10.0) - gain * sensor)
        assert made(rod(gain, M * (1 + 1e-9), sensor_gain=sensor)).holds
        assert not made(rod(gain, M * (1 - 1e-9), sensor_gain=sensor)).holds
    assert not made(rod(2.0, 1.0)).holds  # M = -1.095


def test_margin_is_proven_and_close():
    certificate = made(rod(0.2, 0.9))
    M = math.exp(-0.1) - 0.2
    assert certificate.margin["contraction"] == pytest.approx(0.9 - M, rel=0.02)
    larger = Certificate(**{**vars(certificate), "margin": {"contraction": 0.9 - M + 1e-6}})
    assert not verify(larger).valid and "stored margin" in verify(larger).reason


@pytest.mark.parametrize("hint", [math.nan, math.inf, -math.inf, 0.5])
def test_a_wrong_hint_costs_time_and_no_margin(hint, monkeypatch):
    """Floats say where to look for the margin; what they say wrongly is found out by the proof."""
    rng = np.random.default_rng(8)
    found = [each for each in (made(with_energy(machine(rng), 1.0)) for _ in range(6)) if each.holds]
    assert len(found) >= 3 and all(verify(each).valid and each.margin["contraction"] > 0 for each in found)
    monkeypatch.setattr("robthermal.verification._observer._Inequality.hint", lambda *some: hint)
    for each in found:
        again = establish("observer", system=each.system, region=each.region, evidence=each.evidence, made_by={})
        assert again.margin == each.margin


def test_the_margin_is_that_of_the_worst_operating_point():
    """Sampled: the inequality holds with the margin taken off; 5 % more is not proven."""
    rng = np.random.default_rng(8)
    held = [(each, margin) for each, margin in ((each, made(with_energy(each, 1.0)).margin) for each in
                                                (machine(rng) for _ in range(8))) if margin]
    assert len(held) >= 4
    for document, margin in held:
        assert violation(with_energy(document, 1.0 - margin["contraction"]), rng) < 0
        assert not made(with_energy(document, 1.0 - 1.05 * margin["contraction"]), margin={}).holds


def with_energy(document, contraction):
    E = [lump["capacity"] for lump in document["system"]["lumps"].values()]
    return {**document, "evidence": {"matrix": np.diag(E).tolist(), "contraction": contraction}}


def violation(document, rng, count=40, nominal=None):
    P = np.array([[truth.number(value) for value in row] for row in document["evidence"]["matrix"]])
    c = truth.number(document["evidence"]["contraction"])
    worst = -float(np.linalg.eigvalsh((P + P.T) / 2)[0])
    for x, currents in truth.points(document["system"], document["region"], rng, count):
        M = error_matrix(document, x, currents, nominal)
        worst = max(worst, float(np.linalg.eigvalsh(M.T @ P @ M - c**2 * P)[-1] / np.linalg.norm(P, 2)))
    return worst


@pytest.mark.exhaustive
def test_random_and_mutated_observers_are_never_wrongly_accepted():
    rng = np.random.default_rng(4)
    accepted = refused = 0
    for _ in range(60):
        document = machine(rng)
        E = [lump["capacity"] for lump in document["system"]["lumps"].values()]
        document["evidence"] = {"matrix": np.diag(E).tolist(), "contraction": 1.0}
        for changed in (document, mutated(document, rng), mutated(document, rng)):
            try:
                certificate = made(changed, margin={})
            except InputError:
                continue
            value = violation(changed, rng)
            assert not (certificate.holds and value > 1e-9), changed
            accepted += certificate.holds
            refused += value > 0
    assert accepted > 15 and refused > 15


def mutated(document, rng):
    sections = ("system", "region", "evidence")
    numeric = [path for section in sections for path in truth.leaves(document[section], (section,))
               if not {"between", "hot", "cold", "ambients", "sensors"} & set(path)]
    path = numeric[int(rng.integers(len(numeric)))]
    factor = float(rng.choice([-1.0, 0.5, 0.9, 1.1, 4.0]))
    return truth.replaced(document, path, lambda value: truth.number(value) * factor)


@pytest.mark.parametrize(("path", "value", "message"), [
    (("system", "sensors"), None, "sensors"), (("system", "sensors"), ["attic"], "not a lump"),
    (("system", "gain"), [[0.1, 0.2]], "gain"), (("system", "gain"), [], "rows"),
    (("region", "sample_time"), 0.0, "not positive"), (("region", "sample_time"), "NaN", "not a number"),
    (("evidence", "contraction"), 1.5, "at most 1"), (("evidence", "matrix"), [[1.0], [2.0]], "matrix"),
    (("region", "parameters"), {"lumps.rod.capacity": [9, 11]}, "uncertain")])
def test_malformed_observers_are_refused(path, value, message):
    document = rod(0.2, 0.9)
    document[path[0]] = {**document[path[0]], path[1]: value}
    with pytest.raises(InputError, match=message):
        made(document)


def test_hopeless_observers_are_not_proven():
    assert "too long" in made(rod(0.2, 0.9, sample_time=1e9)).reason
    floating = rod(0.2, 0.9)
    floating["system"] = {**floating["system"], "links": []}
    assert "no path to an ambient" in made(floating).reason


def test_an_uncertain_conductance_that_plant_and_observer_share():
    """M = exp(-g T/E) - l + Γ (g - g_p), Γ = (1 - exp(-g T/E))/g, largest at the least g_p."""
    decay = math.exp(-0.5 * 2.0 / 10.0)
    M = decay - 0.2 + (1 - decay) / 0.5 * (0.5 - 0.3)
    for factor, holds in ((1 + 1e-9, True), (1 - 1e-9, False)):
        document = rod(0.2, M * factor)
        document["region"] = {**document["region"], "parameters": {"links.rod-room.conductance": [0.3, 0.6]}}
        certificate = made(document)
        assert certificate.holds is holds
    assert "'links.rod-room.conductance' in [0.3, 0.6], the same in plant and observer" in certificate.claim


@pytest.mark.exhaustive
def test_no_machine_of_the_ranges_violates_an_accepted_observer():
    rng = np.random.default_rng(9)
    accepted = violated = 0
    for _ in range(40):
        document = machine(rng)
        E = [lump["capacity"] for lump in document["system"]["lumps"].values()]
        document["evidence"] = {"matrix": np.diag(E).tolist(), "contraction": 1.0}
        ranges = spans(document["system"], names_of(document["system"]), rng, 3)
        cert = made({**document, "region": {**document["region"], "parameters": ranges}}, margin={})
        worst = max(violation({**document, "system": other}, rng, 8, document["system"])
                    for other in machines(document["system"], ranges, rng, 6))
        assert not (cert.holds and worst > 1e-9), cert.claim
        accepted += cert.holds
        violated += worst > 0
    assert accepted > 4 and violated > 4


def gain_document(value, rate=0.01):
    return {"system": ROD, "region": {"temperature": [280.0, 350.0], "current": {}},
            "evidence": {"rate": rate, "gains": {"ambients": {"room": [value]}, "heat": {"rod": [2.6]}}}}


def test_gain_of_one_lump_is_one_over_its_conductance():
    """-g d + b <= -rate E d: K/K 0.5/(0.5 - 0.1) = 1.25 exactly, K/W 2.5."""
    assert made(gain_document(1.25), "gain").holds
    assert not made(gain_document(1.2499999), "gain").holds
    negative = made(gain_document(-1.25), "gain")
    assert not negative.holds and "not positive" in negative.reason


@pytest.mark.parametrize(("gains", "message"), [
    ({}, "no disturbance"), ({"ambients": {"attic": [1.0]}}, "not an ambient"), ({"heat": {"x": [1.0]}}, "not a lump"),
    ({"wind": {"room": [1.0]}}, "unknown key"), ({"ambients": {"room": [1.0, 2.0]}}, "2 numbers")])
def test_malformed_gains_are_refused(gains, message):
    document = gain_document(1.25)
    document["evidence"] = {"rate": 0.0, "gains": gains}
    with pytest.raises(InputError, match=message):
        made(document, "gain")


def test_files_survive_saving(tmp_path):
    for document, kind in ((rod(0.2, 0.9), "observer"), (gain_document(1.25), "gain")):
        certificate = made(document, kind)
        certificate.save(tmp_path / "c.json")
        assert verify(Certificate.load(tmp_path / "c.json")).valid
        other = Certificate(**{**vars(certificate), "claim": certificate.claim.replace("rod", "bar")})
        assert not verify(other).valid


def test_definiteness_is_never_wrong():
    """Matrices with a smallest eigenvalue known from their construction, down to the last digits."""
    rng = np.random.default_rng(0)
    for n in (1, 2, 5, 20, 60):
        B = rng.integers(-3, 4, (n, n)).astype(float)
        gram = B @ B.T  # integers: exact, positive semidefinite
        for shift, definite in ((1.0, True), (1e-6, True), (-1e-6, None), (-1.0, None)):
            A = gram + shift * np.eye(n)
            proven = is_positive(arb_mat(A.tolist()))
            smallest = np.linalg.eigvalsh(A)[0]
            assert not (proven and smallest < -1e-10)
            assert proven or not definite
    for bad in (np.ones((3, 3)), -np.eye(2)):
        assert not is_positive(arb_mat(bad.tolist()))
    wide = arb(0, 1.1)  # the matrix contains [[1, 1.1], [1.1, 1]], which is indefinite
    assert not is_positive(arb_mat([[arb(1), wide], [wide, arb(1)]]))
