"""The four bounds of a usable current: contraction in the stated box, an invariant box inside it, runaway, rating."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import Any, Literal

import numpy as np

from ..errors import InputError
from ..thermal import DrivableRange, System, drivable_range
from ..verification import Certificate
from ._contraction import Method
from ._enclosure import RESERVE, named_box, no_box
from ._energy import energy_rate
from ._faces import Array, Faces
from ._invariance import invariance
from ._jacobian import BoxJacobian, box_jacobian
from ._limits import Direction, bisect, current_range, largest_current
from ._lyapunov import largest_growth
from ._polytope import polytope
from ._sections import Interval, Temperatures, temperature_box
from ._smallest_box import smallest_box
from ._usable_result import CurrentBound
from ._weights import has_weights

Lower = Literal["inside", "reported"]
_ROOM = 3.0  # times the reserve of the search, kept in the certified box where there is room for it


@dataclass(frozen=True)
class Question:
    """What is asked of a machine: its ranges, the stated box and the direction of the currents."""

    system: System
    direction: Direction
    temperature: Temperatures
    ambient: Mapping[str, Interval]
    heat: Mapping[str, Interval]
    parameters: Mapping[str, Any]
    lower: Lower
    method: Method

    @cached_property
    def stated(self) -> Array:
        """The stated box, (2, n) [K]."""
        given = temperature_box(self.system, self.temperature)
        return np.array([given[name] if isinstance(given, Mapping) else given for name in self.system.lumps]).T

    @cached_property
    def faces(self) -> Faces:
        """Heat through the faces of boxes of this machine."""
        return Faces(self.system, self.ambient, self.heat, self.parameters, RESERVE)

    @cached_property
    def roomy_faces(self) -> Faces:
        """The same with a larger reserve, for boxes that have room in the stated one."""
        return replace(self.faces, reserve=_ROOM * self.faces.reserve)

    def without(self, name: str) -> Question:
        """The same with one parameter at its value in the system."""
        return replace(self, parameters={key: pair for key, pair in self.parameters.items() if key != name})

    def check_box(self) -> None:
        """Refuse a stated box that excludes the ambients: the machine at rest would be outside it."""
        low, high = self.faces.surroundings[0].min(), self.faces.surroundings[1].max()
        for name, (least, most) in zip(self.system.lumps, self.stated.T, strict=True):
            if high > most or (low < least and self.lower == "inside"):
                raise InputError(
                    f"the box of lump {name!r}, {least:.2f} to {most:.2f} K, excludes ambients of {low:.2f} to "
                    f"{high:.2f} K, where the machine is at rest", where="argument temperature",
                    expected="a box with the whole range of the ambients inside",
                    remedy="Widen it, or narrow `ambient`.")

    def box(self, c: float, start: Array | None = None, *, roomy: bool = False) -> Array | None:
        """Smallest invariant box for currents up to c, if it is inside the stated one and may contract."""
        current = current_range(self.system, self.direction, c)
        box = smallest_box(self.roomy_faces if roomy else self.faces, current, start)
        if box is None or (box[1] > self.stated[1]).any():
            return None
        if self.lower == "inside" and (box[0] < self.stated[0]).any():
            return None
        region = {"temperature": {name: list(pair) for name, pair in named_box(self.system, box).items()},
                  "current": current, "parameters": self.parameters}
        return box if may_contract(box_jacobian(self.system, region), self.method) else None

    def certified_box(self, c: float) -> tuple[dict[str, Interval], Certificate]:
        """Box at a current, by lump, and the certificate that it is never left; empty where there is none."""
        current, box = current_range(self.system, self.direction, c), self.box(c, roomy=True)
        if box is None:
            box = self.box(c)
        if box is None:
            return {}, no_box(self.system, current)
        named = named_box(self.system, box)
        return named, invariance(self.system, current=current, temperature=named, ambient=self.ambient,
                                 heat=self.heat or None, parameters=self.parameters)


def may_contract(box: BoxJacobian, method: str) -> bool:
    """Whether a certificate of a method may exist; quick and without proof."""
    if method == "energy":
        return energy_rate(box) > 0
    return largest_growth(polytope(box)) < 0 if method == "lyapunov" else has_weights(box, method)


def contraction_bound(question: Question) -> CurrentBound:
    """Largest current with which the stated box contracts."""
    q = question
    limit = largest_current(q.system, temperature=q.temperature, direction=q.direction, method=q.method,
                            parameters=q.parameters)
    text = ("Up to it any two temperature histories inside the stated box approach each other (norm of method "
            f"{q.method!r}); that they stay inside is not part of it.")
    return CurrentBound(limit.current, limit.certificate, "proven", text if limit.certificate.holds else
                        limit.outcome.text)


def largest_box_current(question: Question) -> float:
    """Largest current with an invariant box inside the stated one [A]."""
    known: list[Array] = []  # boxes of smaller currents lie inside those of larger ones

    def holds(c: float) -> bool:
        box = question.box(c, known[-1] if known else None)
        if box is not None:
            known.append(box)
        return box is not None

    return bisect(holds, precision=1e-4)[0]


def rating_bound(question: Question) -> CurrentBound:
    """Least declared limit of the modules in this direction: rating, bridge, and what the supply drives in the box."""
    found = {name: _drivable(question, name) for name in question.system.modules}
    ends: dict[str, Callable[[DrivableRange], tuple[float, str]]] = {
        "cooling": lambda one: (one.high, one.why_high), "heating": lambda one: (-one.low, one.why_low),
        "symmetric": lambda one: min((one.high, one.why_high), (-one.low, one.why_low))}
    sizes = {name: ends[question.direction](one) for name, one in found.items()}
    least = min(sizes, key=lambda name: sizes[name][0])
    size, why = sizes[least]
    if not isfinite(size):
        return CurrentBound(float("inf"), None, "declared", "The system file declares no current_limits.")
    text = f"{why} of module {least!r} in the system file." if why == "current_limits" else f"Module {least!r}: {why}."
    return CurrentBound(max(0.0, size), None, "declared", text)


def _drivable(question: Question, name: str) -> DrivableRange:
    """Currents of a module with both faces anywhere in the stated box."""
    module, lumps = question.system.modules[name], list(question.system.lumps)
    faces = question.stated[:, [lumps.index(module.cold), lumps.index(module.hot)]]
    return drivable_range(module, (float(faces[0].min()), float(faces[1].max())))
