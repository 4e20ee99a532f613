"""Kind "runaway": the current and load beyond which one module with constant S, R, K has no equilibrium to return to.

Hot side with conductance g to a sink at w, cold face held at x_c. The load is q(I) = N(I)/(g + K - S I), and q'(I)
has the sign of a cubic (errata of Evers (2021), "Thermal runaway"). Everything is a polynomial with rational
coefficients: signs are decided exactly by Bernstein coefficients (proof note, 6).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flint import fmpq

from ._fields import Interval, get, interval, mapping, no_other, positive, text
from ._kind import Kind, Proof
from ._numbers import as_float, name_of, show
from ._system import say_interval

_DEEPEST = 200
Polynomial = list[fmpq]  # coefficients, constant first


@dataclass(frozen=True)
class Runaway:
    """The exact problem of one runaway certificate."""

    name: str
    S: fmpq
    R: fmpq
    K: fmpq
    g: fmpq
    w: fmpq
    cold: fmpq
    current: Interval
    load: Interval


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Runaway:
    """Return the exact problem, or raise InputError."""
    table, found = mapping(system, "system"), mapping(evidence, "evidence")
    mapping(region, "region")
    no_other(mapping(margin, "margin"), [], "margin")
    S, R, K, g, w, cold = (positive(get(table, key, "system"), f"system.{key}") for key in (
        "seebeck", "resistance", "conductance", "sink_conductance", "sink_temperature", "setpoint"))
    name = text(table["name"], "system.name") if "name" in table else ""
    return Runaway(name, S, R, K, g, w, cold, interval(get(found, "current", "evidence"), "evidence.current"),
                   interval(get(found, "load", "evidence"), "evidence.load"))


def claim(problem: Runaway) -> str:
    """Return the one sentence the data give."""
    title = f" {name_of(problem.name)}" if problem.name else ""
    return (f"The module{title} (S = {show(problem.S)} V/K, R = {show(problem.R)} Ohm, K = {show(problem.K)} W/K), hot "
            f"side at {show(problem.g)} W/K to a sink of {show(problem.w)} K, cold face at {show(problem.cold)} K, "
            f"carries more load with more current up to a current in {say_interval(problem.current)} A, where the load "
            f"is in {say_interval(problem.load)} W and stops growing.")


def prove(problem: Runaway) -> Proof:
    """Prove sign pattern of the cubic and enclosure of the load at its smallest positive root."""
    low, high = problem.current
    cubic = slope_cubic(problem)
    if low < 0:
        return Proof(False, f"the current interval starts at {show(low)} A, below 0")
    if problem.g + problem.K - problem.S * high <= 0:
        return Proof(False, f"g + K - S I is not positive up to {show(high)} A: no equilibrium of the hot side there")
    if not _positive_on(cubic, fmpq(0), low):
        return Proof(False, f"dq/dI > 0 fails or cannot be proven on [0, {show(low)}] A: the fold lies lower")
    if not _value(cubic, high) < 0:
        return Proof(False, f"dq/dI is not negative at {show(high)} A: the fold lies higher")
    least = _load(problem, low)  # q grows from low to the root
    if not problem.load[0] <= least:
        return Proof(False, f"the load at {show(low)} A is {show(least)} W, below {show(problem.load[0])} W")
    if not _positive_on(_load_gap(problem, problem.load[1]), low, high):
        return Proof(False, f"q(I) < {show(problem.load[1])} W fails or cannot be proven over "
                            f"{say_interval(problem.current)} A")
    margins = {"current_width": as_float(high - low), "load_width": as_float(problem.load[1] - least)}
    return Proof(True, "dq/dI > 0 below the interval and < 0 at its end, exactly", margins)


def find_margin(problem: Runaway) -> dict[str, float]:
    """Return no margin: the intervals are the claim."""
    return {}


def slope_cubic(problem: Runaway) -> Polynomial:
    """Return the cubic with the sign of dq/dI (errata; equal to 2 (g + K - S I)² dq/dI)."""
    S, R, K, g, w, cold = problem.S, problem.R, problem.K, problem.g, problem.w, problem.cold
    return [2 * g * S * ((g + 2 * K) * cold - K * w), -2 * (K + g) * (2 * K * R + g * R + 2 * S * S * cold),
            S * (5 * K * R + 4 * g * R + 2 * S * S * cold), -2 * R * S * S]


def _numerator(problem: Runaway) -> Polynomial:
    S, R, K, g, w, cold = problem.S, problem.R, problem.K, problem.g, problem.w, problem.cold
    return [g * K * (cold - w), g * S * cold, -(g * R / 2 + K * R + S * S * cold), S * R / 2]


def _load(problem: Runaway, current: fmpq) -> fmpq:
    return _value(_numerator(problem), current) / (problem.g + problem.K - problem.S * current)


def _load_gap(problem: Runaway, load: fmpq) -> Polynomial:
    """Return load (g + K - S I) - N(I): positive where q(I) is below the load, as long as g + K - S I > 0."""
    a, b, c, d = _numerator(problem)
    return [load * (problem.g + problem.K) - a, -load * problem.S - b, -c, -d]


def _value(polynomial: Polynomial, x: fmpq) -> fmpq:
    total = fmpq(0)
    for coefficient in reversed(polynomial):
        total = total * x + coefficient
    return total


def _positive_on(polynomial: Polynomial, low: fmpq, high: fmpq) -> bool:
    """Prove a cubic positive on an interval: its Bernstein coefficients are, on a fine enough subdivision."""
    stack = [(low, high, 0)]
    while stack:
        a, b, depth = stack.pop()
        if min(_bernstein(polynomial, a, b)) > 0:
            continue
        middle = (a + b) / 2
        if depth == _DEEPEST or min(_value(polynomial, x) for x in (a, middle, b)) <= 0:
            return False
        stack += [(a, middle, depth + 1), (middle, b, depth + 1)]
    return True


def _bernstein(polynomial: Polynomial, low: fmpq, high: fmpq) -> list[fmpq]:
    """Return the Bernstein coefficients of a cubic on an interval: the cubic lies between the least and largest."""
    a, b, c, d = polynomial
    h = high - low
    p0 = _value(polynomial, low)
    p1 = (b + 2 * c * low + 3 * d * low * low) * h
    p2 = (c + 3 * d * low) * h * h
    p3 = d * h * h * h
    return [p0, p0 + p1 / 3, p0 + 2 * p1 / 3 + p2 / 3, p0 + p1 + p2 + p3]


RUNAWAY = Kind("runaway", read, claim, prove, find_margin)
