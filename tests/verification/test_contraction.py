"""Contraction certificates against sampled truth, the reference table, and systems that must not be certified."""

from __future__ import annotations

import copy
import tomllib
from pathlib import Path

import certificate_truth as truth
import numpy as np
import pytest
import scipy.linalg
from flint import ctx

from robthermal.errors import InputError
from robthermal.verification import Certificate, claim_sentence, establish, not_certified, verify

METHODS = ("sum", "max", "energy", "lyapunov")


def make(system, region, evidence, margin=None):
    return establish("contraction", system=system, region=region, evidence=evidence, made_by={"test": 1}, margin=margin)


def rod(**changes):
    system = {"lumps": {"a": {"capacity": 2.0}, "b": {"capacity": 1.0}}, "ambients": ["room"], "modules": {},
              "links": [{"between": ["a", "b"], "conductance": 1.0}, {"between": ["a", "room"], "conductance": 0.5}]}
    return {**system, **changes}


def passive(**changes):
    return {"temperature": [280.0, 350.0], "current": {}, **changes}


def two_module(shared: Path, *, constant: bool = False):
    table = tomllib.loads((shared / "systems" / "two_module.toml").read_text())
    modules = {}
    for name, module in table["modules"].items():
        modules[name] = {key: module[key] for key in ("hot", "cold", "seebeck", "resistance", "conductance")}
        modules[name]["reference_temperature"] = module["reference_temperature"] + 273.15
        if constant:
            for key in ("seebeck", "resistance"):
                modules[name][key] = {**module[key], "slope": 0.0}
    return {"lumps": {k: {"capacity": v["capacity"]} for k, v in table["lumps"].items()},
            "ambients": list(table["ambients"]), "links": table["links"], "modules": modules}


def region_of(system, low, high):
    return {"temperature": [278.0, 358.0], "current": {name: [low, high] for name in system["modules"]}}


def limit(system, method, direction, rng, steps=9):
    """Largest current that is certified, by bisection."""
    low, high = 0.5, 20.0
    for _ in range(steps):
        c = (low + high) / 2
        region = region_of(system, *{"symmetric": (-c, c), "cooling": (0.0, c), "heating": (-c, 0.0)}[direction])
        holds = make(system, region, truth.evidence_for(method, system, region, 0.0, rng), {}).holds
        low, high = (c, high) if holds else (low, c)
    return low


@pytest.mark.parametrize(("method", "constant", "direction", "reference"), [
    ("energy", False, "symmetric", 2.72), ("energy", False, "cooling", 5.51), ("energy", False, "heating", 2.72),
    ("energy", True, "symmetric", 4.93), ("energy", True, "cooling", 17.04), ("energy", True, "heating", 4.93),
    ("sum", False, "symmetric", 2.54), ("sum", False, "cooling", 5.54), ("sum", False, "heating", 2.72),
    ("max", False, "symmetric", 2.18), ("max", False, "cooling", 5.22), ("max", False, "heating", 2.62)])
def test_reference_table(shared, method, constant, direction, reference):
    system = two_module(shared, constant=constant)
    found = limit(system, method, direction, np.random.default_rng(1), steps=12 if method == "energy" else 10)
    assert found == pytest.approx(reference, rel=0.012, abs=0.025)


def test_eighteen_lumps_are_verified_in_a_blink(shared, tmp_path, capsys):
    system = two_module(shared)
    region = region_of(system, -1.5, 1.5)
    for method in METHODS:
        rng = np.random.default_rng(0)
        evidence = truth.evidence_for(method, system, region, 0.001, rng)
        if method == "lyapunov":
            evidence["matrix"] = np.diag([lump["capacity"] for lump in system["lumps"].values()])
        certificate = make(system, region, evidence)
        assert certificate.holds, certificate.reason
        certificate.save(tmp_path / "c.json")
        verdict = verify(Certificate.load(tmp_path / "c.json"))
        assert verdict.valid and verdict.margins["rate"] > 0
        with capsys.disabled():
            print(f"\n18 lumps, {method}: verified in {verdict.seconds * 1e3:.1f} ms", end="")


