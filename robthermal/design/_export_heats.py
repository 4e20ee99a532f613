"""Heats of an observer's model, each kind twice side by side: lines of C, and the same operations in Python.

N holds the nodes (lumps, then ambients), w the drives (heaters, currents, ambients), q the heat into every node. What
has a memory is taken at rest, as in `Equations.heat`: lags and delays are over, a hysteresis remembers the present
sign, periodic loads are at their mean, steps have not happened.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..thermal import Equations

Row = list[float]
INTEGERS = ("a", "b", "drive")  # numbers of nodes and drives


@dataclass(frozen=True)
class Heat:
    """One kind of heat.

    Parameters
    ----------
    columns : tuple of str
        What a row of its table holds.
    c : tuple of str
        C lines for row `p`.
    add : callable
        The same in Python: row, N, w, q.
    """

    columns: tuple[str, ...]
    c: tuple[str, ...]
    add: Callable[[Any, Row, Row, Row], None]


def named(heat: Heat, row: Row) -> SimpleNamespace:
    """Row of a table by the names of its columns.

    Parameters
    ----------
    heat : Heat
        Kind of heat, which names the columns.
    row : list of float
        Of its table.
    """
    return SimpleNamespace(**{column: int(value) if column in INTEGERS else value
                              for column, value in zip(heat.columns, row, strict=True)})


def _drive(p: Any, N: Row, w: Row, q: Row) -> None:
    linear = (1.0 + p.gain) * w[p.drive] + p.offset
    value = (1.0 + p.gain_slope * abs(linear)) * linear - p.cubic * linear * linear * linear
    w[p.drive] = p.clip if value > p.clip else -p.clip if value < -p.clip else value


def _module(p: Any, N: Row, w: Row, q: Row) -> None:
    hot, cold, current = N[p.a], N[p.b], w[p.drive]
    dT, across = 0.5 * (hot + cold) - p.T_ref, hot - cold
    pump = (p.S + p.S_slope * dT) * current
    joule = 0.5 * (p.R + p.R_slope * dT) * current * current
    along = 0.5 * p.thomson * current * across
    leak = p.K_slope * dT * across + 2.0 * p.split * joule
    q[p.a] += pump * hot + joule - along - leak
    q[p.b] += joule - pump * cold - along + leak


def _hysteresis(p: Any, N: Row, w: Row, q: Row) -> None:
    q[p.a] += p.heat if w[p.drive] > 0.0 else -p.heat if w[p.drive] < 0.0 else 0.0


def _natural(p: Any, N: Row, w: Row, q: Row) -> None:
    dT = N[p.b] - N[p.a] + (p.warmer_b - p.warmer_a)
    flow = p.gain * abs(dT) ** p.exponent * dT
    q[p.a] += flow
    q[p.b] -= flow


def _radiation(p: Any, N: Row, w: Row, q: Row) -> None:
    a, b = N[p.a] + p.warmer_a, N[p.b] + p.warmer_b
    flow = p.coefficient * (b * b * b * b - a * a * a * a)
    q[p.a] += flow
    q[p.b] -= flow


def _heater(p: Any, N: Row, w: Row, q: Row) -> None:
    power = p.gain * p.slope * (N[p.a] - p.T_ref) * w[p.drive]
    q[p.a] += (1.0 - p.share) * power
    q[p.b] += p.share * power


def _lead(p: Any, N: Row, w: Row, q: Row) -> None:
    q[p.a] += p.resistance * w[p.drive] * w[p.drive]


def _follow(p: Any, N: Row, w: Row, q: Row) -> None:
    flow = p.conductance * p.relative * abs(w[p.drive]) * (N[p.b] - N[p.a] + p.warmer)
    q[p.a] += flow
    q[p.b] -= flow


def _power(p: Any, N: Row, w: Row, q: Row) -> None:
    a, b = N[p.a] + p.warmer_a, N[p.b] + p.warmer_b
    flow = p.conductance * ((0.5 * (a + b) / p.T_ref) ** p.exponent - 1.0) * (b - a)
    q[p.a] += flow
    q[p.b] -= flow


def _condensation(p: Any, N: Row, w: Row, q: Row) -> None:
    q[p.a] += p.conductance * (p.dew_point - N[p.a]) if N[p.a] < p.dew_point else 0.0


DRIVE = Heat(("drive", "gain", "offset", "gain_slope", "cubic", "clip"), (
    "double linear = (1.0 + p->gain) * w[p->drive] + p->offset;",
    "double value = (1.0 + p->gain_slope * fabs(linear)) * linear - p->cubic * linear * linear * linear;",
    "w[p->drive] = value > p->clip ? p->clip : value < -p->clip ? -p->clip : value;"), _drive)
# by the names of the terms of `Equations.terms`
HEATS = {
    "ModuleTerm": Heat(
        ("a", "b", "drive", "S", "S_slope", "R", "R_slope", "K_slope", "T_ref", "thomson", "split"), (
            "double hot = N[p->a], cold = N[p->b], current = w[p->drive];",
            "double dT = 0.5 * (hot + cold) - p->T_ref, across = hot - cold;",
            "double pump = (p->S + p->S_slope * dT) * current;",
            "double joule = 0.5 * (p->R + p->R_slope * dT) * current * current;",
            "double along = 0.5 * p->thomson * current * across;",
            "double leak = p->K_slope * dT * across + 2.0 * p->split * joule;",
            "q[p->a] += pump * hot + joule - along - leak;",
            "q[p->b] += joule - pump * cold - along + leak;"), _module),
    "hysteresis": Heat(("a", "drive", "heat"), (
        "q[p->a] += w[p->drive] > 0.0 ? p->heat : w[p->drive] < 0.0 ? -p->heat : 0.0;",), _hysteresis),
    "NaturalTerm": Heat(("a", "b", "gain", "exponent", "warmer_a", "warmer_b"), (
        "double dT = N[p->b] - N[p->a] + (p->warmer_b - p->warmer_a);",
        "double flow = p->gain * pow(fabs(dT), p->exponent) * dT;",
        "q[p->a] += flow;", "q[p->b] -= flow;"), _natural),
    "RadiationTerm": Heat(("a", "b", "coefficient", "warmer_a", "warmer_b"), (
        "double a = N[p->a] + p->warmer_a, b = N[p->b] + p->warmer_b;",
        "double flow = p->coefficient * (b * b * b * b - a * a * a * a);",
        "q[p->a] += flow;", "q[p->b] -= flow;"), _radiation),
    "HeaterTerm": Heat(("a", "b", "drive", "gain", "slope", "share", "T_ref"), (
        "double power = p->gain * p->slope * (N[p->a] - p->T_ref) * w[p->drive];",
        "q[p->a] += (1.0 - p->share) * power;", "q[p->b] += p->share * power;"), _heater),
    "LeadTerm": Heat(("a", "drive", "resistance"), (
        "q[p->a] += p->resistance * w[p->drive] * w[p->drive];",), _lead),
    "FollowTerm": Heat(("a", "b", "drive", "conductance", "relative", "warmer"), (
        "double flow = p->conductance * p->relative * fabs(w[p->drive]) * (N[p->b] - N[p->a] + p->warmer);",
        "q[p->a] += flow;", "q[p->b] -= flow;"), _follow),
    "PowerTerm": Heat(("a", "b", "conductance", "exponent", "T_ref", "warmer_a", "warmer_b"), (
        "double a = N[p->a] + p->warmer_a, b = N[p->b] + p->warmer_b;",
        "double flow = p->conductance * (pow(0.5 * (a + b) / p->T_ref, p->exponent) - 1.0) * (b - a);",
        "q[p->a] += flow;", "q[p->b] -= flow;"), _power),
    "CondensationTerm": Heat(("a", "conductance", "dew_point"), (
        "q[p->a] += N[p->a] < p->dew_point ? p->conductance * (p->dew_point - N[p->a]) : 0.0;",), _condensation),
}


def tables(eq: Equations) -> dict[str, list[Row]]:
    """Rows of every kind of heat that is present, by the keys of `HEATS`.

    Parameters
    ----------
    eq : Equations
        Equations of the exported system.
    """
    found: dict[str, list[Row]] = {}
    for term in eq.terms:
        kind = type(term).__name__
        if kind == "StepTerm":  # has not happened
            continue
        values: dict[str, Any] = {key: getattr(term, key) for key in HEATS[kind].columns}
        columns = [np.broadcast_to(np.asarray(values[key], float), len(term.components)) for key in HEATS[kind].columns]
        found[kind] = np.column_stack(columns).tolist()
    sticky = [[float(eq.index[module.cold]), float(eq.drives.column[name]), module.hysteresis.heat]
              for name, module in eq.system.modules.items() if module.hysteresis]
    return {**found, **({"hysteresis": sticky} if sticky else {})}


def drives(eq: Equations) -> list[Row]:
    """Rows of the drives that are not exactly their column.

    Parameters
    ----------
    eq : Equations
        Equations of the exported system.
    """
    return [[float(column), d.gain, d.offset, d.gain_slope, d.cubic, np.inf if d.clip is None else d.clip]
            for column, d in eq.drives.of.items() if d.gain or d.offset or d.gain_slope or d.cubic or d.clip]
