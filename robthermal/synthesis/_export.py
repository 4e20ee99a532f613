"""Designs for other programs: a state-space controller in C99, MATLAB or JSON, and its certificates beside it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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

Measurements: {y}. Controls: {u}. The state starts at zero."""

_BODY = """\
typedef struct {{
    double x[{states}];
}} {p}_state;

static inline void {p}_step({p}_state *s, const double y[{n_y}], double u[{n_u}])
{{
    double next[{states}] = {{0}};
{output}
{state}
    for (int k = 0; k < {states}; k++)
        s->x[k] = next[k];
}}
"""


def export_design(controller: control.StateSpace, facts: Mapping[str, Any], certificates: Sequence[Certificate],
                  path: str | Path, name: str, source: bool = True) -> None:
    """Write one file, or a folder with all of them; `facts`: what design.json says beside the controller.

    `source`: whether a folder gets C source of a sampled controller.
    """
    content = document(controller, name) | dict(facts)
    if Path(path).suffix:
        if controller.dt:
            write_export(path, lambda: content, lambda: program(controller, name))
        else:  # no test vector: there is no program
            by_suffix(path, {".json": lambda: json_bytes(plain(content)), ".mat": lambda: matlab_bytes(content)},
                      "C source needs a sampled controller: design it with sample_time=.")
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
    if controller.dt and source:
        for suffix in (".c", ".h"):
            write(folder / f"controller{suffix}", program(controller, name).text().encode("ascii"))


def document(K: control.StateSpace, name: str) -> dict[str, Any]:
    """Start of design.json: the controller."""
    return {"format": FORMAT, "name": name,
            "controller": {"A": K.A, "B": K.B, "C": K.C, "D": K.D, "sample_time": float(K.dt or 0.0),
                           "inputs": list(K.input_labels), "outputs": list(K.output_labels)}}


def program(controller: control.StateSpace, name: str) -> Program:
    """C source of a sampled controller, the doubles of the certificate."""
    K = read_plant(controller)
    p, n, (n_u, n_y) = identifier(name, "controller"), len(K.A), K.D.shape
    given = [*(f"s->x[{k}]" for k in range(n)), *(f"y[{k}]" for k in range(n_y))]
    body = _BODY.format(p=p, states=max(n, 1), n_y=n_y, n_u=n_u, output=_sums("u", np.hstack([K.C, K.D]), given),
                        state=_sums("next", np.hstack([K.A, K.B]), given))
    about = _ABOUT.format(p=p, n=n, h=K.dt, y=comment(", ".join(controller.input_labels)),
                          u=comment(", ".join(controller.output_labels)))
    call = f"        {p}_step(&state, in, out);"
    return Program(p, "CONTROLLER_TEST", about, body, list(_vector(K)), n_y, f"    {p}_state state = {{{{0}}}};", call)


def _sums(target: str, matrix: Array, names: Sequence[str]) -> str:
    """One assignment per row, summed from the left."""
    lines = []
    for i, row in enumerate(matrix):
        terms = [f"{number(a)} * {name}" for a, name in zip(row, names, strict=True) if a != 0]
        lines.append(f"    {target}[{i}] = " + ("\n        + ".join(terms) or "0.0") + ";")
    return "\n".join(lines)


def _vector(K: Plant) -> Iterator[list[float]]:
    """Measurements, and the controls that follow, summed in the order of the source."""
    rng = np.random.default_rng(0)
    x: list[float] = [0.0] * len(K.A)
    output: list[list[float]] = np.hstack([K.C, K.D]).tolist()
    state: list[list[float]] = np.hstack([K.A, K.B]).tolist()
    for _ in range(_TEST_SAMPLES):
        y = [float(value) for value in rng.standard_normal((K.D.shape[1],))]
        both = [*x, *y]
        yield [*y, *(_dot(row, both) for row in output)]
        x = [_dot(row, both) for row in state]


def _dot(row: Sequence[float], values: Sequence[float]) -> float:
    total = None
    for a, value in zip(row, values, strict=True):
        if a != 0:
            total = a * value if total is None else total + a * value
    return 0.0 if total is None else total
