"""Matrices of the estimation error over a box of temperatures and currents: A_d - L C + Γ ∂f/∂x."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from ..errors import InputError
from ..thermal import Equations, System
from ._modules import Array
from ._observer_model import ObserverModel

Interval = tuple[float, float]
Temperatures = Interval | Mapping[str, Interval]
_COLDEST = 150.0  # K: below, a temperature is in Celsius
_MOST = 256  # combinations of vertices looked at; beyond, a seeded sample of them


@dataclass(frozen=True)
class Block:
    """Heat slopes [[hh, hc], [ch, cc]] of one module at points of the box.

    Parameters
    ----------
    a, b : int
        Hot and cold lump.
    frozen : ndarray, shape (k, 2, 2)
        At corners of temperature and current: attained, so an unstable one refutes.
    hull : ndarray, shape (k, 2, 2)
        Corners whose convex hull holds every slope in the box, (I, I²) by the triangle around the parabola.
    """

    a: int
    b: int
    frozen: Array
    hull: Array


def blocks(system: System, current: Mapping[str, Interval], temperature: Temperatures) -> list[Block]:
    """Slopes of every module over a box."""
    if any(link.natural is not None or link.radiation is not None for link in system.links):
        raise InputError("natural convection and radiation links", where="argument system",
                         expected="linear links over a box", remedy="Give them a linear conductance for this design.")
    _expect_ranges(current)
    for name in (*system.modules, *current):
        if name not in current or name not in system.modules:
            raise InputError(f"module {name!r} has no range" if name in system.modules else f"no module {name!r}",
                             where="argument current", expected='{"m1": (lower, upper), …}, every module named [A]')
    return [_block(system, name, _pair(current[name], "current"), temperature) for name in system.modules]


def check_box(system: System, current: Mapping[str, Interval], temperature: Temperatures,
              where: str = "argument temperature") -> None:
    """Refuse a box of temperatures without the steady state of the currents nearest to zero: nothing stays in it."""
    _expect_ranges(current)
    ranges = {name: _pair(current[name], "current") for name in system.modules if name in current}
    nearest = {name: float(np.clip(0.0, low, high)) for name, (low, high) in ranges.items()}
    for lump, value in zip(system.lump_names, _settled(system, nearest), strict=False):
        pair = temperature.get(lump) if isinstance(temperature, Mapping) else temperature
        low, high = (-np.inf, np.inf) if pair is None else _pair(pair, "temperature", _COLDEST)
        if not low <= value <= high:
            at = ", ".join(f"{name} at {amps:g} A" for name, amps in nearest.items())
            raise InputError(f"the box ({low:g}, {high:g}) K excludes the equilibrium: lump {lump!r} settles at "
                             f"{value:.2f} K with {at}", where=where,
                             expected="a box with the temperatures the system works at",
                             remedy="Widen the box; kelvin, not degrees Celsius.")


def _settled(system: System, current: Mapping[str, float]) -> list[float]:
    """Temperatures at rest with constant currents, by Newton from the initial ones; empty where that does not end."""
    eq = Equations(system)
    x, u = eq.initial(), eq.nominal()
    for name, value in current.items():
        u[system.exogenous_names.index(name)] = value
    for _ in range(30):
        change = np.linalg.solve(eq.jacobian(x, u).toarray(), eq.heat(x, u))
        x = x - change
        if np.abs(change).max() < 1e-9:
            return x.tolist()
    return []


def _block(system: System, name: str, current: Interval, temperature: Temperatures) -> Block:
    part = system.modules[name]
    faces = [_pair(temperature[lump] if isinstance(temperature, Mapping) else temperature, "temperature", _COLDEST)
             for lump in (part.hot, part.cold)]
    low, high = current
    currents = [(low, low * low), (high, high * high)]
    hull = [*currents, (0.5 * (low + high), low * high)]
    if low < 0 < high:
        currents.append((0.0, 0.0))
    corners = list(product(*faces))
    return Block(system.lump_names.index(part.hot), system.lump_names.index(part.cold),
                 np.array([_slopes(part, x, y, *i) for (x, y), i in product(corners, currents)]),
                 np.array([_slopes(part, x, y, *i) for (x, y), i in product(corners, hull)]))


def _slopes(part: object, x_h: float, x_c: float, current: float, square: float) -> Array:
    """Entries of the errata without the conductance at the reference temperature, affine in (I, I²)."""
    S, R, K = (getattr(part, key) for key in ("seebeck", "resistance", "conductance"))
    dT = 0.5 * (x_h + x_c) - part.reference_temperature  # type: ignore[attr-defined]  # a Module
    pump, joule = (S.value + S.slope * dT) * current, 0.25 * R.slope * square
    leak, bend = K.slope * dT, 0.5 * K.slope * (x_h - x_c)
    return np.array([[pump + 0.5 * S.slope * x_h * current + joule - leak - bend,
                      0.5 * S.slope * x_h * current + joule + leak - bend],
                     [-0.5 * S.slope * x_c * current + joule + leak + bend,
                      -pump - 0.5 * S.slope * x_c * current + joule - leak + bend]])


def error_matrices(model: ObserverModel, gain: Array, found: list[Block]) -> Iterator[Array]:
    """A_d - L C + Γ ∂f/∂x at corners of the box, modules independent."""
    own = model.A_d - gain @ model.C
    ways = [range(len(block.frozen)) for block in found]
    total = int(np.prod([len(way) for way in ways]))
    if total <= _MOST:
        choices: Iterator[tuple[int, ...]] = product(*ways)
    else:  # every corner for all modules alike, and a sample of the others
        rng = np.random.default_rng(0)
        alike = [tuple(k % len(way) for way in ways) for k in range(max(len(way) for way in ways))]
        choices = iter(alike + [tuple(int(rng.integers(len(way))) for way in ways) for _ in range(_MOST)])
    for choice in choices:
        F = np.zeros_like(own)
        for block, k in zip(found, choice, strict=True):
            F[np.ix_([block.a, block.b], [block.a, block.b])] += block.frozen[k]
        yield own + model.Gamma @ F


def largest_radius(model: ObserverModel, gain: Array, found: list[Block]) -> float:
    """Largest spectral radius of the frozen error matrices: at 1 or above, some constant current is unstable."""
    return max(float(np.abs(np.linalg.eigvals(M)).max()) for M in error_matrices(model, gain, found))


def _expect_ranges(current: object) -> None:
    if not isinstance(current, Mapping):
        raise InputError(f"current = {current!r}", where="argument current", expected='{"m1": (lower, upper), …} [A]')


def _pair(pair: Interval, argument: str, least: float = -np.inf) -> Interval:
    try:
        low, high = (float(value) for value in pair)
    except (TypeError, ValueError):
        low, high = np.nan, np.nan
    if not (np.isfinite([low, high]).all() and least <= low <= high):
        raise InputError(f"{pair!r}", where=f"argument {argument}",
                         expected="(lower, upper)" + (" in kelvin" if least > 0 else " in ampere"))
    return low, high
