"""Kind "observer": [c P, M'P; P M, c P] > 0 for M = A_d - L C + Γ (J - A) over the box.

A_d = exp(F T), Γ = (integral of exp(F s) from 0 to T) E^-1, F = E^-1 A the nominal passive network, linear links and
modules at the conductance of their reference temperature.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ._ball import BITS, Ball, exponential, fixed
from ._definite import BITS as UNITS
from ._definite import Scaling, definite
from ._document import get, margin, matrix, only, positive, sequence, text
from ._exact import ZERO, Malformed, NotCovered, exact, short
from ._lyapunov import Units, decide, link_shares, refine
from ._result import Answer, not_covered, not_valid
from ._thermal import Network, check_cost, read_nominal
from ._uncertain import read_network
from ._vertices import Entries, Vertex, add, jacobian

_LONGEST = 20_000  # sum of |F_ij| times the sample time
_MOST_LUMPS = 60
_PRIME = 2**61 - 1


@dataclass(frozen=True)
class Sensor:
    """Reads gain times the temperature of one lump."""

    name: str
    lump: int
    gain: Fraction


@dataclass(frozen=True)
class Problem:
    """What one observer certificate claims; ``nominal`` has the section's own numbers."""

    network: Network
    nominal: Network
    sensors: list[Sensor]
    gain: list[list[Fraction]]
    sample_time: Fraction
    contraction: Fraction
    margin: Fraction
    matrix: list[list[Fraction]]


def read(parts: Mapping[str, Mapping[str, Any]]) -> Problem:
    """Return the problem of the sections of a certificate."""
    system, region, evidence = parts["system"], parts["region"], parts["evidence"]
    network = read_network(system, region)
    nominal = read_nominal(system, region)
    if any(name.startswith("lumps.") for name in network.parameters):
        raise Malformed("region.parameters: an uncertain capacity")
    n = len(network.lumps)
    sensors = [_sensor(item, network.lumps, f"system.sensors[{k}]")
               for k, item in enumerate(sequence(get(system, "sensors", "system"), "system.sensors"))]
    contraction = positive(evidence.get("contraction", 1), "evidence.contraction")
    if contraction > 1:
        raise Malformed("evidence.contraction: above 1")
    return Problem(network, nominal, sensors, matrix(get(system, "gain", "system"), n, len(sensors), "system.gain"),
                   positive(get(region, "sample_time", "region"), "region.sample_time"), contraction,
                   margin(parts["margin"], "contraction"),
                   matrix(get(evidence, "matrix", "evidence"), n, n, "evidence.matrix"))


def check(problem: Problem) -> Answer:
    """Decide the inequality over the box, the stored margin taken off the contraction."""
    P, n = problem.matrix, len(problem.matrix)
    c = problem.contraction - problem.margin
    if c <= 0:
        return not_valid("contraction minus margin is not positive")
    if any(P[i][j] != P[j][i] for i in range(n) for j in range(i)):
        return not_valid("P is not symmetric")
    if n > _MOST_LUMPS:
        raise NotCovered(f"{n} lumps are too many, at most {_MOST_LUMPS}")
    status = decide(P)
    if not status:
        return not_valid("P is not positive definite") if status is False else not_covered("P > 0 is not proven")
    check_cost(problem.network)
    sampled = _Sampled(problem)
    base, nonlinear = link_shares(problem.network)
    form = _Form(sampled, [P[k][k] for k in range(n)], c)

    def violated(found: list[Vertex]) -> bool:
        entries, is_exact = jacobian(problem.network, found)
        return is_exact and definite(*form.start(entries)) is False

    return refine(problem.network, form.start(base), nonlinear, form.share, violated)


