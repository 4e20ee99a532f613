"""Observers for other programs: C99, MATLAB and JSON."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..export import Program, comment, doubles, identifier, number, rows, write_export
from ..thermal import format_system
from ._export_heats import DRIVE, HEATS, INTEGERS, Heat, Row
from ._modules import Array
from ._observer_model import ObserverModel
from ._observer_recursion import ObserverRecursion

FORMAT = "robthermal-observer/1"
_TEST_SAMPLES = 64

_ABOUT = """\
Observer of all lumps ({method}): no allocation, no library but math.h.

Sample time {h:.17g} s. All temperatures in kelvin. Once, with a first guess of the lumps, then in every sample:

    {p}_init(&state, lumps);
    state.x is the estimate now;
    lost = {p}_step(&state, readings, inputs);  readings of this sample, inputs held until the next one

lumps: {lumps}
readings: {sensors}
inputs: {inputs} (heaters in their unit, currents [A], ambients [K])
A reading that is not finite corrects nothing; the step returns how many there were. Inputs must be finite."""

_BODY = """\
typedef struct {{
    double x[{n}];
}} {p}_state;

/* State of the next sample: A x + G (heats) + L (errors). */
static const double {p}_A[{n}][{n}] = {{
{A}
}};
static const double {p}_G[{n}][{n}] = {{
{G}
}};
static const double {p}_L[{n}][{n_y}] = {{
{L}
}};
/* Heat of the inputs and, last, constant heat. */
static const double {p}_D[{n}][{n_w}] = {{
{D}
}};
/* Every sensor: its lump, offset [K], gain. */
static const struct {{ int lump; double offset, gain; }} {p}_sensors[{n_y}] = {{
{sensor_rows}
}};
{tables}
/* All heat that the linear network does not hold [W]. N: lumps, then ambients. */
static inline void {p}_heat(const double x[{n}], const double u[{n_u}], double q[{nodes}])
{{
    double w[{n_w}], N[{nodes}];
    for (int k = 0; k < {n_u}; k++)
        w[k] = u[k];
    w[{n_u}] = 1.0;
    for (int k = 0; k < {n}; k++)
        N[k] = x[k];
    for (int k = {n}; k < {nodes}; k++)
        N[k] = u[{first_ambient} + k - {n}];
{drives}    for (int i = 0; i < {nodes}; i++)
        q[i] = 0.0; /* heat into ambients is not used */
    for (int i = 0; i < {n}; i++)
        for (int k = 0; k < {n_w}; k++)
            q[i] += {p}_D[i][k] * w[k];
{heats}}}

static inline void {p}_init({p}_state *s, const double lumps[{n}])
{{
    for (int i = 0; i < {n}; i++)
        s->x[i] = lumps[i];
}}

