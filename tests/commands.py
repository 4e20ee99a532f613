"""What a command of robthermal said."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple


class Said(NamedTuple):
    """Exit status, standard output and standard error."""

    status: int
    out: str
    err: str


Run = Callable[..., Said]


def without_progress(err: str) -> str:
    """Standard error without the plain lines that a slow machine sees every ten seconds."""
    return "".join(line for line in err.splitlines(keepends=True) if not line.endswith(" s so far\n"))
