"""How long a proof in exact numbers would take, counted before it is begun."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from flint import fmpq

from ._system import Region, ThermalSystem

_MOST = 1e6  # evaluations of one module at one corner with short numbers, some 20 s
_SHORT = 200  # bits


def product_up_to(sizes: Iterable[int], most: int) -> int:
    """Return a product of sizes, or a number above ``most`` where it is larger."""
    total = 1
    for size in sizes:
        total *= size
        if total > most:
            break
    return total


def too_many_corners(system: ThermalSystem, region: Region, corners: int, numbers: Sequence[fmpq] = ()) -> str:
    """Return why ``corners`` evaluations of every vertex of every module take too long, empty where they do not.

    Long numbers count more: those of the box, of the modules, and ``numbers``.
    """
    total = corners * sum(len(system.forms(k)) for k in range(len(system.modules)))
    factor = 1 + longest(_numbers(system, region, numbers)) / _SHORT if total else 0
    if total * factor <= _MOST:
        return ""
    return (f"{total} corners of {len(system.modules)} modules and their uncertain numbers, or numbers of too many "
            f"digits: too many to check in exact numbers (at most {_MOST:g} with numbers of double precision)")


def longest(numbers: Iterable[fmpq]) -> int:
    """Return the bits of the longest numerator or denominator."""
    return max((max(value.p.bit_length(), value.q.bit_length()) for value in numbers), default=1)


def _numbers(system: ThermalSystem, region: Region, numbers: Sequence[fmpq]) -> Iterable[fmpq]:
    yield from numbers
    for interval in (*region.temperature, *region.current):
        yield from interval
    for module in system.modules:
        yield from (*module.seebeck, *module.resistance, *module.conductance, module.reference)
