"""Controllers for other programs: C99, MATLAB and JSON, all with the same three matrices."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np

from ..export import Program, comment, identifier, number, write_export
from ._matrices import Matrices, Steps, dot, matrices
from ._modules import Array

FORMAT = "robthermal-controller/1"
_TEST_SAMPLES = 64

_ABOUT = """\
Outer control loop in heats (a {kind}): no allocation, no library but math.h.

Sample time {h:.17g} s. Temperatures in kelvin, heats in watts into the cold faces (negative cools). In every sample:

    {p}_init(&state, &seen, heat);                 once, with the heats in force: no bump
    {p}_heat(&state, &seen, wanted);               then currents from wanted, within their limits,
    {p}_advance(&state, &seen, wanted, achieved);  and what the limits left of the heats: back-calculation

{members}"""

_BODY = """\
typedef struct {{
    double x[{states}];
}} {p}_state;

typedef struct {{
{seen}
}} {p}_seen;

static inline void {p}_init({p}_state *s, const {p}_seen *e, const double heat[{m}])
{{
    (void)e, (void)heat;
{start}
}}

static inline void {p}_heat(const {p}_state *s, const {p}_seen *e, double heat[{m}])
{{
    (void)s, (void)e;
{heat}
}}

static inline void {p}_advance({p}_state *s, const {p}_seen *e, const double wanted[{m}], const double achieved[{m}])
{{
    double next[{states}] = {{0}};
    (void)e, (void)wanted, (void)achieved;
{advance}
    for (int k = 0; k < {states}; k++)
        s->x[k] = next[k];
}}
"""


def export(controller: Steps, path: str | Path, name: str) -> None:
    """Write a .c, .h, .mat or .json file."""
    M = matrices(controller)
    kind = type(controller).__name__
    write_export(path, lambda: _document(M, kind, name), lambda: _program(M, kind, name))


def _document(M: Matrices, kind: str, name: str) -> dict[str, Any]:
    return {"format": FORMAT, "name": name, "kind": kind, "sample_time": M.sample_time,
            "modules": M.modules, "lumps": list(M.lumps), "indices": list(M.indices), "n_lumps": M.n_lumps,
            "around": list(M.around), "start": M.start, "heat": M.heat, "advance": M.advance}


def _program(M: Matrices, kind: str, name: str) -> Program:
    p, n, m = identifier(name, "controller"), len(M.start), M.modules
    own = [f"s->x[{i}]" for i in range(n)]
    seen = [f"e->{part}[{i}]" for part, size in M.sizes.items() for i in range(size)]
    wanted, achieved = ([f"{part}[{i}]" for i in range(m)] for part in ("wanted", "achieved"))
    body = _BODY.format(
        p=p, m=m, states=max(n, 1),
        seen="\n".join(f"    double {part}[{size}];" for part, size in M.sizes.items() if size),
        start=_sums("s->x", M.start, [*seen, *(f"heat[{i}]" for i in range(m))]),
        heat=_sums("heat", M.heat, [*own, *seen]),
        advance=_sums("next", M.advance, [*own, *seen, *wanted, *achieved]))
    setup = f"    {p}_state state = {{{{0}}}};\n    {p}_seen seen;\n    double achieved[{m}];"
    return Program(p, "CONTROLLER_TEST", _ABOUT.format(p=p, kind=kind, h=M.sample_time, members=_members(M)), body,
                   list(vector_of(M)), sum(M.sizes.values()) + m, setup, _test_call(p, M), _columns(M))


def _columns(M: Matrices) -> list[str]:
    """Names of the columns of the test vector."""
    inputs = [f"{part}[{i}]" for part, size in M.sizes.items() for i in range(size)]
    return [*inputs, *(f"taken away[{i}]" for i in range(M.modules)), *(f"heat[{i}]" for i in range(M.modules)),
            *(f"state.x[{i}]" for i in range(len(M.start)))]


def _members(M: Matrices) -> str:
    """Comment on the inputs."""
    lines = ["reference, cold: set-points, and temperatures of the cold faces or what is regulated instead [K]"]
    if M.lumps:
        lines.append("temperatures: of the lumps " + ", ".join(M.lumps) + " [K]")
    if M.around:
        lines.append("around: " + ", ".join(M.around) + ", as measured")
    return "\n".join(comment(line) for line in lines)


def _sums(target: str, matrix: Array, names: list[str]) -> str:
    """One assignment per row."""
    lines = []
    for i, row in enumerate(matrix):
        terms = [f"{number(a)} * {name}" for a, name in zip(row, names, strict=True) if a != 0]
        lines.append(f"    {target}[{i}] = " + ("\n        + ".join(terms) or "0.0") + ";")
    return "\n".join(lines)


def _test_call(p: str, M: Matrices) -> str:
    """Inputs: of the controller, what the limits take away; outputs: wanted heats and the memory after the step."""
    ends = list(accumulate(M.sizes.values()))
    fill = [f"        for (int k = 0; k < {size}; k++) seen.{part}[k] = in[{end - size} + k];"
            for (part, size), end in zip(M.sizes.items(), ends, strict=True) if size]
    n, m, k = len(M.start), M.modules, ends[-1]
    call = [*fill, "        if (t == 0)", f"            {p}_init(&state, &seen, in + {k});",
            f"        {p}_heat(&state, &seen, out);", f"        for (int k = 0; k < {m}; k++)",
            f"            achieved[k] = out[k] - in[{k} + k];", f"        {p}_advance(&state, &seen, out, achieved);",
            *([f"        for (int k = 0; k < {n}; k++) out[{m} + k] = state.x[k];"] if n else [])]
    return "\n".join(call)


def vector_of(M: Matrices) -> Iterator[list[float]]:
    """Rows of inputs and of what must come out: heats, and the memory after the step.

    Parameters
    ----------
    M : Matrices
        Of the controller.
    """
    rng, memory = np.random.default_rng(0), [0.0] * len(M.start)
    for t in range(_TEST_SAMPLES):
        seen = [*rng.uniform(280.0, 300.0, sum(M.sizes.values())).tolist()]
        taken = (rng.standard_normal(M.modules) * (t % 4 == 0)).tolist()  # a limit is active now and then
        if t == 0:
            memory = [dot(row, [*seen, *taken]) for row in M.start]
        wanted = [dot(row, [*memory, *seen]) for row in M.heat]
        achieved = [v - off for v, off in zip(wanted, taken, strict=True)]
        memory = [dot(row, [*memory, *seen, *wanted, *achieved]) for row in M.advance]
        yield [*seen, *taken, *wanted, *memory]
