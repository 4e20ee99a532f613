"""Of two answers without names, with a room free and held, the one that predicts better stands."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from robthermal.diagnosis._held_room import unless_worse


def answer(verdict: str, after: float | None) -> Any:
    held_out = None if after is None else SimpleNamespace(gap=SimpleNamespace(after=after))
    return SimpleNamespace(verdict=verdict, hold_out=held_out)


@pytest.mark.parametrize(("free", "held", "stands"), [
    (("unexplained", 0.46), ("unexplained", 0.50), "free"),  # a processor under a fan, its room not recorded
    (("unexplained", 0.50), ("unexplained", 0.46), "held"),
    (("unexplained", 0.46), ("named_with_remainder", 0.50), "held"),
    (("named_with_remainder", 0.46), ("unexplained", 0.50), "held"),  # a name that a room too warm gave
    (("unexplained", None), ("unexplained", None), "held")])
def test_a_room_that_is_held_stands_unless_nothing_is_named_and_another_day_says_no(free: Any, held: Any, stands: str
                                                                                     ) -> None:
    one, other = answer(*free), answer(*held)
    assert unless_worse(one, other) is {"free": one, "held": other}[stands]
