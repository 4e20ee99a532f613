"""The file: exact round trip, and every way it can be unreadable. Only InputError or a Verdict ever comes out."""

from __future__ import annotations

import json
import os
import random
from dataclasses import replace
from decimal import Decimal

import numpy as np
import pytest

from robthermal.errors import InputError
from robthermal.verification import Certificate, Verdict, claim_sentence, establish, verify

SYSTEM = {"lumps": {"a": {"capacity": 2.0}, "b": {"capacity": 1.5}}, "ambients": ["room"],
          "links": [{"between": ["a", "b"], "conductance": 1.0}, {"between": ["a", "room"], "conductance": 0.5}],
          "modules": {"m": {"hot": "a", "cold": "b", "seebeck": {"value": 0.05, "slope": 7e-5},
                            "resistance": {"value": 4.5, "slope": 0.02}, "conductance": {"value": 0.3, "slope": 0.0},
                            "reference_temperature": 308.15}}}
REGION = {"temperature": [280.0, 350.0], "current": {"m": [-0.1, 0.1]}}
NETWORK = {"capacity": [1.0, 2.0], "rows": [0, 0, 1, 1], "cols": [0, 1, 0, 1], "values": [-2.0, 1.0, 1.0, -1.5]}


def certificates():
    """One certificate of every kind and method."""
    def contraction(**evidence):
        return establish("contraction", system=SYSTEM, region=REGION, evidence={"rate": 0.001, **evidence}, made_by={})

    yield contraction(method="energy")
    yield contraction(method="sum", weights=[1.0, 1.1])
    yield contraction(method="max", weights=[1.0, 1.1])
    yield contraction(method="lyapunov", matrix=np.diag([2.0, 1.5]))
    yield establish("invariance", system={**SYSTEM, "modules": {}}, evidence={}, made_by={},
                    region={"temperature": [280.0, 350.0], "current": {}, "ambient": {"room": [290.0, 300.0]}})
    yield establish("runaway", region={}, made_by={}, evidence={"current": [1.5, 1.6], "load": [3.0, 5.0]},
                    system={"seebeck": 0.053743, "resistance": 4.6298, "conductance": 0.2968, "sink_conductance": 0.689,
                            "sink_temperature": 298.15, "setpoint": 278.15})
    yield establish("network", system=NETWORK, region={}, made_by={}, evidence={"rate": 0.1, "weights": [1.0, 1.1]})


ALL = list(certificates())
IDS = [f"{c.kind}-{c.evidence.get('method', '')}" for c in ALL]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "certificate.json"


