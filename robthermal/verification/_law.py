"""The feedback-linearizing law and its limiter over a box: slopes of the heats that the modules bring.

v = K (x_h - x_c) + R I²/2 - S x_c I is solved for the current I and limited to [low, high]. Per module a small change
of temperatures and of v changes the heats into the two faces. Between the limits (the cold face gets v, Evers (5.15))
    heat_h = a_h dx_h + a_c dx_c + k dv,   heat_c = dv,   dI = g_h dx_h + g_c dx_c + g_v dv,
with k = b_h/b_c, a_h = J_hh - k J_ch, a_c = J_hc - k J_cc, g = (-J_ch, -J_cc, 1)/b_c, b = ∂(heats)/∂I; at a limit
dI = 0 (proof note, loops).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from itertools import product
from typing import Any

from flint import arb, fmpq

from ._fields import Interval
from ._numbers import name_of, show
from ._system import Module, Quadratic, peak
from ._vertices import ends

_CELLS = 6  # per temperature and current, for the enclosure of the slopes of the law


@dataclass(frozen=True)
class Variation:
    """Bounds over the box for one module, faces in the order hot, cold.

    ``size`` of |J| without the conductance at the reference temperature, and how much J and b = ∂(heats)/∂I can change
    while the temperatures move within one sample.
    """

    size: tuple[tuple[fmpq, fmpq], tuple[fmpq, fmpq]]
    slope: tuple[tuple[fmpq, fmpq], tuple[fmpq, fmpq]]
    drive: tuple[fmpq, fmpq]


@dataclass(frozen=True)
class _Slope:
    """A number with its derivatives by x_h, x_c and I, in balls."""

    value: arb
    by: tuple[arb, arb, arb]

    def __add__(self, other: Any) -> _Slope:
        o = _slope(other)
        return _Slope(self.value + o.value, _each(lambda a, b: a + b, self, o))

    def __sub__(self, other: Any) -> _Slope:
        o = _slope(other)
        return _Slope(self.value - o.value, _each(lambda a, b: a - b, self, o))

    def __mul__(self, other: Any) -> _Slope:
        o = _slope(other)
        return _Slope(self.value * o.value, _each(lambda a, b: a * o.value + self.value * b, self, o))

    def __truediv__(self, other: Any) -> _Slope:
        o = _slope(other)
        ratio = self.value / o.value
        return _Slope(ratio, _each(lambda a, b: (a - ratio * b) / o.value, self, o))

    def __radd__(self, other: Any) -> _Slope:
        return self + other

    def __rmul__(self, other: Any) -> _Slope:
        return self * other

    def __neg__(self) -> _Slope:
        return self * -1


def _slope(value: Any) -> _Slope:
    return value if isinstance(value, _Slope) else _Slope(arb(value), (arb(0),) * 3)


def _each(rule: Callable[[arb, arb], arb], a: _Slope, b: _Slope) -> tuple[arb, arb, arb]:
    return rule(a.by[0], b.by[0]), rule(a.by[1], b.by[1]), rule(a.by[2], b.by[2])


def unfit(module: Module, hot: Interval, cold: Interval, current: Interval) -> str:
    """Return why the law has no unique current over the box, empty where it has."""
    for h, c in product(ends(hot), ends(cold)):
        offset = (h + c) / 2 - module.reference
        S, R = (pair[0] + pair[1] * offset for pair in (module.seebeck, module.resistance))
        if S <= 0 or R <= 0:
            return f"S or R of module {name_of(module.name)} is not positive over the box"
    for cell in product(*(_pieces(interval) for interval in (hot, cold, current))):
        left = -_drive(module, *cell)[1]
        if not left > 0:
            return (f"module {name_of(module.name)} can reach its optimal current S x_c/R in the box (S x_c - R I may "
                    f"be {show(left.lower().fmpq())} V there): the law has no slope")
    return ""


def free_slopes(module: Module, hot: Interval, cold: Interval, current: Interval) -> list[arb]:
    """Return balls around a_h, a_c, k, g_h, g_c, g_v between the limits, by the mean-value theorem cell by cell."""
    found = []
    for cell in product(*(_pieces(interval) for interval in (hot, cold, current))):
        middle = [ball.mid() for ball in cell]
        moves = [ball - own for ball, own in zip(cell, middle, strict=True)]
        at_middle = _law_slopes(module, *(_slope(value) for value in middle))
        unit = [_Slope(ball, (arb(k == 0), arb(k == 1), arb(k == 2))) for k, ball in enumerate(cell)]
        found.append([own.value + sum((by * move for by, move in zip(full.by, moves, strict=True)), arb(0))
                      for own, full in zip(at_middle, _law_slopes(module, *unit), strict=True)])
    return [reduce(arb.union, column) for column in zip(*found, strict=True)]


def _law_slopes(module: Any, h: _Slope, c: _Slope, x: _Slope) -> list[_Slope]:
    hh, hc, cc, ch = (a + b * x + d * (x * x) for a, b, d in module.entries(h, c))
    b_h, b_c = _drive(module, h, c, x)
    k = b_h / b_c
    return [hh - k * ch, hc - k * cc, k, -ch / b_c, -cc / b_c, _slope(1) / b_c]


def fixed_slopes(module: Module, hot: fmpq, cold: fmpq, current: fmpq) -> tuple[fmpq, fmpq, fmpq, fmpq]:
    """Return hh, hc, cc, ch with the current given: affine in the temperatures."""
    hh, hc, cc, ch = (a + b * current + d * current**2 for a, b, d in module.entries(hot, cold))
    return hh, hc, cc, ch


def variation(module: Module, hot: Interval, cold: Interval, current: Interval, drift: fmpq | None) -> Variation:
    """Return how large and how variable the slopes of one module are; exact maxima at vertices."""
    K = module.conductance[0]
    rest: tuple[Quadratic, ...] = ((K, fmpq(0), fmpq(0)), (-K, fmpq(0), fmpq(0))) * 2
    corners = [[_sum(entry, more) for entry, more in zip(module.entries(h, c), rest, strict=True)]
               for h, c in product(ends(hot), ends(cold))]
    size = [max(_largest(corner[k], current) for corner in corners) for k in range(4)]
    # every entry is affine in the temperatures: its slope is the difference over one kelvin
    start = module.entries(hot[0], cold[0])
    by_hot = [_minus(a, b) for a, b in zip(module.entries(hot[0] + 1, cold[0]), start, strict=True)]
    by_cold = [_minus(a, b) for a, b in zip(module.entries(hot[0], cold[0] + 1), start, strict=True)]
    moves = [width if drift is None else min(width, drift) for width in (hot[1] - hot[0], cold[1] - cold[0])]
    slope = [moves[0] * _largest(by_hot[k], current) + moves[1] * _largest(by_cold[k], current) for k in range(4)]
    drive = [fmpq(0)] * 4  # |∂b_h/∂x_h|, |∂b_h/∂x_c|, |∂b_c/∂x_h|, |∂b_c/∂x_c|: affine in x_h, x_c, I
    dS, dR = module.seebeck[1] / 2, module.resistance[1] / 2
    for h, c, x in product(ends(hot), ends(cold), ends(current)):
        S = module.seebeck[0] + module.seebeck[1] * ((h + c) / 2 - module.reference)
        partial = (S + dS * h + dR * x, dS * h + dR * x, -dS * c + dR * x, -S - dS * c + dR * x)
        drive = [max(old, abs(new)) for old, new in zip(drive, partial, strict=True)]
    return Variation(((size[0], size[1]), (size[3], size[2])), ((slope[0], slope[1]), (slope[3], slope[2])),
                     (drive[0] * moves[0] + drive[1] * moves[1], drive[2] * moves[0] + drive[3] * moves[1]))


def _pieces(interval: Interval) -> list[arb]:
    low, high = interval
    if low == high:
        return [arb(low)]
    marks = [arb(low + (high - low) * k / _CELLS) for k in range(_CELLS + 1)]
    return [a.union(b) for a, b in zip(marks[:-1], marks[1:], strict=True)]


def _drive(module: Module, hot: Any, cold: Any, current: Any) -> tuple[Any, Any]:
    """Return b_h = S x_h + R I and b_c = R I - S x_c of balls, or of balls with derivatives."""
    offset = (hot + cold) / 2 - module.reference
    S, R = (pair[1] * offset + pair[0] for pair in (module.seebeck, module.resistance))
    return S * hot + R * current, R * current - S * cold


def _sum(a: Quadratic, b: Quadratic) -> Quadratic:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _minus(a: Quadratic, b: Quadratic) -> Quadratic:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _largest(value: Quadratic, current: Interval) -> fmpq:
    """Return the exact maximum of |a + b I + c I²|."""
    opposite = (-value[0], -value[1], -value[2])
    return max(peak(value, current)[0], peak(opposite, current)[0])
