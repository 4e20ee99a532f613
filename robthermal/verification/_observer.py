"""Kind "observer": the error of a sampled observer shrinks in one quadratic norm over a box.

x^+ = A_d x^ + Γ f(x^, I) + L (y - C x^), A_d = exp(E^-1 A T_s) of the passive network with the modules' conductance at
their reference temperature, Γ = (E^-1 A)^-1 (A_d - 1) E^-1, f all other heat, held over the sample. The error obeys
e+ = M e with M = A_d - L C + Γ F, F a mean of ∂f/∂x over the box (proof note, 10).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from flint import arb, arb_mat, fmpq

from robthermal.errors import InputError

from ._corners import Part, first_failure, is_positive
from ._definite import approximate
from ._fields import get, mapping, margin_of, no_other, numbers, positive, sequence, text
from ._kind import Kind, Proof, working_precision
from ._lyapunov import (
    PIECES,
    Described,
    asymmetry,
    dense,
    link_slopes,
    module_slopes,
    too_much,
)
from ._numbers import decimal, exact, name_of, round_down, show
from ._system import Region, ThermalSystem, read_region, read_system, say_region
from ._uncertain import Parameters, read_parameters, say_subject, worst_system
from ._vertices import Entries

_LONGEST = 100_000  # |E^-1 A| T_s beyond which the exponential is not enclosed


@dataclass(frozen=True)
class Sensor:
    """Reads gain times the temperature of one lump, without lag."""

    name: str
    lump: int
    gain: fmpq


@dataclass(frozen=True)
class Observer:
    """The exact problem of one observer certificate."""

    system: ThermalSystem
    nominal: ThermalSystem
    region: Region
    parameters: Parameters
    sensors: tuple[Sensor, ...]
    gain: tuple[tuple[fmpq, ...], ...]
    sample_time: fmpq
    contraction: fmpq
    margin: fmpq
    matrix: tuple[tuple[fmpq, ...], ...]


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Observer:
    """Return the exact problem, or raise InputError."""
    nominal, table, found = read_system(system), mapping(region, "region"), mapping(evidence, "evidence")
    box, parameters = read_region(region, nominal), read_parameters(table)
    for name, _ in parameters:
        if name.startswith("lumps."):
            raise InputError(f"an uncertain capacity, {name_of(name)}", where="region.parameters",
                             expected="conductances of links, values and slopes of modules",
                             remedy="Certify the observer for each capacity of interest.")
    network = worst_system(nominal, system, parameters)
    sensors = read_sensors(system, network)
    contraction = positive(found.get("contraction", 1), "evidence.contraction")
    if contraction > 1:
        raise InputError(f"contraction {show(contraction)}", where="evidence.contraction", expected="at most 1")
    n = len(network.lumps)
    return Observer(network, nominal, box, parameters, sensors,
                    _matrix(get(system, "gain", "system"), n, len(sensors), "system.gain"),
                    positive(get(table, "sample_time", "region"), "region.sample_time"), contraction,
                    margin_of(margin, "contraction"),
                    _matrix(get(found, "matrix", "evidence"), n, n, "evidence.matrix"))


def claim(problem: Observer, machine: str) -> str:
    """Return the one sentence the data give."""
    reads = say_sensors(problem.sensors, problem.system)
    speed = (f"shrinks at least by the factor {decimal(problem.contraction)}² per sample" if problem.contraction < 1
             else "shrinks strictly with every sample")
    known = (", the same in plant and observer, A_d and Γ those of the nominal numbers and f all other heat"
             if problem.parameters else "")
    subject = say_subject(problem.system, problem.parameters, machine, "sampled model with held heat")
    return (f"The observer x^+ = A_d x^ + Γ f(x^, I) + L (y - C x^) of the {subject}{known}, with sensors "
            f"{reads}, sampled every {decimal(problem.sample_time)} s, f held in between, converges for all "
            f"{say_region(problem.system, problem.region)}, as long as temperatures and estimates both stay in this "
            f"box (that they do is not part of this claim): e'Pe of the error {speed}.")


def prove(problem: Observer) -> Proof:
    """Prove the inequality over the box, with the stored margin taken off the contraction."""
    with working_precision():
        extra = max(problem.margin, fmpq(0))
        proof = _prove(problem, problem.contraction - extra)
        if proof.valid:
            return replace(proof, margins={"contraction": round_down(extra)})
        if extra > 0 and _prove(problem, problem.contraction).valid:
            return Proof(False, f"stored margin {show(extra)} is larger than what can be proven: {proof.reason}")
        return proof


def find_margin(problem: Observer) -> dict[str, float]:
    """Return how much smaller a contraction the same matrix proves, to one per cent.

    Looked for with the refinement that proves the claim itself: a probe that fails would try all finer ones.
    """
    with working_precision():
        inequality = _inequality(problem)
        if isinstance(inequality, str):
            return {"contraction": 0.0}
        each = (_margin(inequality, problem.contraction, pieces) for pieces in PIECES)
        low = next((margin for margin in each if margin is not None), 0.0)
    return {"contraction": float(f"{low * 0.999:.4g}") if low > 0 else 0.0}


def _margin(inequality: _Inequality, contraction: fmpq, pieces: int) -> float | None:
    """Return the margin with one refinement, none where it does not prove the claim itself.

    By bisection. Floats take its steps, and the one they end with is proven; where it is not, every step is.
    """
    def proven(margin: float) -> bool:
        return inequality.prove(contraction - fmpq(*margin.as_integer_ratio()), (pieces,)).valid

    high, hint = round_down(contraction), inequality.hint(contraction, pieces)
    low = _bisected(lambda margin: margin < hint, high)
    if low > 0 and proven(low):
        return low
    if low == 0 and hint > 0:
        return 0.0  # less than is looked for; no margin claims nothing
    return _bisected(proven, high) if proven(0.0) else None


def _bisected(holds: Callable[[float], bool], high: float) -> float:
    """Return a margin that holds, to one per cent of the largest; 0 where none is found."""
    low = 0.0
    while high - low > max(0.01 * low, 1e-5):
        middle = (low + high) / 2 if low > 0 else high / 4
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _prove(problem: Observer, contraction: fmpq) -> Proof:
    """[c P, M'P; P M, c P] > 0 for all M of the box: affine in M, so that vertices suffice."""
    if contraction <= 0:
        return Proof(False, f"contraction {show(contraction)} is not positive")
    inequality = _inequality(problem)
    return Proof(False, inequality) if isinstance(inequality, str) else inequality.prove(contraction)


@dataclass(frozen=True)
class _Inequality:
    """What the inequality is made of, whatever the contraction."""

    problem: Observer
    P: arb_mat
    passive: arb_mat  # P M without what varies
    left: arb_mat  # P Γ
    nonlinear: Sequence[Collection[Described]]

    def prove(self, contraction: fmpq, refinements: Sequence[int] = PIECES) -> Proof:
        """Prove it at every vertex of the relaxed box, refining the relaxation where it fails."""
        n = self.P.nrows()
        start = _schur(self.passive, self.P * arb(contraction))
        words = f"M'PM < {decimal(contraction)}² P, M = A_d - LC + Γ ∂f/∂x,"
        proof = Proof(False, "too many vertices to check any")
        for pieces in refinements:
            more = self.too_much(pieces)
            if more:
                return Proof(False, f"{proof.reason} ({more})")
            groups = self.groups(pieces)
            failed = first_failure(start, groups, lambda item: _part(self.left, item, n))
            if failed is None:
                return Proof(True, f"{words} at all {math.prod(map(len, groups))} vertices of the relaxed box")
            proof = Proof(False, f"{words} fails or cannot be proven at {failed.where or 'the links'}")
            if failed.real:
                break  # a point of the box: no refinement helps
        return proof

    def hint(self, contraction: fmpq, pieces: int) -> float:
        """Return the margin that floats see: M'PM <= c² P is |L^-1 P M L^-T| <= c with P = L L'. It proves nothing."""
        if self.too_much(pieces):
            return 0.0
        try:
            half = np.linalg.inv(np.linalg.cholesky(approximate(self.P)))
        except np.linalg.LinAlgError:
            return 0.0
        base = half @ approximate(self.passive) @ half.T
        shares = [[half @ approximate(self.left * dense(entries, len(base))) @ half.T for entries, *_ in group]
                  for group in self.groups(pieces)]
        return round_down(contraction) - max(float(np.linalg.norm(sum(some, base), 2)) for some in product(*shares))

    def groups(self, pieces: int) -> list[Collection[Described]]:
        """Return the shares of ∂f/∂x of which every vertex takes one of each group."""
        return [*self.nonlinear, *module_slopes(self.problem.system, self.problem.region, pieces)]

    def too_much(self, pieces: int) -> str:
        """Return why the vertices are too many; else empty."""
        return too_much(self.problem.system, self.problem.region, self.nonlinear, pieces, 2 * self.P.nrows())


def _inequality(problem: Observer) -> _Inequality | str:
    """Return the parts of the inequality, P > 0 proven, or why there is none."""
    n = len(problem.matrix)
    base, nonlinear, missing = link_slopes(problem.system, problem.region)
    if missing:
        return (f"{missing}; no other method helps: leave the observer out, or describe the link by a conductance "
                "alone, with a range of it among the parameters")
    broken = asymmetry(problem.matrix) or too_much(problem.system, problem.region, nonlinear, PIECES[0], 2 * n)
    if broken:
        return broken
    P = arb_mat(n, n, [arb(entry) for row in problem.matrix for entry in row])
    if not is_positive(P):
        return "P > 0 fails or cannot be proven"
    sampled = _sampled(problem)
    if isinstance(sampled, str):
        return sampled
    A_d, hold = sampled
    left = P * hold
    passive = P * (A_d - _injection(problem)) + left * dense(_beyond_passive(problem, base), n)
    return _Inequality(problem, P, passive, left, nonlinear)


def _sampled(problem: Observer) -> tuple[arb_mat, arb_mat] | str:
    """Return balls around A_d and Γ of the nominal network, or why there are none."""
    n = len(problem.matrix)
    entries = _passive(problem)
    scaled = {(i, j): value / problem.system.capacity[i] for (i, j), value in entries.items()}
    size = sum((abs(value) for value in scaled.values()), fmpq(0)) * problem.sample_time
    if size > _LONGEST:
        return f"sample time {show(problem.sample_time)} s: too long to enclose the sampled network"
    F = dense(scaled, n)
    A_d = (F * arb(problem.sample_time)).exp()
    one, inverse = arb_mat(n, n, 1), dense({(i, i): 1 / c for i, c in enumerate(problem.system.capacity)}, n)
    try:
        return A_d, F.solve(A_d - one) * inverse
    except ZeroDivisionError:
        return "the passive network has no inverse, or none can be proven: some lump has no path to an ambient"


def _passive(problem: Observer) -> Entries:
    """Return A: linear links and the conductance of the modules at their reference, nominal."""
    entries = dict(link_slopes(problem.nominal, problem.region)[0])
    for module in problem.nominal.modules:
        h, c, K = module.hot, module.cold, module.conductance[0]
        for place, value in (((h, h), -K), ((c, c), -K), ((h, c), K), ((c, h), K)):
            entries[place] = entries.get(place, fmpq(0)) + value
    return entries


def _beyond_passive(problem: Observer, links: Entries) -> Entries:
    """Return what the linear links add to f beyond A: at their least conductance, minus A."""
    entries = dict(links)
    for place, value in _passive(problem).items():
        entries[place] = entries.get(place, fmpq(0)) - value
    return entries


def _injection(problem: Observer) -> arb_mat:
    entries: Entries = {}
    for i, row in enumerate(problem.gain):
        for value, sensor in zip(row, problem.sensors, strict=True):
            place = (i, sensor.lump)
            entries[place] = entries.get(place, fmpq(0)) + value * sensor.gain
    return dense(entries, len(problem.matrix))


def _part(left: arb_mat, described: tuple[Entries, str, bool], n: int) -> Part:
    entries, where, real = described
    return Part(_schur(left * dense(entries, n)), where, real)


def _schur(PM: arb_mat, own: arb_mat | None = None) -> arb_mat:
    """Return [own, M'P; P M, own] of P M, zero where own is left out."""
    n = PM.nrows()
    below = PM.tolist()
    inside = [[arb(0)] * n for _ in range(n)] if own is None else own.tolist()
    above = PM.transpose().tolist()
    rows = [[*inside[i], *above[i]] for i in range(n)] + [[*below[i], *inside[i]] for i in range(n)]
    return arb_mat(rows)


def read_sensors(system: Mapping[str, Any], network: ThermalSystem) -> tuple[Sensor, ...]:
    """Return the sensors of a certificate's system section."""
    items = sequence(get(system, "sensors", "system"), "system.sensors")
    return tuple(_sensor(item, network, f"system.sensors[{k}]") for k, item in enumerate(items))


def say_sensors(sensors: Sequence[Sensor], system: ThermalSystem) -> str:
    """Return the sensors for a claim."""
    return ", ".join(f"{name_of(s.name)} ({decimal(s.gain)} times {name_of(system.lumps[s.lump])})"
                     for s in sensors) or "none"


def _sensor(value: Any, system: ThermalSystem, where: str) -> Sensor:
    if isinstance(value, str):
        value = {"name": value, "lump": value}
    table = mapping(value, where)
    no_other(table, ("name", "lump", "gain"), where)
    lump = text(get(table, "lump", where), f"{where}.lump")
    if lump not in system.lumps:
        raise InputError(f"{name_of(lump)} is not a lump", where=f"{where}.lump")
    name = text(table.get("name", lump), f"{where}.name")
    return Sensor(name, system.lumps.index(lump), exact(table.get("gain", 1), f"{where}.gain"))


def _matrix(value: Any, rows: int, columns: int, where: str) -> tuple[tuple[fmpq, ...], ...]:
    found = sequence(value, where)
    if len(found) != rows:
        raise InputError(f"{len(found)} rows", where=where, expected=f"{rows}, one per lump")
    return tuple(tuple(numbers(row, columns, f"{where}[{k}]")) for k, row in enumerate(found))


OBSERVER = Kind("observer", read, claim, prove, find_margin)
