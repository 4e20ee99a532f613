"""Sentences: every number printed is the number proven, and every sentence names its machine, plant and parameters."""

from __future__ import annotations

import hashlib
import re
import struct
from decimal import Decimal, localcontext
from fractions import Fraction

import certificate_truth as truth
import mutant_ellipsoid
import mutant_feedback
import mutant_linear
import mutant_scheduled
import mutant_thermal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robthermal.errors import InputError
from robthermal.verification import Certificate, claim_sentence, establish, machine_hash, same_system, verify
from robthermal.verification._numbers import decimal, exact

# above one by less than a double can tell: to nearest it prints as "1"
ABOVE, BELOW = "1.00000000000000000001", "0.99999999999999999999"
ROD = {"name": "rod", "lumps": {"rod": {"capacity": 10.0}}, "ambients": ["room"], "modules": {},
       "links": [{"name": "rod-room", "between": ["rod", "room"], "conductance": 0.5}]}
LAG = {"A": [[-2]], "B": [[1]], "C": [[2]], "D": [[0]], "sample_time": 0}
HALF = {"A": [["0.5"]], "B": [[1]], "C": [["0.5"]], "D": [[0]], "sample_time": 1}
SUBJECTS = {subject.kind: subject for subject in (*mutant_thermal.SUBJECTS, *mutant_linear.SUBJECTS,
                                                  *mutant_feedback.SUBJECTS, *mutant_ellipsoid.SUBJECTS,
                                                  *mutant_scheduled.SUBJECTS)}
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]\d+)?")


def numbers_in(sentence: str) -> list[Fraction]:
    """Return every number of a sentence that is none of a hash."""
    return [Fraction(word) for word in NUMBER.findall(re.sub(r"(machine|region|table) [0-9a-f]{12}", "", sentence))]


FALSE_SENTENCES = [
    ("hinf", LAG, {"bound": ABOVE}, {"method": "polynomial"}, ABOVE),  # gain exactly 1 at frequency zero
    ("frequency", LAG, {"form": "norm", "edges": [], "bounds": [ABOVE], "blocks": [["full", 1, 1]]}, {}, ABOVE),
    ("frequency", LAG, {"form": "radius", "edges": [], "envelopes": [[[1]]], "bound": ABOVE}, {}, ABOVE),
    ("stability", {**LAG, "A": [["-" + ABOVE]]}, {"rate": "1.000000000000000000009"}, {"method": "polynomial"},
     "-1.000000000000000000009"),
    ("stability", {**HALF, "A": [[BELOW]]}, {"rate": "0.000000000000000000009"}, {"method": "polynomial"},
     "0.999999999999999999991"),
    ("peak", HALF, {"bound": ABOVE}, {"method": "positive"}, ABOVE),
]


@pytest.mark.parametrize(("kind", "system", "region", "evidence", "number"), FALSE_SENTENCES)
def test_a_number_that_no_double_holds_is_printed_as_it_was_proven(kind, system, region, evidence, number):
    certificate = establish(kind, system=system, region=region, evidence=evidence, made_by={}, margin={})
    assert certificate.holds and verify(certificate).valid, certificate.reason
    assert Fraction(number) in numbers_in(certificate.claim), certificate.claim
    nearest = {Fraction(1), Fraction(-1)} if kind != "hinf" else {Fraction(1)}
    sizes = ("1 state", "1 input", "1 output", "1 by 1", "at 1 s", "1/s", "R^-1")
    words = certificate.claim
    for size in sizes:
        words = words.replace(size, "")
    assert not nearest & set(numbers_in(words)), certificate.claim


def test_the_numbers_of_thermal_sentences_are_exact_too():
    """Boxes, rates and ranges of more digits than a double has: the same decimals stand in the sentence."""
    region = {"temperature": ["279." + "9" * 20, "350." + "0" * 20 + "1"], "current": {}, "parameters": {
        "links.rod-room.conductance": ["0.4" + "9" * 20, "0.5" + "0" * 20 + "1"]}}
    evidence = {"method": "energy", "rate": "0.04" + "8" * 20}
    certificate = establish("contraction", system=ROD, region=region, evidence=evidence, made_by={}, margin={})
    printed = numbers_in(certificate.claim)
    for text in (*region["temperature"], *region["parameters"]["links.rod-room.conductance"], evidence["rate"]):
        assert Fraction(text) in printed, certificate.claim
    assert certificate.holds, certificate.reason
    assert "for all values of 1 parameter: 'links.rod-room.conductance' in [0.4" in certificate.claim


@settings(max_examples=300, deadline=None)
@given(st.decimals(allow_nan=False, allow_infinity=False, min_value=-10**20, max_value=10**20, places=28),
       st.floats(allow_nan=False, allow_infinity=False))
