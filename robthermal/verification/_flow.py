"""The plant between two samples, by a quadratic form that changes along the sample; with or without an observer.

Differences (x, I, w): temperatures, currents that are held, and all that is constant until the next sample (estimates,
controller states). K takes (x, w) just before a sample to (x, I, w) just after it, A moves them on. For every
combination of modules with free and with limited current there is one matrix S of (x, I, w) with
    S - Q - T (P A + A'P) > 0 for P = S and P = Q,   S > 0,   K'S K < c² Q
at all A and K of the box (proof note, loops). A is affine in its slopes, K'S K convex: the corners of their hulls do.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

from flint import arb, arb_mat, fmpq

from ._between import Sampled, sample
from ._corners import Part, first_failure, is_positive
from ._fields import Interval
from ._growth import Growth, too_many_cases
from ._law import fixed_slopes, free_slopes, unfit
from ._loop_problem import Loop
from ._lyapunov import MOST_WORK, Described, link_slopes
from ._numbers import name_of, show
from ._system import Module
from ._vertices import Entries, ends

_LARGEST = 80  # lumps: the exponentials are of twice this size
Row = dict[int, arb]
Slopes = tuple[fmpq, ...]  # hh, hc, ch, cc [W/K], b_h, b_c [W/A]


@dataclass(frozen=True)
class Corner:
    """At a sample: change of the current, heats into the faces in the view of the law, achieved - wanted heat."""

    current: Row
    hot: Row
    cold: Row
    gap: Row
    where: str


@dataclass(frozen=True)
class Mode:
    """A module with free current in a piece of its range, or at one of its limits."""

    free: bool
    flow: list[Slopes]
    corners: list[Corner]
    where: str


class Layout:
    """Places of temperatures, free currents and constants in (x, I, w), and in (x, w)."""

    def __init__(self, problem: Loop, free: Sequence[bool]):
        self.n, self.m = len(problem.system.lumps), len(free)
        rest = len(problem.controller.A) + (self.n if problem.sensors is not None else 0)
        kept = [k for k in range(self.m) if free[k]]
        self.own = [*range(self.n), *(self.n + k for k in kept), *range(self.n + self.m, self.n + self.m + rest)]
        self.current = {k: self.n + i for i, k in enumerate(kept)}
        self.size, self.end = len(self.own), self.n + rest

    def after(self, k: int) -> int:
        """Place in (x, I, w) of entry k of (x, w)."""
        return k if k < self.n else k + len(self.current)


def flow_growth(problem: Loop, Q: arb_mat) -> Growth | str:
    """Prove what does not depend on the contraction; return K'SK at all corners, lazily, or what fails."""
    system, region = problem.system, problem.region
    base, nonlinear, missing = link_slopes(system, region)
    missing = missing or too_many_cases(region, problem.pieces, nonlinear, Q.nrows())
    if missing:
        return missing
    for module, current in zip(system.modules, region.current, strict=True):
        if broken := unfit(module, region.temperature[module.hot], region.temperature[module.cold], current):
            return broken
    if len(system.lumps) > _LARGEST:
        return f"{len(system.lumps)} lumps: too many, at most {_LARGEST}"
    sampled = sample(system, base, problem.sample_time) if problem.sensors is not None else None
    if isinstance(sampled, str):
        return sampled
    cases = list(product(*([*_modes(problem, k)] for k in range(len(system.modules)))))
    if len(problem.start) not in (1, len(cases)):
        return f"{len(problem.start)} matrices for the start of a sample: 1 or {len(cases)} are needed"
    links = math.prod(len(items) for items in nonlinear)
    moves = sum(math.prod(len(mode.flow) for mode in case) for case in cases) * links
    jumps = sum(math.prod(len(mode.corners) for mode in case) for case in cases) * (1 if sampled is None else links)
    size = Q.nrows() + len(system.modules)
    if (2 * moves + jumps) * (size**3 + 2000) > MOST_WORK:
        return f"{2 * moves + jumps} combinations of slopes: too many to check one by one"
    starts = []
    for k, case in enumerate(cases):
        layout = Layout(problem, [mode.free for mode in case])
        rows = problem.start[min(k, len(problem.start) - 1)]
        S = arb_mat([[arb(rows[i][j]) for j in layout.own] for i in layout.own])
        where = "; ".join(mode.where for mode in case)
        if not is_positive(S):
            return f"the form at the start of a sample is not positive or cannot be proven to be, {where}"
        if failed := _moves(problem, layout, S, Q, base, nonlinear, case):
            return f"between the samples the form may grow, {where}: {failed}"
        starts.append((layout, S, case))
    return Growth(_jumps(problem, starts, sampled, base, nonlinear), jumps)


