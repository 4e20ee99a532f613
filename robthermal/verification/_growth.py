"""What a quadratic form of a sampled loop can become after one sample, at every combination of slopes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

from flint import arb_mat

from ._cost import product_up_to
from ._lyapunov import MOST_ROWS, MOST_WORK, Described
from ._system import Region


@dataclass(frozen=True)
class Growth:
    """All cases, with where they are, and their number."""

    cases: Iterable[tuple[arb_mat, str]]
    count: int


def too_many_cases(region: Region, pieces: int, nonlinear: Sequence[Collection[Described]], rows: int) -> str:
    """Return why a loop has too many cases, counted before any is made; empty where it has not.

    At least one per module and piece of its current or limit, and one per end of every link that is not linear.
    """
    if rows > MOST_ROWS:
        return f"temperatures and controller states need matrices with {rows} rows: too many, at most {MOST_ROWS}"
    modules = [pieces + 2 if low < high else 1 for low, high in region.current]
    most = int(MOST_WORK / (rows**3 + 2000))
    if product_up_to([*modules, *map(len, nonlinear)], most) > most:
        return (f"{len(modules)} modules with {pieces} pieces each and {len(nonlinear)} links that are not linear have "
                "too many combinations of slopes to check one by one")
    return ""
