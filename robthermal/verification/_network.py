"""Kind "network": a large cooperative network E x' = A x decays in a weighted largest or summed temperature.

Rows (or columns) are bounded by floating-point sums with a rigorous error bound, all at once; the few that this cannot
decide are decided in exact rational arithmetic (proof note, 7).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import fmpq

from robthermal.errors import InputError

from ._fields import get, mapping, margin_of, not_negative, text
from ._kind import Kind, Proof
from ._norm import say_rate
from ._numbers import as_float, decimal, exact, name_of, round_down, show
from ._sparse import UNIT, Floats, Indices, Numbers, moderate, one_per_lump, read_sparse


@dataclass(frozen=True)
class Network:
    """The problem of one network certificate."""

    capacity: Numbers
    rows: Indices
    cols: Indices
    values: Numbers
    method: str
    rate: fmpq
    weights: Numbers
    margin: fmpq
    uncertainty: fmpq


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Network:
    """Return the problem, or raise InputError."""
    table, found = mapping(system, "system"), mapping(evidence, "evidence")
    uncertainty = not_negative(mapping(region, "region").get("uncertainty", 0), "region.uncertainty")
    matrix = read_sparse(table)
    method = text(found.get("method", "max"), "evidence.method")
    if method not in ("max", "sum"):
        raise InputError(f"method {name_of(method)}", where="evidence.method", expected="'max' or 'sum'")
    if uncertainty >= 1 or (uncertainty > 0 and method != "max"):
        raise InputError(f"uncertainty {show(uncertainty)} with method {method}", where="region.uncertainty",
                         expected="below 1, with method 'max'")
    weights = one_per_lump(get(found, "weights", "evidence"), len(matrix.capacity.nearest), "evidence.weights")
    rate = not_negative(get(found, "rate", "evidence"), "evidence.rate")
    return Network(matrix.capacity, matrix.rows, matrix.cols, matrix.values, method, rate, weights,
                   margin_of(margin, "rate"), uncertainty)


def claim(problem: Network, machine: str) -> str:
    """Return the one sentence the data give."""
    norm = "largest" if problem.method == "max" else "summed"
    spread = (f"for all conductances within {decimal(100 * problem.uncertainty)} % of the given ones, those between "
              "two lumps and the row sums each on their own" if problem.uncertainty > 0 else "nominal parameters")
    return (f"The thermal network of {len(problem.capacity.nearest)} lumps and {len(problem.rows)} entries (machine "
            f"{machine}), continuous plant, {spread}, is stable: the weighted "
            f"{norm} absolute temperature difference (method {problem.method}) between any two of its "
            f"trajectories under the same inputs {say_rate(problem.rate)}.")


def prove(problem: Network) -> Proof:
    """Prove the inequality of every row (max) or column (sum), with the stored margin added to the rate."""
    off = problem.rows != problem.cols
    negative = np.flatnonzero(off & (problem.values.nearest < 0))
    if len(negative):
        k = int(negative[0])
        return Proof(False, f"not Metzler: A[{problem.rows[k]}, {problem.cols[k]}] = {problem.values.nearest[k]!r}")
    low = np.flatnonzero(~(problem.weights.nearest > 0))
    if len(low):
        return Proof(False, f"weight of lump {low[0]} is {float(problem.weights.nearest[low[0]])!r}, not positive")
    extra = max(problem.margin, fmpq(0))
    failed = _first_failure(problem, problem.rate + extra)
    if failed is None:
        return Proof(True, f"every weighted {_line(problem)} is bounded", {"rate": round_down(extra)})
    lump, value = failed
    if extra > 0 and _first_failure(problem, problem.rate) is None:
        return Proof(False, f"stored margin {show(extra)} 1/s is larger than the recomputed one: {_line(problem)} "
                            f"{lump} decays at {show(-value)} 1/s, rate {show(problem.rate)} 1/s")
    return Proof(False, f"weighted {_line(problem)} {lump} is {show(value)} 1/s, not "
                        f"{'<=' if problem.rate + extra > 0 else '<'} -{show(problem.rate + extra)} 1/s")


def find_margin(problem: Network) -> dict[str, float]:
    """Return a margin that is proven for every line, rounded to the safe side [1/s]."""
    sums, bounds, scale = _sums(problem, 0.0)
    with np.errstate(all="ignore"):
        least = float(np.min(-(sums + bounds) / scale)) - as_float(problem.rate)
    extra = float(f"{least * 0.999:.4g}") if math.isfinite(least) and least > 0 else 0.0
    proven = extra > 0 and _first_failure(problem, problem.rate + exact(extra, "margin")) is None
    return {"rate": extra if proven else 0.0}


def _line(problem: Network) -> str:
    return "row" if problem.method == "max" else "column"


def _first_failure(problem: Network, rate: fmpq) -> tuple[int, fmpq] | None:
    """Return the first line that does not satisfy its inequality and its exact value over w E [1/s], or None."""
    sums, bounds, _ = _sums(problem, as_float(rate))
    with np.errstate(all="ignore"):
        open_lines = np.flatnonzero(~(sums + bounds < 0))  # also where anything is not finite
    if not len(open_lines):
        return None
    lines, _ = _lines(problem)
    order = np.argsort(lines, kind="stable")
    starts = np.searchsorted(lines[order], open_lines, side="left")
    stops = np.searchsorted(lines[order], open_lines, side="right")
    for lump, start, stop in zip(open_lines.tolist(), starts.tolist(), stops.tolist(), strict=True):
        value = _exact_line(problem, lump, order[start:stop])
        if value > -rate or (value == 0 and rate == 0):
            return lump, value
    return None


def _lines(problem: Network) -> tuple[Indices, Indices]:
    """Return the line of every entry and the lump whose weight multiplies it."""
    return (problem.rows, problem.cols) if problem.method == "max" else (problem.cols, problem.rows)


def _sums(problem: Network, rate: float) -> tuple[Floats, Floats, Floats]:
    """Return sum_j A_ij w_j + rate E_i w_i in floats, a bound of its error, and E_i w_i.

    Each of k + 1 terms is a product of at most three doubles that differ from the exact numbers by one rounding each:
    at most five roundings, and k more for the sum in any order, so the error is below gamma_(k+5) times the sum T of
    absolute values (Higham, Accuracy and Stability, lemma 3.1 and section 4.2). (k + 16) 2^-52 times the computed T is
    larger than that, T's own rounding included. Where a number is so small or large that a product could underflow or
    overflow the bound is infinite, and the line is decided exactly.
    """
    lines, others = _lines(problem)
    n = len(problem.capacity.nearest)
    uncertainty = _above(problem.uncertainty)
    with np.errstate(all="ignore"):
        terms = problem.values.nearest * problem.weights.nearest[others]
        scale = problem.capacity.nearest * problem.weights.nearest
        decay = rate * scale
        sums = np.bincount(lines, terms, n) + decay
        total = np.bincount(lines, np.abs(terms), n) + decay
        if uncertainty > 0:
            spread, size = _spread(problem)
            sums, total = sums + uncertainty * spread, total + uncertainty * size
        bounds = total * (np.bincount(lines, minlength=n) + 16.0) * UNIT
    extreme = ~moderate(problem.weights.nearest) | ~moderate(problem.capacity.nearest)
    odd = (~moderate(problem.values.nearest) & (problem.values.nearest != 0)) | extreme[others]
    extreme[lines[odd]] = True
    if rate != 0 and not bool(moderate(np.float64(rate))):
        extreme[:] = True
    bounds[extreme] = math.inf
    return sums, bounds, scale


def _spread(problem: Network) -> tuple[Floats, Floats]:
    """Return sum_j A_ij |w_j - w_i| + |sum_j A_ij| w_i in floats, and the same sums of absolute values.

    What a row gains per unit of uncertainty. A difference errs by three roundings of its parts at most, so the bound of
    ``_sums`` covers these terms too: k more sums of terms with at most six roundings, relative to the larger ``size``.
    """
    n = len(problem.capacity.nearest)
    here, there = problem.weights.nearest[problem.rows], problem.weights.nearest[problem.cols]
    off = np.where(problem.rows == problem.cols, 0.0, problem.values.nearest)
    sums = np.bincount(problem.rows, problem.values.nearest, n)
    sizes = np.bincount(problem.rows, np.abs(problem.values.nearest), n)
    spread = np.bincount(problem.rows, off * np.abs(there - here), n) + np.abs(sums) * problem.weights.nearest
    return spread, np.bincount(problem.rows, off * (there + here), n) + sizes * problem.weights.nearest


def _above(value: fmpq) -> float:
    """Return a double that is not below a number."""
    return -round_down(-value)


def _exact_line(problem: Network, lump: int, entries: Indices) -> fmpq:
    """Return (sum_j A_ij w_j)/(E_i w_i) exactly [1/s]."""
    _, others = _lines(problem)
    total, loss, own = fmpq(0), fmpq(0), problem.weights.at(lump)
    for k in entries.tolist():
        value, weight = problem.values.at(k), problem.weights.at(int(others[k]))
        total += value * weight
        loss += value
        if others[k] != lump:
            total += problem.uncertainty * value * abs(weight - own)
    total += problem.uncertainty * abs(loss) * own
    return total / (problem.capacity.at(lump) * problem.weights.at(lump))


NETWORK = Kind("network", read, claim, prove, find_margin)
