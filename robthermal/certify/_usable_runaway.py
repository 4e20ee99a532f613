"""The bound of a usable current by thermal runaway: I* of the network's fold, or the coldest steady state."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any

from ..errors import InputError
from ..thermal import System, fold
from ..verification import Certificate
from ._coldest import coldest_current
from ._regulated import SetPoints, largest_regulated_current
from ._sections import Interval, named_ranges
from ._usable_bounds import Question
from ._usable_result import CurrentBound

OF_FOLD = 0.98  # share of I* that is used: it is computed, and at I* itself nothing is left


def runaway_bound(question: Question, setpoint: SetPoints | None) -> tuple[CurrentBound, str | None]:
    """The bound, and the parameter whose range costs most of it."""
    system = question.system
    if question.direction == "heating":
        return CurrentBound(float("inf"), None, "computed",
                            "Heating currents have no fold: more current always heats; the box limits them."), None
    held = _points(system, setpoint or {})
    free = [name for name in system.modules if name not in held]

    def smallest(numbers: Mapping[str, float]) -> tuple[float, float]:
        """0.98 I* of the modules with set-points, and the coldest current of the others."""
        machine = system.with_parameters(dict(numbers))
        return (OF_FOLD * _fold_current(machine, held, question),
                coldest_current(machine, free, question.ambient, question.heat) if free else float("inf"))

    nominal = smallest({})
    worst, costly = _worst(question.parameters, nominal, smallest)
    current = min(worst)
    proof = _proof(question, setpoint, current) if held else None
    return CurrentBound(current, proof, "computed", _text(worst, free, question)), costly


def fold_current(question: Question, setpoint: SetPoints) -> float:
    """I* of the modules with set-points for the worst set-points, ambients, heats and parameters [A]."""
    held = _points(question.system, setpoint)

    def smallest(numbers: Mapping[str, float]) -> tuple[float, float]:
        return _fold_current(question.system.with_parameters(dict(numbers)), held, question), float("inf")

    return _worst(question.parameters, smallest({}), smallest)[0][0]


def _points(system: System, setpoint: SetPoints) -> dict[str, Interval]:
    pairs = {name: pair if isinstance(pair, (tuple, list)) else (pair, pair) for name, pair in setpoint.items()}
    found = named_ranges(pairs, system.module_names, "setpoint", "module", kelvin=True)
    return {name: (low, high) for name, (low, high) in found.items()}


def _fold_current(system: System, held: Mapping[str, Interval], question: Question) -> float:
    """Smallest I* over the modules and the corners of set-points, ambients and heats (all low, all high) [A]."""
    if not held:
        return float("inf")
    found = []
    for end in (0, 1) if any(high > low for low, high in question.heat.values()) else (0,):
        machine = system.with_parameters({f"lumps.{name}.heat": pair[end] for name, pair in question.heat.items()})
        pairs = [*held.values(), *question.ambient.values()]
        for corner in product(*(sorted(set(pair)) for pair in pairs)):
            points = dict(zip(held, corner, strict=False))
            around = dict(zip(question.ambient, corner[len(held):], strict=True))
            found.append(float(fold(machine, points, ambient=around, points=2).current[-1].min()))
    return min(found)


def _worst(parameters: Mapping[str, Any], nominal: tuple[float, float],
           smallest: Callable[[Mapping[str, float]], tuple[float, float]]) -> tuple[tuple[float, float], str | None]:
    """Smallest currents with every parameter at its own worst end, all together, and which one costs most."""
    if not parameters:
        return nominal, None
    worst: list[dict[str, float]] = [{}, {}]
    cost = {}
    for name, (low, high) in parameters.items():
        up = smallest({name: high})
        cost[name] = abs(min(up) - min(nominal))
        for kind in (0, 1):
            worst[kind][name] = high if up[kind] < nominal[kind] else low
    together = min(nominal[0], smallest(worst[0])[0]), min(nominal[1], smallest(worst[1])[1])
    return together, max(cost, key=lambda name: cost[name])


def _proof(question: Question, setpoint: SetPoints | None, current: float) -> Certificate | None:
    """Certificate that the machine contracts while the cold faces are held, for currents up to the largest provable."""
    system = question.system
    held = [system.modules[name].cold for name in setpoint or {}]
    temperature: Any = {name: (float(low), float(high)) for name, low, high in
                        zip(system.lumps, *question.stated, strict=True) if name not in held}
    others = {name: (0.0, current) for name in system.modules if name not in (setpoint or {})}
    try:
        limit = largest_regulated_current(system, setpoint=setpoint or {}, temperature=temperature, current=others,
                                          parameters=question.parameters)
    except InputError:  # cascades, and ranges that this kind does not cover: there is no such certificate
        return None
    return limit.certificate if limit.outcome.ok else None


def _text(worst: Sequence[float], free: Sequence[str], question: Question) -> str:
    where = " for the worst parameters" * bool(question.parameters)
    if worst[0] <= worst[1]:
        return f"0.98 I*, the fold of the network at the set-points and the worst ambient{where}."
    return (f"Beyond it more current heats the cold face of {' or '.join(free)} in steady state{where}, at the worst "
            "ambient and heat.")
