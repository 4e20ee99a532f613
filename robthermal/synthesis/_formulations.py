"""The programs as the papers write them, in cvxpy: slow, readable, and what the fast methods are compared with.

Nothing here is evidence; what comes out is a number or gains. Continuous time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cvxpy
import numpy as np
from scipy.linalg import null_space

from .._arrays import Array
from ..errors import InputError
from ._frf_program import Bins
from ._plant import GeneralizedPlant, balanced
from ._vertices import Vertices

cp: Any = cvxpy  # its types name only part of what it exports
_SETTINGS = {"chordal_decomposition_enable": False, "max_iter": 400}  # with it Clarabel 0.11 may abort


def hinf_level(plant: GeneralizedPlant) -> float:
    """Smallest H-infinity norm of any controller: Gahinet and Apkarian (1994), theorem 4.3, with D22 = 0.

    Minimize γ over R, S = R', S' with [R 1; 1 S] >= 0 and, N_R, N_S bases of the kernels of [B2' D12'], [C2 D21]:
    diag(N_R, 1)' [AR + RA', RC1', B1; ., -γ, D11; ., ., -γ] diag(N_R, 1) <= 0 and its dual.
    """
    return lpv_level([balanced(plant)])


def lpv_level(plants: Sequence[GeneralizedPlant]) -> float:
    """Smallest bound of any scheduled controller with one quadratic form: Apkarian, Gahinet and Becker (1995).

    The inequalities of `hinf_level` at every vertex, with the same R and S; B2, C2, D12, D21 common, D22 = 0.
    """
    n = len(plants[0].A)
    R, S, level = cp.Variable((n, n), symmetric=True), cp.Variable((n, n), symmetric=True), cp.Variable()
    eye = np.eye(n)
    constraints = [cp.bmat([[R, eye], [eye, S]]) >> 0]
    for p in plants:
        m, q = p.B1.shape[1], len(p.C1)
        controls = cp.bmat([[p.A @ R + R @ p.A.T, R @ p.C1.T, p.B1], [p.C1 @ R, -level * np.eye(q), p.D11],
                            [p.B1.T, p.D11.T, -level * np.eye(m)]])
        measured = cp.bmat([[p.A.T @ S + S @ p.A, S @ p.B1, p.C1.T], [p.B1.T @ S, -level * np.eye(m), p.D11.T],
                            [p.C1, p.D11, -level * np.eye(q)]])
        outer_R = _outer(np.hstack([p.B2.T, p.D12.T]), m)
        outer_S = _outer(np.hstack([p.C2, p.D21]), q)
        constraints += [negative(outer_R.T @ controls @ outer_R), negative(outer_S.T @ measured @ outer_S)]
    return minimum(level, constraints)


def h2_level(plant: GeneralizedPlant) -> float:
    """Smallest H2 norm of any strictly proper controller, D11 = 0, D22 = 0: Scherer, Gahinet and Chilali (1997), (38).

    Minimize tr Q over X, Y, A^, B^, C^ with the inequalities of the linearizing change of variables.
    """
    p = balanced(plant)
    n, m, q = len(p.A), p.B1.shape[1], len(p.C1)
    X, Y, Q = (cp.Variable((size, size), symmetric=True) for size in (n, n, q))
    A_hat, B_hat, C_hat = cp.Variable((n, n)), cp.Variable((n, len(p.C2))), cp.Variable((p.B2.shape[1], n))
    states = p.A @ X + p.B2 @ C_hat
    estimates = Y @ p.A + B_hat @ p.C2
    driven = Y @ p.B1 + B_hat @ p.D21
    lyapunov = cp.bmat([[states + states.T, A_hat.T + p.A, p.B1], [A_hat + p.A.T, estimates + estimates.T, driven],
                        [p.B1.T, driven.T, -np.eye(m)]])
    eye, seen = np.eye(n), p.C1 @ X + p.D12 @ C_hat
    bound = cp.bmat([[X, eye, seen.T], [eye, Y, p.C1.T], [seen, p.C1, Q]])
    return float(np.sqrt(minimum(cp.trace(Q), [negative(lyapunov), (bound + bound.T) / 2 >> 0])))


def margin_step(bins: Bins, at: Array, objective: Array, margin: float) -> Array:
    """Gains of largest objective around the last ones: Karimi and Galdos (2010), the constraints of one bin a line."""
    x = cp.Variable(len(at))
    phi = 1 + bins.center * (bins.basis @ at)
    constraints = []
    for k, c in enumerate(phi):
        row = bins.center[k] * bins.basis[k] * (c.conjugate() / abs(c))
        C = cp.norm(cp.hstack([bins.basis[k].real @ x, bins.basis[k].imag @ x]))
        constraints.append((c.conjugate() / abs(c)).real + row.real @ x >= max(margin, bins.S[k]) + bins.radius[k] * C)
    cp.Problem(cp.Maximize(objective @ x), constraints).solve(solver=cp.CLARABEL)
    return np.asarray(x.value, float)


def polytope_level(vertices: Vertices, objective: str) -> float:
    """Smallest bound that one state feedback and one quadratic form show for a hull of continuous plants.

    H-infinity: Boyd et al. (1994), section 7.5.1, minimize g with [AW + BY + ., B1, (CW + D2Y)'; ., -1, D1'; ., ., -g]
    <= 0 at every vertex. H2: minimize g with [AW + BY + ., (CW + D2Y)'; ., -1] <= 0, tr B1' W^-1 B1 <= g.
    """
    n, w, m, p = vertices.sizes
    W, Y, g = cp.Variable((n, n), symmetric=True), cp.Variable((m, n)), cp.Variable()
    constraints = [W >> 0]
    for A, B1, B2, C, D1, D2 in zip(vertices.A, vertices.B1, vertices.B2, vertices.C, vertices.D1, vertices.D2,
                                    strict=True):
        moved, seen = A @ W + B2 @ Y, C @ W + D2 @ Y
        if objective == "hinf":
            constraints.append(negative(cp.bmat([[moved + moved.T, B1, seen.T], [B1.T, -np.eye(w), D1.T],
                                                  [seen, D1, -g * np.eye(p)]])))
        else:
            Z = cp.Variable((w, w), symmetric=True)
            energy = cp.bmat([[Z, B1.T], [B1, W]])
            constraints += [negative(cp.bmat([[moved + moved.T, seen.T], [seen, -np.eye(p)]])),
                            (energy + energy.T) / 2 >> 0, cp.trace(Z) <= g]
    return float(np.sqrt(minimum(g, constraints)))


def _outer(rows: Array, more: int) -> Array:
    kernel = null_space(rows)
    found = np.zeros((kernel.shape[0] + more, kernel.shape[1] + more))
    found[:kernel.shape[0], :kernel.shape[1]] = kernel
    found[kernel.shape[0]:, kernel.shape[1]:] = np.eye(more)
    return found


def negative(matrix: Any) -> Any:
    """The constraint matrix <= 0, of what is symmetric but for the way it is written."""
    return (matrix + matrix.T) / 2 << 0


def minimum(objective: Any, constraints: list[Any]) -> float:
    """Least objective; InputError where the program is not solved."""
    problem = cp.Problem(cp.Minimize(objective), constraints)
    try:
        problem.solve(solver=cp.CLARABEL, **_SETTINGS)
    except cp.SolverError as error:
        raise InputError(f"the reference program was not solved: {error}", where="argument method",
                         expected="a small, well-scaled plant", remedy='Use method="auto".') from None
    if problem.value is None or not np.isfinite(problem.value):
        raise InputError(f"the reference program was not solved: {problem.status}", where="argument method",
                         expected="a small, well-scaled plant", remedy='Use method="auto".')
    return float(problem.value)
