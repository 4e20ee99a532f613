"""What the reviewer's appendix lists: every assumption once, with a number, and which claim rests on which."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ._content import Report
from ._evidence import Evidence


@dataclass(frozen=True)
class Resting:
    """A claim, the numbers of its assumptions, and its evidence if it has some."""

    title: str
    answer: str
    numbers: list[tuple[int, int]]  # runs, first and last: "1–6, 9"
    evidence: Evidence | None
    margin: str = ""  # as on the card of the claim


def numbered_assumptions(report: Report) -> list[str]:
    """Every assumption of the report once: those of all claims first."""
    return list(dict.fromkeys([*report.assumptions, *(text for one in report.evidence for text in one.assumptions)]))


def resting(report: Report) -> list[Resting]:
    """What every claim rests on: certificates, then claims that have none (tests, and what was not found)."""
    number = {text: i for i, text in enumerate(numbered_assumptions(report), 1)}
    common = [number[text] for text in report.assumptions]
    shown = {one.file for one in report.evidence}
    stated = {claim.file: claim.margin for claim in report.claims if claim.file}
    rows = [Resting(one.title, _answer(one), _runs({*common, *(number[text] for text in one.assumptions)}), one,
                    stated.get(one.file, "")) for one in report.evidence]
    return rows + [Resting(claim.title, claim.status.lower(), _runs(common), None, claim.margin)
                   for claim in report.claims if claim.file not in shown]


def margins(evidence: Evidence) -> list[str]:
    """Slack of the inequalities that were checked, for a cell of a table."""
    return [f"{name} {value:.3g}" for name, value in evidence.margins.items()]


def _runs(numbers: Iterable[int]) -> list[tuple[int, int]]:
    runs: list[tuple[int, int]] = []
    for n in sorted(numbers):
        if runs and runs[-1][1] == n - 1:
            runs[-1] = (runs[-1][0], n)
        else:
            runs.append((n, n))
    return runs


def _answer(one: Evidence) -> str:
    if one.good:
        return "verified"
    return "NOT VERIFIED" if one.proven else "not proven"
