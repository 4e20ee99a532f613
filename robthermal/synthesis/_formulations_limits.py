"""Further programs as the papers write them, in cvxpy: several aims at once, limits of controls, ellipsoids.

As in `_formulations`: slow, readable, what the fast methods are compared with. Nothing here is evidence.
"""

from __future__ import annotations

import numpy as np

from .._arrays import Array
from ..linear import Plant
from ._ellipsoid_program import Driven
from ._formulations import cp, minimum, negative
from ._mpc_limits import Limits
from ._plant import GeneralizedPlant


def mixed_level(plant: GeneralizedPlant, limit: float) -> float:
    """Smallest bound of the H2 norm of a continuous plant with H-infinity norm below a limit: one Lyapunov matrix.

    Scherer, Gahinet and Chilali (1997), (35)-(47), strictly proper controllers, D11 = 0: minimize tr Q over X, Y, A^,
    B^, C^ with [A + A', B; ., -1] < 0, [Q, C; ., P] > 0, [A + A', B, C'; ., -1, 0; ., ., -limit²] < 0, where A, B, C
    are the matrices of the loop in these unknowns and P = [X 1; 1 Y].
    """
    p = plant
    n, m, q = len(p.A), p.B1.shape[1], len(p.C1)
    X, Y, Q = (cp.Variable((size, size), symmetric=True) for size in (n, n, q))
    A_hat, B_hat, C_hat = cp.Variable((n, n)), cp.Variable((n, len(p.C2))), cp.Variable((p.B2.shape[1], n))
    A = cp.bmat([[p.A @ X + p.B2 @ C_hat, p.A], [A_hat, Y @ p.A + B_hat @ p.C2]])
    B = cp.vstack([p.B1, Y @ p.B1 + B_hat @ p.D21])
    C = cp.hstack([p.C1 @ X + p.D12 @ C_hat, p.C1])
    P = cp.bmat([[X, np.eye(n)], [np.eye(n), Y]])
    zero = np.zeros((m, q))
    norm = cp.bmat([[A + A.T, B, C.T], [B.T, -np.eye(m), zero], [C, zero.T, -limit**2 * np.eye(q)]])
    return float(np.sqrt(minimum(cp.trace(Q), [negative(cp.bmat([[A + A.T, B], [B.T, -np.eye(m)]])), negative(norm),
                                               negative(-cp.bmat([[Q, C], [C.T, P]]))])))


def anti_windup_gain(loop: Plant, k: int, n_u: int) -> float:
    """Smallest L2 gain of a continuous limited loop: Mulder, Kothare and Morari (2001).

    Loop from (w, q, e) to (z, v), e added to the k states of the controller, v without direct path from q: minimize g
    over Q, diagonal M and X = E M with [AQ + QA', Bq M + Be X + QCv', Bw, QCz'; ., -2M, Dvw, (Dzq M + Dze X)'; ., .,
    -1, Dzw'; ., ., ., -g] < 0, and take its root.
    """
    N, m, q = len(loop.A), loop.B.shape[1] - n_u - k, len(loop.C) - n_u
    Q, M, X, g = cp.Variable((N, N), symmetric=True), cp.Variable(n_u), cp.Variable((k, n_u)), cp.Variable()
    (Bw, Bq, Be), (Dw, Dq, De) = (np.split(part, [m, m + n_u], axis=1) for part in (loop.B, loop.D))
    Cz, Cv = loop.C[:q], loop.C[q:]
    into, through = Bq @ cp.diag(M) + Be @ X, Dq[:q] @ cp.diag(M) + De[:q] @ X
    form = cp.bmat([[loop.A @ Q + Q @ loop.A.T, into + Q @ Cv.T, Bw, Q @ Cz.T],
                    [(into + Q @ Cv.T).T, -2 * cp.diag(M), Dw[q:], through.T],
                    [Bw.T, Dw[q:].T, -np.eye(m), Dw[:q].T], [Cz @ Q, through, Dw[:q], -g * np.eye(q)]])
    return float(np.sqrt(minimum(g, [negative(form), Q >> 0])))


