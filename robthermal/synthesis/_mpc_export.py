"""A predictive controller in C99: its numbers in the units of the terminal set, and steps to test it with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import cholesky

from .._arrays import Array
from ..export import Program as Source
from ..export import comment, doubles, identifier, rows
from ._mpc_source import ABOUT, SOLVER, TYPES
from ._mpc_step import KEPT, Program

ROUNDS = 60  # most Newton steps in a sample
AGREES = 1e-5  # of the largest control: what C and Clarabel may differ by
_STARTS, _SIZES = 32, (0.3, 1.0, 1.5, 2.0, 3.0, 6.0)  # of the test: states by their distance in terminal sets
_CLEAR = 1e-3  # of a limit: smaller misses are no test of what is feasible


def source(own: Program, name: str, states: Sequence[str], controls: Sequence[str], outcome: str) -> Source:
    """C source of the quadratic program, solved in every sample."""
    p, horizon, (m, n) = identifier(name, "controller"), len(own.prediction.law), own.terminal.K.shape
    tables = _tables(own)
    sizes = {"A": "[n][n]", "B": "[n][m]", "Q": "[n][n]", "S": "[m][n]", "R": "[m][m]", "E": "[rows][n]",
             "H": "[rows][m]", "K": "[m][n]", "scaled": "[n][n]"}
    shape = {"n": f"{p}_n", "m": f"{p}_m", "rows": f"{p}_rows"}
    lines = []
    for key, form in sizes.items():
        for word, size in shape.items():
            form = form.replace(f"[{word}]", f"[{size}]")
        lines.append(f"static const double {p}_{key}{form} = {{\n{rows(tables[key])}\n}};")
    lines.append(f"static const double {p}_unit[{p}_m] = {doubles(tables['unit'])};")
    kinds = ", ".join(str(int(one)) for one in tables["moved"])
    lines += ["/* What moves a row: 0 states alone, 1 both, 2 controls alone. */",
              f"static const int {p}_moved[{p}_rows] = {{{kinds}}};"]
    facts = {"p": p, "n": n, "m": m, "horizon": horizon, "rounds": ROUNDS, "rows": len(tables["E"])}
    about = ABOUT.format(**facts, h=own.dt, states=comment(", ".join(states)), controls=comment(", ".join(controls)),
                         outcome=outcome)
    body = "\n".join([TYPES.format(**facts), *lines, SOLVER.replace("@", p)])
    call = f"        {p}_start(&memory);\n        out[{m}] = {p}_step(&memory, in, out);"
    return Source(p, "CONTROLLER_TEST", about, body, _vector(own), n, f"    static {p}_memory memory;", call,
                  [*states, *controls, "status"], AGREES)


def fallback(own: Program, x: Array) -> Array:
    """What the C source does where it finds no plan: u = K x, moved to the limits of this sample in turn."""
    t = _tables(own)
    z = t["scaled"] @ x
    c = np.zeros(len(t["K"]))
    for _ in range(10):
        for E, H in zip(t["E"], t["H"], strict=True):
            over, square = E @ z + H @ c - 1.0, H @ H
            if over > 0 and square > 0:
                c = c - H * over / square
    alone = t["moved"] == 2
    share = (1.0 / np.maximum(t["E"][alone] @ z + t["H"][alone] @ c, 1.0)).min(initial=1.0)
    u: Array = share * (t["K"] @ z + c) * t["unit"]
    return u


def _tables(own: Program) -> dict[str, Array]:
    """Matrices for z, |z| <= 1 in the terminal set, and controls of size one there; limits E z + H c <= 1."""
    P, K, level = own.terminal.P, own.terminal.K, own.terminal.level
    scaled = cholesky(P) / np.sqrt(level)
    back = np.linalg.inv(scaled)
    loop, B = own.prediction.free[1], own.prediction.driven[1][:, :len(K)]
    limits = own.limits
    reach = np.linalg.norm(K @ back, axis=1)
    most = np.abs(limits.H / limits.g[:, None]).max(axis=0)
    unit = np.where(reach > 0, reach, 1.0 / np.where(most > 0, most, 1.0))
    G, H = limits.G / limits.g[:, None], limits.H / limits.g[:, None]
    moved = np.where(~H.any(axis=1), 0, np.where(G.any(axis=1), 1, 2))
    return {"scaled": scaled, "A": scaled @ loop @ back, "B": scaled @ B * unit, "unit": unit,
            "K": K @ back / unit[:, None], "E": (G + H @ K) @ back, "H": H * unit, "moved": moved,
            "Q": _symmetric(back.T @ (own.Q + K.T @ own.R @ K) @ back / level),
            "S": unit[:, None] * (own.R @ K @ back) / level, "R": _symmetric(unit[:, None] * own.R * unit / level)}


def _symmetric(matrix: Array) -> Array:
    return (matrix + matrix.T) / 2


def _vector(own: Program) -> list[list[float]]:
    """States, the first control Clarabel finds, and whether there is a plan: 0, or 2 and the law that takes over."""
    rng = np.random.default_rng(0)
    back = np.sqrt(own.terminal.level) * np.linalg.inv(cholesky(own.terminal.P))
    found = []
    for k in range(_STARTS):
        direction = rng.standard_normal((len(back),))
        x = _SIZES[k % len(_SIZES)] * back @ direction / np.linalg.norm(direction)
        short = own.missed(x)
        if short <= KEPT:
            found.append([*x.tolist(), *own.step(x).control.tolist(), 0.0])
        elif short > _CLEAR:
            found.append([*x.tolist(), *fallback(own, x).tolist(), 2.0])
    return found
