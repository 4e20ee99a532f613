"""One sample of exponential collocation as matrices.

The linear part is propagated exactly. The nonlinear heats q at the ports are polynomials of degree p over the step,
given by their values at the p + 1 Chebyshev-Lobatto nodes c; with held inputs u,

    z(c_i h) = e^{F c_i h} z(0) + ∫ e^{F(c_i h - s)} ds B u + Σ_j ∫ e^{F(c_i h - s)} l_j(s/h) ds N q_j,

which is linear in z(0), u and q: only the small fixed-point problem q = heat(T) at the ports remains.
"""

from __future__ import annotations

from collections.abc import Sequence
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
_POWERS = np.array([factorial(k) for k in range(DEGREE + 1)]) * _MONOMIALS.T  # (s/h)^k -> nodal values
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

    The last few are kept, for several records of one system; they cannot be written to.
    """
    if parts.F.size > _SMALL:
        return _made(parts, h)
    arrays = (parts.F, parts.B, parts.N, parts.ports)
    return _kept(_Asked(b"".join(one.tobytes() for one in arrays), tuple((one.shape, one.dtype.str) for one in arrays),
                        h, parts))


def step_slopes(parts: Augmented, along: Sequence[Augmented], h: float) -> Array:
    """Derivatives of [K Ku M] of a step of length h [s] along changes of F, B and N, (columns, rows, changes)."""
    (nz, nu), nq, P = parts.B.shape, parts.N.shape[1], len(along)
    B, N = (np.stack([getattr(one, part) for one in along], axis=1) * h for part in ("B", "N"))
    integrals, slopes = _of_ports(parts, h, np.stack([one.F for one in along], axis=1) * h)
    rows = len(integrals)
    out = np.empty((nz + nu + (DEGREE + 1) * nq, rows, P))
    out[:nz] = slopes[:, 0].transpose(2, 0, 1)
    by_inputs = slopes[:, 1] @ (parts.B * h) + (integrals[:, 1] @ B.reshape(nz, -1)).reshape(rows, P, nu)
    out[nz:nz + nu] = by_inputs.transpose(2, 0, 1)
    if nq:
        heats, moved = _of_heats(integrals), _of_heats(slopes.reshape(rows, -1, P * nz)).reshape(rows, -1, P, nz)
        by_heats = moved @ (parts.N * h) + (heats @ N.reshape(nz, -1)).reshape(rows, -1, P, nq)
        out[nz + nu:] = by_heats.transpose(1, 3, 0, 2).reshape(-1, rows, P)
    return out


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
    nz, nq = parts.N.shape
    integrals, _ = _of_ports(parts, h, np.zeros((nz, 0, nz)))
    heats = _of_heats(integrals) @ (parts.N * h) if nq else np.zeros((len(integrals), 0))
    return Step(np.ascontiguousarray(integrals[:, 0]), integrals[:, 1] @ (parts.B * h),
                heats.reshape(len(integrals), (DEGREE + 1) * nq))


def _of_ports(parts: Augmented, h: float, along: Array) -> tuple[Array, Array]:
    """Integrals with rows [ports at nodes 1..p, z at the end] (rows, functions, n), and their derivatives."""
    if parts.ports.size or parts.N.shape[1]:
        both = node_integrals(parts.F * h, along)
    else:  # a linear network: its state at the end, by that at the start and held inputs
        both = node_integrals(parts.F * h, along, NODES[-1:], 2)
    at_nodes = DEGREE * parts.ports.size
    integrals, slopes = (np.concatenate([np.take(of, parts.ports, axis=2).swapaxes(1, 2).reshape(
        at_nodes, of.shape[1], *of.shape[3:]), of[-1].swapaxes(0, 1)]) for of in both)
    return integrals, slopes


def _of_heats(integrals: Array) -> Array:
    """By the heat at every node (rows, p + 1, ...), of integrals of the powers of s / h."""
    return np.asarray(_POWERS @ integrals[:, 1:], np.float64)


def node_integrals(Z: Array, along: Array, nodes: Array = NODES[1:], functions: int = _FUNCTIONS
                   ) -> tuple[Array, Array]:
    """θ_j(c) = Σ_m c^(m+j) / (m+j)! Z^m at nodes c: e^(cZ), and integrals over s of e^((c-s)Z) s^(j-1) / (j-1)!.

    A Taylor series at c / 2^s, then s doublings θ_j(2c) = θ_0 θ_j + Σ_(k=1..j) c^(j-k) / (j-k)! θ_k
    (Al-Mohy and Higham 2011, section 3); their derivatives by the rule of products in both (Al-Mohy and Higham 2009).

    Parameters
    ----------
    Z : ndarray, shape (n, n)
        Rate times step [-].
    along : ndarray, shape (n, changes, n)
        Changes of Z [-], the axis of changes between row and column.
    nodes : ndarray, shape (n_nodes,)
        Parts of the step c [-]; default the nodes 1 to p.
    functions : int
        How many functions, j from 0 on; default p + 2.

    Returns
    -------
    integrals : ndarray, shape (n_nodes, functions, n, n)
        By node and j.
    slopes : ndarray, shape (n_nodes, functions, n, changes, n)
        Derivatives along the changes.
    """
    size = float(np.abs(Z).sum(axis=-1).max(initial=0.0))
    doublings = max(0, int(np.ceil(np.log2(size)))) if size > 1.0 else 0
    n, P, _ = along.shape
    m, j = np.arange(_TERMS), np.arange(functions)[:, None]
    c = nodes[:, None, None] / 2.0**doublings
    weights = nodes[:, None, None] ** m * c**j / _FACTORIALS[m + j]
    theta, slopes = (np.tensordot(weights, powers, axes=1)
                     for powers in _powers(Z / 2.0**doublings, along / 2.0**doublings))
    flat, tall = (nodes.size, functions, -1), (nodes.size, 1, n * P, n)
    for _ in range(doublings):
        later = np.maximum(j - j.T, 0)
        mixing = np.where((j.T >= 1) & (j.T <= j), c**later / _FACTORIALS[later], 0.0)
        first = theta[:, :1]
        if P:
            mixed = (mixing @ slopes.reshape(flat)).reshape(slopes.shape)
            mixed += first @ slopes
            mixed += (slopes[:, :1].reshape(tall) @ theta).reshape(slopes.shape)
            slopes = mixed
        theta = first @ theta + (mixing @ theta.reshape(flat)).reshape(theta.shape)
        c = 2.0 * c
    return theta, slopes.reshape(nodes.size, functions, n, P, n)


def _powers(Z: Array, along: Array) -> tuple[Array, Array]:
    """Z^m (m, n, n) and their derivatives (m, n, changes n)."""
    n, P, _ = along.shape
    powers, slopes, wide = np.empty((_TERMS, n, n)), np.zeros((_TERMS, n, P * n)), along.reshape(n, P * n)
    powers[0] = np.eye(n)
    for m in range(1, _TERMS):
        np.matmul(powers[m - 1], Z, out=powers[m])
        if P:
            slopes[m] = (slopes[m - 1].reshape(n * P, n) @ Z).reshape(n, P * n) + powers[m - 1] @ wide
    return powers, slopes


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