def attraction_size(loop: Plant, limits: Array, states: int, k: int, rate: float) -> float:
    """Largest ball of plant states in a region of attraction, its radius: Gomes da Silva and Tarbouriech (2005).

    Continuous; minimize t over Q, Z, M, X with [AQ + QA' + 2 rate Q, Bq M + Be X + QCv' - Z'; ., -2M] < 0, [limit²,
    Z_i; ., Q] > 0, [t, (1 0); ., Q] > 0: the radius is 1/√t.
    """
    N, n_u = len(loop.A), len(limits)
    m = loop.B.shape[1] - n_u - k
    Q, M, X, t = cp.Variable((N, N), symmetric=True), cp.Variable(n_u), cp.Variable((k, n_u)), cp.Variable()
    Z = cp.Variable((n_u, N))
    Bq, Be, Cv = loop.B[:, m:m + n_u], loop.B[:, m + n_u:], loop.C[-n_u:]
    cross = Bq @ cp.diag(M) + Be @ X + Q @ Cv.T - Z.T
    first = np.eye(N)[:states]
    inside = [negative(-cp.bmat([[np.array([[limits[i] ** 2]]), Z[i:i + 1]], [Z[i:i + 1].T, Q]])) for i in range(n_u)]
    found = minimum(t, [negative(cp.bmat([[loop.A @ Q + Q @ loop.A.T + 2 * rate * Q, cross],
                                          [cross.T, -2 * cp.diag(M)]])),
                        negative(-cp.bmat([[t * np.eye(states), first], [first.T, Q]])), *inside])
    return float(1 / np.sqrt(found))


def reached_size(driven: Driven, decay: float) -> float:
    """Least tr Q of an ellipsoid x'Q^-1 x <= 1 that is not left, for one decay: Boyd et al. (1994), section 6.1.3.

    [AQ + QA' + decay Q, B; B', -diag β] <= 0 at every vertex, Σ β_k d_k² <= decay; sampled [(1 - decay)Q, 0, QA'; .,
    diag β, B'; ., ., Q] >= 0; r'Qr <= g² for the limits.
    """
    n, m = driven.B.shape[1:]
    Q, weights = cp.Variable((n, n), symmetric=True), cp.Variable(m)
    sizes = np.broadcast_to(driven.size, (m,))
    constraints = [weights == decay / sizes**2] if driven.joint else [weights @ sizes**2 <= decay]
    for A, B in zip(driven.A, driven.B, strict=True):
        if driven.dt:
            zero = np.zeros((n, m))
            constraints.append(negative(-cp.bmat([[(1 - decay) * Q, zero, Q @ A.T], [zero.T, cp.diag(weights), B.T],
                                                  [A @ Q, B, Q]])))
        else:
            constraints.append(negative(cp.bmat([[A @ Q + Q @ A.T + decay * Q, B], [B.T, -cp.diag(weights)]])))
    constraints += [row @ Q @ row <= bound**2 for row, bound in zip(driven.rows, driven.bounds, strict=True)]
    return minimum(cp.trace(Q), constraints)


def terminal_size(plant: Plant, Q: Array, R: Array, limits: Limits, dearer: float, least: Array) -> float:
    """Largest t of a terminal set that holds x' least x <= t: Kothare, Balakrishnan and Morari (1996).

    Maximize t over W = level P^-1, Y = KW and the level: [W, (AW + BY)', (Q^½W)', (R^½Y)'; ., W, 0, 0; ., ., level, 0;
    ., ., ., level] >= 0, [g², GW + HY; ., W] >= 0, W >= t least^-1, W >= level/dearer least^-1.
    """
    n, m = plant.B.shape
    W, Y, level, t = cp.Variable((n, n), symmetric=True), cp.Variable((m, n)), cp.Variable(), cp.Variable()
    root_x, root_u = np.linalg.cholesky(Q + 1e-14 * np.eye(n)).T, np.linalg.cholesky(R).T
    moved, wide, narrow = plant.A @ W + plant.B @ Y, np.zeros((n, n)), np.zeros((n, m))
    inverse = np.linalg.inv(least)
    falls = cp.bmat([[W, moved.T, W @ root_x.T, Y.T @ root_u.T], [moved, W, wide, narrow],
                     [root_x @ W, wide, level * np.eye(n), narrow], [root_u @ Y, narrow.T, narrow.T,
                                                                     level * np.eye(m)]])
    constraints = [negative(-falls), negative(t * inverse - W), negative(level / dearer * inverse - W)]
    for G, H, g in zip(limits.G, limits.H, limits.g, strict=True):
        row = cp.reshape(G @ W + H @ Y, (1, n), order="C")
        constraints.append(negative(-cp.bmat([[np.array([[g**2]]), row], [row.T, W]])))
    return -minimum(-t, constraints)
