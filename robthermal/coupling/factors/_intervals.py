"""Frequency intervals on which the envelope of Delta_p is constant, from zero to the end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..._arrays import Array
from ._uncertainty import Uncertainty

_SLACK = 0.9  # intervals are merged as long as the wider ones stay below this part of the largest value


@dataclass(frozen=True, eq=False)
class Intervals:
    """Intervals [edges[k], edges[k+1]] with a constant envelope each.

    Parameters
    ----------
    edges : ndarray, shape (K + 1,)
        Frequencies [rad/s], from 0 to the Nyquist frequency or infinity.
    envelopes : ndarray, shape (K, 2, 2)
        R on each interval.
    """

    edges: Array
    envelopes: Array

    def points(self, index: int, count: int = 2000) -> Array:
        """Frequencies inside an interval [rad/s].

        Parameters
        ----------
        index : int
            Number of the interval.
        count : int
            Number of points in it.
        """
        low, high = self.edges[index], self.edges[index + 1]
        if np.isfinite(high):
            return np.linspace(low, high, count)
        return max(low, 1e-6) * np.geomspace(1.0, 1e6, count)

    def weights(self) -> Array:
        """mu of the envelope for off-diagonal Delta_k: sup over phases of rho(Delta_p [[0, 1], [1, 0]]), shape (K,)."""
        diagonal = np.sqrt(self.envelopes[:, 0, 0] * self.envelopes[:, 1, 1])
        if not np.any(self.envelopes[:, 0, 1]) and not np.any(self.envelopes[:, 1, 0]):
            return diagonal
        return np.max(np.abs(np.linalg.eigvals(self.envelopes[:, :, ::-1])), axis=1)

    def widest(self) -> Array:
        """Largest envelope over all intervals, shape (1, 2, 2)."""
        return np.max(self.envelopes, axis=0, keepdims=True)

    def merged(self, radii: Array, worst: float) -> Intervals:
        """Fewer, wider intervals with the larger envelope: sound, and as tight where it matters.

        Parameters
        ----------
        radii : ndarray, shape (K,)
            Value attained on each interval.
        worst : float
            Largest of the radii.
        """
        starts, current, size = [0], self.envelopes[0], radii[0]
        envelopes = []
        for k in range(1, len(radii)):
            wider = np.maximum(current, self.envelopes[k])
            bound = max(size * growth(wider, current), radii[k] * growth(wider, self.envelopes[k]))
            if bound <= _SLACK * worst:
                current, size = wider, bound
                continue
            envelopes.append(current)
            starts.append(k)
            current, size = self.envelopes[k], radii[k]
        envelopes.append(current)
        return Intervals(np.append(self.edges[starts], self.edges[-1]), np.array(envelopes))


def growth(larger: Array, smaller: Array) -> float:
    """How much rho(|Delta_k| R) can grow from one envelope to a larger one: the largest ratio of entries.

    Parameters
    ----------
    larger, smaller : ndarray, shape (2, 2)
        Envelopes, larger >= smaller entrywise.
    """
    if np.any((smaller == 0) & (larger > 0)):
        return float("inf")
    return float(np.max(np.divide(larger, smaller, out=np.ones_like(larger), where=smaller > 0)))


def intervals_of(uncertainty: Uncertainty, dt: float) -> Intervals:
    """Larger of the two envelope values between two frequencies, the end values outside.

    Parameters
    ----------
    uncertainty : Uncertainty
        Envelope of the measured plants.
    dt : float
        Sample time of the loop [s].
    """
    last = np.pi / dt if dt else np.inf
    omega, R = uncertainty.omega, np.moveaxis(uncertainty.envelope, -1, 0)
    edges, envelopes = list(omega), list(np.maximum(R[:-1], R[1:]))
    if omega[0] > 0:
        edges, envelopes = [0.0, *edges], [R[0], *envelopes]
    if omega[-1] < last * (1 - 1e-12):
        edges, envelopes = [*edges, last], [*envelopes, R[-1]]
    edges[-1] = last
    return Intervals(np.array(edges), np.array(envelopes))
