"""Heat flows that are left at an operating point, over ranges of ambients, loads and uncertain numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from flint import arb, arb_mat, fmpq

from ._fields import Interval
from ._slopes import power
from ._system import Link, Module, ThermalSystem


@dataclass(frozen=True)
class Heats:
    """Operating temperatures [K], ranges of ambients [K] and of loads on lumps [W]."""

    temperatures: tuple[fmpq, ...]
    ambient: Mapping[str, Interval]
    heat: Mapping[int, Interval]


def residual_norm(nominal: ThermalSystem, worst: ThermalSystem, heats: Heats, currents: Sequence[fmpq], P: arb_mat
                  ) -> arb:
    """Return a ball whose upper end is at least √(r'Pr), r = E^-1 f(x0, I0), for everything in the ranges.

    r is the sum of what links, modules and loads give. Each is replaced by its middle; what it may differ from that
    is added in the norm.
    """
    n = len(worst.lumps)
    total, spread = [arb(0)] * n, arb(0)
    for link in worst.links:
        lumps = [node for node in link.nodes if isinstance(node, int)]
        if not lumps:
            continue
        bounds = _flow(link, heats)
        middle, half = (bounds[0] + bounds[1]) / 2, (bounds[1] - bounds[0]) / 2
        way = [arb(0)] * n
        for sign, node in zip((1, -1), link.nodes, strict=True):
            if isinstance(node, int):
                way[node] = arb(sign / worst.capacity[node])
        total = [a + middle * b for a, b in zip(total, way, strict=True)]
        spread += half * _norm(way, P)
    for k, (low, high) in heats.heat.items():
        way = [arb(1 / worst.capacity[i]) if i == k else arb(0) for i in range(n)]
        total = [a + arb((low + high) / 2) * b for a, b in zip(total, way, strict=True)]
        spread += arb((high - low) / 2) * _norm(way, P)
    for k, current in enumerate(currents):
        middle_heat = _module(nominal.modules[k], worst, heats, current, n)
        total = [a + b for a, b in zip(total, middle_heat, strict=True)]
        away = arb(0)
        for form in worst.forms(k):
            own = _module(form, worst, heats, current, n)
            away = away.union(_norm([a - b for a, b in zip(own, middle_heat, strict=True)], P))
        spread += away.upper()
    return _norm(total, P).upper() + spread.upper()


def _norm(vector: Sequence[arb], P: arb_mat) -> arb:
    column = arb_mat(len(vector), 1, list(vector))
    squared = (column.transpose() * P * column)[0, 0]
    return squared.upper().sqrt() if squared.upper() > 0 else arb(0)


def _flow(link: Link, heats: Heats) -> tuple[arb, arb]:
    """Return lower and upper bound of the heat into the first node of a link [W]: affine in every uncertain number."""
    first, second = (_ends(node, heats) for node in link.nodes)
    least, most = [], []
    for a, b, g, k, c in product(first, second, _two(link.conductance, link.spread), _two(link.gain, link.gain_spread),
                                 _two(link.radiation, link.radiation_spread)):
        linear, difference = g * (b - a) + c * (b**4 - a**4), b - a
        convected = [k * difference * bound for bound in power(abs(difference), link.exponent)] if k != 0 else [fmpq(0)]
        least.append(linear + min(convected))
        most.append(linear + max(convected))
    return arb(min(least)), arb(max(most))


def _two(low: fmpq, width: fmpq) -> tuple[fmpq, ...]:
    return (low, low + width) if width != 0 else (low,)


def _ends(node: int | str, heats: Heats) -> tuple[fmpq, ...]:
    if isinstance(node, int):
        return (heats.temperatures[node],)
    low, high = heats.ambient[node]
    return (low, high) if low < high else (low,)


def _module(module: Module, system: ThermalSystem, heats: Heats, current: fmpq, n: int) -> list[arb]:
    """Return what a module gives to E^-1 f."""
    hot, cold = heats.temperatures[module.hot], heats.temperatures[module.cold]
    offset = (hot + cold) / 2 - module.reference
    S, R, K = (pair[0] + pair[1] * offset for pair in (module.seebeck, module.resistance, module.conductance))
    joule, conducted = R * current * current / 2, K * (cold - hot)
    found = [arb(0)] * n
    found[module.hot] = arb((S * hot * current + joule + conducted) / system.capacity[module.hot])
    found[module.cold] = arb((-S * cold * current + joule - conducted) / system.capacity[module.cold])
    return found
