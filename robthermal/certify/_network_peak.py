"""Search for certificates of kind "network_peak": moments by sparse products, then pieces of time small enough."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike
from scipy.sparse import csr_array, diags_array

from .._arrays import Array
from .._checks import whole_number
from ..errors import InputError
from ..verification import Certificate, establish, not_certified
from ._network import checked_network
from ._sections import made_by

_SLACK = 5e-4  # of the largest value, between it and the bound
_SURPLUS = 30.0  # exponent of what the sum leaves out
_MOST = 5_000  # pieces of time
_GRID, _ZOOMS = 1000, 4  # times where the largest value is looked for, and how often around it


@dataclass(frozen=True)
class _Moments:
    """delta' T_k(B) x of one lump, the fastest rate and the growth [1/s]."""

    values: Array
    rate: float
    growth: float
    norm: float  # of the start over that of the lump [K]
    entries: int

    def at(self, t: float) -> tuple[float, float]:
        """Temperature [K] and its slope [K/s] without growth."""
        rho = self.rate * t
        k = np.arange(1, min(len(self.values) - 2, int(math.sqrt(80.0 * rho) + 40.0)) + 1)
        weights, mu = 2.0 * scipy.special.ive(k, rho), self.values
        none = float(scipy.special.ive(0, rho))
        slope = none * (mu[1] - mu[0]) + weights @ ((mu[k - 1] + mu[k + 1]) / 2 - mu[k])
        return float(none * mu[0] + weights @ mu[k]), self.rate * float(slope)

    def most(self, low: float, high: float) -> float:
        """What the checker can prove between two times, a little more [K]."""
        z, slope = self.at((low + high) / 2)
        r, rho = (high - low) / 2, self.rate * high
        error = self.norm * (8 * (self.entries + 16) * 2.0**-52 * (rho + 3 * math.sqrt(rho) + 2) + 1e-14)
        bend = self.norm * (2 / (math.e * low)) ** 2
        most = z + (abs(slope) + 2 * self.rate * error) * r + bend * r**2 / 2 + 2 * error
        return most * math.exp(min(self.growth * high, 700.0)) * (1 + 1e-12)

    def peak(self, horizon: float) -> tuple[float, float]:
        """Largest value on a grid that is refined around it, and when."""
        times = np.union1d(np.linspace(0.0, horizon, _GRID + 1)[1:], np.geomspace(1e-5, 1.0, _GRID // 4) * horizon)
        for _ in range(_ZOOMS):
            values = [self.at(t)[0] * math.exp(min(self.growth * t, 700.0)) for t in times]
            k = int(np.argmax(values))
            best, when = values[k], float(times[k])
            times = np.linspace(times[max(k - 1, 0)], times[min(k + 1, len(times) - 1)], 21)
        return max((best, when), (float(self.values[0]), 0.0))


def network_peak(E: ArrayLike, A: Any, lump: int, start: ArrayLike, horizon: float, *,
                 bound: float | None = None) -> Certificate:
    """Certify how warm one lump of a sparse network E ẋ = A x becomes, from every start nowhere warmer than one.

    Temperatures are counted from that of the surroundings; there is no heat but that of the start. Up to 10⁶ lumps.

    Parameters
    ----------
    E : array_like, shape (n,)
        Heat capacity of every node [J/K].
    A : scipy.sparse array, shape (n, n)
        Symmetric, Metzler (off-diagonals not negative) [W/K].
    lump : int
        Index of the lump that is watched, from 0.
    start : array_like, shape (n,)
        Warmest start of every lump [K]. Between -1e90 and 1e90; colder starts are covered.
    horizon : float
        How long the bound holds [s].
    bound : float, optional
        Temperature to prove [K], above 0; by default the smallest that is found, and 0.05 % more.

    Returns
    -------
    Certificate
        Its claim names the bound, ``certificate.region["bound"]``. Not certified, with the reason, where A is not
        symmetric or the lump becomes warmer than `bound`.

    Raises
    ------
    InputError
        Wrong shapes, negative off-diagonals, an index that there is not, a horizon or bound that is not positive.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> from scipy.sparse import csr_array
    >>> A = csr_array(np.array([[-1.0, 1.0], [1.0, -2.0]]))
    >>> c = rt.certify.network_peak([10.0, 10.0], A, 1, [5.0, 0.0], 100.0)
    >>> c.holds, c.region["bound"]
    (True, 1.3754)
    """
    capacity, matrix = checked_network(E, A)
    n = capacity.size
    lump = whole_number(lump, "lump", least=0)
    if lump >= n:
        raise InputError(f"lump is {lump}", where="argument lump", expected=f"an index from 0 to {n - 1}")
    warmest = _start(start, n)
    for name, value in (("horizon", horizon), ("bound", 1.0 if bound is None else bound)):
        if not (np.ndim(value) == 0 and np.isreal(value) and 0.0 < value < math.inf):
            raise InputError(f"{name} is {value!r}", where=f"argument {name}", expected="a positive number")
    entries = matrix.tocoo()
    system = {"capacity": capacity, "rows": entries.row.astype(np.int64), "cols": entries.col.astype(np.int64),
              "values": entries.data}
    author = made_by("Chebyshev moments", "found")

    def refused(reason: str, limit: float = math.nan) -> Certificate:
        region = {"start": warmest, "lump": lump, "horizon": float(horizon)}
        return not_certified("network_peak", system=system, region=region, evidence={}, made_by=author, reason=reason,
                             claim=f"Lump {lump} stays below {limit:g} K." if math.isfinite(limit) else "")

    if (matrix != matrix.T).nnz:
        return refused("A is not symmetric")
    if not matrix.diagonal().min() < 0:
        return refused("no lump loses heat to another or to the surroundings: the start stays as it is")
    found = _moments(capacity, matrix, lump, warmest, float(horizon))
    highest, when = found.peak(float(horizon))
    limit = float(f"{max(highest, 0.0) * (1 + _SLACK):.5g}") if bound is None else float(bound)
    if highest > limit or limit <= 0.0:
        return refused(f"from the warmest start the lump reaches {highest:.6g} K after {when:.4g} s", limit)
    pace = float(found.growth - matrix.diagonal()[lump] / capacity[lump]) * max(float(warmest.max()), 0.0)
    edges = _edges(found, limit, pace, float(horizon))
    if not edges:
        return refused(f"the largest temperature found, {highest:.6g} K after {when:.4g} s, is too close to the bound",
                       limit)
    return establish("network_peak", system=system, made_by=author, margin={},
                     region={"start": warmest, "lump": lump, "horizon": float(horizon), "bound": limit},
                     evidence={"degree": len(found.values) - 2, "edges": edges})


def _start(start: ArrayLike, n: int) -> Array:
    try:
        warmest = np.array(start, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"not numbers ({error})", where="argument start") from None
    if warmest.shape != (n,) or not np.isfinite(warmest).all():
        raise InputError(f"start has shape {warmest.shape}" if warmest.shape != (n,) else "start is not finite",
                         where="argument start", expected=f"{n} finite temperatures [K], one per lump")
    return warmest


def _moments(capacity: Array, matrix: csr_array, lump: int, start: Array, horizon: float) -> _Moments:
    growth = max(0.0, float(np.max(matrix.sum(axis=1) / capacity)))
    rate = (float(np.max(-matrix.diagonal() / capacity)) + growth) * (1 + 1e-12)
    own = diags_array(np.full(capacity.size, 2.0 * (1.0 - growth / rate)))
    twice = csr_array(diags_array(2.0 / (capacity * rate)) @ matrix + own)
    degree = math.ceil(math.sqrt(2.0 * _SURPLUS * rate * horizon) + 40.0)
    before, now = start, 0.5 * (twice @ start)
    found = [before[lump], now[lump]]
    for _ in range(degree):
        before, now = now, twice @ now - before
        found.append(now[lump])
    norm = math.sqrt(float(np.sum(capacity * start**2)) / capacity[lump])
    return _Moments(np.array(found), rate, growth, norm, int(np.diff(matrix.indptr).max()))


def _edges(found: _Moments, bound: float, pace: float, horizon: float) -> list[float]:
    """Ends of pieces of time in each of which the bound can be proven; empty where there are too many."""
    gap = bound - max(float(found.values[0]), 0.0)
    low = min(horizon, 0.9 * gap / pace) if pace > 0 else horizon
    low = min(low, 0.05 / found.growth) if found.growth > 0 else low
    edges, width = [low], low
    while edges[-1] < horizon and len(edges) < _MOST:
        low, width = edges[-1], 2.0 * width
        while low > 0 and width > 1e-9 * low and found.most(low, min(low + width, horizon)) > bound:
            width *= 0.7
        if not width > 1e-9 * low > 0:
            return []
        edges.append(min(low + width, horizon))
    return edges if edges[-1] == horizon else []