def _modes(problem: Loop, k: int) -> Iterator[Mode]:
    module, current = problem.system.modules[k], problem.region.current[k]
    hot, cold = problem.region.temperature[module.hot], problem.region.temperature[module.cold]
    title, law = f"module {name_of(module.name)}", _law_place(problem)
    h, c = module.hot + law, module.cold + law
    wanted = _wanted(problem, k)
    for low, high in _split(current, problem.pieces):
        balls = free_slopes(module, hot, cold, (low, high))
        if problem.sensors is None:
            balls = [arb(0)] * 3 + balls[3:]  # the heat in the view of the law matters to an observer only
        corners = []
        for a_h, a_c, ratio, g_h, g_c, g_v in product(*(sorted({b.lower(), b.upper()}, key=float) for b in balls)):
            into = _plus({h: a_h, c: a_c}, _times(ratio, wanted))
            corners.append(Corner(_plus({h: g_h, c: g_c}, _times(g_v, wanted)), into, wanted, {},
                                  f"dI = {float(g_h):.4g} dx_h + {float(g_c):.4g} dx_c + {float(g_v):.4g} dv"))
        where = f"{title} free in [{show(low)}, {show(high)}] A"
        yield Mode(True, control_points(module, (hot, cold, (low, high))), corners, where)
    for x in ends(current):
        corners = []
        for at_hot, at_cold in product(ends(hot), ends(cold)):
            hh, hc, cc, ch = (arb(value) for value in fixed_slopes(module, at_hot, at_cold, x))
            achieved = {h: ch, c: cc}
            corners.append(Corner({}, {h: hh, c: hc}, achieved, _plus(achieved, _times(arb(-1), wanted)),
                                  f"{show(at_hot)} K, {show(at_cold)} K"))
        yield Mode(False, control_points(module, (hot, cold, (x, x))), corners, f"{title} limited to {show(x)} A")


def control_points(module: Module, box: tuple[Interval, Interval, Interval]) -> list[Slopes]:
    """Return points whose hull has the slopes (J, ∂(heats)/∂I) at every hot and cold temperature and current.

    They are polynomials of degree two at most in each of the three: Bernstein's control points (proof note, loops).
    """
    marks = [[low] if low == high else [low, (low + high) / 2, high] for low, high in box]
    found: dict[tuple[int, ...], Slopes] = {
        place: _slopes(module, *(marks[axis][k] for axis, k in enumerate(place)))
        for place in product(*(range(len(axis)) for axis in marks))}
    for axis in range(3):
        middle = [place for place in found if place[axis] == 1]
        nonlinear = False
        for place in middle:
            low, high = (found[(*place[:axis], end, *place[axis + 1:])] for end in (0, 2))
            chord = [(a + b) / 2 for a, b in zip(low, high, strict=True)]
            control = tuple(2 * a - b for a, b in zip(found[place], chord, strict=True))
            nonlinear |= any(a != b for a, b in zip(control, chord, strict=True))
            found[place] = control
        if not nonlinear:
            found = {place: value for place, value in found.items() if place[axis] != 1}
    return list(dict.fromkeys(found.values()))


def _slopes(module: Module, hot: fmpq, cold: fmpq, current: fmpq) -> Slopes:
    hh, hc, cc, ch = fixed_slopes(module, hot, cold, current)
    offset = (hot + cold) / 2 - module.reference
    S, R = (pair[0] + pair[1] * offset for pair in (module.seebeck, module.resistance))
    return hh, hc, ch, cc, S * hot + R * current, R * current - S * cold


def _moves(problem: Loop, layout: Layout, S: arb_mat, Q: arb_mat, base: Entries,
           nonlinear: Sequence[Sequence[Described]], case: Sequence[Mode]) -> str:
    """Return where S - Q - T (P A + A'P) > 0 fails, for P = S and P = Q; empty where it is proven."""
    time, capacity, d = arb(problem.sample_time), problem.system.capacity, layout.size
    place = [layout.after(k) for k in range(layout.end)]
    end = [[arb(0)] * d for _ in range(d)]
    for i, row in enumerate(Q.tolist()):
        for j, value in enumerate(row):
            end[place[i]][place[j]] = value
    after = arb_mat(end)

    def grown(P: arb_mat, item: Described) -> Part:
        entries, where, real = item
        A = [[arb(0)] * d for _ in range(d)]
        for (i, j), value in entries.items():
            A[i][j] = arb(value / capacity[i])
        PA = P * arb_mat(A)
        return Part((PA + PA.transpose()) * -time, where, real)

    modules = [[(_entries(problem.system.modules[k], slopes, layout.current.get(k)), "", False) for slopes in mode.flow]
               for k, mode in enumerate(case)]
    for P in (S, after):
        start = S - after + grown(P, (base, "", True)).matrix
        failed = first_failure(start, [*nonlinear, *modules], partial(grown, P))
        if failed is not None:
            return "at the start of the sample" if P is S else "at the end of the sample"
    return ""


def _entries(module: Module, slopes: Slopes, current: int | None) -> Entries:
    h, c = module.hot, module.cold
    hh, hc, ch, cc, b_h, b_c = slopes
    found: Entries = {(h, h): hh, (h, c): hc, (c, h): ch, (c, c): cc}
    if current is not None:
        found |= {(h, current): b_h, (c, current): b_c}
    return found


