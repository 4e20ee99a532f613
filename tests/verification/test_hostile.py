"""What a hostile or careless file may contain: it ends in time, without surprise, and leaves no physics out."""

from __future__ import annotations

import copy
import json

import numpy as np
import pytest
import small_loop
from flint import arb, ctx
from observer_truth import rod as observed_rod

from robthermal.errors import InputError
from robthermal.verification import Certificate, establish, verify
from robthermal.verification._bernstein import largest_ratio
from robthermal.verification._definite import eliminate

MODULE = {"hot": "a", "cold": "b", "seebeck": {"value": 0.001, "slope": 0.0}, "reference_temperature": 300.0,
          "resistance": {"value": 4.0, "slope": 0.001}, "conductance": {"value": 0.03, "slope": 0.0}}
PAIR = {"lumps": {"a": {"capacity": 10.0}, "b": {"capacity": 5.0}}, "ambients": ["room"], "modules": {"m": MODULE},
        "links": [{"between": ["a", "room"], "conductance": 5.0}, {"between": ["b", "room"], "conductance": 5.0}]}
BOX = {"temperature": [280.0, 320.0], "current": {"m": [-0.1, 0.1]}}


def contraction(system, region=None, method="energy", **evidence):
    return establish("contraction", system=system, region=region or BOX, made_by={}, margin={},
                     evidence={"method": method, "rate": 0.0, **evidence})


@pytest.mark.parametrize(("place", "key", "value"), [
    (("modules", "m"), "thomson", 5.0), (("modules", "m"), "joule_split", 0.3), (("modules", "m"), "drive", {}),
    (("modules", "m"), "hysteresis", {}), (("links", 0), "step", {}), (("links", 0), "follow", {}),
    (("links", 0), "temperature_law", {}),
    (("lumps", "a"), "condensation", {}),
    (("lumps", "a"), "heat", 1.0), (("lumps", "a"), "gradient", 1.0), ((), "leads", [])])
def test_effects_that_no_claim_takes_into_account_are_refused(place, key, value):
    """They were read over once: the certificate was then about another machine than its file."""
    system = copy.deepcopy(PAIR)
    assert contraction(system).holds
    part = system
    for name in place:
        part = part[name]
    part[key] = value
    with pytest.raises(InputError, match=key):
        contraction(system)


UNKNOWN = [("system",), ("system", "lumps", "a"), ("system", "links", 0), ("system", "links", 0, "natural"),
           ("system", "modules", "m"), ("system", "modules", "m", "seebeck"), ("region",)]


@pytest.mark.parametrize("place", UNKNOWN, ids=lambda place: str(place[-1]))
def test_other_keys_are_free(place):
    """The format says so; the names of effects are not among them."""
    document = {"system": copy.deepcopy(PAIR), "region": copy.deepcopy(BOX)}
    document["system"]["links"][0]["natural"] = {"gain": 0.1, "exponent": 0.25}
    part = document
    for name in place:
        part = part[name]
    part.update(note="measured in May", source=None, batch=7, color=[1.0, 2.0], shop={"row": 3})
    assert contraction(**document).holds


@pytest.mark.parametrize(("key", "value", "message"), [
    ("temperature_unit", "degC", "temperature_unit"), ("inputs", {"foil": {"lump": "a", "power_slope": 0.5}}, "slope"),
    ("inputs", {"foil": {"lump": "a", "drive": {"gain": 0.1}}}, "drive"), ("inputs", [1.0], "not an object"),
    ("sensors", {"T": {"lump": "a", "self_heating": 0.1}}, "self_heating")])
def test_heaters_and_sensors_that_heat_otherwise_are_refused(key, value, message):
    """A heater whose power grows with its temperature is part of the Jacobian."""
    plain = {"temperature_unit": "K", "inputs": {"foil": {"lump": "a", "gain": 2.0, "limits": [0.0, 1.0]}},
             "sensors": {"T": {"lump": "a", "noise": 0.01, "time_constant": 5.0}}}
    assert contraction({**PAIR, **plain}).holds
    with pytest.raises(InputError, match=message):
        contraction({**PAIR, **plain, key: value})


