"""Codes of outcomes: a closed set, every outcome goes through it, `explain` and the docs read it."""

from __future__ import annotations

import ast
import runpy
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import robthermal as rt
from robthermal.errors import InputError, Outcome, OutcomeCode
from robthermal.jobs.explanations import outcome_codes, package_of

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "robthermal"
MEMBERS = [member for members in outcome_codes().values() for member in members]
# What scripts compare with: a code that goes, or changes its answer, breaks them. + yes, - no, ? left to the result.
CODES = {
    "calibration": "+at_bound +converged +fitted -not_converged -not_explained -not_uniform -undetermined",
    "certify": "+certified +found +mapped -none -not_certified +usable",
    "coupling": """-axis +gap -infeasible -limit +met +nominal -not_proven ?not_reduced -not_robust -not_stable
        +robust""",
    "design": """+as_declared +certified +certified_sampled_model +collapsed +designed +found -limited +margins
        -moving -none -not_certified -not_contracting -not_found -not_held -not_tuned -ran_away
        +reachable -reversed +settled +tuned -undecided -unreachable -unstable""",
    "diagnosis": """+adequate -ambiguous +consistent +converged +declared -doubtful +estimated +finer +found
        -inadequate -inexact +named +named_with_remainder -none -not_converged -not_finer -not_predicted +nothing
        +predicted +selected -unexplained""",
    "fleet": "+done -failed",
    "identify": "?constant_input +estimated -frf_without_covariance -suspect -undetermined",
    "jobs": "-bins_left_out -circles_left_out -frf_without_covariance",
    "signals": "+designed -not_lower +resolved -undetermined -unresolved",
    "synthesis": "+at_the_bins +certified +certified_region +step -infeasible -no_step -not_certified -not_found",
    "thermal": "+agrees +closed -disagrees +found +held -none -not_held -not_reducible +reduced +rounded +unchecked",
}


class BatteryCode(OutcomeCode):
    FULL = (True, "The battery is full.")
    EMPTY = (False, "The battery is empty.", "Charge it.")
    MEASURED = (None, "The voltage was measured.", "Compare it with the sheet.")


def constructed(source: str) -> Iterator[int]:
    """Lines that make an `Outcome` themselves."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call):
            called = node.func
            name = called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")
            if name == "Outcome":
                yield node.lineno


def test_outcomes_are_made_by_their_codes_only() -> None:
    files = [path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "errors.py"]
    found = [f"{path.relative_to(ROOT)}:{line}" for path in files
             for line in constructed(path.read_text(encoding="utf-8"))]
    assert len(files) > 100 and found == []
    assert list(constructed("a = 1\nb = errors.Outcome(True, 'x', '')\nc = Outcome(ok=True, code='x')\n")) == [2, 3]


def test_codes_are_those_that_scripts_know() -> None:
    sign = {True: "+", False: "-", None: "?"}
    found: dict[str, set[str]] = {}
    for member in MEMBERS:
        found.setdefault(package_of(member), set()).add(sign[member.ok] + member.code)
    assert found == {package: set(codes.split()) for package, codes in CODES.items()}


def test_every_enum_of_codes_is_read_by_explain() -> None:
    """A package that gets codes of its own is found by its file, not by a list."""
    written = {}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and any(getattr(base, "id", "") == "OutcomeCode" for base in node.bases):
                written[node.name] = path
    assert set(written) == {type(member).__name__ for member in MEMBERS}
    assert {path.name for path in written.values()} == {"_outcomes.py"}


@pytest.mark.parametrize("member", MEMBERS, ids=str)
def test_a_code_says_what_it_means_and_what_to_do_and_is_explained(member: OutcomeCode) -> None:
    assert member.meaning.endswith(".") and (member.remedy or member.ok is True)
    assert not member.remedy or member.remedy.endswith(".")
    texts = [text for one in rt.jobs.explain(member.code) if one.what == "outcome"
             for text in one.details["Said by"] if text.startswith(f"{package_of(member)}, ")]
    assert len(texts) == 1 and member.meaning in texts[0] and member.remedy in texts[0]


def test_every_code_is_used() -> None:
    enums = {type(member) for member in MEMBERS}
    assert len(enums) > 5
    for enum in enums:
        package = PACKAGE / enum.__module__.split(".")[1]
        source = "".join(path.read_text(encoding="utf-8") for path in package.rglob("*.py"))
        assert [one.name for one in enum if f"{enum.__name__}.{one.name}" not in source] == []


def test_a_name_in_two_packages_keeps_both_meanings() -> None:
    assert [package_of(code) for code in outcome_codes()["found"]] == ["thermal", "certify", "design", "diagnosis"]


def test_an_outcome_is_what_happened_and_the_remedy() -> None:
    assert BatteryCode.FULL.outcome() == Outcome(True, "full", "The battery is full.")
    assert BatteryCode.EMPTY.outcome("It is at 3 %.").text == "It is at 3 %. Charge it."
    assert BatteryCode.EMPTY.outcome("It is at 3 %:").text == "It is at 3 %: charge it."
    assert BatteryCode.EMPTY.outcome("It is at 3 %.", remedy="Wait.").text == "It is at 3 %. Wait."
    assert BatteryCode.EMPTY.outcome("It is at 3 %: wait.", remedy="").text == "It is at 3 %: wait."
    assert [BatteryCode.MEASURED.outcome(ok=ok).ok for ok in (True, False)] == [True, False]


@pytest.mark.parametrize(("member", "ok"), [(BatteryCode.MEASURED, None), (BatteryCode.FULL, False),
                                            (BatteryCode.EMPTY, True), (BatteryCode.EMPTY, False)])
def test_the_answer_is_given_once(member: OutcomeCode, ok: bool | None) -> None:
    with pytest.raises(InputError, match="exactly one"):
        member.outcome(ok=ok)


def test_results_say_the_codes_of_their_package() -> None:
    """Results and codes side by side, a yes and a no of each."""
    machine = rt.systems.two_module()
    limit = rt.certify.largest_current(machine, temperature=(278.15, 358.15), direction="cooling").outcome
    code = rt.certify.CertifyCode.CERTIFIED
    assert (limit.ok, limit.code) == (code.ok, code.code)
    words = "contraction limit inside the box; not a limit for use"
    assert words in limit.text and words in code.meaning
    sheet = rt.thermal.module_from_datasheet(v_max=15.4, i_max=6.0, dt_max=67.0, q_max=51.4, t_hot=298.0).outcome
    wrong = rt.thermal.ThermalCode.DISAGREES
    assert (sheet.ok, sheet.code) == (False, wrong.code) and sheet.text.endswith(wrong.remedy[1:])


def test_the_page_of_codes_is_what_the_enums_say() -> None:
    script = runpy.run_path(str(ROOT / "docs" / "table_of_outcomes.py"))
    assert script["PAGE"].read_text(encoding="utf-8") == script["page"](), "run python docs/table_of_outcomes.py"


def test_the_file_that_explain_reads_is_what_the_packages_say() -> None:
    script = runpy.run_path(str(ROOT / "docs" / "table_of_outcomes.py"))
    assert script["KNOWN"].read_text(encoding="utf-8") == script["known"](), "run python docs/table_of_outcomes.py"


def test_explain_imports_no_package_of_the_method() -> None:
    """Its start was three times as long when it asked every package."""
    code = "import sys, robthermal as rt; rt.jobs.explain('contraction'); rt.jobs.explainable(); print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"numpy", "scipy", "pydantic", "robthermal.thermal", "robthermal.design"} & set(run.stdout.split())
