"""JUnit, JSON and provenance: what a pipeline reads."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from robthermal.errors import InputError
from robthermal.report import Claim, Report, Table, file_hash, versions, write_json, write_junit


def test_junit_of_good_claims(report: Report, tmp_path: Path) -> None:
    suite = ElementTree.parse(write_junit(report, tmp_path / "junit.xml")).getroot().find("testsuite")
    assert suite is not None
    assert (suite.get("tests"), suite.get("failures")) == ("2", "0")
    cases = suite.findall("testcase")
    assert {case.get("classname") for case in cases} == {"robthermal.certificates"}
    assert cases[0].get("name") == 'Contraction <script>alert("&\ufffd\ufffd\ufffd")</script> Æ €'
    assert [float(case.get("time", "nan")) for case in cases] == [0.03, 0.03]


@pytest.mark.parametrize(("holds", "verified", "kind"), [(False, None, "not certified"), (True, None, "not verified"),
                                                         (True, False, "not verified")])
def test_junit_failure_says_why(holds: bool, verified: bool | None, kind: str, tmp_path: Path,
                                with_claim: Callable[..., Report]) -> None:
    report = with_claim(holds=holds, verified=verified, reason="margin <0 \x07")
    suite = ElementTree.parse(write_junit(report, tmp_path / "junit.xml")).getroot().find("testsuite")
    assert suite is not None and suite.get("failures") == "1"
    failure = suite.find("testcase/failure")
    assert failure is not None and (failure.get("type"), failure.get("message")) == (kind, "margin <0 \ufffd")


def test_junit_fails_when_nothing_is_claimed(report: Report, tmp_path: Path) -> None:
    root = ElementTree.parse(write_junit(replace(report, claims=()), tmp_path / "junit.xml")).getroot()
    assert (root.get("tests"), root.get("failures")) == ("1", "1")


def test_junit_cases_of_one_title_have_different_names(report: Report, claim: Claim, tmp_path: Path) -> None:
    root = ElementTree.parse(write_junit(replace(report, claims=(claim, claim)), tmp_path / "junit.xml")).getroot()
    assert len({case.get("name") for case in root.iter("testcase")}) == 2


def test_json_summary(report: Report, claim: Claim, tmp_path: Path) -> None:
    bad = replace(claim, title="odd", holds=np.True_, verified=None)
    summary = json.loads(write_json(replace(report, claims=(claim, bad)), tmp_path / "s.json").read_text())
    assert summary["format"] == "robthermal-summary/2"
    assert summary["holds"] is False
    assert [(c["holds"], c["verified"]) for c in summary["claims"]] == [(True, True), (True, None)]
    assert summary["claims"][1]["reason"] == "the independent check was not run"
    assert summary["provenance"] == {name.replace("\ud800", "\ufffd"): v for name, v in report.provenance.items()}
    assert [c["valid"] for c in summary["claims"]] == [True, False]
    one = summary["certificates"][0]
    assert (one["file"], one["valid"], one["margins"]) == ("certificates/contraction.json", True, {"rate": 0.00123})
    assert summary["version"] == "0.1.0" and summary["checker"] == "robthermal 0.1.0"
    assert "Starts in the box." in summary["assumptions"]
    assert json.loads(write_json(report, tmp_path / "t.json").read_text())["holds"] is True


def test_file_hash_against_the_published_digest(tmp_path: Path) -> None:
    # FIPS 180-2, B.1 and B.3: "abc" and one million times "a"
    short, long = tmp_path / "short", tmp_path / "long"
    short.write_bytes(b"abc")
    long.write_bytes(b"a" * 1_000_000)
    assert file_hash(short) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert file_hash(str(long)) == "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0"
    assert file_hash(short) != hashlib.sha256(b"abd").hexdigest()


def test_file_hash_of_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere.csv.*cannot be read.*Check the path"):
        file_hash(tmp_path / "nowhere.csv")


def test_versions_are_those_that_run() -> None:
    found = versions()
    assert found["numpy"] == np.__version__
    assert set(found) == {"robthermal", "python", "numpy", "scipy", "python-flint", "platform"}
    assert all(found.values())


@pytest.mark.parametrize(("value", "text"), [
    (0.0512345, "0.05123"), (86400.5, "86400"), (1.2e-7, "1.2e-07"), (3.2e12, "3.2e+12"),
    (float("nan"), "–"), (float("inf"), "inf"), (-123456.0, "-123456"), (0.0, "0"),
])
def test_numbers_in_tables(value: float, text: str) -> None:
    assert Table(pd.DataFrame({"name": ["a"], "value": [value]}), "T").rows == [["a", text]]


def test_table_index_and_kinds_of_columns() -> None:
    frame = pd.DataFrame({"n": [1, 2], "yes": [True, False], "t": [None, "x"]}, index=pd.Index(["a", "b"], name="lump"))
    table = Table(frame, "T")
    assert table.header == ["lump", "n", "yes", "t"]
    assert table.rows == [["a", "1", "yes", "–"], ["b", "2", "no", "x"]]
    assert table.numeric == [False, True, False, False]


@pytest.mark.parametrize(("arguments", "named"), [(([[1]], "T"), "frame"), ((pd.DataFrame(), "T", 0), "digits")])
def test_bad_tables_are_refused(arguments: tuple[object, ...], named: str) -> None:
    with pytest.raises(InputError, match=named):
        Table(*arguments)
