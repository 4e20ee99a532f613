"""Two checkers, one verdict; tests/benchmarks/two_checkers.py compares them on ten thousand certificates."""

from __future__ import annotations

import ast
import copy
import json
import re
import subprocess
import sys
from pathlib import Path

import certificate_truth
import mutant_ellipsoid
import mutant_feedback
import mutant_linear
import mutant_scheduled
import mutant_thermal
import numpy as np
import pytest
from agreement import both, cases, judge
from heat3d import MAXIMA, heat3d

import recheck
import robthermal as rt
from robthermal.verification import establish
from robthermal.verification._kinds import KINDS

SUBJECTS = {subject.kind: subject for subject in (*mutant_thermal.SUBJECTS, *mutant_linear.SUBJECTS,
                                                  *mutant_feedback.SUBJECTS, *mutant_ellipsoid.SUBJECTS,
                                                  *mutant_scheduled.SUBJECTS)}
COVERED = ("contraction", "invariance", "runaway", "network", "stability", "gain", "observer", "polytope",
           "ellipsoid", "scheduled", "network_peak")


def document_of(certificate) -> dict:
    """Return the content of the file of a certificate."""
    return {"format": certificate.format, "kind": certificate.kind, "claim": certificate.claim,
            **{key: getattr(certificate, key) for key in ("system", "region", "evidence", "margin", "made_by")}}


@pytest.mark.exhaustive
@pytest.mark.parametrize("kind", COVERED)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_no_disagreement_on_certificates_and_mutants(kind):
    subject, rng = SUBJECTS[kind], np.random.default_rng(12)
    pairs = []
    for document in cases(subject, np.random.default_rng(11), 36):
        pairs.append(both(kind, document))
        if pairs[-1].second == "valid":  # floats on samples, which know neither checker
            assert subject.violation(document, rng) <= subject.tolerance
    assert not [pair for pair in pairs if pair.disagree]
    accepted = [pair for pair in pairs if pair.first]
    assert len(accepted) >= 5 and all(pair.second == "valid" for pair in accepted)
    assert sum(pair.second == "not valid" for pair in pairs) >= 5


@pytest.mark.parametrize("kind", sorted(set(KINDS) - set(COVERED) - {"loop"}))
def test_other_kinds_are_not_covered(kind):
    pair = both(kind, {"margin": {}, **SUBJECTS[kind].make(np.random.default_rng(1))})
    assert pair.first and pair.second == "not covered"


def test_kinds_are_those_of_the_first_checker():
    from recheck._check import KINDS as SECOND
    from recheck._check import OTHERS
    assert {*SECOND, *OTHERS} == set(KINDS) and tuple(SECOND) == COVERED


@pytest.mark.parametrize("method", ["sum", "max", "energy", "lyapunov"])
def test_a_machine_of_the_size_people_have(method):
    """18 lumps, two modules with constant numbers uncertain by 5 % (three of each), not modules for lyapunov."""
    system = rt.systems.two_module()
    values = {f"modules.{name}.{key}.value": getattr(module, key).value for name, module in system.modules.items()
              for key in ("seebeck", "resistance", "conductance")}
    spread = {name: (0.95 * value, 1.05 * value) for name, value in values.items()}
    current = {"m1": (-1, 1), "m2": (-1, 1)}
    found = rt.certify.contraction(system, current=current, temperature=(278, 330), method=method,
                                   parameters=None if method == "lyapunov" else spread)
    pair = judge(json.loads(json.dumps(document_of(found), default=dict)))
    assert found.holds and pair.first and pair.second == "valid", pair.reasons


@pytest.mark.parametrize("change", ["digit", "letter", "machine"])
def test_another_sentence_is_rejected_by_both(change):
    rng = np.random.default_rng(2)
    document = {"margin": {}, **SUBJECTS["invariance"].make(rng)}
    content = document_of(establish("invariance", system=document["system"], region=document["region"],
                                    evidence=document["evidence"], made_by={}))
    claim = content["claim"]
    content["claim"] = {"digit": claim.replace("290", "291", 1), "letter": claim.replace("never", "ever", 1),
                        "machine": claim.replace("machine ", "machine 0", 1)}[change]
    assert content["claim"] != claim
    pair = judge(content)
    assert not pair.first and pair.second == "not valid"


