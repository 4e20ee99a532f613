"""A stored report gives the same page again, and nothing in it is taken on trust."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robthermal.errors import InputError
from robthermal.report import Evidence, Report, read_content, write_content, write_html, write_json, write_junit

Write = Callable[[Report, Path], Path]


@pytest.fixture
def stored(report: Report, tmp_path: Path) -> Path:
    return write_content(report, tmp_path / "report.json")


@pytest.mark.parametrize("write", [write_html, write_junit, write_json], ids=["page", "junit", "summary"])
def test_what_is_read_gives_the_same_bytes(write: Write, report: Report, stored: Path, tmp_path: Path) -> None:
    again = read_content(stored)
    first, second = write(report, tmp_path / "first"), write(again, tmp_path / "second")
    assert first.read_bytes() == second.read_bytes()
    assert write_content(again, tmp_path / "again.json").read_bytes() == stored.read_bytes()


def test_numpy_truth_values_are_stored_as_truth_values(report: Report, tmp_path: Path) -> None:
    claim = replace(report.claims[0], holds=np.True_, verified=np.False_)
    path = write_content(replace(report, claims=(claim,)), tmp_path / "report.json")
    assert (read_content(path).claims[0].holds, read_content(path).claims[0].verified) == (True, False)


def change(path: Path, *place: object, value: object) -> None:
    data = json.loads(path.read_text())
    inner = data
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    path.write_text(json.dumps(data))


@pytest.mark.parametrize(("place", "value"), [
    (("claims", 0, "verified"), "yes"), (("claims", 0, "verified"), 1), (("claims", 0, "holds"), None),
    (("claims", 0, "seconds"), -1.0), (("evidence", 0, "valid"), "true"), (("evidence", 0, "margins"), {"rate": "1"}),
    (("format",), "robthermal-report-content/1"), (("gate",), [{"level": "fail"}]),
    (("usable",), [{"direction": "cooling"}]), (("nonsense",), 1), (("title",), 3), (("sections",), {}),
    (("sections", 0, "tables", 0, "rows"), [["only one cell"]]),
    (("sections", 0, "figures", 0, "svg"), "<svg><script>alert(1)</script></svg>"),
    (("sections", 0, "figures", 0, "svg"), '<svg><image href="https://example.org/x.png"/></svg>'),
    (("sections", 0, "figures", 0, "alt"), ""),
])
def test_what_does_not_fit_is_refused(place: tuple[object, ...], value: object, stored: Path) -> None:
    change(stored, *place, value=value)
    with pytest.raises(InputError, match="report.json: is not a stored report"):
        read_content(stored)


@pytest.mark.parametrize("content", [b"", b"[1]", b"\x00\xff", b"[" * 100_000, b'{"format": NaN}'])
def test_files_that_are_something_else(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "report.json").write_bytes(content)
    with pytest.raises(InputError, match="is not a stored report"):
        read_content(tmp_path / "report.json")


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.json: cannot be read"):
        read_content(tmp_path / "none.json")


@pytest.mark.parametrize("bad", [{"proven": "yes"}, {"valid": 1}, {"margins": {"rate": float("nan")}},
                                 {"seconds": float("inf")}])
def test_evidence_is_truth_values_and_numbers(bad: dict[str, object], report: Report) -> None:
    with pytest.raises(InputError, match="evidence"):
        replace(report.evidence[0], **bad)


@pytest.mark.parametrize(("proven", "valid", "good"), [(True, True, True), (True, None, False), (True, False, False),
                                                       (False, True, False)])
def test_evidence_is_good_only_if_proven_and_checked(proven: bool, valid: bool | None, good: bool) -> None:
    assert Evidence("t", "f", "s", "k", "c", proven, valid).good is good
