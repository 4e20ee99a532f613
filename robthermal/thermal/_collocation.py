"""One sample of exponential collocation as matrices.

The linear part is propagated exactly. The nonlinear heats q at the ports are polynomials of degree p over the step,
given by their values at the p + 1 Chebyshev-Lobatto nodes c; with held inputs u,

    z(c_i h) = e^{F c_i h} z(0) + ∫ e^{F(c_i h - s)} ds B u + Σ_j ∫ e^{F(c_i h - s)} l_j(s/h) ds N q_j,

which is linear in z(0), u and q: only the small fixed-point problem q = heat(T) at the ports remains.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from math import factorial

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from ._augmented import Augmented
from ._terms import Array

DEGREE = 5
NODES = 0.5 * (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE))
_MONOMIALS = np.linalg.inv(np.vander(NODES, increasing=True))  # nodal values -> coefficients of (s/h)^k
# nodal values -> last two Chebyshev coefficients
TAIL = np.linalg.inv(chebyshev.chebvander(2 * NODES - 1, DEGREE))[-2:]
_TERMS = 18  # of the series of a matrix of norm 1: 1/18! is below a rounding
_FUNCTIONS = DEGREE + 2
_SMALL = 20000  # entries of F, of all derivatives together: larger ones are not kept
_FACTORIALS = np.array([factorial(k) for k in range(_TERMS + _FUNCTIONS)], float)


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
    """Matrices of a step of length h [s].

    Complex `parts` (complex-step derivatives) and leading axes of F, B and N (many derivatives at once) are allowed;
    the matrices then have the same leading axes. The last few are kept, for several records of one system; they
    cannot be written to.
    """
    if parts.F.size > _SMALL:
        return _made(parts, h)
    arrays = (parts.F, parts.B, parts.N, parts.ports)
    return _kept(_Asked(b"".join(one.tobytes() for one in arrays), tuple((one.shape, one.dtype.str) for one in arrays),
                        h, parts))


@dataclass(frozen=True)
class _Asked:
    """What the matrices of a step depend on."""

    numbers: bytes
    kinds: tuple[tuple[tuple[int, ...], str], ...]
    h: float
    parts: Augmented = field(compare=False)


@lru_cache(maxsize=16)
def _kept(asked: _Asked) -> Step:
    made = _made(asked.parts, asked.h)
    for one in (made.K, made.Ku, made.M):
        one.flags.writeable = False
    return made


def _made(parts: Augmented, h: float) -> Step:
    many, nz, nq = parts.F.shape[:-2], parts.F.shape[-1], parts.N.shape[-1]
    if not parts.ports.size and not nq:  # a linear network: its state at the end, by that at the start and held inputs
        (K, integral), = np.moveaxis(node_integrals(parts.F * h, NODES[-1:], 2), (-4, -3), (0, 1))
        return Step(K, integral @ (parts.B * h), np.zeros((*many, nz, 0)))
    theta = node_integrals(parts.F * h)
    n_rows = DEGREE * parts.ports.size
    to_nodes, to_end = theta[..., parts.ports, :], theta[..., -1, :, :, :]

    def stacked(function: int, by: Array) -> Array:
        """Rows [ports at nodes 1..p, z at the end] of one of the functions times a matrix."""
        nodes = (to_nodes[..., function, :, :] @ by[..., None, :, :]).reshape(*many, n_rows, by.shape[-1])
        return np.concatenate([nodes, to_end[..., function, :, :] @ by], axis=-2)

    powers = np.stack([factorial(k) * stacked(k + 1, parts.N * h) for k in range(DEGREE + 1)], axis=-2)  # of s/h
    M = np.einsum("...rkq,kj->...rjq", powers, _MONOMIALS)
    return Step(stacked(0, np.eye(nz)), stacked(1, parts.B * h), M.reshape(*M.shape[:-2], (DEGREE + 1) * nq))


def node_integrals(Z: Array, nodes: Array = NODES[1:], functions: int = _FUNCTIONS) -> Array:
    """θ_j(c) = Σ_m c^(m+j) / (m+j)! Z^m at nodes c: e^(cZ), and integrals over s of e^((c-s)Z) s^(j-1) / (j-1)!.

    A Taylor series at c / 2^s, then s doublings θ_j(2c) = θ_0 θ_j + Σ_(k=1..j) c^(j-k) / (j-k)! θ_k
    (Al-Mohy and Higham 2011, section 3).

    Parameters
    ----------
    Z : ndarray, shape (..., n, n)
        Rate times step [-].
    nodes : ndarray, shape (n_nodes,)
        Parts of the step c [-]; default the nodes 1 to p.
    functions : int
        How many functions, j from 0 on; default p + 2.

    Returns
    -------
    ndarray, shape (..., n_nodes, functions, n, n)
        By node and j.
    """
    size = float(np.abs(Z).sum(axis=-1).max(initial=0.0))
    doublings = max(0, int(np.ceil(np.log2(size)))) if size > 1.0 else 0
    many, n = Z.shape[:-2], Z.shape[-1]
    scaled, powers = Z / 2.0**doublings, [np.broadcast_to(np.eye(n), Z.shape)]
    for _ in range(_TERMS - 1):
        powers.append(powers[-1] @ scaled)
    m, j = np.arange(_TERMS), np.arange(functions)[:, None]
    c = nodes[:, None, None] / 2.0**doublings
    weights = nodes[:, None, None] ** m * c**j / _FACTORIALS[m + j]
    theta = np.moveaxis(np.tensordot(weights, np.stack(powers), axes=1), (0, 1), (-4, -3))
    for _ in range(doublings):
        later = np.maximum(j - j.T, 0)
        mixing = np.where((j.T >= 1) & (j.T <= j), c**later / _FACTORIALS[later], 0.0)
        mixed = mixing @ theta.reshape(*many, nodes.size, functions, n * n)
        theta = theta[..., :1, :, :] @ theta + mixed.reshape(theta.shape)
        c = 2.0 * c
    return np.asarray(theta)


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
