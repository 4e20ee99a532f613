"""Plants with known optima, and norms of closed loops by a way of their own."""

from __future__ import annotations

import control
import numpy as np


def generalized(A, B1, B2, C1, C2, D11, D12, D21, D22=None, dt=0.0) -> control.StateSpace:
    """P from its parts."""
    B1, B2, C1, C2 = (np.atleast_2d(np.asarray(part, float)) for part in (B1, B2, C1, C2))
    D22 = np.zeros((len(C2), B2.shape[1])) if D22 is None else D22
    D = np.block([[np.asarray(D11), np.asarray(D12)], [np.asarray(D21), np.asarray(D22)]])
    return control.ss(A, np.hstack([B1, B2]), np.vstack([C1, C2]), D, dt)


def scherer() -> control.StateSpace:
    """Example 7 of Scherer, Gahinet and Chilali (1997): optimum 9.508085."""
    return generalized([[0, 10, 2], [-1, 1, 0], [0, 2, -5]], [[1], [0], [1]], [[0], [1], [0]],
                       [[1, 0, 0], [0, 0, 0]], [[0, 1, 0]], np.zeros((2, 1)), [[0], [1]], [[2]])


def mixed_sensitivity(weight: float) -> control.StateSpace:
    """Skogestad and Postlethwaite, example 2.11: 200/((10 s + 1)(0.05 s + 1)²), states of the plant and of W1."""
    G = control.ss(control.tf([200], np.polymul([10, 1], np.polymul([0.05, 1], [0.05, 1]))))
    a, b = 1e-3, (10 - 1e-3 / 1.5)  # W1 = (s/1.5 + 10)/(s + 1e-3) = 1/1.5 + b/(s + a)
    n = G.nstates
    A = np.block([[G.A, np.zeros((n, 1))], [-b * G.C, -a * np.eye(1)]])
    return generalized(A, np.vstack([np.zeros((n, 1)), [[b]]]), np.vstack([G.B, [[0]]]),
                       np.vstack([np.hstack([-G.C / 1.5, [[1.0]]]), np.zeros((1, n + 1))]),
                       np.hstack([-G.C, [[0.0]]]), [[1 / 1.5], [0]], [[0], [weight]], [[1]])


def hard() -> control.StateSpace:
    """Benner, Byers, Mehrmann and Xu: optimum √0.65, where slycot says 0.0062."""
    return generalized(-np.eye(2), [[0, 0], [0, 1]], [[1], [1]], np.eye(2), [[1, 1]], 0.5 * np.eye(2), [[0], [1]],
                       [[0, 1]])


def random_plant(seed: int, n: int = 5, dt: float = 0.0) -> control.StateSpace:
    """Unstable, two controls, two measurements, all direct paths."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((n, n))
    if dt:
        A = 1.2 * A / abs(np.linalg.eigvals(A)).max()
    D = rng.standard_normal((6, 6))
    D[4:, 4:] *= 0.2
    return control.ss(A, rng.standard_normal((n, 6)), rng.standard_normal((6, n)), D, dt)


def norm(P: control.StateSpace, K: control.StateSpace) -> float:
    """Largest singular value of python-control's own loop on a dense grid; infinity where it is not stable."""
    loop = P.lft(K)
    poles, dt = loop.poles(), loop.dt or 0.0
    if (abs(poles) >= 1).any() if dt else (poles.real >= 0).any():
        return float("inf")
    near = np.log(poles.astype(complex) + 1e-30) / dt if dt else poles
    around = np.concatenate([abs(p) * np.ones(1) + abs(p.real) * np.linspace(-2, 2, 41) for p in near])
    around = np.concatenate([around, *(abs(p.imag) + abs(p.real) * np.linspace(-2, 2, 41) for p in near)])
    w = np.concatenate([np.geomspace(1e-5, 1e6, 1000), around[around > 0]])
    w = w[w < np.pi / dt] if dt else w
    z = np.exp(1j * w * dt) if dt else 1j * w
    n = loop.nstates
    found = loop.C @ np.linalg.solve(z[:, None, None] * np.eye(n) - loop.A, loop.B.astype(complex)) + loop.D
    return float(np.linalg.norm(found, 2, axis=(1, 2)).max())
