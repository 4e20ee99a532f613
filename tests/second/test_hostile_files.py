"""Files that a hostile or careless hand wrote: never valid, an answer in bearable time and memory, no traceback."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from agreement import judge

import recheck
from robthermal.errors import InputError
from robthermal.verification import Certificate, establish, verify

ROD = {"lumps": {"rod": {"capacity": 10.0}}, "ambients": ["room"], "modules": {},
       "links": [{"between": ["rod", "room"], "conductance": 0.5}]}
BOX = {"temperature": [250.0, 400.0], "current": {}}
HEAD = {"format": "robthermal-certificate/1", "margin": {}, "made_by": {}, "claim": "c"}


@pytest.fixture(scope="module")
def good(tmp_path_factory) -> str:
    """Return the text of a valid certificate."""
    file = tmp_path_factory.mktemp("good") / "good.json"
    establish("contraction", system=ROD, region=BOX, evidence={"method": "energy", "rate": 0.04}, made_by={}).save(file)
    return file.read_text()


def test_the_good_one_is_valid(good):
    assert judge(json.loads(good)).second == "valid"


@pytest.mark.parametrize(("old", "new"), [
    ('"capacity": 10.0', '"capacity": NaN'), ('"capacity": 10.0', '"capacity": Infinity'),
    ('"capacity": 10.0', '"capacity": true'), ('"capacity": 10.0', '"capacity": null'),
    ('"capacity": 10.0', '"capacity": ""'), ('"capacity": 10.0', '"capacity": 1e400'),
    ('"capacity": 10.0', '"capacity": 1e-400'), ('"capacity": 10.0', '"capacity": "1e99999999"'),
    ('"capacity": 10.0', '"capacity": "0x1p5000"'), ('"capacity": 10.0', '"capacity": -10.0'),
    ('"capacity": 10.0', '"capacity": 10.0, "capacity": 10.0'), ('"capacity": 10.0', '"capacity": [10.0]'),
    ('"capacity": 10.0', '"capacity": 10.0, "thomson": 1'), ('"capacity": 10.0', '"capacity": 10.0, "follow": {}'),
    ('"capacity": 10.0', '"capacity": 10.0, "temperature_law": {}'),
    ('"rate": 0.04', '"rate": 0.06'),
    ('"rate": 0.04', '"rate": -0.04'), ('"method": "energy"', '"method": "hope"'),
    ('"method": "energy"', '"method": "sum"'), ('"robthermal-certificate/1"', '"robthermal-certificate/2"'),
    ('"kind": "contraction"', '"kind": "wish"'), ('"holds": true', '"holds": false'), ('"holds": true', '"holds": 1'),
    ('"room"', '"rod"'), ('"current": {}', '"current": {"m": [0, 1]}'), ("250.0", "450.0"), ("250.0", "-1"),
    ('"region"', '"legion"'), ('"margin": {', '"margin": {"speed": 1,'), ("{", "{{"), ("}", "")])
def test_one_defect_is_rejected_by_both(good, old, new, tmp_path):
    assert old in good
    file = tmp_path / "bad.json"
    file.write_text(good.replace(old, new, 1))
    assert recheck.check(file).status == "not valid"
    try:
        assert not verify(Certificate.load(file)).valid
    except InputError as error:
        assert str(error)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"[" * 100_000, b"{}", b"[]", b'"text"', b"1",
                                     b'{"a":' * 2000 + b"1" + b"}" * 2000, b'{"format": "\\ud800"}'])
def test_what_is_no_certificate_is_not_valid(content, tmp_path):
    file = tmp_path / "file.json"
    file.write_bytes(content)
    found = recheck.check(file)
    assert found.status == "not valid" and found.reason


def test_no_file_is_unreadable(tmp_path):
    with pytest.raises(recheck.Unreadable):
        recheck.check(tmp_path / "none.json")
    with pytest.raises(recheck.Unreadable):
        recheck.check(tmp_path)


def _network(lumps: int, links: int, modules: int, number: str) -> dict:
    module = {"hot": "l0", "cold": "l1", "reference_temperature": 300, "seebeck": {"value": number, "slope": number},
              "resistance": {"value": number, "slope": "-" + number}, "conductance": {"value": number, "slope": number}}
    names = [f"l{k}" for k in range(lumps)]
    system = {"lumps": {name: {"capacity": number} for name in names}, "ambients": ["room"],
              "links": [{"name": f"n{k}", "between": [names[k % lumps], names[(k + 1) % lumps]], "conductance": number,
                         "natural": {"gain": number, "exponent": "0.333333333333333333333"}, "radiation": number}
                        for k in range(links)],
              "modules": {f"m{k}": {**module, "hot": names[k % lumps], "cold": names[(k + 1) % lumps]}
                          for k in range(modules)}}
    region = {"temperature": [number, "2" + number[1:]], "current": {f"m{k}": [0, number] for k in range(modules)},
              "ambient": {"room": [1, 2]}, "sample_time": number}
    return {"system": system, "region": region}


LONG = "1." + "7" * 900
DENSE, MANY = _network(30, 60, 20, LONG), _network(3000, 9000, 2000, "1.5")
LARGE = {"A": [[LONG[:40]] * 150] * 150, "B": [[1]] * 150, "C": [[1] * 150], "D": [[1]], "sample_time": 0}
HOSTILE = {
    "long numbers, every method": [
        *(("contraction", DENSE, {"method": method, "rate": 0, "weights": [LONG] * 30, "matrix": [[LONG] * 30] * 30})
          for method in ("sum", "max", "energy", "lyapunov")), ("invariance", DENSE, {}),
        ("gain", DENSE, {"rate": 0, "gains": {"heat": {f"l{k}": [LONG] * 30 for k in range(30)}}})],
    "many links and modules": [
        *(("contraction", MANY, {"method": method, "rate": 0, "weights": [1] * 3000}) for method in ("max", "energy")),
        ("invariance", MANY, {})],
    "a large matrix": [
        ("stability", {"system": LARGE, "region": {}}, evidence) for evidence in
        ({"method": "polynomial"}, {"method": "lyapunov", "matrix": [[LONG] * 150] * 150})],
    "seven uncertain constants": [("runaway", {"system": {key: LONG for key in (
        "seebeck", "resistance", "conductance", "sink_conductance", "sink_temperature", "setpoint")},
        "region": {"parameters": {key: [1, 2] for key in ("seebeck", "resistance", "conductance", "sink_conductance",
                                                          "sink_temperature", "setpoint")}}},
        {"current": [0.001, LONG], "load": [0, 1]})],
}


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", sorted(HOSTILE))
def test_work_is_bounded(name, tmp_path):
    """With the right sentence, so that the work begins; at most 1 GB, and far less than a minute each."""
    files = []
    for k, (kind, parts, evidence) in enumerate(HOSTILE[name]):
        file = tmp_path / f"{k}.json"
        file.write_text(json.dumps({**HEAD, "kind": kind, **parts, "evidence": evidence}))
        files.append(str(file))
    code = ("import sys, recheck, recheck._check as c\n"
            "c.sentence = lambda kind, problem, parts: 'c'\n"
            "print([recheck.check(file).status for file in sys.argv[1:]])")
    run = subprocess.run([sys.executable, "-c", code, *files], capture_output=True, text=True, timeout=60, check=False,
                         cwd=Path(recheck.__file__).parents[1],
                         preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (10**9, 10**9)))
    assert run.returncode == 0 and "'valid'" not in run.stdout, run.stderr
