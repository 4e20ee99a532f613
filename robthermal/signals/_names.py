"""Which name did the user mean?"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from difflib import get_close_matches


def suggestion(name: str, known: Sequence[str]) -> str:
    """Remedy for an unknown name: the closest known one, if any, and the list of all."""
    folded = {fold(other): other for other in known}
    close = [folded[fold(name)]] if fold(name) in folded else get_close_matches(name, known, n=1)
    listed = ", ".join(known) if known else "none"
    return f"Did you mean {close[0]!r}? Known: {listed}." if close else f"Known: {listed}."


def misspelt(name: str, missing: Iterable[str]) -> str | None:
    """The missing name that `name` is most likely a misspelling of; None when it is a name of its own.

    Case, white space and punctuation do not count. Digits do: T1 is not a misspelling of T2.
    """
    for other in missing:
        if fold(name) == fold(other):
            return other
    for other in missing:
        allowed = 0 if len(other) < 4 else 1 if len(other) < 6 else 2
        if _digits(name) == _digits(other) and _distance(fold(name), fold(other)) <= allowed:
            return other
    return None


def fold(name: str) -> str:
    """Name without case, white space and punctuation.

    >>> fold(" T_6 ") == fold("t6")
    True
    """
    return re.sub(r"[\W_]+", "", name).casefold()


def _digits(name: str) -> list[str]:
    return re.findall(r"\d+", name)


def _distance(a: str, b: str) -> int:
    """Levenshtein distance; capped at 3, which is far more than a slip of the finger."""
    if abs(len(a) - len(b)) > 2:
        return 3
    row = list(range(len(b) + 1))
    for i, letter in enumerate(a, 1):
        previous, row[0] = row[0], i
        for j, other in enumerate(b, 1):
            previous, row[j] = row[j], min(row[j] + 1, row[j - 1] + 1, previous + (letter != other))
    return min(row[-1], 3)
