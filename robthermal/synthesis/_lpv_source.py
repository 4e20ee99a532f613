"""C99 source of a scheduled controller: those of the vertices, averaged with the weights of the point at hand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from .._arrays import Array
from .._control import control
from ..export import Program, comment, doubles, identifier, rows
from ._schedule import Schedule

_SAMPLES = 64
_BEYOND = 0.1  # of the range of a quantity: how far the test goes beyond it

_ABOUT = """\
Scheduled controller, {n} states, sample time {h:.17g} s. In every sample:

    outside = {p}_step(&state, at, y, u);     u from quantities and measurements of this sample, then the next state

Controllers of {count} points are averaged with the weights of `at`. A point outside of theirs is moved to them, and 1
is returned: nothing is proven there. Quantities: {at}.
Measurements: {y}. Controls: {u}. The state starts at zero.
{outcome}"""

_STEP = """
static inline int @_step(@_state *s, const double at[@_quantities], const double *y, double *u)
{
    double w[@_points], next[@_n + 1] = {0};
    int outside = @_weights(at, w);
    for (int i = 0; i < @_controls; i++) u[i] = 0.0;
    for (int i = 0; i < @_controls + @_n; i++) {
        double sum = 0.0;
        for (int v = 0; v < @_points; v++) {
            double own = 0.0;
            if (w[v] == 0.0) continue;
            for (int j = 0; j < @_n; j++) own += @_matrix[v][i][j] * s->x[j];
            for (int j = 0; j < @_measured; j++) own += @_matrix[v][i][@_n + j] * y[j];
            sum += w[v] * own;
        }
        if (i < @_controls) u[i] = sum;
        else next[i - @_controls] = sum;
    }
    for (int i = 0; i < @_n; i++) s->x[i] = next[i];
    return outside;
}
"""

_GRID = """
/* Weights of the corners of the cell: products of the shares along every quantity. */
static inline int @_weights(const double *at, double *w)
{
    int outside = 0;
    for (int v = 0; v < @_points; v++) w[v] = 1.0;
    for (int d = 0; d < @_quantities; d++) {
        const double *axis = @_axis[d];
        int last = @_length[d] - 1, k = 0;
        double value = at[d] <= axis[last] ? at[d] : axis[last], upper = 0.0;
        if (!(value >= axis[0])) value = axis[0];
        outside = outside || !(value == at[d]);
        while (k + 1 < last && value >= axis[k + 1]) k++;
        if (last > 0) upper = (value - axis[k]) / (axis[k + 1] - axis[k]);
        for (int v = 0; v < @_points; v++) {
            int own = @_where[v][d];
            w[v] *= own == k ? 1.0 - upper : own == k + 1 ? upper : 0.0;
        }
    }
    return outside;
}
"""

_SIMPLICES = """
/* Shares of the corners of the simplex in which the least one is largest; negative ones are cut off. */
static inline int @_weights(const double *at, double *w)
{
    double best[@_quantities + 1] = {0}, most = -INFINITY, sum = 0.0;
    int found = 0;
    for (int k = 0; k < @_simplices; k++) {
        double share[@_quantities + 1], least = INFINITY;
        for (int i = 0; i <= @_quantities; i++) {
            share[i] = @_share[k][i][@_quantities];
            for (int d = 0; d < @_quantities; d++) share[i] += @_share[k][i][d] * at[d];
            least = share[i] < least ? share[i] : least;
        }
        if (!(least > most)) continue;
        most = least;
        found = k;
        for (int i = 0; i <= @_quantities; i++) best[i] = share[i];
    }
    for (int v = 0; v < @_points; v++) w[v] = 0.0;
    for (int i = 0; i <= @_quantities; i++) {
        best[i] = best[i] > 0.0 && best[i] < INFINITY ? best[i] : 0.0;
        sum += best[i];
    }
    for (int i = 0; i <= @_quantities; i++)
        w[@_corner[found][i]] = sum > 0.0 ? best[i] / sum : 1.0 / (@_quantities + 1);
    return !(most >= -1e-9);
}
"""


def scheduled_program(controllers: Sequence[control.StateSpace], schedule: Schedule, name: str,
                      outcome: str) -> Program:
    """C source of controllers at the points of a schedule."""
    p, first = identifier(name, "controller"), controllers[0]
    matrices = [np.vstack([np.hstack([K.C, K.D]), np.hstack([K.A, K.B])]) for K in controllers]
    points, quantities = schedule.points.shape
    sizes = {"n": first.nstates, "controls": first.noutputs, "measured": first.ninputs, "points": points,
             "quantities": quantities}
    parts = [f"static const double {p}_matrix[{points}][{len(matrices[0])}][{max(matrices[0].shape[1], 1)}] = {{\n"
             + ",\n".join("{\n" + rows(one.tolist()) + "\n}" for one in matrices) + "\n};"]
    if schedule.axes:
        longest = max(len(axis) for axis in schedule.axes)
        where = [[int(np.flatnonzero(axis == value)[0]) for axis, value in zip(schedule.axes, row, strict=True)]
                 for row in schedule.points]
        lengths = ", ".join(str(len(axis)) for axis in schedule.axes)
        parts += [f"static const double {p}_axis[{quantities}][{longest}] = {{\n"
                  + rows([axis.tolist() for axis in schedule.axes]) + "\n};",
                  f"static const int {p}_length[{quantities}] = {{{lengths}}};",
                  f"static const int {p}_where[{points}][{quantities}] = {_integers(where)};", _GRID.replace("@", p)]
    else:
        corners, shares = schedule.simplices
        sizes["simplices"] = len(corners)
        parts += [f"static const int {p}_corner[{len(corners)}][{quantities + 1}] = {_integers(corners.tolist())};",
                  f"static const double {p}_share[{len(corners)}][{quantities + 1}][{quantities + 1}] = {{\n"
                  + ",\n".join("{" + ", ".join(doubles(row) for row in one) + "}" for one in shares.tolist()) + "\n};",
                  _SIMPLICES.replace("@", p)]
    declared = ", ".join(f"{p}_{word} = {size}" for word, size in sizes.items())
    head = f"enum {{ {declared} }};\n\ntypedef struct {{\n    double x[{max(first.nstates, 1)}];\n}} {p}_state;\n"
    about = _ABOUT.format(p=p, n=first.nstates, h=first.dt, count=points, at=comment(", ".join(schedule.names)),
                          y=comment(", ".join(first.input_labels)), u=comment(", ".join(first.output_labels)),
                          outcome=outcome)
    call = f"        out[{first.noutputs}] = {p}_step(&state, in, in + {quantities}, out);"
    return Program(p, "CONTROLLER_TEST", about, "\n".join([head, *parts, _STEP.replace("@", p)]),
                   list(_vector(matrices, first, schedule)), quantities + first.ninputs,
                   f"    {p}_state state = {{{{0}}}};", call,
                   [*schedule.names, *first.input_labels, *first.output_labels, "outside"])


def _integers(table: Sequence[Sequence[int]]) -> str:
    return "{" + ", ".join("{" + ", ".join(str(one) for one in row) + "}" for row in table) + "}"


def _vector(matrices: Sequence[Array], first: control.StateSpace, schedule: Schedule) -> Iterator[list[float]]:
    """Quantities, measurements, and the controls that follow, summed in the order of the source."""
    rng = np.random.default_rng(0)
    low, high = schedule.points.min(axis=0), schedule.points.max(axis=0)
    x, tables = [0.0] * first.nstates, [one.tolist() for one in matrices]
    for _ in range(_SAMPLES):
        at = low + (high - low) * rng.uniform(-_BEYOND, 1 + _BEYOND, len(low))
        weights, outside = schedule.moved_inside(at)
        y = [float(value) for value in rng.standard_normal((first.ninputs,))]
        found = []
        for i in range(len(tables[0])):
            total = 0.0
            for weight, table in zip(weights.tolist(), tables, strict=True):
                if weight != 0.0:
                    own = 0.0
                    for a, value in zip(table[i], [*x, *y], strict=True):
                        own += a * value
                    total += weight * own
            found.append(total)
        yield [*at.tolist(), *y, *found[:first.noutputs], float(outside)]
        x = found[first.noutputs:]
