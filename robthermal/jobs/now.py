"""The time of a report."""

from __future__ import annotations

from datetime import UTC, datetime


def now() -> str:
    """Date and time for the report."""
    return datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
