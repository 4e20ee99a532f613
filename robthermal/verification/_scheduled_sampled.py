"""Sampled feedback of currents: what the current of the last sample differs from that of now (proof note, 13).

Between samples I = I0 + F (x_k - x0). Of every module |F_k (x_k - x)| grows no faster than |F_k E^-1 f(x, I)|, which
the slopes of the box bound; ∂f/∂I turns that into heat.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from flint import arb, arb_mat, fmpq

from ._fields import Interval
from ._flow import control_points
from ._lyapunov import link_slopes
from ._numbers import show
from ._residual import Heats
from ._system import Region, ThermalSystem
from ._vertices import Entries


@dataclass(frozen=True)
class Held:
    """Sample time T [s] and the rate that is claimed from sample to sample [1/s]."""

    sample_time: fmpq
    rate: fmpq


@dataclass(frozen=True)
class Slopes:
    """Groups of slopes J [W/K], of each module its ∂f/∂I as (hot, cold) pairs [W/A]."""

    groups: list[list[Entries]]
    inputs: list[tuple[int, int, list[tuple[fmpq, fmpq]]]]


def sampled_failure(held: Held, rate: fmpq, level: fmpq, left: arb, gains: tuple[arb, arb]) -> str:
    """Return which inequality of a sampled feedback is not proven, empty where both are.

    ``rate``: of the feedback without samples; ``left``: bound of |E^-1 f(x0, I0)|_P; ``gains``: as `sampled_gains`.
    T/2 (rate² + C) <= rate - claimed, and r + T/2 ((rate² + C) √level + C' r) < rate √level.
    """
    growth, pushed = gains
    half, edge = arb(held.sample_time) / 2, arb(level).sqrt()
    more = half * (arb(rate) ** 2 + growth)
    if not more <= arb(rate - held.rate):
        left_over = float((arb(rate) - more).lower())
        return (f"sampled every {show(held.sample_time)} s: of the rate {float(left_over):.3g} 1/s is left, less than "
                f"{show(held.rate)} 1/s" if left_over > 0 else
                f"sampled every {show(held.sample_time)} s: the decay is lost between the samples, or cannot be proven")
    if not left + more * edge + half * pushed * left < arb(rate) * edge:
        return f"sampled every {show(held.sample_time)} s: the heat left at the operating point is too large"
    return ""


def sampled_gains(system: ThermalSystem, region: Region, heats: Heats, gain: Sequence[Sequence[fmpq]],
                  P: arb_mat, W: arb_mat) -> tuple[arb, arb] | str:
    """Return C = Σ c_k h_k and C' = Σ c_k κ_k, or what is missing to bound a slope.

    c_k: largest |E^-1 ∂f/∂I_k|_P; κ_k = |F_k|_*; h_k: bound of |F_k E^-1 (J + ∂f/∂I F)|_* in two parts, J by its middle
    and what each group may add; |v|_* = √(v W v').
    """
    n = len(system.lumps)
    found = _slopes(system, region, heats)
    if isinstance(found, str):
        return found
    rows = [arb_mat(1, n, [arb(entry) for entry in row]) for row in gain]
    scaled = [[arb(entry / capacity) for entry, capacity in zip(row, system.capacity, strict=True)] for row in gain]
    kappa = [_length(row, W) for row in rows]
    growth, pushed = arb(0), arb(0)
    for k, (hot, cold, points) in enumerate(found.inputs):
        strength = _largest(_length(_column(n, {hot: b_h / system.capacity[hot], cold: b_c / system.capacity[cold]}), P)
                            for b_h, b_c in points)
        speed = _speed(scaled[k], found.groups, W)
        for m, (h, c, others) in enumerate(found.inputs):
            speed += kappa[m] * _largest(abs(scaled[k][h] * arb(b_h) + scaled[k][c] * arb(b_c)) for b_h, b_c in others)
        growth += strength * speed
        pushed += strength * kappa[k]
    return growth.upper(), pushed.upper()


def _speed(row: Sequence[arb], groups: Sequence[Sequence[Entries]], W: arb_mat) -> arb:
    """Return |row J|_* of the middle, and the largest distance from it of every group."""
    total: Entries = {}
    spread = arb(0)
    for group in groups:
        middle: Entries = {}
        for entries in group:
            for place, value in entries.items():
                middle[place] = middle.get(place, fmpq(0)) + value / len(group)
        for place, value in middle.items():
            total[place] = total.get(place, fmpq(0)) + value
        if len(group) > 1:
            spread += _largest(_length(_moved(row, {place: entries.get(place, fmpq(0)) - value
                                                    for place, value in middle.items()}), W) for entries in group)
    return _length(_moved(row, total), W) + spread


def _slopes(system: ThermalSystem, region: Region, heats: Heats) -> Slopes | str:
    base, nonlinear, missing = link_slopes(system, region, heats.ambient)
    if missing:
        return missing
    groups = [[base], *([entries for entries, _, _ in group] for group in nonlinear)]
    inputs = []
    for k, module in enumerate(system.modules):
        h, c = module.hot, module.cold
        box: tuple[Interval, Interval, Interval] = (region.temperature[h], region.temperature[c], region.current[k])
        points = [point for form in system.forms(k) for point in control_points(form, box)]
        groups.append([{(h, h): hh, (h, c): hc, (c, h): ch, (c, c): cc} for hh, hc, ch, cc, _, _ in points])
        inputs.append((h, c, [(b_h, b_c) for *_, b_h, b_c in points]))
    return Slopes(groups, inputs)


def _moved(row: Sequence[arb], entries: Entries) -> arb_mat:
    found = [arb(0)] * len(row)
    for (i, j), value in entries.items():
        found[j] += row[i] * arb(value)
    return arb_mat(1, len(row), found)


def _column(n: int, entries: dict[int, fmpq]) -> arb_mat:
    return arb_mat(1, n, [arb(entries.get(i, fmpq(0))) for i in range(n)])


def _length(row: arb_mat, form: arb_mat) -> arb:
    squared = (row * form * row.transpose())[0, 0]
    return squared.upper().sqrt().upper() if squared.upper() > 0 else arb(0)


def _largest(values: Iterable[arb]) -> arb:
    found = arb(0)
    for value in values:
        upper = value.upper()
        found = upper if upper > found else found
    return found
