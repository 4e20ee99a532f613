"""Files that ask for hours or gigabytes: each is answered within a minute and a gigabyte, and none ends the process.

Each is verified in a process of its own with a limit on memory and on processor time.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys

import pytest

from robthermal.verification._certificate import FORMAT

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of a process, and /proc")
MEMORY, SECONDS = 1_500_000_000, 60  # address space, of which the interpreter and its libraries are some 400 MB
CHECK = f"""
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, ({MEMORY}, {MEMORY}))
resource.setrlimit(resource.RLIMIT_CPU, ({SECONDS}, {SECONDS}))
from dataclasses import replace
from robthermal.errors import InputError
from robthermal.verification import Certificate, claim_sentence, verify
try:
    c = Certificate.load(sys.argv[1])
    c = replace(c, claim=claim_sentence(c.kind, c.system, c.region, c.evidence))
    verdict = verify(c)
    print("valid" if verdict.valid else "not valid", verdict.reason)
except InputError as error:
    print("refused", error)
with open("/proc/self/status") as status:  # ru_maxrss would be that of the parent too
    peak = next(int(line.split()[1]) / 1024 for line in status if line.startswith("VmHWM"))
print(f"{{peak:.0f}} MB")
sys.exit(peak > 1000)
"""
LONG = "1" * 1900


def module(hot, cold, **more):
    return {"hot": hot, "cold": cold, "seebeck": {"value": 0.05, "slope": 1e-4}, "reference_temperature": 300,
            "resistance": {"value": 2, "slope": 0.01}, "conductance": {"value": 0.5, "slope": 0.001}, **more}


def pairs(count):
    """Modules that share no lump."""
    return {f"m{k}": module(f"l{2 * k}", f"l{2 * k + 1}") for k in range(count)}


def network(lumps, modules=None, links=(), **more):
    room = [{"between": [f"l{k}", "room"], "conductance": 1} for k in range(lumps)]
    return {"lumps": {f"l{k}": {"capacity": 5} for k in range(lumps)}, "ambients": ["room"], "modules": modules or {},
            "links": [*room, *links], **more}


def bent(lumps, count):
    """Links with radiation and natural convection between random lumps."""
    chance = random.Random(1)
    return [{"between": [f"l{a}", f"l{b}"], "conductance": 0.1, "radiation": 1e-9,
             "natural": {"gain": 0.1, "exponent": 0.25}}
            for a, b in (chance.sample(range(lumps), 2) for _ in range(count))]


def box(modules=(), top=1.0, **more):
    return {"temperature": [280, 350], "current": {name: [0, top] for name in modules}, **more}


def uncertain(modules):
    """All six numbers of every module."""
    return {f"modules.{name}.{part}.{key}": [-9, 9] for name in modules
            for part in ("seebeck", "resistance", "conductance") for key in ("value", "slope")}


def one(n):
    return [[int(i == j) for j in range(n)] for i in range(n)]


def contraction(system, region, method, size):
    evidence = {"sum": {"weights": [1] * size}, "max": {"weights": [1] * size}, "energy": {},
                "lyapunov": {"matrix": one(size)}}[method]
    return "contraction", system, region, {"method": method, "rate": 1e-3, **evidence}


def observer(lumps, links):
    system = network(lumps, links=links, sensors=["l0"], gain=[[0]] * lumps)
    return "observer", system, box(sample_time=1), {"matrix": one(lumps)}


def regulated(modules, links, method):
    lumps = 2 * len(modules)
    free = lumps - len(modules)
    kind, system, region, evidence = contraction(network(lumps, modules, links), box(modules), method, free)
    return "regulated", system, {**region, "setpoint": {name: [290, 290] for name in modules}}, evidence


def loop(count, states, pieces):
    modules, n = pairs(count), 2 * count
    controller = {"A": one(states), "B": [[0] * n] * states, "C": [[0] * states] * count, "D": [[0] * n] * count,
                  "windup": [[0] * count] * states}
    evidence = {"contraction": 1, "pieces": pieces, "matrix": one(n + states), "weights": [1] * n, "sizes": [1] * 4 * n}
    return "loop", network(n, modules, controller=controller), box(modules, 0.5, sample_time=1), evidence


SAME = {f"m{k}": module("l0", "l1") for k in range(2000)}
CHAIN = {f"m{k}": module(f"l{k}", f"l{k + 1}") for k in range(3000)}
FILES = {
    "radiation": lambda: contraction(network(160, links=bent(160, 200)), box(), "lyapunov", 160),
    "observer": lambda: observer(200, bent(200, 120)),
    "large observer": lambda: observer(250, []),
    "dense P": lambda: contraction(network(450), box(), "lyapunov", 450),
    "modules, energy": lambda: contraction(network(6000, pairs(3000)), box(pairs(3000)), "energy", 6000),
    "modules, lyapunov": lambda: contraction(network(400, pairs(200)), box(pairs(200)), "lyapunov", 400),
    "chain": lambda: contraction(network(3001, CHAIN), box(CHAIN), "energy", 3001),
    "variants, energy": lambda: contraction(network(2, SAME), box(SAME, parameters=uncertain(SAME)), "energy", 2),
    "variants, max": lambda: contraction(network(2, SAME), box(SAME, parameters=uncertain(SAME)), "max", 2),
    "variants, lyapunov": lambda: contraction(network(2, SAME), box(SAME, parameters=uncertain(SAME)), "lyapunov", 2),
    "variants, invariance": lambda: ("invariance", network(2, SAME), box(SAME, parameters=uncertain(SAME),
                                                                         ambient={"room": [290, 300]}), {}),
    "ranges": lambda: contraction(network(4000), box(parameters={f"links.l{k}-room.conductance": [0.9, 1.1]
                                                                  for k in range(4000)}), "max", 4000),
    "long numbers": lambda: contraction(network(6000, pairs(3000)), box(pairs(3000), temperature=["280." + LONG, 350]),
                                        "sum", 6000),
    "fill-in": lambda: contraction(network(3000, links=bent(2000, 30000)), box(), "energy", 2000),
    "regulated, links": lambda: regulated(pairs(1), bent(2, 5000), "lyapunov"),
    "regulated, modules": lambda: regulated(pairs(1000), [], "energy"),
    "gain": lambda: ("gain", network(400), box(), {"rate": 0, "gains": {"heat": {f"l{k}": [2] * 400
                                                                                for k in range(400)}}}),
    "loop, modules": lambda: loop(40, 2, 16),
    "loop, states": lambda: loop(1, 900, 1),
}


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", FILES)
def test_no_file_takes_minutes_or_gigabytes(name, tmp_path):
    kind, system, region, evidence = FILES[name]()
    path = tmp_path / "certificate.json"
    document = {"format": FORMAT, "kind": kind, "claim": "to be replaced", "system": system, "region": region,
                "evidence": evidence, "margin": {}, "made_by": {}}
    path.write_text(json.dumps(document, separators=(",", ":")))
    assert path.stat().st_size < 10_000_000
    assert_answered(path)


def assert_answered(path):
    done = subprocess.run([sys.executable, "-c", CHECK, path], capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, (done.returncode, done.stdout[-300:], done.stderr[-300:])
    assert done.stdout.startswith(("valid", "not valid", "refused")), done.stdout[:300]


@pytest.mark.exhaustive
@pytest.mark.parametrize("text", ["[" + "[]," * 1_000_000 + "[]]", "[" + "{}," * 1_000_000 + "1]",
                                  "[" + "1e-300," * 300_000 + "1]", "[" * 1_000_000 + "]" * 1_000_000,
                                  "[" + "1" * 9_000_000 + "]", '[' + f"0.{LONG}," * 1000 + "1]"],
                         ids=["lists", "objects", "exponents", "nesting", "digits", "long decimals"])
def test_no_text_takes_minutes_or_gigabytes(text, tmp_path):
    path = tmp_path / "certificate.json"
    path.write_text(text)
    assert_answered(path)


def test_values_are_counted_before_they_are_parsed(tmp_path):
    path = tmp_path / "certificate.json"
    path.write_text("[" + "0," * 8_000_001 + "0]")
    done = subprocess.run([sys.executable, "-c", CHECK, path], capture_output=True, text=True, timeout=900)
    assert "more than 8000000 values" in done.stdout, (done.stdout[-300:], done.stderr[-300:])
