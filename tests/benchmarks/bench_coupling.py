"""Coupling synthesis: H-infinity shaping with 60 coefficients at 4000 frequencies, and the demo scanner."""

from __future__ import annotations

from dataclasses import replace

import cvxpy
import numpy as np
from _timing import best_of, header, row

import robthermal as rt
from robthermal.conic import smallest_bound
from robthermal.coupling.problem import prepare
from robthermal.coupling.synthesis import (
    Demands,
    Design,
    Limits,
    Responses,
    Touching,
    cones,
    default_pole,
    make_basis,
    solve,
)

SIZES = (125, 250, 500)  # frequencies of the naive formulation; the largest is extrapolated to 4000


def shaping(machine: rt.systems.Scanner, coefficients: int, frequencies: int) -> tuple[Responses, Demands]:
    """Peak of e12 under |1+X|, |1+Y| <= 3 and robustness; `coefficients` in both filters together."""
    problem = prepare(machine.P1, machine.P2, machine.C1, machine.C2, uncertainty=list(machine.frf),
                      disturbances=machine.disturbances)
    basis = make_basis("laguerre", coefficients // 2, default_pole(problem), problem.dt)
    design = Design(problem, basis, "hinf", (True, True))
    grid = np.geomspace(1.0, np.pi / problem.dt, frequencies)
    return design.responses_at(grid), design.demands(Limits(improvement=3.0, robust=0.9))


def at_once(responses: Responses, demands: Demands) -> float:
    """Vectorized, every frequency in one program; the robust ellipses fixed at |X| = |Y|, as the naive one has them."""
    every = np.ones(responses.basis.shape[1], bool)
    start = Touching.at(responses, demands, None)
    return smallest_bound(cones(responses, demands, start, every), 2 * len(responses.basis)).value


def naive(responses: Responses, demands: Demands) -> float:
    """One cvxpy constraint per frequency and bound, as the formulas are written."""
    n, n_f = responses.basis.shape
    x, y, t = cvxpy.Variable(n), cvxpy.Variable(n), cvxpy.Variable()
    rules = []
    for k in range(n_f):
        phi = responses.basis[:, k]
        X, Y = (responses.factor[i, k] * phi for i in (0, 1))
        plus_x, plus_y = 1 + X.real @ x + 1j * (X.imag @ x), 1 + Y.real @ y + 1j * (Y.imag @ y)
        s = np.abs(responses.signal[:, k])
        rules.append(cvxpy.norm(cvxpy.hstack([s[0] * plus_x, s[1] * plus_y])) <= t)
        rules += [cvxpy.abs(plus_x) <= demands.improvement, cvxpy.abs(plus_y) <= demands.improvement]
        r = np.prod([responses.envelope[i, i, k] for i in (0, 1)]) * np.prod(responses.block[:, k])
        hats = [phi.real @ c + 1j * (phi.imag @ c) for c in (x, y)]
        if r > 1e-8:
            rules.append(cvxpy.norm(cvxpy.hstack(hats)) <= demands.radius * np.sqrt(2 / r))
    return float(cvxpy.Problem(cvxpy.Minimize(t), rules).solve(solver="CLARABEL"))


def main() -> None:
    """Print everything."""
    machine = rt.systems.scanner()
    header("H-infinity shaping, 60 coefficients, |1+X|, |1+Y| and robustness bounded at every frequency")
    for frequencies in SIZES:
        problem = shaping(machine, 60, frequencies)
        ours, found = best_of(lambda problem=problem: at_once(*problem), repeats=3)
        row(f"vectorized, {frequencies} frequencies", ours, f"peak {found:.5f}")
        theirs, peak = best_of(lambda problem=problem: naive(*problem), repeats=1)
        row(f"constraint by constraint, {frequencies} frequencies", theirs, f"peak {peak:.5f}, x {theirs / ours:.0f}")
    problem = shaping(machine, 60, 4000)
    theirs *= 4000 / SIZES[-1]
    row("constraint by constraint, 4000 frequencies", theirs, "not run: extrapolated, linear in the frequencies")
    ours, found = best_of(lambda: at_once(*problem), repeats=1)
    row("vectorized, 4000 frequencies, all at once", ours, f"peak {found:.5f}, x {theirs / ours:.0f}")
    ours, solution = best_of(lambda: solve(*problem), repeats=1)
    note = f"peak {solution.value:.5f}, x {theirs / ours:.0f}, every bound met at all of them: {solution.feasible}"
    row("as synthesize does it: as needed, ellipses refitted", ours, note)
    only = replace(problem[1], improvement=None, radius=None)
    ours, solution = best_of(lambda: solve(problem[0], only), repeats=1)
    row("the same, the peak of e12 alone", ours, f"peak {solution.value:.5f}")

    header("Demo scanner: synthesis, proof included")
    window = {"window": 0.01, "msd_limit": 1.2, "disturbances": machine.disturbances}
    systems = (machine.P1, machine.P2, machine.C1, machine.C2)
    for name, more in (("nominal", {}), ("robust", {"uncertainty": list(machine.frf)}),
                       ("robust, stable controller", {"uncertainty": list(machine.frf), "stable_controller": True})):
        seconds, filters = best_of(lambda more=more: rt.coupling.synthesize(*systems, **window, **more), repeats=1)
        reached = filters.performance
        row(name, seconds, f"MA / {reached.ma_before / reached.ma_after:.2f}, "
                           f"MSD x {reached.msd_after / reached.msd_before:.2f}, holds {filters.holds}")


if __name__ == "__main__":
    main()
