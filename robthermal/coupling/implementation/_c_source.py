"""C99 source of the coupling: sections, one step of the recursion in double, and a test vector."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from ...export import Program, identifier, number, rows
from ._recursion import Recursion

if TYPE_CHECKING:
    from ..evaluation import Filters

_TEST_SAMPLES = 64
_ON_UNTIL = 48  # the last samples of the test vector are with the coupling switched off

_ABOUT = """\
Coupling filters between two control loops (Evers 2021, chapter 6).

Sample time {dt:.17g} s. Verdict: {verdict}. Negative feedback, e = r - y. In every sample, with the errors e[2]:

    {p}_step(&state, e, on, plus, add);
    u1 = output of C1 for the input plus[0], + add[0];
    u2 = output of C2 for the input plus[1], + add[1];

state starts with zeros: {p}_state state = {{0}};
on = 0 cuts the inputs of the filters. They ring out, and C1, C2 see nothing of the switching. Keep calling the step.

Sections in series, rows b0 b1 b2 a1 a2, transposed direct form II. X_hat drives Z1 (X = Z1 X_hat) and
Q1 (X/P1 = Q1 X_hat); Y_hat drives Z2 and Q2."""

_BODY = """\
{tables}
typedef struct {{
{states}
}} {p}_state;

/* Output for the input x, the states left alone. */
static inline double {p}_look(int n, const double c[][5], double z[][2], double x)
{{
    for (int k = 0; k < n; k++)
        x = c[k][0] * x + z[k][0];
    return x;
}}

/* Output for the input x, and on to the next sample. */
static inline double {p}_run(int n, const double c[][5], double z[][2], double x)
{{
    for (int k = 0; k < n; k++) {{
        double y = c[k][0] * x + z[k][0];
        z[k][0] = c[k][1] * x - c[k][3] * y + z[k][1];
        z[k][1] = c[k][2] * x - c[k][4] * y;
        x = y;
    }}
    return x;
}}

static inline void {p}_step({p}_state *s, const double e[2], int on, double plus[2], double add[2])
{{
    double dx = on ? {dx} : 0.0, dy = on ? {dy} : 0.0; /* X, Y of the same sample */
    double f1 = e[0] + {p}_look({nZ1}, {p}_Z1, s->Z1, {p}_look({nX}, {p}_X_hat, s->X_hat, 0.0));
    double f2 = e[1] + {p}_look({nZ2}, {p}_Z2, s->Z2, {p}_look({nY}, {p}_Y_hat, s->Y_hat, 0.0));
    plus[0] = (f1 + dx * f2) / (1.0 - dx * dy);
    plus[1] = (f2 + dy * f1) / (1.0 - dx * dy);
    double x = {p}_run({nX}, {p}_X_hat, s->X_hat, on ? plus[1] : 0.0);
    double y = {p}_run({nY}, {p}_Y_hat, s->Y_hat, on ? plus[0] : 0.0);
    {p}_run({nZ1}, {p}_Z1, s->Z1, x);
    {p}_run({nZ2}, {p}_Z2, s->Z2, y);
    add[0] = {p}_run({nQ1}, {p}_Q1, s->Q1, x);
    add[1] = {p}_run({nQ2}, {p}_Q2, s->Q2, y);
}}
"""


def program(filters: Filters, name: str = "coupling") -> Program:
    """C99 source that stands for itself; the test has inputs e1 e2 on and outputs plus[0] plus[1] add[0] add[1].

    Parameters
    ----------
    filters : Filters
        Discrete time, short enough for sections.
    name : str
        Prefix of every identifier; characters that C does not allow become underscores.
    """
    p, recursion = identifier(name, "coupling"), Recursion(filters)
    chains = recursion.chains
    sizes = {key: len(chain.rows) for key, chain in chains.items()}
    tables = "".join(f"static const double {p}_{key}[{sizes[key]}][5] = {{\n{rows(chain.rows)}\n}};\n"
                     for key, chain in chains.items())
    states = "\n".join(f"    double {key}[{size}][2];" for key, size in sizes.items())
    body = _BODY.format(p=p, tables=tables, states=states, dx=number(recursion.direct[0]),
                        dy=number(recursion.direct[1]), nX=sizes["X_hat"],
                        nY=sizes["Y_hat"], nZ1=sizes["Z1"], nZ2=sizes["Z2"], nQ1=sizes["Q1"], nQ2=sizes["Q2"])
    return Program(p, "COUPLING_TEST", _ABOUT.format(p=p, dt=filters.problem.dt, verdict=filters.verdict), body,
                   list(_test_vector(recursion)), 3, f"    {p}_state state = {{0}};",
                   f"        {p}_step(&state, in, in[2] != 0.0, out, out + 2);")


def _test_vector(recursion: Recursion) -> Iterable[list[float]]:
    noise = np.random.default_rng(0).standard_normal((_TEST_SAMPLES, 2)).tolist()
    for t, (e1, e2) in enumerate(noise):
        on = t < _ON_UNTIL
        yield [e1, e2, float(on), *recursion.step(e1, e2, on)]