def test_the_claim_of_a_box_that_is_never_left_says_that_there_is_no_other_heat():
    region = {**BOX, "ambient": {"room": [290.0, 300.0]}, "heat": {"a": [0.0, 1.0]}}
    claim = establish("invariance", system=PAIR, region=region, evidence={}, made_by={}).claim
    assert "heat load on 'a' in [0, 1] W" in claim and "with no other heat" in claim


@pytest.mark.parametrize("key", ["time_constant", "delay", "offset"])
def test_a_sensor_that_does_more_than_read_is_refused(key):
    document = observed_rod(0.2, 0.9)
    document["system"]["sensors"] = [{"name": "T", "lump": "rod", "gain": 1.0, key: 20.0}]
    with pytest.raises(InputError, match=key):
        establish("observer", **document, made_by={}, margin={})


def test_proofs_do_not_depend_on_the_precision_of_the_caller():
    nonlinear = copy.deepcopy(PAIR)
    nonlinear["links"][0]["natural"] = {"gain": 0.05, "exponent": 0.25}
    region = {**BOX, "ambient": {"room": [290.0, 300.0]}}
    evidence = {"rate": 0.0, "gains": {"ambients": {"room": [1.05, 1.02]}}}
    kinds = {"gain": (nonlinear, region, evidence),
             "invariance": (nonlinear, {**region, "temperature": [250.0, 330.0]}, {}),
             "contraction": (nonlinear, BOX, {"method": "energy", "rate": 0.4}),
             "loop": tuple(small_loop.document().values())}
    before = ctx.prec
    for kind, (system, box, given) in kinds.items():
        found = []
        for bits in (53, 2, 3000):
            ctx.prec = bits
            try:
                made = establish(kind, system=system, region=box, evidence=given, made_by={}, margin={})
                assert ctx.prec == bits
            finally:
                ctx.prec = before
            found.append((made.holds, made.reason))
        assert found[0] == found[1] == found[2] and found[0][0], (kind, found)


def test_a_bound_that_is_no_number_is_no_bound():
    assert largest_ratio([arb("nan"), arb(1)], [arb(1), arb(1)]) is None
    assert largest_ratio([arb(1), arb(0, "inf")], [arb(1), arb(1)]) is None
    assert largest_ratio([arb(-1), arb(1)], [arb(1), arb(2)]) < 1


def parallel(count, others=0):
    system = copy.deepcopy(PAIR)
    system["modules"] = {f"m{k}": MODULE for k in range(count)}
    for k in range(others):
        system["lumps"][f"x{k}"] = {"capacity": 3.0}
        system["links"].append({"between": [f"x{k}", "room"], "conductance": 1.0})
    return system, {**BOX, "current": {name: [-0.01, 0.01] for name in system["modules"]}}


def test_vertices_by_the_million_are_refused_before_they_are_listed():
    """14 modules between two lumps have 19 million vertices: once they were all listed."""
    for count in (14, 60):
        system, region = parallel(count)
        for method, evidence in (("energy", {}), ("lyapunov", {"matrix": [[10.0, 0.0], [0.0, 5.0]]})):
            refused = contraction(system, region, method, **evidence)
            assert not refused.holds and "too many vertices" in refused.reason
        assert contraction(system, region, "max", weights=[1.0, 1.0]).holds


@pytest.mark.exhaustive
def test_dense_matrices_beyond_reach_are_refused_before_they_are_factored():
    system, region = parallel(1, 670)
    n = len(system["lumps"])
    P = [[int(i == j) for j in range(n)] for i in range(n)]
    refused = contraction(system, region, "lyapunov", matrix=P)
    assert not refused.holds and "too large" in refused.reason
    refused = establish("observer", system={**system, "sensors": [], "gain": [[]] * n}, made_by={}, margin={},
                        region={**region, "sample_time": 1.0}, evidence={"matrix": P})
    assert not refused.holds and "too large" in refused.reason


def test_many_modules_at_known_temperatures_and_currents():
    """One vertex each, but a matrix of all their lumps: refused beyond what can be eliminated in time."""
    n = 800
    names = [f"x{k}" for k in range(n)]
    system = {"lumps": {name: {"capacity": 1.0} for name in names}, "ambients": ["room"],
              "links": [{"between": [name, "room"], "conductance": 5.0} for name in names],
              "modules": {f"m{k}": {**MODULE, "hot": names[k], "cold": names[k + 1]} for k in range(0, n, 2)}}
    region = {"temperature": [300.0, 300.0], "current": dict.fromkeys(system["modules"], [0.1, 0.1])}
    refused = contraction(system, region)
    assert not refused.holds and "too many" in refused.reason