@pytest.mark.exhaustive
def test_decay_of_reference(shared):
    """The largest proven rate is that of the generalized eigenvalues at the vertices of the box, and below it."""
    system = two_module(shared)
    E = np.diag([lump["capacity"] for lump in system["lumps"].values()])
    for low, high in ((0.0, 3.3), (-1.5, 1.5)):
        region = region_of(system, low, high)
        certificate = make(system, region, {"method": "energy", "rate": 0.0})
        samples = [truth.jacobian(system, x, i) for x, i in truth.points(system, region, np.random.default_rng(0), 800)]
        rate = min(-scipy.linalg.eigh((J + J.T) / 2, E, eigvals_only=True)[-1] for J in samples)
        assert certificate.margin["rate"] == pytest.approx(rate, rel=0.02)
        assert certificate.margin["rate"] < rate


@pytest.mark.parametrize("method", METHODS)
def test_margin_is_the_largest_rate(method):
    """One lump, no module: the decay rate is g/C exactly."""
    system = {"lumps": {"a": {"capacity": 4.0}}, "ambients": ["room"], "modules": {},
              "links": [{"between": ["room", "a"], "conductance": 0.5}]}
    extra = {"sum": {"weights": [3.0]}, "max": {"weights": [3.0]}, "energy": {}, "lyapunov": {"matrix": [[7.0]]}}
    certificate = make(system, passive(), {"method": method, "rate": 0.025, **extra[method]})
    assert certificate.margin["rate"] == pytest.approx(0.1, rel=0.02)
    assert certificate.margin["rate"] < 0.1
    assert not make(system, passive(), {"method": method, "rate": 0.125001, **extra[method]}).holds
    assert make(system, passive(), {"method": method, "rate": 0.124999, **extra[method]}).holds


@pytest.mark.parametrize("method", METHODS)
def test_no_path_to_ambient_is_never_certified(method):
    system = rod(links=[{"between": ["a", "b"], "conductance": 1.0}])
    evidence = truth.evidence_for(method, system, passive(), 0.0, np.random.default_rng(0))
    assert not make(system, passive(), evidence).holds


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("method", METHODS)
def test_never_valid_where_a_sample_violates(method, seed):
    """Random systems (slopes of any sign, shared lumps, convection, radiation) around their limit."""
    rng = np.random.default_rng([seed, METHODS.index(method)])
    system = truth.random_system(rng, modules=2, nonlinear=seed % 3 == 1, wild=seed % 2 == 1)
    held = 0
    for top in (0.5, 1.5, 2.5, 4.0, 8.0):
        region = truth.box(system, top)
        certificate = make(system, region, truth.evidence_for(method, system, region, 0.0, rng), {})
        document = {"system": system, "region": region, "evidence": certificate.evidence}
        if certificate.holds:
            held += 1
            assert truth.violation(document, rng, 80) <= 1e-9
            assert truth.frozen_abscissa(document, rng, 80) < 0
    assert held == 0 if method == "lyapunov" and seed % 3 == 1 else held >= 4  # no full P with convection


@pytest.mark.exhaustive
@pytest.mark.parametrize("method", METHODS)
def test_not_more_cautious_than_the_samples(method):
    """The checker must not refuse what is true with a small distance: 10 different systems, dense samples."""
    rng = np.random.default_rng(5)
    decided = 0
    for _ in range(10):
        system = truth.random_system(rng, modules=1)
        region = truth.box(system, float(rng.uniform(0.5, 3)))
        evidence = truth.evidence_for(method, system, region, 0.0, rng)
        document = {"system": system, "region": region, "evidence": evidence}
        value = truth.violation(document, rng, 400)
        if abs(value) > 1e-6:
            decided += 1
            assert make(system, region, evidence, {}).holds == (value < 0)
    assert decided > 7


