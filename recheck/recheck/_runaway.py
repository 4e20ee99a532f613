"""Kind "runaway": the current at which the load of one module with a cold face at its set-point stops growing.

Hot side with conductance g to a sink at w, cold face at x, constant S, R, K: q = N/(g + K - S I), and the sign of dq/dI
is that of a cubic. All are polynomials in the constants and the current.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ._document import get, interval, only, positive, text
from ._exact import ZERO, Interval, Malformed, short
from ._polynomial import Polynomial, positive_on, variables
from ._result import Answer, not_covered, not_valid, valid
from ._thermal import read_parameters

CONSTANTS = ("seebeck", "resistance", "conductance", "sink_conductance", "sink_temperature", "setpoint")


@dataclass(frozen=True)
class Problem:
    """What one runaway certificate claims."""

    name: str
    constants: dict[str, Fraction]
    parameters: dict[str, Interval]
    current: Interval
    load: Interval


def read(parts: Mapping[str, Mapping[str, Any]]) -> Problem:
    """Return the problem of the sections of a certificate."""
    system, evidence = parts["system"], parts["evidence"]
    only(parts["margin"], [], "margin")
    constants = {key: positive(get(system, key, "system"), f"system.{key}") for key in CONSTANTS}
    parameters = read_parameters(parts["region"])
    only(parameters, CONSTANTS, "region.parameters")
    for key, (low, high) in parameters.items():
        if low <= 0 or not low <= constants[key] <= high:
            raise Malformed(f"region.parameters[{short(key)}]: may be zero or less, or excludes the system's number")
    name = text(system["name"], "system.name") if "name" in system else ""
    return Problem(name, constants, parameters, interval(get(evidence, "current", "evidence"), "evidence.current"),
                   interval(get(evidence, "load", "evidence"), "evidence.load"))


def check(problem: Problem) -> Answer:
    """Decide the signs that put the first zero of dq/dI into the current interval, and q there into the load's."""
    (low, high), (least, most) = problem.current, problem.load
    if low < 0:
        return not_valid("the current interval starts below 0")
    cubic, numerator, denominator = _polynomials()
    zero = Polynomial({})
    steps = [("g + K - S I > 0 at the upper current", denominator, (high, high), True),
             ("dq/dI > 0 up to the lower current", cubic, (ZERO, low), True),
             ("dq/dI < 0 at the upper current", zero - cubic, (high, high), True),
             ("the load at the lower current", numerator - denominator * least, (low, low), False),
             ("the load between the currents", denominator * most - numerator, (low, high), True)]
    ranges = [problem.parameters.get(key, (value, value)) for key, value in problem.constants.items()]
    undecided = ""
    for words, polynomial, current, strict in steps:
        found = positive_on(polynomial, [*ranges, current], strict)
        if found is False:
            return not_valid(f"{words}: violated")
        undecided = undecided or ("" if found else words)
    return not_covered(f"{undecided}: not decided") if undecided else valid("all signs of the fold are decided")


def _polynomials() -> tuple[Polynomial, Polynomial, Polynomial]:
    """Return 2 (g + K - S I)² dq/dI, and numerator and denominator of q(I)."""
    S, R, K, g, w, x, I = variables(7)  # noqa: E741 - the current
    half, two = Fraction(1, 2), 2
    cubic = (g * S * ((g + two * K) * x - K * w) * two
             - two * (K + g) * (two * K * R + g * R + two * S * S * x) * I
             + S * (5 * K * R + 4 * g * R + two * S * S * x) * I * I - two * R * S * S * I * I * I)
    numerator = (g * K * (x - w) + g * S * x * I - (half * g * R + K * R + S * S * x) * I * I
                 + half * S * R * I * I * I)
    return cubic, numerator, g + K - S * I
