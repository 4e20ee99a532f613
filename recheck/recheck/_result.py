"""What a checker of one kind answers."""

from __future__ import annotations

from dataclasses import dataclass

VALID, NOT_VALID, NOT_COVERED = "valid", "not valid", "not covered"


@dataclass(frozen=True)
class Answer:
    """Status and the inequality that decided it."""

    status: str
    reason: str


def valid(reason: str) -> Answer:
    """Every inequality is proven."""
    return Answer(VALID, reason)


def not_valid(reason: str) -> Answer:
    """The file breaks the format, or an inequality is violated for certain."""
    return Answer(NOT_VALID, reason)


def not_covered(reason: str) -> Answer:
    """Neither proven nor refuted."""
    return Answer(NOT_COVERED, reason)
