"""What a quadratic form of a sampled loop can become after one sample, at every combination of slopes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from flint import arb_mat


@dataclass(frozen=True)
class Growth:
    """All cases, with where they are, and their number."""

    cases: Iterable[tuple[arb_mat, str]]
    count: int