class _Sampled:
    """P (A_d - L C) and P Γ, and A."""

    def __init__(self, problem: Problem):
        n = len(problem.matrix)
        self.size, self.P = n, problem.matrix
        self.A, _ = link_shares(problem.nominal)
        for module in problem.nominal.modules:
            K = module.nominal[2][0]
            for i, j in ((module.hot, module.cold), (module.cold, module.hot)):
                add(self.A, (i, i), -K)
                add(self.A, (i, j), K)
        capacity = [low for low, _ in problem.nominal.capacity]
        F = {(i, j): value / capacity[i] for (i, j), value in self.A.items()}
        if sum((abs(value) for value in F.values()), ZERO) * problem.sample_time > _LONGEST:
            raise NotCovered("the sample time is too long to enclose the sampled network")
        if not _regular([[self.A.get((i, j), ZERO) for j in range(n)] for i in range(n)]):
            raise NotCovered("the passive network is not regular: some lump has no path to an ambient")
        power, integral = exponential(F, n, problem.sample_time)
        matrix = fixed({(i, j): value for i, row in enumerate(problem.matrix) for j, value in enumerate(row)}, n, n)
        self.hold = matrix * (integral * fixed({(k, k): 1 / value for k, value in enumerate(capacity)}, n, n))
        injection: Entries = {}
        for i, row in enumerate(problem.gain):
            for value, sensor in zip(row, problem.sensors, strict=True):
                add(injection, (i, sensor.lump), -value * sensor.gain)
        self.passive = matrix * (power + fixed(injection, n, n))


class _Form:
    """The matrix [c P, M'P; P M, c P] in units, scaled so that its diagonal is near one."""

    def __init__(self, sampled: _Sampled, diagonal: list[Fraction], contraction: Fraction):
        self.sampled, self.contraction, self.n = sampled, contraction, len(diagonal)
        self.scaling = Scaling([contraction * value for value in (*diagonal, *diagonal)])

    def start(self, jacobian: Entries) -> Units:
        """Return the matrix for one Jacobian, and a bound of its errors."""
        entries = dict(jacobian)
        for place, value in self.sampled.A.items():
            add(entries, place, -value)
        n, P = self.n, self.sampled.P
        rows, error = self._around(self.sampled.passive + self._held(entries))
        for k in (0, n):
            for i in range(n):
                for j in range(n):
                    rows[k + i][k + j] = self.scaling.units(self.contraction * P[i][j], k + i, k + j)
        return rows, error

    def share(self, entries: Entries) -> Units:
        """Return the share of some entries of the Jacobian, and a bound of its errors."""
        return self._around(self._held(entries))

    def _held(self, entries: Entries) -> Ball:
        return self.sampled.hold * fixed(entries, self.n, self.n)

    def _around(self, ball: Ball) -> Units:
        """Return [0, X'; X, 0] in units."""
        n, shifts = self.n, self.scaling.shifts
        found = [[0] * (2 * n) for _ in range(2 * n)]
        for i in range(n):
            for j in range(n):
                down = BITS - UNITS + shifts[n + i] + shifts[j]
                found[n + i][j] = found[j][n + i] = _shifted(ball.rows[i][j], down)
        return found, 1 + _shifted(ball.error, BITS - UNITS + 2 * min(shifts)) + 1


def _shifted(value: int, down: int) -> int:
    return value >> down if down >= 0 else value << -down


def _regular(rows: list[list[Fraction]]) -> bool:
    """Whether a matrix is regular for certain: its determinant is not zero modulo a prime."""
    scale = math.lcm(*(value.denominator for row in rows for value in row))
    work = [[int(value * scale) % _PRIME for value in row] for row in rows]
    n = len(work)
    for k in range(n):
        pivot = next((i for i in range(k, n) if work[i][k]), None)
        if pivot is None:
            return False
        work[k], work[pivot] = work[pivot], work[k]
        inverse = pow(work[k][k], -1, _PRIME)
        for i in range(k + 1, n):
            factor = work[i][k] * inverse % _PRIME
            if factor:
                work[i] = [(a - factor * b) % _PRIME for a, b in zip(work[i], work[k], strict=True)]
    return True


def _sensor(value: Any, lumps: tuple[str, ...], where: str) -> Sensor:
    table = {"name": value, "lump": value} if isinstance(value, str) else value
    if not isinstance(table, Mapping):
        raise Malformed(f"{where}: {short(value)} is not an object")
    only(table, ("name", "lump", "gain"), where)
    lump = text(get(table, "lump", where), where)
    if lump not in lumps:
        raise Malformed(f"{where}: {short(lump)} is not a lump")
    return Sensor(text(table.get("name", lump), where), lumps.index(lump), exact(table.get("gain", 1), where))
