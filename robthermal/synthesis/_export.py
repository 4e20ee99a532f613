"""Designs for other programs: a state-space controller in C99, MATLAB or JSON, and its certificates beside it."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import Array
from .._control import control
from .._write import write
from ..errors import InputError
from ..export import Program, by_suffix, comment, identifier, json_bytes, matlab_bytes, number, plain, write_export
from ..linear import Plant, read_plant
from ..verification import Certificate

FORMAT = "robthermal-design/1"
_TEST_SAMPLES = 64

_ABOUT = """\
Controller u = K y, {n} states, sample time {h:.17g} s. In every sample:

    {p}_step(&state, y, u);     u from the measurements of this sample, then the next state
{limited}
Measurements: {y}. Controls: {u}. The state starts at zero.
{outcome}"""

_LIMITED = "u is inside the limits of the controls; what they cut off goes to the state inside.\n"

_BODY = """\
typedef struct {{
    double x[{states}];
}} {p}_state;

static inline void {p}_step({p}_state *s, const double y[{n_y}], double u[{n_u}])
{{
    double next[{states}] = {{0}};{held}
{output}{limit}
{state}
    for (int k = 0; k < {states}; k++)
        s->x[k] = next[k];
}}
"""


def export_design(content: Mapping[str, Any], certificates: Sequence[Certificate], path: str | Path,
                  source: Callable[[], Program] | None, remedy: str) -> None:
    """Write one file, or a folder with all of them.

    `content`: what design.json says; `source`: makes the C source, None where there is none; `remedy`: how to get one.
    """
    if Path(path).suffix:
        if source is not None:
            write_export(path, lambda: content, source)
        else:  # no test vector: there is no program
            by_suffix(path, {".json": lambda: json_bytes(plain(content)), ".mat": lambda: matlab_bytes(content)},
                      remedy)
        return
    folder = Path(path)
    try:
        (folder / "certificates").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder: {error.strerror}", where=ascii(str(folder))) from None
    write(folder / "design.json", json_bytes(plain(content)))
    for k, certificate in enumerate(certificates):
        measure = certificate.region.get("measure", certificate.kind)
        certificate.save(folder / "certificates" / f"{k + 1}_{measure}.json")
    if source is not None:
        text = source().text().encode("ascii")
        for suffix in (".c", ".h"):
            write(folder / f"controller{suffix}", text)


def said(outcome: str) -> str:
    """What is proven, as lines of the comment at the top of C source.

    `outcome`: text of the outcome of the design.
    """
    return "\n".join(textwrap.wrap(comment(f"As designed: {outcome}"), 110))


def document(K: control.StateSpace, name: str) -> dict[str, Any]:
    """Start of design.json: the controller."""
    return {"format": FORMAT, "name": name,
            "controller": {"A": K.A, "B": K.B, "C": K.C, "D": K.D, "sample_time": float(K.dt or 0.0),
                           "inputs": list(K.input_labels), "outputs": list(K.output_labels)}}


def program(controller: control.StateSpace, name: str, outcome: str, limits: Sequence[float] = ()) -> Program:
    """C source of a sampled controller, the doubles of the certificate.

    `limits`: largest absolute values of the controls, where what they cut off are the last inputs of the controller.
    """
    K = read_plant(controller)
    p, n, (n_u, n_in) = identifier(name, "controller"), len(K.A), K.D.shape
    n_y = n_in - len(limits)
    given = [f"{word}[{k}]" for word, count in (("s->x", n), ("y", n_y), ("q", len(limits))) for k in range(count)]
    wanted = "v" if limits else "u"
    body = _BODY.format(p=p, states=max(n, 1), n_y=n_y, n_u=n_u, output=_sums(wanted, np.hstack([K.C, K.D]), given),
                        held=f"\n    double v[{n_u}], q[{n_u}];" if limits else "", limit=_limit(limits),
                        state=_sums("next", np.hstack([K.A, K.B]), given))
    about = _ABOUT.format(p=p, n=n, h=K.dt, y=comment(", ".join(controller.input_labels[:n_y])),
                          u=comment(", ".join(controller.output_labels)), outcome=outcome,
                          limited=_LIMITED if limits else "")
    call = f"        {p}_step(&state, in, out);"
    return Program(p, "CONTROLLER_TEST", about, body, list(_vector(K, limits)), n_y,
                   f"    {p}_state state = {{{{0}}}};", call)


def _limit(limits: Sequence[float]) -> str:
    """Controls inside their limits, and what was cut off."""
    lines = [f"\n    u[{k}] = fmin(fmax(v[{k}], {number(-one)}), {number(one)});\n    q[{k}] = v[{k}] - u[{k}];"
             for k, one in enumerate(limits)]
    return "".join(lines)


def _sums(target: str, matrix: Array, names: Sequence[str]) -> str:
    """One assignment per row, summed from the left."""
    lines = []
    for i, row in enumerate(matrix):
        terms = [f"{number(a)} * {name}" for a, name in zip(row, names, strict=True) if a != 0]
        lines.append(f"    {target}[{i}] = " + ("\n        + ".join(terms) or "0.0") + ";")
    return "\n".join(lines)


def _vector(K: Plant, limits: Sequence[float]) -> Iterator[list[float]]:
    """Measurements, and the controls that follow, summed in the order of the source."""
    rng = np.random.default_rng(0)
    x: list[float] = [0.0] * len(K.A)
    output: list[list[float]] = np.hstack([K.C, K.D]).tolist()
    state: list[list[float]] = np.hstack([K.A, K.B]).tolist()
    for _ in range(_TEST_SAMPLES):
        y = [float(value) for value in rng.standard_normal((K.D.shape[1] - len(limits),))]
        v = [_dot(row, [*x, *y, *limits]) for row in output]  # no direct path from what is cut off
        u = [min(max(one, -most), most) for one, most in zip(v, limits, strict=True)] if limits else v
        yield [*y, *u]
        both = [*x, *y, *(one - used for one, used in zip(v, u, strict=True))] if limits else [*x, *y]
        x = [_dot(row, both) for row in state]


def _dot(row: Sequence[float], values: Sequence[float]) -> float:
    total = None
    for a, value in zip(row, values, strict=True):
        if a != 0:
            total = a * value if total is None else total + a * value
    return 0.0 if total is None else total
