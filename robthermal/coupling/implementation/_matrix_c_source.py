"""C99 source of a coupling of several channels: state spaces, one step in double, and a test vector."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ...export import Program, doubles, identifier

if TYPE_CHECKING:
    from ..matrix import MatrixFilters

_TEST_SAMPLES = 64
_ON_UNTIL = 48  # the last samples of the test vector are with the coupling switched off

_ABOUT = """\
Coupling filters between two control loops of several inputs and outputs (Evers 2021, chapter 6).

Sample time {dt:.17g} s. Verdict: {verdict}. Negative feedback, e = r - y. {channels} channels each; {m1} inputs of
subsystem 1, {m2} of subsystem 2. In every sample, with the errors e[{two_p}], those of subsystem 1 first:

    {p}_step(&state, e, on, plus, add);
    u1 = output of C1 for the input plus[0] ... plus[{last}], + add[0] ...
    u2 = output of C2 for the input plus[{channels}] ..., + add[{m1}] ...

state starts with zeros: {p}_state state = {{{{0}}, {{0}}}};
on = 0 cuts the inputs of the filters. They ring out, and C1, C2 see nothing of the switching. Keep calling the step.

State spaces of [X; X_input], driven by e2+, and of [Y; Y_input], driven by e1+. Matrices row by row."""

_BODY = """\
{tables}
typedef struct {{
    double x[{nx}], y[{ny}];
}} {p}_state;

/* out += M in, M of so many rows and columns. */
static inline void {p}_add(int rows, int columns, const double *M, const double *in, double *out)
{{
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < columns; j++)
            out[i] += M[i * columns + j] * in[j];
}}

/* State z of n and input in of {channels} on to the next sample. */
static inline void {p}_next(int n, const double *A, const double *B, const double *in, double *z)
{{
    double next[{most}] = {{0}};
    {p}_add(n, n, A, z, next);
    {p}_add(n, {channels}, B, in, next);
    for (int i = 0; i < n; i++)
        z[i] = next[i];
}}

