"""What e'Pe can become after one sample of a loop, at every combination of slopes of its modules and links.

For every case: M'P~M + W'Y W + Σ w q² with M the sampled map, P~ = (P^-1 - X)^-1, W = dx'/ds at the start, X and Y the
matrices of `_between`. Each of these is convex in the slopes: the corners of their ranges suffice (proof note, loops).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

from flint import arb, arb_mat, fmpq

from ._between import Bounds, Deviation, Sampled, deviation, diagonal, sample
from ._definite import approximate, is_positive_preconditioned
from ._fields import Interval
from ._growth import Growth, too_many_cases
from ._law import fixed_slopes, free_slopes, unfit, variation
from ._loop_problem import Loop
from ._lyapunov import MOST_WORK, link_slopes
from ._numbers import name_of, show
from ._system import Module
from ._vertices import Entries, ends

_LARGEST = 80  # lumps: the exponentials are of four times this size
Row = list[arb]  # a linear function of (dx, dz)


@dataclass(frozen=True)
class Share:
    """What one module or link adds at one corner.

    Heats into ports; achieved - wanted where the current is limited; what moves it where it is free (`_current`).
    """

    heats: dict[int, Row]
    windup: Row | None
    free: tuple[Row, ...]
    where: str


def growth(problem: Loop, P: arb_mat) -> Growth | str:
    """Return the cases, lazily, or why there are none."""
    system, region = problem.system, problem.region
    base, nonlinear, missing = link_slopes(system, region)
    missing = missing or too_many_cases(region, problem.pieces, nonlinear, P.nrows())
    if missing:
        return missing
    faces = [(region.temperature[module.hot], region.temperature[module.cold]) for module in system.modules]
    for module, (hot, cold), current in zip(system.modules, faces, region.current, strict=True):
        if broken := unfit(module, hot, cold, current):
            return broken
    if len(system.lumps) > _LARGEST:
        return f"{len(system.lumps)} lumps: too many, at most {_LARGEST}"
    sampled = sample(system, base, problem.sample_time)
    if isinstance(sampled, str):
        return sampled
    currents = [_current(problem, k) for k in range(len(system.modules))]
    shares = [_module_shares(problem, k, rows) for k, (rows, _) in enumerate(currents)]
    shares += [[_link_share(problem, entries, words) for entries, words, _ in items] for items in nonlinear]
    total = math.prod(len(items) for items in shares)
    if total * P.nrows() ** 3 > MOST_WORK:
        return f"{total} combinations of slopes: too many to check one by one"
    if problem.plant == "held":
        return Growth(_cases(problem, P, sampled, shares, None), total)
    ports = sorted({lump for items in shares for share in items for lump in share.heats})
    expected = (len(ports), 2 * len(ports) + 4 * len(system.modules))
    if (len(problem.weights), len(problem.sizes)) != expected:
        return (f"weights and sizes must have {expected[0]} and {expected[1]} numbers: one per port; two per port and "
                "four per module")
    bounds = _bounds(problem, ports, [found for _, found in currents],
                     [(pair[0][0], pair[-1][0]) for pair in nonlinear])
    found = deviation(sampled, ports, system.capacity, problem.sample_time, bounds, problem.weights, problem.sizes)
    if isinstance(found, str):
        return found
    wider = P.inv() - _padded(found.scatter, P.nrows())
    if not is_positive_preconditioned(wider, approximate(wider)):
        return "P^-1 > X fails or cannot be proven: what happens between the samples is too much for this P"
    return Growth(_cases(problem, wider.inv(), sampled, shares, (found, ports)), total)


def _module_shares(problem: Loop, k: int, movers: tuple[Row, ...]) -> list[Share]:
    """Return the corners of one module: current free in each piece of its range, or at one of its limits."""
    module, current = problem.system.modules[k], problem.region.current[k]
    hot, cold = problem.region.temperature[module.hot], problem.region.temperature[module.cold]
    title = f"module {name_of(module.name)}"
    dv = _wanted(problem, k)
    found = []
    for low, high in _split(current, problem.pieces):
        a_h, a_c, gain = free_slopes(module, hot, cold, (low, high))[:3]
        for s_h, s_c, s_v in product(*((s.lower(), s.upper()) for s in (a_h, a_c, gain))):
            into = [s_v * entry for entry in dv]
            into[module.hot] += s_h
            into[module.cold] += s_c
            found.append(Share(_beyond_reference(module, into, list(dv)), None, movers,
                               f"{title} free in [{show(low)}, {show(high)}] A, slopes {float(s_h):.4g}, "
                               f"{float(s_c):.4g} W/K, {float(s_v):.4g}"))
    for x, h, c in product(ends(current), ends(hot), ends(cold)):
        hh, hc, cc, ch = fixed_slopes(module, h, c, x)
        into_hot, into_cold = _row(problem, {module.hot: hh, module.cold: hc}), _row(problem, {module.hot: ch,
                                                                                              module.cold: cc})
        windup = [achieved - wanted for achieved, wanted in zip(into_cold, dv, strict=True)]
        found.append(Share(_beyond_reference(module, into_hot, into_cold), windup, (),
                           f"{title} limited to {show(x)} A at {show(h)} K, {show(c)} K"))
    return found


def _current(problem: Loop, k: int) -> tuple[tuple[Row, ...], list[arb]]:
    """Return rows u and shares a with |dI| <= Σ a |u| where the current is free.

    The first row is dI with its slopes at the middle of their ranges, the others are dx_h, dx_c and dv.
    """
    module = problem.system.modules[k]
    hot, cold = problem.region.temperature[module.hot], problem.region.temperature[module.cold]
    slopes = free_slopes(module, hot, cold, problem.region.current[k])[3:]
    middles = [ball.mid() for ball in slopes]
    rows = [_row(problem, {module.hot: fmpq(1)}), _row(problem, {module.cold: fmpq(1)}), _wanted(problem, k)]
    middle = [sum((a * b for a, b in zip(middles, column, strict=True)), arb(0)) for column in zip(*rows, strict=True)]
    return (middle, *rows), [arb(1), *(abs(ball - own).upper() for ball, own in zip(slopes, middles, strict=True))]


def _link_share(problem: Loop, entries: Entries, words: str) -> Share:
    lumps = sorted({lump for place in entries for lump in place})
    heats = {i: _row(problem, {j: value for (row, j), value in entries.items() if row == i}) for i in lumps}
    return Share(heats, None, (), words)


def _split(current: Interval, pieces: int) -> list[Interval]:
    """Return the pieces of a range of currents; none where the current cannot move."""
    low, high = current
    marks = [low + (high - low) * k / pieces for k in range(pieces + 1)]
    return list(zip(marks[:-1], marks[1:], strict=True)) if low < high else []


def _wanted(problem: Loop, k: int) -> Row:
    return [arb(value) for value in (*problem.controller.D[k], *problem.controller.C[k])]


def _row(problem: Loop, entries: dict[int, fmpq]) -> Row:
    row = [arb(0)] * (len(problem.system.lumps) + len(problem.controller.A))
    for place, value in entries.items():
        row[place] = arb(value)
    return row


def _beyond_reference(module: Module, hot: Row, cold: Row) -> dict[int, Row]:
    """Return the heats into both faces without what the passive network conducts between them."""
    h, c, K = module.hot, module.cold, arb(module.conductance[0])
    hot[h], hot[c], cold[h], cold[c] = hot[h] + K, hot[c] - K, cold[h] - K, cold[c] + K
    return {h: hot, c: cold}


def _bounds(problem: Loop, ports: list[int], currents: list[list[arb]],
            links: list[tuple[Entries, Entries]]) -> Bounds:
    place = {port: j for j, port in enumerate(ports)}
    p, m = len(ports), len(problem.system.modules)
    size = [[fmpq(0)] * p for _ in ports]
    state, free = [[arb(0)] * p for _ in ports], [[arb(0)] * (4 * m) for _ in ports]
    for k, module in enumerate(problem.system.modules):
        hot, cold = problem.region.temperature[module.hot], problem.region.temperature[module.cold]
        current = problem.region.current[k]
        found = variation(module, hot, cold, current, problem.drift)
        for a, (i, drive) in enumerate(zip((module.hot, module.cold), found.drive, strict=True)):
            for b, j in enumerate((module.hot, module.cold)):
                size[place[i]][place[j]] += found.size[a][b]
                state[place[i]][place[j]] += found.slope[a][b]
            for b, share in enumerate(currents[k]):
                free[place[i]][4 * k + b] += drive * share
    for one, other in links:
        for (i, j), value in one.items():
            size[place[i]][place[j]] += max(abs(value), abs(other[i, j]))
            state[place[i]][place[j]] += abs(value - other[i, j])
    return Bounds(size, state, free)


def _padded(matrix: arb_mat, size: int) -> arb_mat:
    rows = [row + [arb(0)] * (size - len(row)) for row in matrix.tolist()]
    return arb_mat(rows + [[arb(0)] * size for _ in range(size - len(rows))])


def _cases(problem: Loop, P: arb_mat, sampled: Sampled, shares: list[list[Share]],
           bound: tuple[Deviation, list[int]] | None) -> Iterator[tuple[arb_mat, str]]:
    """Yield what e'Pe can become at most, and where, for every combination."""
    n, control = len(problem.system.lumps), problem.controller
    size = P.nrows()
    windup = arb_mat([[arb(value) for value in row] for row in control.windup]) if control.A else None
    below = [[arb(value) for value in (*b, *a)] for a, b in zip(control.A, control.B, strict=True)]
    still = [[arb(0)] * size for _ in range(n)]
    for chosen in product(*shares):
        heats = [list(row) for row in still]
        for share in chosen:
            for lump, row in share.heats.items():
                heats[lump] = [a + b for a, b in zip(heats[lump], row, strict=True)]
        phi = arb_mat(heats)
        above = _wide(sampled.passive, size) + sampled.hold * phi
        rows = above.tolist()
        if windup is not None:
            gap = [share.windup or [arb(0)] * size for share in chosen[:len(problem.system.modules)]]
            rows += (arb_mat(below) + windup * arb_mat(gap)).tolist()
        M = arb_mat(rows)
        after = M.transpose() * P * M
        if bound is not None:
            after += _moving(problem, sampled, phi, chosen, *bound)
        yield after, "; ".join(share.where for share in chosen)


def _moving(problem: Loop, sampled: Sampled, phi: arb_mat, chosen: tuple[Share, ...], found: Deviation,
            ports: list[int]) -> arb_mat:
    """Return the bound on the deviation from the held heats as a quadratic form."""
    size, p = phi.ncols(), len(ports)
    inverse = diagonal([1 / arb(capacity) for capacity in problem.system.capacity])
    W = _wide(sampled.F, size) + inverse * phi
    total = W.transpose() * found.moved * W
    time, sizes = arb(problem.sample_time), problem.sizes
    own = [arb(0)] * size
    for j, port in enumerate(ports):
        own[port] = time * sizes[p + j]
    total += diagonal(own)
    for k, share in enumerate(chosen):
        for b, mover in enumerate(share.free):
            row = arb_mat([mover])
            total += row.transpose() * row * (time * sizes[2 * p + 4 * k + b])
    return total


def _wide(matrix: arb_mat, size: int) -> arb_mat:
    return arb_mat([row + [arb(0)] * (size - len(row)) for row in matrix.tolist()])
