"""Kind "runaway": the current and load beyond which one module with constant S, R, K has no equilibrium to return to.

Hot side with conductance g to a sink at w, cold face held at x_c. The load is q(I) = N(I)/(g + K - S I), and q'(I)
has the sign of a cubic (errata of Evers (2021), "Thermal runaway"). Everything is a polynomial with rational
coefficients in the current and the constants: signs are decided exactly by Bernstein coefficients (proof note, 6).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flint import Ordering, fmpq, fmpq_mpoly_ctx

from robthermal.errors import InputError

from ._box_sign import Terms, positive_on
from ._fields import Interval, get, interval, mapping, no_other, positive, text
from ._kind import Kind, Proof
from ._numbers import decimal, name_of, round_up, show
from ._system import say_interval
from ._uncertain import Parameters, must_contain, read_parameters, say_parameters

_CONSTANTS = {"seebeck": "S", "resistance": "R", "conductance": "K", "sink_conductance": "g", "sink_temperature": "w",
              "setpoint": "x_c"}
Polynomial = Any  # in (S, R, K, g, w, x_c, I), flint's


@dataclass(frozen=True)
class Runaway:
    """The exact problem of one runaway certificate: ranges of its constants, and where the fold is claimed to be."""

    name: str
    ranges: tuple[Interval, ...]
    parameters: Parameters
    current: Interval
    load: Interval


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Runaway:
    """Return the exact problem, or raise InputError."""
    table, found = mapping(system, "system"), mapping(evidence, "evidence")
    no_other(mapping(margin, "margin"), [], "margin")
    constants = {key: positive(get(table, key, "system"), f"system.{key}") for key in _CONSTANTS}
    parameters = read_parameters(mapping(region, "region"))
    given = dict(parameters)
    no_other(given, list(_CONSTANTS), "region.parameters")
    for key, (low, high) in parameters:
        where = f"region.parameters[{name_of(key)}]"
        if low <= 0:
            raise InputError(f"{key} may be {show(low)}", where=where, expected="numbers above zero")
        must_contain((low, high), constants[key], where)
    ranges = tuple(given.get(key, (value, value)) for key, value in constants.items())
    name = text(table["name"], "system.name") if "name" in table else ""
    return Runaway(name, ranges, parameters,
                   interval(get(found, "current", "evidence"), "evidence.current"),
                   interval(get(found, "load", "evidence"), "evidence.load"))


def claim(problem: Runaway, machine: str) -> str:
    """Return the one sentence the data give."""
    title = f" {name_of(problem.name)}" if problem.name else ""
    S, R, K, g, w, cold = (f"= {decimal(low)}" if low == high else f"in {say_interval((low, high))}"
                           for low, high in problem.ranges)
    return (f"The single module{title} (machine {machine}), steady states of the continuous plant, "
            f"{say_parameters(problem.parameters)}, with constant S {S} V/K, R {R} Ohm, K {K} W/K, the hot "
            f"side at g {g} W/K to a sink of w {w} K, the cold face at x_c {cold} K, carries more load with more "
            f"current up to a current in {say_interval(problem.current)} A, where the load is in "
            f"{say_interval(problem.load)} W and stops growing.")


def prove(problem: Runaway) -> Proof:
    """Prove sign pattern of the cubic and enclosure of the load at its smallest positive root, for all constants."""
    low, high = problem.current
    cubic, numerator, denominator = _polynomials()
    if low < 0:
        return Proof(False, f"the current interval starts at {show(low)} A, below 0")
    if not _holds(problem, denominator, (high, high)):
        return Proof(False, f"g + K - S I is not positive up to {show(high)} A: no equilibrium of the hot side there")
    if not _holds(problem, cubic, (fmpq(0), low)):
        return Proof(False, f"dq/dI > 0 fails or cannot be proven on [0, {show(low)}] A: the fold lies lower")
    if not _holds(problem, -cubic, (high, high)):
        return Proof(False, f"dq/dI is not negative at {show(high)} A: the fold lies higher")
    least, most = problem.load  # q grows from low to the root
    if not _holds(problem, numerator - least * denominator, (low, low), strict=False):
        return Proof(False, f"the load at {show(low)} A is below {show(least)} W, or not proven to be above")
    if not _holds(problem, most * denominator - numerator, (low, high)):
        return Proof(False, f"q(I) < {show(most)} W fails or cannot be proven over {say_interval(problem.current)} A")
    margins = {"current_width": round_up(high - low), "load_width": round_up(most - least)}
    return Proof(True, "dq/dI > 0 below the interval and < 0 at its end, exactly", margins)


def find_margin(problem: Runaway) -> dict[str, float]:
    """Return no margin: the intervals are the claim."""
    return {}


def _polynomials() -> tuple[Polynomial, Polynomial, Polynomial]:
    """Return the cubic with the sign of dq/dI (errata; 2 (g + K - S I)² dq/dI), and numerator, denominator of q(I)."""
    S, R, K, g, w, x, I = fmpq_mpoly_ctx.get([*_CONSTANTS.values(), "I"], Ordering.lex).gens()  # noqa: E741 - current
    half = fmpq(1, 2)
    cubic = (2 * g * S * ((g + 2 * K) * x - K * w) - 2 * (K + g) * (2 * K * R + g * R + 2 * S * S * x) * I
             + S * (5 * K * R + 4 * g * R + 2 * S * S * x) * I**2 - 2 * R * S * S * I**3)
    numerator = (g * K * (x - w) + g * S * x * I - (half * g * R + K * R + S * S * x) * I**2 + half * S * R * I**3)
    return cubic, numerator, g + K - S * I


def _holds(problem: Runaway, polynomial: Polynomial, current: Interval, *, strict: bool = True) -> bool:
    """Prove a polynomial positive for all constants of their ranges and all currents of an interval."""
    terms: Terms = polynomial.to_dict()
    return positive_on(terms, [*problem.ranges, current], strict=strict)


RUNAWAY = Kind("runaway", read, claim, prove, find_margin)