def test_decimals_are_exact_and_those_of_doubles_are_the_usual_ones(number, double):
    assert Fraction(decimal(exact(str(number), "here"))) == Fraction(number)
    usual = repr(double + 0.0)
    assert decimal(exact(double, "here")) == usual.removesuffix(".0")
    assert Fraction(decimal(exact(double.hex(), "here"))) == Fraction(double)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 10**30), st.integers(-12, 6))
def test_no_bound_is_printed_smaller_and_no_rate_larger_than_proven(digits, power):
    """One sentence of every form with a number of up to 31 digits: printed is that number, never the nearest."""
    text = f"{digits}e{power - 30}"
    value = Fraction(digits) * Fraction(10) ** (power - 30)
    share = f"0.{digits:031d}"
    pair = {"temperature": [280, 350], "current": {}}
    network = {"capacity": [1], "rows": [0], "cols": [0], "values": [-1]}
    sentences = [
        (claim_sentence("hinf", LAG, {"bound": text}, {"method": "polynomial"}), value),
        (claim_sentence("peak", LAG, {"bound": text}, {"method": "positive"}), value),
        (claim_sentence("frequency", LAG, {"form": "norm", "edges": [], "bounds": [text]}, {}), value),
        (claim_sentence("frequency", LAG, {"form": "norm", "edges": [1], "bounds": ["1e-9", text]}, {}),
         max(value, Fraction("1e-9"))),
        (claim_sentence("frequency", LAG, {"form": "radius", "edges": [], "envelopes": [[[1]]], "bound": text}, {}),
         value),
        (claim_sentence("stability", LAG, {"rate": text}, {"method": "polynomial"}), -value),
        (claim_sentence("stability", HALF, {"rate": share}, {"method": "polynomial"}), 1 - Fraction(share)),
        (claim_sentence("network", network, {}, {"rate": text, "weights": [1]}), value),
        (claim_sentence("network", network, {"uncertainty": share}, {"rate": 1, "weights": [1]}),
         100 * Fraction(share)),
        (claim_sentence("contraction", ROD, pair, {"method": "energy", "rate": text}), value),
        (claim_sentence("gain", ROD, pair, {"rate": text, "gains": {"heat": {"rod": [text]}}}), value),
        (claim_sentence("invariance", ROD, {**pair, "ambient": {"room": [290, 300]}, "heat": {"rod": [0, text]}}, {}),
         value),
    ]
    for sentence, expected in sentences:
        assert expected in numbers_in(sentence), (expected, sentence)


def nudged(value):
    """A number larger by a share of 1e-25, in decimals; texts and lists stay."""
    if isinstance(value, str) or isinstance(value, bool) or value == 0:
        return value
    return format(Decimal(repr(float(value))) * (1 + Decimal("1e-25")), "f")


@pytest.mark.parametrize("kind", sorted(SUBJECTS))
def test_no_number_of_machine_or_region_can_change_behind_the_sentence(kind):
    rng = np.random.default_rng(17)
    document = SUBJECTS[kind].make(rng)
    parts = {key: document[key] for key in ("system", "region", "evidence")}
    sentence = claim_sentence(kind, **parts)
    assert f"machine {machine_hash(parts['system'])}" in sentence
    assert re.search("nominal parameters|for all values of|for all conductances within", sentence)
    assert re.search("continuous plant|sampled model|as given, continuous|as given, sampled at|u = K" +
                     r"(\(w\))? y, (continuous|sampled at [^,]*), (of the plant as given|the average of)", sentence)
    changed = 0
    with localcontext() as context:
        context.prec = 60
        for section in ("system", "region"):
            paths = truth.leaves(parts[section], (section,))
            for k in rng.permutation(len(paths))[:25]:
                other = truth.replaced(parts, paths[k], nudged)
                if other == parts:
                    continue
                try:
                    assert claim_sentence(kind, **other) != sentence, paths[k]
                except InputError:
                    continue  # an index, or a range that no longer holds the machine's own number
                changed += 1
    assert changed > 2


