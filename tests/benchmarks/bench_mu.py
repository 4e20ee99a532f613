"""Structured singular value of the distillation column: 61 frequencies against peers, and the proof at all of them."""

from __future__ import annotations

import cvxpy
import numpy as np
from _timing import best_of, header, row
from distillation import distillation

import robthermal as rt

try:
    import slycot
except ImportError:
    slycot = None

BLOCKS = [("full", 1, 1), ("full", 1, 1), ("full", 2, 2)]


def bisection(M: np.ndarray) -> float:
    """Largest upper bound by a conic solver and bisection (as dkpy does), to 1e-4."""
    x, gamma2 = cvxpy.Variable(3), cvxpy.Parameter(nonneg=True)
    X = cvxpy.diag(cvxpy.hstack([x[0], x[1], 1.0, 1.0]))
    worst = 0.0
    for k in range(M.shape[2]):
        scaled = M[:, :, k]
        F = gamma2 * X - scaled.conj().T @ X @ scaled
        problem = cvxpy.Problem(cvxpy.Minimize(0), [(F + F.H) / 2 >> 1e-8 * np.eye(4), x >= 1e-8])
        low, high = 0.0, float(np.linalg.norm(scaled, 2)) * 1.001
        while high - low > 1e-4 * high:
            middle = (low + high) / 2
            gamma2.value = middle**2
            low, high = (low, middle) if feasible(problem) else (middle, high)
        worst = max(worst, high)
    return worst


def feasible(problem: cvxpy.Problem) -> bool:
    """Whether the solver says so."""
    try:
        problem.solve(solver=cvxpy.CLARABEL)
    except cvxpy.SolverError:
        return False
    return problem.status == "optimal"


if __name__ == "__main__":
    header("Structured singular value, robust performance of the distillation column")
    system, omega = distillation(), np.logspace(-3, 3, 61)
    inside = [np.linalg.solve(1j * w * np.eye(8) - system.A, system.B) for w in omega]
    M = np.moveaxis([system.C @ states + system.D for states in inside], 0, 2)
    seconds, found = best_of(lambda: rt.coupling.mu(M, BLOCKS), repeats=5)
    gap = float(np.max(1 - found.lower / found.upper))
    row("mu, 61 frequencies, both bounds", seconds, f"{found.upper.max():.5f}, largest gap {gap:.1e}")
    if slycot is not None:
        taken, upper = best_of(lambda: max(slycot.ab13md(M[:, :, k], [1, 1, 2], [2, 2, 2])[0] for k in range(61)))
        row("SLICOT AB13MD, upper bound only", taken, f"{upper:.5f}, {taken / seconds:.1f} times as long")
    taken, upper = best_of(lambda: bisection(M), repeats=1)
    row("conic solver with bisection, upper bound only", taken, f"{upper:.5f}, {taken / seconds:.0f} times as long")
    taken, bound = best_of(lambda: rt.coupling.mu_bound(system, BLOCKS), repeats=1)
    row("mu_bound, all frequencies, proven", taken, f"{bound.lower:.5f} to {bound.upper:.5f}, {bound.outcome.code}")
    row("  verification", best_of(lambda: rt.verify(bound.certificate), repeats=1)[0])