@pytest.mark.exhaustive
@pytest.mark.parametrize("method", METHODS)
def test_mutations(method):
    """Whatever is changed in a valid file, the checker never says valid where a sample says false."""
    rng = np.random.default_rng(METHODS.index(method))
    system = truth.random_system(rng, modules=2)
    region = truth.box(system, 1.0)
    good = make(system, region, truth.evidence_for(method, system, region, 1e-3, rng))
    assert good.holds
    tight = {**good.evidence, "rate": 1e-3 + 0.95 * good.margin["rate"]}
    document = {"system": good.system, "region": good.region, "evidence": tight}
    assert make(**document, margin={}).holds
    rejected = 0
    for _ in range(60):
        changed = truth.mutate(document, rng)
        try:
            valid = make(changed["system"], changed["region"], changed["evidence"], {}).holds
        except InputError:
            valid = False
        rejected += not valid
        if valid:
            assert truth.violation(changed, rng, 60) <= 1e-9
    assert rejected > 10


def test_opposite_modules_and_negative_off_diagonals():
    """Far beyond the cooperative range the off-diagonals turn negative: they count by absolute value."""
    module = {"hot": "a", "cold": "b", "seebeck": {"value": 0.0, "slope": -1e-3},
              "resistance": {"value": 1.0, "slope": 0.0}, "conductance": {"value": 0.0, "slope": 0.0},
              "reference_temperature": 300.0}
    system = rod(modules={"m": module}, links=[{"between": [k, "room"], "conductance": 1.0} for k in "ab"])
    region = {"temperature": [300.0, 300.0], "current": {"m": [8.0, 8.0]}}
    J = truth.jacobian(system, np.array([300.0, 300.0]), {"m": 8.0})
    assert J[0, 1] == pytest.approx(-1.2)  # and J_hh = -1 - 1.2
    for method in ("sum", "max"):
        evidence = {"method": method, "rate": 0.0, "weights": [1.0, 1.0]}
        document = {"system": system, "region": region, "evidence": evidence}
        expected = truth.violation(document, np.random.default_rng(0)) < 0
        assert make(system, region, evidence).holds == expected


@pytest.mark.parametrize("nonlinear", [{"natural": {"gain": 5.0, "exponent": 0.25}}, {"radiation": 1e-7}])
def test_links_that_are_not_linear(nonlinear):
    """Strong convection or radiation helps a lump and feeds its neighbor: the sum must notice unequal weights."""
    system = rod()
    system["links"][0] = {**system["links"][0], **nonlinear}
    evidence = {"method": "sum", "rate": 0.0, "weights": [1.0, 1.2]}
    assert make(rod(), passive(), evidence).holds is True
    good = make(system, passive(), evidence)
    assert truth.violation({"system": system, "region": passive(), "evidence": evidence},
                           np.random.default_rng(0), 200) > 0
    assert good.holds is False
    assert "'a'" in good.reason or "'b'" in good.reason


def test_energy_with_radiation_is_sharp_enough_and_safe():
    system, held = rod(), []
    for strength in (1e-9, 1e-8, 1e-7, 1e-6):
        system["links"][0] = {**system["links"][0], "radiation": strength}
        document = {"system": system, "region": passive(), "evidence": {"method": "energy", "rate": 0.0}}
        if make(system, passive(), document["evidence"]).holds:
            held.append(strength)
            assert truth.violation(document, np.random.default_rng(0), 400) < 0
    assert held == [1e-9, 1e-8]


def test_lyapunov_refines_the_current():
    """A full P far from E with a wide current box is only proven with a finer hull, and never beyond the truth."""
    rng = np.random.default_rng(3)
    system = truth.random_system(rng, modules=1)
    held = []
    for top in np.linspace(0.5, 12.0, 12):
        region = truth.box(system, float(top))
        evidence = truth.evidence_for("lyapunov", system, region, 0.0, rng)
        document = {"system": system, "region": region, "evidence": evidence}
        if make(system, region, evidence, {}).holds:
            held.append(float(top))
            assert truth.violation(document, rng, 300) < 0
    assert 6 <= len(held) < 12  # the last ones are beyond what can be proven


def test_many_modules_use_a_common_bound():
    """Seven separate modules with 8^7 vertices are still decided, and safely."""
    rng = np.random.default_rng(0)
    system = truth.random_system(rng, modules=7)
    certificate = make(system, truth.box(system, 0.5), {"method": "energy", "rate": 0.0}, {})
    assert certificate.holds
    assert not make(system, truth.box(system, 9.0), {"method": "energy", "rate": 0.0}, {}).holds


