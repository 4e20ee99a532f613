"""One sample of exponential collocation as matrices.

The linear part is propagated exactly. The nonlinear heats q at the ports are polynomials of degree p over the step,
given by their values at the p + 1 Chebyshev-Lobatto nodes c; with held inputs u,

    z(c_i h) = e^{F c_i h} z(0) + ∫ e^{F(c_i h - s)} ds B u + Σ_j ∫ e^{F(c_i h - s)} l_j(s/h) ds N q_j,

which is linear in z(0), u and q: only the small fixed-point problem q = heat(T) at the ports remains.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy.linalg import expm

from ._augmented import Augmented
from ._terms import Array

DEGREE = 5
NODES = 0.5 * (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE))
_MONOMIALS = np.linalg.inv(np.vander(NODES, increasing=True))  # nodal values -> coefficients of (s/h)^k
# nodal values -> last two Chebyshev coefficients
TAIL = np.linalg.inv(chebyshev.chebvander(2 * NODES - 1, DEGREE))[-2:]


@dataclass(frozen=True)
class Step:
    """Matrices of one step; rows are [port temperatures at nodes 1..p, z at the end].

    Parameters
    ----------
    K : ndarray, shape (rows, n_z)
        From the state at the start.
    Ku : ndarray, shape (rows, n_u)
        From the held inputs.
    M : ndarray, shape (rows, (p + 1) n_q)
        From the nodal heats, node by node.
    """

    K: Array
    Ku: Array
    M: Array


def step_matrices(parts: Augmented, h: float) -> Step:
    """Matrices of a step of length h [s]; complex `parts` are allowed (complex-step derivatives)."""
    nz, nu, nq = parts.F.shape[0], parts.B.shape[1], parts.N.shape[1]
    size = nz + nu + (DEGREE + 1) * nq
    H = np.zeros((size, size), parts.F.dtype)
    H[:nz, :nz], H[:nz, nz:nz + nu], H[:nz, nz + nu:nz + nu + nq] = parts.F * h, parts.B * h, parts.N * h
    chain = np.arange(nz + nu, size - nq)
    H[chain, chain + nq] = 1.0  # v_j' = v_(j+1): the chain that makes monomials
    rows = [expm(c * H)[:nz] for c in NODES[1:]]
    K, Ku, M = [], [], []
    for i, block in enumerate(rows, start=1):
        keep = parts.ports if i < DEGREE else np.concatenate([parts.ports, np.arange(nz)])
        block = block[keep]
        K.append(block[:, :nz])
        Ku.append(block[:, nz:nz + nu])
        powers = block[:, nz + nu:].reshape(len(keep), DEGREE + 1, nq)
        powers = powers * np.array([factorial(k) for k in range(DEGREE + 1)])[:, None]
        M.append(np.einsum("rkq,kj->rjq", powers, _MONOMIALS).reshape(len(keep), (DEGREE + 1) * nq))
    return Step(np.concatenate(K), np.concatenate(Ku), np.concatenate(M))


def window_matrices(step: Step, ports: NDArray[np.intp], samples: int) -> Step:
    """Matrices of several consecutive samples at once.

    Rows are [port temperatures at all nodes of all samples, node 0 included; z at the end of every sample];
    columns of Ku and M run sample by sample.
    """
    nz, nodes = step.K.shape[1], DEGREE * ports.size
    nu, nq = step.Ku.shape[1], step.M.shape[1]
    z = [np.eye(nz), np.zeros((nz, samples * nu)), np.zeros((nz, samples * nq))]
    at_ports: list[list[Array]] = []
    at_ends: list[list[Array]] = []
    for s in range(samples):
        after = [step.K @ part for part in z]
        after[1][:, s * nu:(s + 1) * nu] += step.Ku
        after[2][:, s * nq:(s + 1) * nq] += step.M
        at_ports.append([np.concatenate([part[ports], new[:nodes]]) for part, new in zip(z, after, strict=True)])
        z = [new[nodes:] for new in after]
        at_ends.append(z)
    K, Ku, M = (np.concatenate([row[k] for row in at_ports + at_ends]) for k in range(3))
    return Step(K, Ku, np.ascontiguousarray(M))