def read(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return Certificate.load(path)


@pytest.mark.parametrize("certificate", ALL, ids=IDS)
def test_round_trip(certificate, path):
    assert certificate.holds is True, certificate.reason
    certificate.save(path)
    loaded = Certificate.load(path)
    assert loaded == certificate
    before, after = verify(certificate), verify(loaded)
    assert before.valid is True and after.valid is True
    assert before.margins == after.margins
    assert os.listdir(path.parent) == [path.name]  # no part file left


@pytest.mark.parametrize("certificate", ALL, ids=IDS)
def test_numbers_in_any_allowed_form(certificate, path):
    """Decimal text in place of JSON numbers is the same claim; a double in full is another number, and says so."""
    certificate.save(path)
    document = json.loads(path.read_text())

    def rewrite(value, form, key=""):
        if isinstance(value, dict):
            return {name: rewrite(part, form, name) for name, part in value.items()}
        if isinstance(value, list) and key not in ("rows", "cols"):
            return [rewrite(part, form) for part in value]
        return form(value) if type(value) is float else value

    def rewritten(form):
        return {key: rewrite(document[key], form) for key in ("system", "region", "evidence")}

    for form in (repr, lambda value: f"{Decimal(repr(value)):.25e}", lambda value: f"{Decimal(repr(value)):+.60E}"):
        verdict = verify(read(path, json.dumps({**document, **rewritten(form)})))
        assert verdict.valid, verdict.reason
    for form in (float.hex, lambda value: f"{value:.25e}"):
        sections = rewritten(form)
        claim = claim_sentence(certificate.kind, **sections)
        changed = read(path, json.dumps({**document, **sections, "margin": {}, "claim": claim}))
        verdict = verify(changed)
        assert verdict.valid, verdict.reason
        assert verify(replace(changed, claim=certificate.claim)).valid == (claim == certificate.claim)


@pytest.mark.parametrize("certificate", ALL, ids=IDS)
@pytest.mark.parametrize("junk", [None, True, [], "text", 3.0, "missing"], ids=repr)
def test_sections_missing_or_of_another_type(certificate, junk, path):
    certificate.save(path)
    document = json.loads(path.read_text())
    for section in ("format", "kind", "claim", "system", "region", "evidence", "margin", "made_by"):
        changed = {key: value for key, value in document.items() if key != section or junk != "missing"}
        if junk != "missing":
            changed[section] = junk
        try:
            verdict = verify(read(path, json.dumps(changed)))
        except InputError as error:
            assert section in str(error)
        else:
            assert not verdict.valid and section == "claim" and junk == "text"


@pytest.mark.parametrize("certificate", ALL, ids=IDS)
def test_every_leaf_replaced_by_something_that_is_no_number(certificate, path):
    certificate.save(path)
    text = path.read_text()

    def places(value, at=()):
        if isinstance(value, (dict, list)):
            for key, part in value.items() if isinstance(value, dict) else enumerate(value):
                yield from places(part, (*at, key))
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            yield at

    found = list(places({key: json.loads(text)[key] for key in ("system", "region", "evidence", "margin")}))
    assert len(found) > 5
    for at in found:
        for junk in ("true", "null", '""', "NaN", "-Infinity", "1e999", '"1e999"', '"nan"', "[]", "{}", '"1_0"', '" 1"',
                     '"1\\n"', '"\\u0661"', '"0x"', '"0x1p9999"', "1" + 5000 * "0", '"0e99999999999"', "1e-999",
                     "[[]]"):
            document = json.loads(text)
            part = document
            for key in at[:-1]:
                part = part[key]
            part[at[-1]] = "REPLACED"
            with pytest.raises(InputError):
                read(path, json.dumps(document).replace('"REPLACED"', junk))


@pytest.mark.parametrize("text", [
    "", " ", "{", "[]", "null", "3", '"text"', "{}", "{} {}", b"\x00\xff\xfe", b"\xef\xbb\xbf{}", "[" * 100_000,
    '{"a":' * 5000 + "1" + "}" * 5000, "[" * 500 + "]" * 500, '{"a": NaN}', '{"kind": "a", "kind": "b"}', "9" * 10_000,
    '{"\\ud800": 1}', "{'a': 1}", "\x00" * 1000])
def test_not_a_certificate(text, path):
    with pytest.raises(InputError) as caught:
        read(path, text)
    assert "certificate.json" in str(caught.value)
    str(caught.value).encode("ascii")


def test_no_such_file(tmp_path):
    for path in (tmp_path, tmp_path / "none.json", tmp_path / "none" / "c.json", "\x00", "/dev/null", 3, None):
        with pytest.raises(InputError):
            Certificate.load(path)


def test_pipe_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="regular file"):
        Certificate.load(tmp_path / "pipe")


def test_format_kind_and_depth(path):
    ALL[0].save(path)
    document = json.loads(path.read_text())
    for key, value in (("format", "robthermal-certificate/2"), ("kind", "magic"), ("kind", ["contraction"]),
                       ("holds", "yes"), ("holds", 1), ("reason", None)):
        with pytest.raises(InputError):
            read(path, json.dumps({**document, key: value}))
    deep: dict = {}
    for _ in range(98):
        deep = {"a": deep}
    assert read(path, json.dumps({**document, "extra": deep})).holds
    with pytest.raises(InputError, match="nested"):
        read(path, json.dumps({**document, "extra": {"a": {"a": deep}}}))


