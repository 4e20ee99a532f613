"""Kind "regulated": the rest of a network contracts while modules hold their cold lumps exactly at their set-points.

The currents of these modules are whatever holds them. With the heat pumped instead of the current as the coordinate,
the ranges of the currents are a convex set, so that two trajectories obey E e' = J e with J a mean of the reduced
Jacobian (see ``_regulated_modules``) over the box; every inequality is convex in J (proof note, 12).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import product
from typing import Any

from flint import arb, arb_mat, fmpq

from robthermal.errors import InputError

from ._contraction import search, shorten
from ._corners import is_positive as dense_is_positive
from ._cost import product_up_to, too_many_corners
from ._definite import eliminate, is_positive
from ._fields import get, kelvin_interval, mapping, margin_of
from ._kind import Kind, Proof, working_precision
from ._lyapunov import MOST_ROWS, asymmetry
from ._norm import NORMS, read_norm, say_rate
from ._numbers import decimal, name_of, round_down, show
from ._regulated_modules import Alternative, Groups, RegulatedNetwork, lost_regulation, shares
from ._system import ThermalSystem, read_region, read_system, say_interval
from ._uncertain import Parameters, read_parameters, say_subject, worst_system
from ._vertices import Entries

_PIECES = (1, 4, 16)  # per current, refined in turn
_MOST_WORK = 3e7  # combinations times (lumps that vary)³
_MOST_ENTRIES = 3_000_000  # of all blocks, some 500 MB
Rows = list[dict[int, arb]]
Sparse = defaultdict[int, dict[int, arb]]


@dataclass(frozen=True)
class Regulated:
    """The exact problem of one certificate; weights and P over the lumps that are not held, in order."""

    network: RegulatedNetwork
    method: str
    rate: fmpq
    margin: fmpq
    weights: tuple[fmpq, ...]
    matrix: tuple[tuple[fmpq, ...], ...]
    parameters: Parameters


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Regulated:
    """Return the exact problem, or raise InputError."""
    nominal, table = read_system(system), mapping(region, "region")
    parameters = read_parameters(table)
    network = _held_network(worst_system(nominal, system, parameters), table)
    norm = read_norm(evidence, len(network.free))
    return Regulated(network, norm.method, norm.rate, margin_of(margin, "rate"), norm.weights, norm.matrix, parameters)


def claim(problem: Regulated, machine: str) -> str:
    """Return the one sentence the data give."""
    network, system = problem.network, problem.network.system
    held = ", ".join(f"lump {name_of(system.lumps[lump])} held exactly at one set-point in "
                     f"{say_interval(network.region.temperature[lump])} K by the current of "
                     f"{name_of(system.modules[k].name)} in {say_interval(network.region.current[k])} A"
                     for lump, k in network.holder.items())
    others = "".join(f" and current of {name_of(module.name)} in {say_interval(current)} A"
                     for k, (module, current) in enumerate(zip(system.modules, network.region.current, strict=True))
                     if k not in network.holder.values())
    return (f"The {say_subject(system, problem.parameters, machine)}, with {held}, contracts for all "
            f"{_say_temperatures(network)}{others}: between any two trajectories under the same set-points, ambients, "
            f"heat loads and other currents, as long as both stay in these ranges (that they do is not part "
            f"of this claim), {NORMS[problem.method]} of the lumps that are not held (method {problem.method}) "
            f"{say_rate(problem.rate)}; more current takes more heat from every held lump.")


def prove(problem: Regulated) -> Proof:
    """Prove that the currents hold their lumps, and the inequality of the method with the stored margin added."""
    with working_precision():
        lost = lost_regulation(problem.network) or _malformed(problem)
        if lost:
            return Proof(False, lost)
        extra, prove_rate = max(problem.margin, fmpq(0)), _prover(problem)
        proof = prove_rate(problem.rate + extra)
        if proof.valid:
            return replace(proof, margins={"rate": round_down(extra)})
        if extra > 0 and prove_rate(problem.rate).valid:
            return Proof(False, f"stored margin {show(extra)} 1/s is larger than what can be proven: {proof.reason}")
        return proof


def find_margin(problem: Regulated) -> dict[str, float]:
    """Return a margin that the checker proves, close to the largest [1/s]."""
    with working_precision():
        prove_rate = _prover(problem)
        extra = search(lambda value: prove_rate(problem.rate + fmpq(*value.as_integer_ratio())).valid,
                       round_down(problem.rate))
    return {"rate": shorten(extra)}


def _malformed(problem: Regulated) -> str:
    """Return what is wrong with the evidence itself, empty where nothing is."""
    names = [problem.network.system.lumps[k] for k in problem.network.free]
    for name, weight in zip(names, problem.weights, strict=False):
        if weight <= 0:
            return f"weight of lump {name_of(name)} is {show(weight)}, not positive"
    if not problem.matrix:
        return ""
    capacity = next((name for name, _ in problem.parameters if name.startswith("lumps.")), "")
    if capacity:
        return f"method lyapunov: {name_of(capacity)} is uncertain, which needs method energy, sum or max"
    broken = asymmetry(problem.matrix)
    n = len(problem.matrix)
    if n > MOST_ROWS:
        broken = f"a dense matrix for {n} lumps is too large to check, at most {MOST_ROWS}"
    if not broken and not dense_is_positive(arb_mat(n, n, [arb(value) for row in problem.matrix for value in row])):
        broken = "P > 0 fails or cannot be proven"
    return f"method lyapunov: {broken}" if broken else ""


def _prover(problem: Regulated) -> Callable[[fmpq], Proof]:
    """Return the proof for any rate; the reduced Jacobian does not depend on it and is made once for each cut."""
    return partial(_prove_rate, problem, cache(partial(shares, problem.network, problem.method)))


def _prove_rate(problem: Regulated, reduced: Callable[[int], tuple[Entries, Groups, str]], rate: fmpq) -> Proof:
    """Prove the inequality over the box, cutting the currents finer where it fails."""
    proof = Proof(False, "")
    for pieces in _PIECES:
        region = problem.network.region
        many = too_many_corners(problem.network.system, region, 16 * pieces, problem.weights)  # 4 corners, 4 bounds
        if many:
            return replace(proof, reason=proof.reason or f"method {problem.method}: {many}")
        base, groups, missing = reduced(pieces)
        if missing:
            return Proof(False, f"method {problem.method}: {missing}")
        proof = (_prove_lines if problem.weights else _prove_form)(problem, rate, base, groups)
        if proof.valid:
            break
    return proof


def _prove_lines(problem: Regulated, rate: fmpq, base: Entries, groups: Groups) -> Proof:
    """Weighted rows (max) or columns (sum) of J below -rate E, in exact rational arithmetic."""
    names, free = problem.network.system.lumps, problem.network.free
    weight = dict(zip(free, problem.weights, strict=True))
    total = dict.fromkeys(free, fmpq(0))
    where: dict[int, list[str]] = {line: [] for line in free}
    for group in [[Alternative(base, "the links")], *groups]:
        for line, (value, place) in _largest(problem.method, weight, group).items():
            total[line] += value
            where[line].append(place)
    for line in free:
        value, bound = total[line] / (weight[line] * problem.network.system.capacity[line]), -rate
        if value > bound or (value == bound and rate == 0):
            words = f"weighted {'column' if problem.method == 'sum' else 'row'} of lump {name_of(names[line])}"
            return Proof(False, f"method {problem.method}: the {words} may reach {show(value)} 1/s, not "
                                f"{'<=' if rate > 0 else '<'} {show(bound)} 1/s, at {', '.join(where[line])}")
    return Proof(True, "every weighted line is bounded over the box")


def _largest(method: str, weight: Mapping[int, fmpq], group: list[Alternative]) -> dict[int, tuple[fmpq, str]]:
    """Return the largest share of one group in every line, diagonal signed, the rest by absolute value."""
    largest: dict[int, tuple[fmpq, str]] = {}
    touched = {line for item in group for line in _line_sums(method, weight, item)}
    for item in group:
        sums = _line_sums(method, weight, item)
        for line in touched:
            value = sums.get(line, fmpq(0))
            if line not in largest or value > largest[line][0]:
                largest[line] = (value, item.where)
    return largest


def _line_sums(method: str, weight: Mapping[int, fmpq], item: Alternative) -> dict[int, fmpq]:
    sums: dict[int, fmpq] = {}
    for (i, j), value in item.entries.items():
        line, other = (j, i) if method == "sum" else (i, j)
        sums[line] = sums.get(line, fmpq(0)) + weight[other] * (value if i == j else abs(value))
    return sums


def _prove_form(problem: Regulated, rate: fmpq, base: Entries, groups: Groups) -> Proof:
    """-(P E^-1 J + J'E^-1 P) - 2 rate P > 0 (P = E for method energy), in balls, at every combination."""
    names = problem.network.system.lumps
    words = f"method {problem.method}: V decays at {decimal(rate)} 1/s"
    touched = {lump for group in groups for item in group for place in item.entries for lump in place}
    ports = sorted(set(problem.network.free) if problem.matrix else touched)
    most = int(_MOST_WORK / max(len(ports), 1) ** 3)
    total = product_up_to(map(len, groups), most)
    if total > most or sum(map(len, groups)) * len(ports) ** 2 > _MOST_ENTRIES:
        return Proof(False, f"{words} is not proven: {len(groups)} groups of slopes at {len(ports)} lumps have too "
                            "many combinations to check one by one")
    P = _own(problem)
    rows: Rows = [{} for _ in names]
    _add_form(rows, problem, P, base)
    for i, row in P.items():
        for j, value in row.items():
            rows[i][j] = rows[i].get(j, arb(0)) - 2 * arb(rate) * value
    forms = [[(_form(problem, P, item.entries), item.where) for item in group] for group in groups]
    held = set(problem.network.holder)
    failed = eliminate(rows, set(ports) | held)
    if failed is not None:
        return Proof(False, f"{words} fails or cannot be proven even without the modules, at lump "
                            f"{name_of(names[failed])}")
    rest = _block(rows, ports)
    blocks = [[(_block(form, ports), where) for form, where in group] for group in forms]
    for chosen in product(*blocks):
        matrix = [[sum(entries, arb(0)) for entries in zip(*lines, strict=True)]
                  for lines in zip(rest, *(block for block, _ in chosen), strict=True)]
        if not is_positive(matrix):
            return Proof(False, f"{words} fails or cannot be proven at {'; '.join(where for _, where in chosen)}")
    return Proof(True, f"{words} at all {total} combinations of module and link slopes")


def _own(problem: Regulated) -> dict[int, dict[int, arb]]:
    """Return the rows of P: E for method energy."""
    free, capacity = problem.network.free, problem.network.system.capacity
    if not problem.matrix:
        return {i: {i: arb(capacity[i])} for i in free}
    return {i: {j: arb(value) for j, value in zip(free, row, strict=True)}
            for i, row in zip(free, problem.matrix, strict=True)}


def _form(problem: Regulated, P: Mapping[int, Mapping[int, arb]], entries: Entries) -> Sparse:
    """Return -(P E^-1 J + J'E^-1 P) of some entries of J."""
    rows: Sparse = defaultdict(dict)
    _add_form(rows, problem, P, entries)
    return rows


def _add_form(rows: Rows | Sparse, problem: Regulated, P: Mapping[int, Mapping[int, arb]], entries: Entries) -> None:
    """Add -(P E^-1 J + J'E^-1 P) of some entries of J to sparse rows."""
    capacity = problem.network.system.capacity
    for (j, k), value in entries.items():
        for i, factor in P[j].items():  # P is symmetric
            share = factor * arb(value / capacity[j])
            rows[i][k] = rows[i].get(k, arb(0)) - share
            rows[k][i] = rows[k].get(i, arb(0)) - share


def _block(rows: Rows | Sparse, ports: list[int]) -> list[list[arb]]:
    return [[rows[i].get(j, arb(0)) for j in ports] for i in ports]


def _held_network(system: ThermalSystem, region: Mapping[str, Any]) -> RegulatedNetwork:
    where = "region.setpoint"
    setpoint = mapping(get(region, "setpoint", "region"), where)
    modules = {module.name: k for k, module in enumerate(system.modules)}
    holder: dict[int, int] = {}
    for name in setpoint:
        if name not in modules:
            raise InputError(f"{name_of(name)} is not a module", where=where)
        lump = system.modules[modules[name]].cold
        if lump in holder:
            raise InputError(f"two modules hold lump {name_of(system.lumps[lump])}: their currents are not determined",
                             where=where, expected="one module per cold lump")
        holder[lump] = modules[name]
    if not holder:
        raise InputError("no module holds its cold lump", where=where, expected="at least one")
    for k in holder.values():
        if system.modules[k].hot in holder:
            raise InputError(f"the hot lump of {name_of(system.modules[k].name)} is held by another module",
                             where=where, expected="modules whose hot lumps are free (no cascades)")
    known = {**region, "temperature": _temperatures(system, region, holder)}
    return RegulatedNetwork(system, read_region(known, system), holder)


def _temperatures(system: ThermalSystem, region: Mapping[str, Any], holder: Mapping[int, int]) -> dict[str, Any]:
    """Return the range of every lump, the set-point's for those held."""
    held = {system.lumps[lump]: region["setpoint"][system.modules[k].name] for lump, k in holder.items()}
    given: Any = get(region, "temperature", "region")
    if not isinstance(given, Mapping):
        kelvin_interval(given, "region.temperature")
        return {name: held.get(name, given) for name in system.lumps}
    for name in held:
        if name in given:
            raise InputError(f"lump {name_of(name)} is held: its range is the set-point's", where="region.temperature")
    return {**given, **held}


def _say_temperatures(network: RegulatedNetwork) -> str:
    names, boxes, free = network.system.lumps, network.region.temperature, network.free
    if all(boxes[k] == boxes[free[0]] for k in free):
        return f"other lump temperatures in {say_interval(boxes[free[0]])} K"
    return "lump temperatures " + ", ".join(f"{name_of(names[k])} in {say_interval(boxes[k])} K" for k in free)


REGULATED = Kind("regulated", read, claim, prove, find_margin)
