"""What a kind of certificate is made of: how it is read, what it says, how it is proven."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from flint import ctx

PRECISION = 192  # bits; the accuracy of the balls is checked by the proofs themselves, more bits only prove more


@dataclass(frozen=True)
class Proof:
    """Outcome of one checker: proven or not, the recomputed margins, and the inequality that fails."""

    valid: bool
    reason: str
    margins: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Kind:
    """One kind of certificate. Adding a kind is one file with such an object and one line in ``_kinds.py``.

    Parameters
    ----------
    name : str
        Value of the key "kind".
    read : callable
        (system, region, evidence, margin) to the exact problem; InputError for malformed content.
    claim : callable
        Problem and the short hash of its machine to the one sentence its data give.
    prove : callable
        Problem to Proof, from the data alone.
    find_margin : callable
        Problem to a margin that can be stored with it.
    """

    name: str
    read: Callable[[Any, Any, Any, Any], Any]
    claim: Callable[[Any, str], str]
    prove: Callable[[Any], Proof]
    find_margin: Callable[[Any], dict[str, float]]


@contextmanager
def working_precision(bits: int = PRECISION) -> Iterator[None]:
    """Set the precision of ball arithmetic for one proof and restore the caller's."""
    before = ctx.prec
    ctx.prec = bits
    try:
        yield
    finally:
        ctx.prec = before