def test_key_given_twice_anywhere(path):
    ALL[0].save(path)
    text = path.read_text()
    keys = [key for key in ("kind", "lumps", "capacity", "slope", "rate", "m", "room") if f'"{key}":' in text]
    assert len(keys) == 6
    for key in keys:
        with pytest.raises(InputError, match="twice"):
            read(path, text.replace(f'"{key}":', f'"{key}": 1, "{key}":', 1))


def test_free_keys_are_free(path):
    ALL[0].save(path)
    document = json.loads(path.read_text())
    document["comment"] = None
    document["system"]["sensors"] = [True, None]
    document["system"]["links"][0]["name"] = "a-b"
    document["evidence"]["solver"] = {"status": "optimal"}
    assert verify(read(path, json.dumps(document))).valid
    document["margin"]["other"] = 1.0
    with pytest.raises(InputError, match="other"):
        read(path, json.dumps(document))


def test_more_digits_than_a_double_are_kept(path):
    ALL[0].save(path)
    document = json.loads(path.read_text())
    document["evidence"]["rate"] = "LONG"
    loaded = read(path, json.dumps(document).replace('"LONG"', "0.00100000000000000000000001"))
    assert loaded.evidence["rate"] == "0.00100000000000000000000001"
    loaded.save(path)
    assert Certificate.load(path) == loaded


def test_save_says_what_it_cannot_write(tmp_path):
    for target in (tmp_path, tmp_path / "none" / "c.json", "\x00"):
        with pytest.raises(InputError):
            ALL[0].save(target)
    broken = Certificate(**{**vars(ALL[0]), "made_by": {"solver": object()}})
    with pytest.raises(InputError, match="object"):
        broken.save(tmp_path / "c.json")
    with pytest.raises(InputError):
        Certificate(**{**vars(ALL[0]), "made_by": {"x": float("nan")}}).save(tmp_path / "c.json")
    assert os.listdir(tmp_path) == []


def test_verify_takes_only_certificates():
    with pytest.raises(InputError, match="certificate"):
        verify({"kind": "contraction"})
    for change in ({"system": None}, {"kind": "magic"}, {"evidence": {"method": "energy", "rate": "x"}},
                   {"format": "x"}, {"holds": "yes"}, {"claim": 3}):
        with pytest.raises(InputError):
            verify(Certificate(**{**vars(ALL[0]), **change}))


@pytest.mark.parametrize("certificate", ALL, ids=IDS)
def test_damaged_files_never_surprise(certificate, path):
    """Random damage to the bytes: an InputError, or a verdict whose reason is not empty when it is not valid."""
    certificate.save(path)
    good = path.read_bytes()
    chance = random.Random(certificate.claim)
    outcomes = {"error": 0, "valid": 0, "not valid": 0}
    for _ in range(120):
        damaged = bytearray(good)
        for _ in range(chance.choice([1, 1, 1, 3])):
            k = chance.randrange(len(damaged))
            action = chance.randrange(4)
            if action == 0:
                damaged[k] = chance.randrange(256)
            elif action == 1:
                damaged[k] = ord(chance.choice('0123456789-+.eE"{}[],:xnt'))
            elif action == 2:
                del damaged[k:k + chance.choice([1, 1, 5, 50])]
            else:
                damaged[k:k] = damaged[max(0, k - chance.randrange(1, 40)):k]
        path.write_bytes(bytes(damaged))
        try:
            verdict = verify(Certificate.load(path))
        except InputError as error:
            outcomes["error"] += 1
            assert str(error)
        else:
            assert isinstance(verdict, Verdict) and isinstance(verdict.valid, bool)
            assert verdict.valid or verdict.reason
            outcomes["valid" if verdict.valid else "not valid"] += 1
    assert outcomes["error"] > 10