def _jumps(problem: Loop, starts: Sequence[tuple[Layout, arb_mat, tuple[Mode, ...]]], sampled: Sampled | None,
           base: Entries, nonlinear: Sequence[Sequence[Described]]) -> Iterator[tuple[arb_mat, str]]:
    """Yield K'SK and where, for every corner of every case."""
    links = ([[_seen_link(problem, sampled, entries) for entries, _, _ in items] for items in nonlinear]
             if sampled else [])
    for layout, S, case in starts:
        fixed = _fixed_rows(problem, layout, sampled)
        parts = [[(_corner_rows(problem, layout, sampled, k, corner), corner.where) for corner in mode.corners]
                 for k, mode in enumerate(case)]
        parts += [[(_shifted(rows, layout), "") for rows in items] for items in links]
        title = "; ".join(mode.where for mode in case)
        for chosen in product(*parts):
            K = fixed
            for rows, _ in chosen:
                K = K + rows
            yield K.transpose() * S * K, f"{title}: {'; '.join(words for _, words in chosen if words)}"


def _fixed_rows(problem: Loop, layout: Layout, sampled: Sampled | None) -> arb_mat:
    """Return K without modules: temperatures stay, the observer's passive network and gain, the controller."""
    n, law, control = layout.n, _law_place(problem), problem.controller
    rows = [[arb(0)] * layout.end for _ in range(layout.size)]
    for i in range(n):
        rows[i][i] = arb(1)
    if sampled is not None and problem.sensors is not None:
        for i in range(n):
            row = rows[layout.after(n + i)]
            for j in range(n):
                row[n + j] += sampled.passive[i, j]
            for gain, sensor in zip(problem.gain[i], problem.sensors, strict=True):
                row[sensor.lump] += arb(gain * sensor.gain)
                row[n + sensor.lump] -= arb(gain * sensor.gain)
    first = layout.end - len(control.A)
    for i, (a, b) in enumerate(zip(control.A, control.B, strict=True)):
        row = rows[layout.after(first + i)]
        for j, value in enumerate(b):
            row[law + j] += arb(value)
        for j, value in enumerate(a):
            row[first + j] += arb(value)
    return arb_mat(rows)


def _corner_rows(problem: Loop, layout: Layout, sampled: Sampled | None, k: int, corner: Corner) -> arb_mat:
    """Return what one module adds to K."""
    rows = [[arb(0)] * layout.end for _ in range(layout.size)]
    module, first = problem.system.modules[k], layout.end - len(problem.controller.A)
    if k in layout.current:
        _add(rows[layout.current[k]], arb(1), corner.current)
    for i, windup in enumerate(problem.controller.windup):
        _add(rows[layout.after(first + i)], arb(windup[k]), corner.gap)
    if sampled is not None:
        h, c, K = module.hot, module.cold, arb(module.conductance[0])
        n = layout.n
        exchange = {n + h: K, n + c: -K}  # conducted by the passive network already
        for i in range(n):
            row = rows[layout.after(n + i)]
            _add(row, sampled.hold[i, h], _plus(corner.hot, exchange))
            _add(row, sampled.hold[i, c], _plus(corner.cold, _times(arb(-1), exchange)))
    return arb_mat(rows)


def _seen_link(problem: Loop, sampled: Sampled, entries: Entries) -> list[list[arb]]:
    """Return what a link that is not linear adds to the observer's step, (n, n)."""
    n = len(problem.system.lumps)
    rows = [[arb(0)] * n for _ in range(n)]
    for (i, j), value in entries.items():
        for r in range(n):
            rows[r][j] += sampled.hold[r, i] * arb(value)
    return rows


def _shifted(estimates: list[list[arb]], layout: Layout) -> arb_mat:
    rows = [[arb(0)] * layout.end for _ in range(layout.size)]
    for i, line in enumerate(estimates):
        rows[layout.after(layout.n + i)][layout.n:2 * layout.n] = line
    return arb_mat(rows)


def _law_place(problem: Loop) -> int:
    """Where in (x, w) the temperatures begin that law and controller read."""
    return 0 if problem.sensors is None else len(problem.system.lumps)


def _wanted(problem: Loop, k: int) -> Row:
    law, n = _law_place(problem), len(problem.system.lumps)
    row = {law + j: arb(value) for j, value in enumerate(problem.controller.D[k]) if value != 0}
    return row | {law + n + j: arb(value) for j, value in enumerate(problem.controller.C[k]) if value != 0}


def _split(current: Interval, pieces: int) -> list[Interval]:
    low, high = current
    marks = [low + (high - low) * k / pieces for k in range(pieces + 1)]
    return list(zip(marks[:-1], marks[1:], strict=True)) if low < high else []


def _plus(a: Row, b: Row) -> Row:
    return {k: a.get(k, arb(0)) + b.get(k, arb(0)) for k in a | b}


def _times(factor: arb, row: Row) -> Row:
    return {k: factor * value for k, value in row.items()}


def _add(line: list[arb], factor: arb, row: Row) -> None:
    for k, value in row.items():
        line[k] += factor * value