def test_a_thousand_lumps():
    n = 1000
    names = [f"x{k}" for k in range(n)]
    links = [{"between": [a, b], "conductance": 2.0} for a, b in zip(names[:-1], names[1:], strict=True)]
    links += [{"between": [a, b], "conductance": 1.0} for a, b in zip(names[:-30], names[30:], strict=True)]
    links += [{"between": [name, "room"], "conductance": 0.01} for name in names]
    system = {"lumps": {name: {"capacity": 1.0} for name in names}, "ambients": ["room"], "links": links, "modules": {}}
    for evidence in ({"method": "energy", "rate": 0.0099}, {"method": "sum", "rate": 0.01, "weights": [1] * n}):
        assert make(system, passive(), evidence, {}).holds
        assert not make(system, passive(), {**evidence, "rate": 0.0101}, {}).holds


def test_stored_margin_larger_than_true_is_rejected():
    for method, extra in (("energy", {}), ("sum", {"weights": [1.0, 1.1]}), ("max", {"weights": [1.0, 1.1]}),
                          ("lyapunov", {"matrix": [[2.0, 0.0], [0.0, 1.0]]})):
        good = make(rod(), passive(), {"method": method, "rate": 0.0, **extra})
        assert good.holds and good.margin["rate"] > 0
        fields = {name: getattr(good, name) for name in ("kind", "claim", "system", "region", "evidence", "made_by")}
        for factor, expected in ((0.5, True), (0.0, True), (-1.0, True), (1.05, False), (1e300, False)):
            verdict = verify(Certificate(**fields, margin={"rate": good.margin["rate"] * factor}))
            assert verdict.valid is expected
            if not expected:
                assert "stored margin" in verdict.reason


def test_claim_is_the_one_of_the_data():
    good = make(rod(), passive(), {"method": "energy", "rate": 0.01})
    assert good.claim == claim_sentence("contraction", rod(), passive(), {"method": "energy", "rate": 0.01})
    for wider in (passive(temperature=[270.0, 350.0]), passive(temperature=[280.0, 351.0])):
        changed = Certificate(**{**vars(good), "region": wider})
        assert not verify(changed).valid and "claim" in verify(changed).reason
    assert not verify(Certificate(**{**vars(good), "claim": good.claim.replace("0.01", "0.02")})).valid


def test_no_is_an_answer(tmp_path):
    refused = make(rod(), passive(), {"method": "energy", "rate": 10.0})
    assert refused.holds is False and refused.reason and refused.claim.startswith("Not certified")
    refused.save(tmp_path / "c.json")
    verdict = verify(Certificate.load(tmp_path / "c.json"))
    assert verdict.valid is False and verdict.reason == refused.reason
    nothing = not_certified("contraction", system=rod(), region=passive(), evidence={}, made_by={}, reason="no weights")
    assert verify(nothing).reason == "no weights"
    dressed = Certificate(**{**vars(refused), "holds": True, "claim": refused.claim.removeprefix("Not certified: ")})
    assert verify(dressed).valid is False


def test_strict_when_rate_is_zero():
    """A lump that only exchanges heat has a column sum of exactly zero: not contracting, and not certified."""
    system = rod()
    assert not make(system, passive(), {"method": "sum", "rate": 0, "weights": [1, 1]}).holds
    assert make(system, passive(), {"method": "sum", "rate": 0, "weights": ["0.9999999999", 1]}).holds


@pytest.mark.parametrize("weights", [[1.0, 0.0], [1.0, -1.0], [-1.0, -1.0]])
def test_weights_must_be_positive(weights):
    certificate = make(rod(), passive(), {"method": "max", "rate": 0.0, "weights": weights})
    assert not certificate.holds and "weight" in certificate.reason


def test_matrix_must_be_symmetric_and_positive():
    for matrix, word in (([[2.0, 0.1], [0.2, 1.0]], "symmetric"), ([[2.0, 3.0], [3.0, 1.0]], "P > 0"),
                         ([[-2.0, 0.0], [0.0, -1.0]], "P > 0"), ([[0.0, 0.0], [0.0, 0.0]], "P > 0")):
        certificate = make(rod(), passive(), {"method": "lyapunov", "rate": 0.0, "matrix": matrix})
        assert not certificate.holds and word in certificate.reason