static inline int {p}_step({p}_state *s, const double readings[{n_y}], const double inputs[{n_u}])
{{
    double q[{nodes}], e[{n_y}], next[{n}];
    int lost = 0;
    {p}_heat(s->x, inputs, q);
    for (int k = 0; k < {n_y}; k++) {{
        int off = !isfinite(readings[k]);
        lost += off;
        e[k] = off ? 0.0 : {T_ref} + (readings[k] - {p}_sensors[k].offset - {T_ref}) / {p}_sensors[k].gain
            - s->x[{p}_sensors[k].lump];
    }}
    for (int i = 0; i < {n}; i++) {{
        double total = 0.0;
        for (int k = 0; k < {n}; k++)
            total += {p}_A[i][k] * s->x[k];
        for (int k = 0; k < {n}; k++)
            total += {p}_G[i][k] * q[k];
        for (int k = 0; k < {n_y}; k++)
            total += {p}_L[i][k] * e[k];
        next[i] = total;
    }}
    for (int i = 0; i < {n}; i++)
        s->x[i] = next[i];
    return lost;
}}
"""


def export(model: ObserverModel, gain: Array, method: str, path: str | Path, name: str) -> None:
    """Write a .c, .h, .mat or .json file."""
    write_export(path, lambda: _document(model, gain, method, name), lambda: _program(model, gain, method, name))


def _document(model: ObserverModel, gain: Array, method: str, name: str) -> dict[str, Any]:
    """x⁺ = A x + G f + L (y - C x); f follows from the system, given as the text of its file."""
    return {"format": FORMAT, "name": name, "method": method, "sample_time": model.sample_time,
            "lumps": list(model.system.lump_names), "sensors": list(model.sensors),
            "inputs": list(model.system.exogenous_names), "A": model.A_d, "G": model.Gamma, "C": model.C,
            "L": gain, "system": format_system(model.system)}


def _program(model: ObserverModel, gain: Array, method: str, name: str) -> Program:
    """Inputs of the test: readings, inputs; outputs: the estimate after the step."""
    p, system, recursion = identifier(name, "observer"), model.system, ObserverRecursion.of(model, gain)
    n, n_y, n_u = len(system.lumps), len(model.sensors), len(system.exogenous_names)
    about = _ABOUT.format(
        p=p, method=method, h=model.sample_time, lumps=comment(", ".join(system.lump_names)),
        sensors=comment(", ".join(model.sensors)), inputs=comment(", ".join(system.exogenous_names)))
    # the first row of the test starts at the readings' mean
    call = (f"        if (t == 0)\n            for (int k = 0; k < {n}; k++)\n                state.x[k] = in[0];\n"
            f"        {p}_step(&state, in, in + {n_y});\n        for (int k = 0; k < {n}; k++)\n"
            f"            out[k] = state.x[k];")
    return Program(p, "OBSERVER_TEST", about, _body(p, model, recursion), list(_test_vector(model, recursion)),
                   n_y + n_u, f"    {p}_state state = {{{{0}}}};", call,
                   [*model.sensors, *system.exogenous_names, *system.lump_names])


def _body(p: str, model: ObserverModel, recursion: ObserverRecursion) -> str:
    system = model.system
    n, n_u = len(system.lumps), len(system.exogenous_names)
    kinds = [(HEATS[kind], kind.removesuffix("Term").lower(), table) for kind, table in recursion.heats.items()]
    shaped = [(DRIVE, "drive", recursion.drives)] if recursion.drives else []
    return _BODY.format(
        p=p, n=n, n_y=len(model.sensors), n_u=n_u, n_w=n_u + 1,
        nodes=n + recursion.n_ambients, first_ambient=n_u - recursion.n_ambients, T_ref=number(recursion.T_ref),
        A=rows(recursion.A_d), G=rows(recursion.Gamma), L=rows(recursion.L), D=rows(recursion.D),
        sensor_rows=",\n".join(f"    {{{int(lump)}, {number(offset)}, {number(gain)}}}"
                               for lump, offset, gain in recursion.sensors),
        tables="".join(_table(p, *kind) for kind in [*shaped, *kinds]),
        drives="".join(_loop(p, *kind) for kind in shaped), heats="".join(_loop(p, *kind) for kind in kinds))


def _table(p: str, heat: Heat, kind: str, table: list[Row]) -> str:
    numbers = [column for column in heat.columns if column in INTEGERS]
    values = [column for column in heat.columns if column not in INTEGERS]
    lines = [f"    {{{', '.join(str(int(v)) for v in row[:len(numbers)])}, {doubles(row[len(numbers):])[1:]}"
             for row in table]
    return (f"struct {p}_{kind} {{\n    int {', '.join(numbers)};\n    double {', '.join(values)};\n}};\n"
            f"static const struct {p}_{kind} {p}_{kind}_rows[{len(table)}] = {{\n" + ",\n".join(lines) + "\n};\n")


def _loop(p: str, heat: Heat, kind: str, table: list[Row]) -> str:
    body = "\n".join(f"        {line}" for line in heat.c)
    return (f"    for (int k = 0; k < {len(table)}; k++) {{\n"
            f"        const struct {p}_{kind} *p = &{p}_{kind}_rows[k];\n{body}\n    }}\n")


def _test_vector(model: ObserverModel, recursion: ObserverRecursion) -> Iterator[list[float]]:
    """Inputs within their ranges, readings that follow the estimate."""
    system, rng = model.system, np.random.default_rng(0)
    ranges = [limits or (-1.0, 1.0) for limits in (*system.input_limits.values(), *system.current_limits.values())]
    x: Row = []
    for t in range(_TEST_SAMPLES):
        y = rng.uniform(295.0, 301.0, len(model.sensors)).tolist()
        x = x or [y[0]] * len(recursion.A_d)
        u = [float(rng.uniform(*pair)) * (t % 8 > 0) for pair in ranges]
        u += [float(part.temperature + rng.standard_normal()) for part in system.ambients.values()]
        x = recursion.step(x, y, u)
        yield [*y, *u, *x]
