"""Heats of a step or window by fixed point: the heats follow from temperatures at the ports, these from the heats."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ._collocation import DEGREE
from ._mixing import mixed
from ._ports import PortHeat
from ._terms import Array

HOTTEST = 3000.0  # K
_ITERATIONS = 20
_SLOW = 0.3  # of the change before
_TRIED = 3  # iterations with mixing, after which their rate tells whether the rest will do


class FixedPoint:
    """Solves T = base + M q, q = heat(T), at all nodes of some samples at once.

    By Picard's iteration; Anderson's mixing takes over where that is slow, as after a large step of a conductance;
    what will not converge in time is given up early. This is the innermost loop: unknowns lie port by port, so that
    every operation runs over all nodes of a port, and meters, which feed nothing back, are left out.

    Parameters
    ----------
    heat : PortHeat
        Of the system.
    M : ndarray, shape (samples (p + 1) n_ports, samples (p + 1) n_q)
        What the heats do to the ports, sample by sample, node by node.
    samples : int
        That are solved at once.
    goal : float
        Change at which to stop [K].
    """

    def __init__(self, heat: PortHeat, M: Array, samples: int, goal: float):
        self._heat, self._samples, self._goal = heat, samples, goal
        self._nodes = nodes = samples * (DEGREE + 1)
        n_ports = heat.ports.size
        by_port = M.reshape(nodes, n_ports, nodes, heat.scatter.shape[1]).transpose(1, 0, 3, 2)
        felt = np.flatnonzero(by_port.any(axis=(0, 1, 3)))
        self._M = np.ascontiguousarray(by_port[:, :, felt]).reshape(n_ports * nodes, felt.size * nodes)
        self._gather = np.ascontiguousarray(heat.scatter[:, felt].T)

    def solve(self, base: Array, start: Array, w: Array) -> tuple[Array, bool]:
        """Heats (samples, p + 1, n_q), and whether they converged.

        Parameters
        ----------
        base : ndarray, shape (samples (p + 1) n_ports,)
            Port states without the heats.
        start : ndarray, shape (n_z,)
            State at the start.
        w : ndarray, shape (samples, n_w)
            Drives, constant over every sample.
        """
        heat, n_ports, nodes = self._heat, self._heat.ports.size, self._nodes
        V = np.empty((n_ports + w.shape[1], nodes))
        V[:n_ports] = start[heat.ports][:, None]
        V[n_ports:] = np.repeat(w, DEGREE + 1, axis=0).T
        base = base.reshape(nodes, n_ports).T.ravel()
        points, changes, sizes = [V[:n_ports].flatten()], [], [np.inf]
        slow_since, converged = _ITERATIONS, False
        for k in range(_ITERATIONS):
            flows = heat.flows(V.T)
            new = base + self._M @ (self._gather @ flows.T).ravel()
            changes.append(new - points[-1])
            sizes.append(np.abs(changes[-1]).max(initial=0.0))
            rate = sizes[-1] / sizes[-2] if 0 < k < slow_since else 1.0  # mixing's says little about what is left
            converged = bool(sizes[-1] * min(1.0, rate / max(1.0 - rate, 0.5)) < self._goal)
            if converged or not sizes[-1] < (HOTTEST if k > slow_since else 2 * sizes[-2]):  # grows, or is not a number
                break
            if k > 1 and sizes[-1] > _SLOW * sizes[-2]:
                slow_since = min(slow_since, k)
            if k >= slow_since + _TRIED and not _in_time(sizes[-1 - _TRIED:], self._goal, _ITERATIONS - 1 - k):
                break
            points.append(mixed(points, changes) if k >= slow_since else new)
            V[:n_ports] = points[-1].reshape(n_ports, nodes)
        return (flows @ heat.scatter).reshape(self._samples, DEGREE + 1, -1), converged


def _in_time(sizes: Sequence[float], goal: float, left: int) -> bool:
    """Whether changes that shrink at the rate of these reach the goal in the iterations left."""
    rate = (sizes[-1] / sizes[0]) ** (1.0 / (len(sizes) - 1))
    return bool(sizes[-1] * rate**left <= goal)