def test_an_elimination_that_fills_up_is_given_up(monkeypatch):
    monkeypatch.setattr("robthermal.verification._definite._MOST_UPDATES", 1000)
    n = 40
    rows = [{j: arb(n if i == j else -0.1) for j in range(n)} for i in range(n)]
    assert eliminate(rows, set()) is not None


def test_exact_polynomials_with_too_many_digits_are_refused():
    rng = np.random.default_rng(0)
    digits = "".join(str(value) for value in rng.integers(0, 10, 1900))
    n = 120
    A = [[f"-1.{digits}" if i == j else "0" for j in range(n)] for i in range(n)]
    system = {"A": A, "B": [[1]] * n, "C": [[1] * n], "D": [[0]], "sample_time": 0}
    for kind, region, evidence in (("stability", {}, {"method": "polynomial"}), ("peak", {"bound": 1e3}, {
            "method": "positive"}), ("frequency", {"form": "norm", "edges": [], "bounds": [1e3]}, {})):
        refused = establish(kind, system=system, region=region, evidence=evidence, made_by={}, margin={})
        assert not refused.holds and "too many" in refused.reason


def test_intervals_and_channels_beyond_reach_are_refused():
    system = {"A": [[-1]], "B": [[1] * 120], "C": [[1]] * 120, "D": [[0] * 120] * 120, "sample_time": 0}
    edges = [1 + k / 100 for k in range(100)]
    refused = establish("frequency", system=system, evidence={}, made_by={}, margin={},
                        region={"form": "norm", "edges": edges, "bounds": [1e3] * 101})
    assert not refused.holds and "too many" in refused.reason


def test_numbers_at_the_end_of_the_floats_give_no_traceback():
    """The common bound of many vertices overflows in floats."""
    system, region = {"lumps": {}, "ambients": ["room"], "links": [], "modules": {}}, {"temperature": [1.0, 1e308],
                                                                                       "current": {}}
    for k in range(6):
        for face in ("h", "c"):
            system["lumps"][f"{face}{k}"] = {"capacity": 1.0}
            system["links"].append({"between": [f"{face}{k}", "room"], "conductance": 1e308})
        system["modules"][f"m{k}"] = {**MODULE, "hot": f"h{k}", "cold": f"c{k}",
                                      "seebeck": {"value": 1e308, "slope": -1e308},
                                      "conductance": {"value": -1e308, "slope": 1e300}}
        region["current"][f"m{k}"] = [-1e308, 1e308]
    refused = contraction(system, region)
    assert not refused.holds and refused.reason


def test_a_key_given_twice_among_very_many_is_found_at_once(tmp_path):
    path = tmp_path / "c.json"
    certificate = contraction(PAIR)
    certificate.save(path)
    text = path.read_text()
    many = ", ".join(f'"k{k}": 0' for k in range(50_000))
    path.write_text(text.replace("{", f'{{"extra": {{{many}, "k49999": 1}},', 1))
    with pytest.raises(InputError, match="'k49999' is given twice"):
        Certificate.load(path)


def test_large_boxes_are_read_and_bounded_in_time():
    """Six thousand lumps with ranges of their own: every lump looks at its own links only."""
    n = 6_000
    names = [f"x{k}" for k in range(n)]
    system = {"lumps": {name: {"capacity": 1.0} for name in names}, "ambients": ["room"], "modules": {},
              "links": [{"between": [name, "room"], "conductance": 1.0} for name in names]}
    region = {"temperature": {name: [280.0, 320.0] for name in names}, "current": {},
              "ambient": {"room": [290.0, 310.0]}}
    assert establish("invariance", system=system, region=region, evidence={}, made_by={}, margin={}).holds


def test_equal_verdicts_before_and_after_a_file(tmp_path):
    certificate = contraction(PAIR, method="max", weights=["0x1p0", "1.00"])
    certificate.save(tmp_path / "c.json")
    loaded = Certificate.load(tmp_path / "c.json")
    assert verify(loaded).valid and json.loads((tmp_path / "c.json").read_text())["evidence"]["weights"][0] == "0x1p0"