def test_precision_is_restored_and_a_low_one_does_not_matter():
    before = ctx.prec
    ctx.prec = 20
    try:
        assert make(rod(), passive(), {"method": "energy", "rate": 0.01}).holds
        assert not make(rod(), passive(), {"method": "energy", "rate": 1.0}).holds
        assert ctx.prec == 20
    finally:
        ctx.prec = before


def test_the_digits_count():
    """0.1 is one tenth: the boundary rate of 0.1/1 is accepted, the binary number above it is not."""
    system = {"lumps": {"a": {"capacity": 1}}, "ambients": ["room"], "modules": {},
              "links": [{"between": ["a", "room"], "conductance": "0.1"}]}
    for rate, expected in ((0.1, True), ("0.1", True), ((0.1).hex(), False), ("0.1" + 40 * "0" + "1", False)):
        assert make(system, passive(), {"method": "sum", "rate": rate, "weights": [1]}).holds is expected


def bad(change):
    document = copy.deepcopy({"system": rod(), "region": passive(), "evidence": {"method": "energy", "rate": 0.0}})
    change(document)
    return document


@pytest.mark.parametrize(("change", "words"), [
    (lambda d: d["system"]["lumps"]["a"].update(capacity=-3.0), "capacity"),
    (lambda d: d["system"]["lumps"]["a"].update(capacity=True), "capacity"),
    (lambda d: d["system"]["lumps"]["a"].update(capacity=""), "capacity"),
    (lambda d: d["system"]["lumps"]["a"].update(capacity=float("nan")), "capacity"),
    (lambda d: d["system"]["lumps"]["a"].update(capacity="1_0"), "capacity"),
    (lambda d: d["system"]["lumps"]["a"].update(capacity=" 1"), "capacity"),
    (lambda d: d["system"]["lumps"]["a"].update(capacity="1e999"), "range of a float"),
    (lambda d: d["system"]["lumps"]["a"].update(capacity="0x1p5000"), "range of a float"),
    (lambda d: d["system"]["lumps"]["a"].update(capacity=10**400), "range of a float"),
    (lambda d: d["system"]["lumps"]["a"].clear(), "capacity"),
    (lambda d: d["system"].update(lumps={}), "lumps"),
    (lambda d: d["system"].pop("modules"), "modules"),
    (lambda d: d["system"]["links"][0].update(conductance=-1.0), "negative"),
    (lambda d: d["system"]["links"][0].update(between=["a", "c"]), "'c'"),
    (lambda d: d["system"]["links"][0].update(between=["a", "a"]), "itself"),
    (lambda d: d["system"]["links"][0].update(between=["a"]), "two"),
    (lambda d: d["system"].update(ambients=["room", "a"]), "twice"),
    (lambda d: d["region"].update(temperature=[350.0, 280.0]), "empty"),
    (lambda d: d["region"].update(temperature=[-5.0, 80.0]), "absolute zero"),
    (lambda d: d["region"].update(temperature={"a": [280, 350]}), "'b'"),
    (lambda d: d["region"].update(temperature={"a": [280, 350], "b": [280, 350], "c": [1, 2]}), "'c'"),
    (lambda d: d["region"].update(current={"m": [0, 1]}), "'m'"),
    (lambda d: d["region"].pop("current"), "current"),
    (lambda d: d["evidence"].update(rate=-0.1), "negative"),
    (lambda d: d["evidence"].update(rate=None), "rate"),
    (lambda d: d["evidence"].update(method="magic"), "method"),
    (lambda d: d["evidence"].update(method="sum"), "weights"),
    (lambda d: d["evidence"].update(method="sum", weights=[1.0]), "one per lump"),
    (lambda d: d["evidence"].update(method="lyapunov", matrix=[[1.0, 0.0]]), "one per lump"),
])
def test_malformed_content(change, words):
    document = bad(change)
    with pytest.raises(InputError) as caught:
        make(document["system"], document["region"], document["evidence"])
    assert words in str(caught.value)