static inline void {p}_step({p}_state *s, const double e[{two_p}], int on, double plus[{two_p}], double add[{m}])
{{
    double f[{two_p}], to_x[{channels}] = {{0}}, to_y[{channels}] = {{0}}; /* inputs of the filters */
    for (int i = 0; i < {two_p}; i++) {{
        f[i] = e[i];
        plus[i] = 0.0;
    }}
    {p}_add({channels}, {nx}, {p}_X_C, s->x, f);
    {p}_add({channels}, {ny}, {p}_Y_C, s->y, f + {channels});
    if (on)
        {p}_add({two_p}, {two_p}, {p}_direct, f, plus); /* X, Y of the same sample */
    else
        for (int i = 0; i < {two_p}; i++)
            plus[i] = f[i];
    for (int i = 0; on && i < {channels}; i++) {{
        to_x[i] = plus[{channels} + i];
        to_y[i] = plus[i];
    }}
    for (int i = 0; i < {m}; i++)
        add[i] = 0.0;
    {p}_add({m1}, {nx}, {p}_X_input_C, s->x, add);
    {p}_add({m1}, {channels}, {p}_X_input_D, to_x, add);
    {p}_add({m2}, {ny}, {p}_Y_input_C, s->y, add + {m1});
    {p}_add({m2}, {channels}, {p}_Y_input_D, to_y, add + {m1});
    {p}_next({nx}, {p}_X_A, {p}_X_B, to_x, s->x);
    {p}_next({ny}, {p}_Y_A, {p}_Y_B, to_y, s->y);
}}
"""


class MatrixRecursion:
    """e to e+ and to what is added to the outputs of C1, C2, operation by operation as the C source.

    Parameters
    ----------
    filters : MatrixFilters
        What is programmed, in discrete time.
    """

    def __init__(self, filters: MatrixFilters):
        if not filters.problem.dt:
            raise InputError("continuous-time filters have no C source", where="export", expected="discrete time",
                             remedy="Discretize plants and controllers first.")
        x, y = (_with_state(*pair) for pair in ((filters.X, filters.X_input), (filters.Y, filters.Y_input)))
        p = filters.X.noutputs
        direct = np.linalg.inv(np.block([[np.eye(p), -x["D"]], [-y["D"], np.eye(p)]]))
        self.channels = p
        self.tables: dict[str, Array] = {"direct": direct}
        for name, found in (("X", x), ("Y", y)):
            self.tables |= {f"{name}_{key}": found[key] for key in ("A", "B", "C", "input_C", "input_D")}
        self.states = [0.0] * len(x["A"]), [0.0] * len(y["A"])
        self._rows = {key: table.tolist() for key, table in self.tables.items()}

    def step(self, e: list[float], on: bool) -> tuple[list[float], list[float]]:
        """One sample.

        Parameters
        ----------
        e : list of float
            Errors r - y of subsystem 1, then 2.
        on : bool
            Whether the filters get an input.

        Returns
        -------
        tuple of list of float
            e+, and what is added to u1 and u2.
        """
        p, t, (x, y) = self.channels, self._rows, self.states
        f = [*_plus(e[:p], t["X_C"], x), *_plus(e[p:], t["Y_C"], y)]
        plus = _plus([0.0] * 2 * p, t["direct"], f) if on else f
        to_x, to_y = (plus[p:], plus[:p]) if on else ([0.0] * p, [0.0] * p)
        add = []
        for name, state, given in (("X", x, to_x), ("Y", y, to_y)):
            rows = t[f"{name}_input_C"]
            add += _plus(_plus([0.0] * len(rows), rows, state), t[f"{name}_input_D"], given)
            state[:] = _plus(_plus([0.0] * len(state), t[f"{name}_A"], state), t[f"{name}_B"], given)
        return plus, add


def matrix_program(filters: MatrixFilters, name: str = "coupling") -> Program:
    """C99 source that stands for itself; the test has inputs e, on and outputs plus, add.

    Parameters
    ----------
    filters : MatrixFilters
        What is programmed, in discrete time.
    name : str
        Prefix of every identifier; characters that C does not allow become underscores.
    """
    prefix, recursion = identifier(name, "coupling"), MatrixRecursion(filters)
    m1, m2, channels = filters.X_input.noutputs, filters.Y_input.noutputs, recursion.channels
    nx, ny = (len(state) for state in recursion.states)
    tables = "".join(f"static const double {prefix}_{key}[{table.size}] = {doubles(table.ravel())};\n"
                     for key, table in recursion.tables.items())
    sizes = {"p": prefix, "channels": channels, "two_p": 2 * channels, "m1": m1, "m2": m2, "m": m1 + m2}
    body = _BODY.format(tables=tables, nx=nx, ny=ny, most=max(nx, ny), **sizes)
    about = _ABOUT.format(dt=filters.problem.dt, verdict=filters.verdict, last=channels - 1, **sizes)
    return Program(prefix, "COUPLING_TEST", about, body, list(_test_vector(recursion)), 2 * channels + 1,
                   f"    {prefix}_state state = {{{{0}}, {{0}}}};",
                   f"        {prefix}_step(&state, in, in[{2 * channels}] != 0.0, out, out + {2 * channels});")


def _with_state(signal: control.StateSpace, to_input: control.StateSpace) -> dict[str, Array]:
    """Matrices of a filter and of what it adds to the plant input, which share A and B; C has no arrays of size zero,
    so that a filter without states gets one that stays zero."""
    n = max(signal.nstates, 1)
    padded = {"A": (signal.A, (n, n)), "B": (signal.B, (n, signal.ninputs)), "C": (signal.C, (signal.noutputs, n)),
              "input_C": (to_input.C, (to_input.noutputs, n))}
    found = {key: np.zeros(shape) if not signal.nstates else np.asarray(M) for key, (M, shape) in padded.items()}
    return found | {"D": np.asarray(signal.D), "input_D": np.asarray(to_input.D)}


def _plus(start: list[float], rows: list[list[float]], x: list[float]) -> list[float]:
    """start + rows x, sums from the left."""
    found = []
    for value, row in zip(start, rows, strict=True):
        for coefficient, entry in zip(row, x, strict=True):
            value += coefficient * entry
        found.append(value)
    return found


def _test_vector(recursion: MatrixRecursion) -> Iterable[list[float]]:
    noise = np.random.default_rng(0).standard_normal((_TEST_SAMPLES, 2 * recursion.channels)).tolist()
    for t, e in enumerate(noise):
        plus, add = recursion.step(e, t < _ON_UNTIL)
        yield [*e, float(t < _ON_UNTIL), *plus, *add]
