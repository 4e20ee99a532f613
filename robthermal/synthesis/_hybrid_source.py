"""C99 source of a hybrid integrator-gain element beside a linear controller."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..export import Program, doubles, identifier, number, rows
from ..linear import Plant

_SAMPLES = 64

_ABOUT = """\
Hybrid integrator-gain element beside a linear controller, {n} states, sample time {h:.17g} s. In every sample:

    u = {p}_step(&state, error);     error: set-point - measured; u is not limited

The state starts at zero.
{outcome}"""

_BODY = """\
enum {{ {p}_n = {n} }};

typedef struct {{
    double x[{p}_n + 1], element;
}} {p}_state;

static const double {p}_state_rows[{p}_n + 1][{p}_n + 1] = {{
{state}
}};
static const double {p}_output[{p}_n + 1] = {output};

static inline double {p}_step({p}_state *s, double error)
{{
    const double gain = {gain} * error, moved = s->element + {rate} * error;
    double next[{p}_n + 1], u = {p}_output[{p}_n] * error;
    s->element = fmin(fmax(moved, fmin(0.0, gain)), fmax(0.0, gain));
    for (int i = 0; i < {p}_n; i++) {{
        u += {p}_output[i] * s->x[i];
        next[i] = {p}_state_rows[i][{p}_n] * error;
        for (int j = 0; j < {p}_n; j++)
            next[i] += {p}_state_rows[i][j] * s->x[j];
    }}
    for (int i = 0; i < {p}_n; i++)
        s->x[i] = next[i];
    return u + s->element;
}}
"""


def hybrid_program(linear: Plant, gain: float, step: float, name: str, outcome: str) -> Program:
    """C source; `step`: rate times sample time, `outcome`: lines for the comment."""
    p, n = identifier(name, "controller"), len(linear.A)
    state = np.vstack([np.hstack([linear.A, linear.B]), np.zeros((1, n + 1))])
    body = _BODY.format(p=p, n=n, state=rows(state.tolist()), gain=number(gain), rate=number(step),
                        output=doubles([*linear.C[0].tolist(), float(linear.D[0, 0])]))
    return Program(p, "CONTROLLER_TEST", _ABOUT.format(p=p, n=n, h=linear.dt, outcome=outcome), body,
                   list(_vector(linear, gain, step)), 1, f"    {p}_state state = {{{{0}}, 0.0}};",
                   f"        out[0] = {p}_step(&state, in[0]);", ["error", "control"])


def _vector(linear: Plant, gain: float, step: float) -> Iterator[list[float]]:
    """Errors and the controls that follow, summed in the order of the source."""
    rng = np.random.default_rng(0)
    n, element = len(linear.A), 0.0
    A, B, C, D = linear.A.tolist(), linear.B[:, 0].tolist(), linear.C[0].tolist(), float(linear.D[0, 0])
    x = [0.0] * n
    for _ in range(_SAMPLES):
        error = float(rng.standard_normal())
        most = gain * error
        element = min(max(element + step * error, min(0.0, most)), max(0.0, most))
        u, then = D * error, []
        for i in range(n):
            u += C[i] * x[i]
            value = B[i] * error
            for j in range(n):
                value += A[i][j] * x[j]
            then.append(value)
        x = then
        yield [error, u + element]
