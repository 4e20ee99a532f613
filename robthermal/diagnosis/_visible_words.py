"""How large a change a comparison of two days would have shown, in words."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..thermal import parameter_in_words

_LISTED = 2  # of the least visible
_NEARLY_ALL, _TWICE = 0.9, 1.0  # relative decrease and increase above which a number says nothing more
_ALIKE = 1.25  # ratio of increase and decrease up to which one number is said


def visible_in_words(visible: Mapping[str, Mapping[str, float]]) -> list[str]:
    """What may have changed without being visible, a sentence each, the least visible first; none without parameters.

    Parameters
    ----------
    visible : mapping
        Smallest visible decrease and increase of every parameter, as `Compared.visible`.

    Examples
    --------
    >>> for sentence in visible_in_words({"inputs.motor.gain": {"lower": float("inf"), "higher": 1.14},
    ...                                  "links.base-hall.conductance": {"lower": 0.19, "higher": 0.23}}):
    ...     print(sentence)
    The gain of motor could be 90 % lower or doubled, and these records need not show it.
    Smaller changes than these may not be visible: the conductance of link base-hall (23 %).
    """
    hardly = [name for name, size in visible.items() if size["lower"] >= _NEARLY_ALL and size["higher"] > _TWICE]
    rest = sorted((name for name in visible if name not in hardly), key=lambda name: -max(visible[name].values()))
    said = []
    if hardly:
        which = " or ".join(map(_words, hardly))
        which = which[0].upper() + which[1:]
        said.append(f"{which} could be 90 % lower or doubled, and these records need not show it.")
    if rest:
        sizes = [f"{_words(name)} ({_size(**visible[name])})" for name in rest[:_LISTED]]
        if more := [visible[name] for name in rest[_LISTED:]]:
            largest = {way: max(size[way] for size in more) for way in ("lower", "higher")}
            sizes.append(f"any other parameter ({_size(**largest)})")
        said.append(f"Smaller changes than these may not be visible: {'; '.join(sizes)}.")
    return said


def _words(name: str) -> str:
    return " and ".join(map(parameter_in_words, name.split(" = ")))


def _size(lower: float, higher: float) -> str:
    if max(lower, higher) <= _ALIKE * min(lower, higher):
        return f"{_percent(max(lower, higher))} %"
    down = "more than 90" if lower >= _NEARLY_ALL else _percent(lower)
    up = "more than 100" if higher > _TWICE else _percent(higher)
    return f"{down} % lower, {up} % higher"


def _percent(size: float) -> str:
    return f"{math.ceil(100 * size - 1e-9)}"
