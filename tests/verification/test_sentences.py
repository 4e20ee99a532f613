"""Sentences: every number printed is the number proven, and every sentence names its machine, plant and parameters."""

from __future__ import annotations

import re
from fractions import Fraction

import pytest

from robthermal.verification import establish, verify

# above one by less than a double can tell: to nearest it prints as "1"
ABOVE, BELOW = "1.00000000000000000001", "0.99999999999999999999"
ROD = {"name": "rod", "lumps": {"rod": {"capacity": 10.0}}, "ambients": ["room"], "modules": {},
       "links": [{"name": "rod-room", "between": ["rod", "room"], "conductance": 0.5}]}
LAG = {"A": [[-2]], "B": [[1]], "C": [[2]], "D": [[0]], "sample_time": 0}
FAST = {**LAG, "A": [["-1.5"]]}
HALF = {"A": [["0.5"]], "B": [[1]], "C": [["0.5"]], "D": [[0]], "sample_time": 1}
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