def test_a_machine_is_its_names_numbers_and_order():
    other = {**ROD, "lumps": {"rod": {"capacity": "1e1", "comment": "brass"}}, "drawn_by": "me"}
    assert machine_hash(other) == machine_hash(ROD)  # the same numbers, and what no checker reads
    two = {**ROD, "lumps": {"rod": {"capacity": 10.0}, "tip": {"capacity": 10.0}}}
    assert len({machine_hash(system) for system in (
        ROD, {**ROD, "name": "bar"}, {**ROD, "ambients": ["room", "air"]}, two,
        {**two, "lumps": dict(reversed(two["lumps"].items()))},
        {**ROD, "lumps": {"rod": {"capacity": "10." + "0" * 25 + "1"}}},
        {**ROD, "links": [{**ROD["links"][0], "name": "x"}]}, {**ROD, "gain": [[1]]}, {**ROD, "gain": [[2]]})}) == 9
    numeric = {**ROD, "lumps": {"1e1": {"capacity": 1}, "10": {"capacity": 1}}, "links": []}
    one, ten = ({**numeric, "links": [{"between": [lump, "room"], "conductance": 1}]} for lump in ("1e1", "10"))
    assert machine_hash(one) != machine_hash(ten)  # names stay names, even those that look like numbers
    for a, b in ((LAG, {**LAG, "A": [["-2.0"]]}), ({**LAG, "A": np.array([[-2.0]])}, LAG)):
        assert machine_hash(a) == machine_hash(b)
    sparse = {"capacity": [1, 2.5], "rows": [0, 1], "cols": [0, 1], "values": [-1.0, "-0.5"]}
    arrays = {"capacity": np.array([1, 2.5]), "rows": np.array([0, 1]), "cols": np.array([0, 1]),
              "values": np.array([-1, -0.5])}
    assert machine_hash(sparse) == machine_hash(arrays) != machine_hash({**sparse, "values": [-1, -0.25]})


def test_the_hash_is_the_documented_one():
    """Computed here by hand from the definition in the reference: any program can do it."""
    def number(value):
        return "d" + struct.pack(">d", value).hex()

    link = f'["rod-room","rod","room",{number(0.5)},{number(0.0)},{number(0.0)},{number(0.0)}]'
    text = f'["thermal","rod",[["rod",{number(10.0)}]],["room"],[{link}],[]]'
    assert machine_hash(ROD) == hashlib.sha256(text.encode()).hexdigest()[:12]
    third = text.replace(number(10.0), "100000000000000000001/10000000000000000000")
    assert machine_hash({**ROD, "lumps": {"rod": {"capacity": "10.0000000000000000001"}}}) == hashlib.sha256(
        third.encode()).hexdigest()[:12]


def test_the_same_system_is_compared_exactly():
    box = {"temperature": [250.0, 400.0], "current": {}}
    good = establish("contraction", system=ROD, region=box, evidence={"method": "energy", "rate": 0.04}, made_by={})
    assert same_system(good, ROD) and same_system(good, {**ROD, "lumps": {"rod": {"capacity": "10"}}})
    assert not same_system(good, {**ROD, "lumps": {"rod": {"capacity": "10.00000000000000000001"}}})
    assert not same_system(good, {**ROD, "ambients": ["room", "air"]}) and not same_system(good, LAG)
    dressed = Certificate(**{**vars(good), "system": {**ROD, "gain": [[1]], "sensors": ["rod"]}})
    assert same_system(dressed, ROD) and not same_system(dressed, {**ROD, "gain": [[2]], "sensors": ["rod"]})


def test_a_certificate_says_that_it_is_not_verified_and_a_verdict_what_is():
    good = establish("hinf", system=LAG, region={"bound": 2}, evidence={"method": "polynomial"}, made_by={}, margin={})
    assert "claims (not verified here" in str(good) and good.claim in str(good)
    verdict = verify(good)
    assert verdict.claim == good.claim and f"valid: {good.claim}" in str(verdict)
    false = establish("hinf", system=LAG, region={"bound": "0.5"}, evidence={"method": "polynomial"}, made_by={})
    assert "does not hold" in str(false) and verify(false).claim == "" and str(verify(false)).startswith("not valid")
    edited = Certificate(**{**vars(good), "claim": good.claim.replace("below 2", "below 1")})
    assert not verify(edited).valid and verify(edited).claim == "" and "below 1" not in str(verify(edited))


def test_a_file_of_an_earlier_version_is_rejected_with_what_to_do():
    good = establish("hinf", system=LAG, region={"bound": 2}, evidence={"method": "polynomial"}, made_by={}, margin={})
    old = Certificate(**{**vars(good), "claim": "The linear system in continuous time with 1 states, 1 inputs and 1 "
                                               "outputs is stable, and the H-infinity norm of its transfer matrix is "
                                               "below 2."})
    assert not verify(old).valid and "Make the certificate again" in verify(old).reason


def test_many_ranges_are_counted_and_named_by_their_table():
    lumps = {f"l{k}": {"capacity": 1} for k in range(14)}
    system = {"lumps": lumps, "ambients": ["room"], "modules": {},
              "links": [{"between": [name, "room"], "conductance": 1} for name in lumps]}
    ranges = {f"lumps.{name}.capacity": [0.9, 1.1] for name in lumps}
    box = {"temperature": [280, 350], "current": {}, "parameters": ranges}
    evidence = {"method": "energy", "rate": 0.1}
    sentence = claim_sentence("contraction", system, box, evidence)
    assert re.search("for all values of 14 parameters of table [0-9a-f]{12}, contracts", sentence)
    wider = {**box, "parameters": {**ranges, "lumps.l3.capacity": ["0.89999999999999999999", 1.1]}}
    assert claim_sentence("contraction", system, wider, evidence) != sentence