def test_a_stored_margin_is_part_of_the_claim():
    rng = np.random.default_rng(3)
    for kind, key in (("contraction", "rate"), ("invariance", "heat"), ("network", "rate"),
                      ("observer", "contraction")):
        document = {"margin": {}, **SUBJECTS[kind].make(rng)}
        document["margin"] = {key: 1e3}
        pair = both(kind, document)
        assert not pair.first and pair.second == "not valid", kind
        document["margin"] = {key: -1.0}
        pair = both(kind, document)
        assert pair.first and pair.second == "valid", kind


def test_uncertain_convection_and_radiation_are_judged_alike_by_both():
    """Ranges of their coefficients, up to 20 times the number of the system, with small and with large currents."""
    rng = np.random.default_rng(4)
    seen = set()
    for trial in range(12):
        system = certificate_truth.random_system(rng, modules=1, nonlinear=True)
        ranges = {}
        for k, link in enumerate(system["links"]):
            link["name"] = f"l{k}"
            natural = link.get("natural", {})
            for key, value in (("radiation", link.get("radiation")), ("natural.gain", natural.get("gain"))):
                if value is not None:
                    ranges[f"links.l{k}.{key}"] = [0.5 * value, (1.5 if trial % 2 else 20.0) * value]
        assert ranges
        region = {"temperature": [280.0, 350.0], "current": {"m0": [0.0, 0.05]}, "parameters": ranges}
        for kind, extra in (("contraction", {}), ("invariance", {"ambient": {"room": [290.0, 300.0]}})):
            document = {"system": system, "region": {**region, **extra}, "margin": {},
                        "evidence": {"method": "energy", "rate": 1e-5} if kind == "contraction" else {}}
            for current in (0.05, 40.0):
                document["region"]["current"] = {"m0": [0.0, current]}
                pair = both(kind, copy.deepcopy(document))
                assert not pair.disagree, (kind, pair.reasons)
                seen.add((kind, pair.second))
    assert seen == {(kind, status) for kind in ("contraction", "invariance") for status in ("valid", "not valid")}


def test_the_second_checker_imports_the_standard_library_only():
    folder = Path(recheck.__file__).parent
    for file in folder.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            names = ([alias.name for alias in node.names] if isinstance(node, ast.Import) else
                     [node.module or ""] if isinstance(node, ast.ImportFrom) and node.level == 0 else [])
            assert all(name.split(".")[0] in sys.stdlib_module_names for name in names), file
    code = "import sys, recheck; sys.exit(any(name in sys.modules for name in ('robthermal', 'numpy', 'flint')))"
    assert subprocess.run([sys.executable, "-c", code], cwd=folder.parent, check=False).returncode == 0


def test_the_page_names_every_key_of_every_kind():
    """A checker can be written from docs/reference/certificate_format.md: no key of a certificate is missing there."""
    page = (Path(__file__).resolve().parents[2] / "docs" / "reference" / "certificate_format.md").read_text()
    words = set(re.findall(r"[A-Za-z_]+", page))
    free = {"name", "capacity"}

    def keys(value, names):
        if isinstance(value, dict):
            for key, part in value.items():
                names |= set() if key in free or not part and part != 0 else {key}
                keys(part, names)
        return names

    for kind, subject in SUBJECTS.items():
        document = subject.make(np.random.default_rng(7))
        parts = {section: document[section] for section in ("system", "region", "evidence")}
        own = {*parts["system"].get("lumps", {}), *parts["system"].get("modules", {}),
               *parts["system"].get("ambients", []), *parts["region"].get("parameters", {}),
               *parts["system"].get("inputs", {})}
        assert kind in words and keys(parts, set()) - own <= words, kind


def test_heat3d_by_both():
    """125 lumps; and a bound just below the published maximum is not valid, whatever its evidence."""
    A, start, lump = heat3d(5)
    found = rt.certify.network_peak(np.ones(125), A, lump, start, 40.0)
    content = json.loads(json.dumps(document_of(found), default=lambda value: value.tolist()))
    pair = judge(content)
    assert pair.first and pair.second == "valid", pair.reasons
    content["region"]["bound"] = MAXIMA[5] - 1e-5
    content["claim"] = content["claim"].replace(str(found.region["bound"]), str(content["region"]["bound"]))
    pair = judge(content)
    assert not pair.first and pair.second == "not valid" and "too large" in pair.reasons[1], pair.reasons
