"""Loops at the vertices of a hull of plants: one state feedback, or controllers averaged with the weights of the plant.

What is proven at the vertices is true of the hull where the loop is the average of the loops at the vertices. A state
feedback always gives that; with controllers that vary no two factors of one product may (`not_affine`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flint import fmpq, fmpq_mat

from robthermal.errors import InputError

from ._closed_loop import join_loop
from ._fields import get, mapping, no_other, not_negative, sequence
from ._lti import LinearSystem, Rows, expect_shape, read_matrix, read_realization
from ._numbers import exact, name_of

_MOST_WORK = 3e8  # vertices times n³, n the states of a loop


@dataclass(frozen=True)
class Loops:
    """Loops at the vertices, and the sizes of the plants; ``measured`` is 0 for a state feedback."""

    at: tuple[LinearSystem, ...]
    plant_states: int
    inputs: int
    n_ctrl: int
    outputs: int
    measured: int

    @property
    def states(self) -> int:
        return self.at[0].states


def read_loops(table: Mapping[str, Any], bounded: bool) -> Loops:
    """Return the loops of a section "system", or raise InputError; ``bounded``: a norm from w to z is claimed."""
    return _read_scheduled(table, bounded) if "controller" in table else _read_feedback(table, bounded)


def _limit_work(count: int, states: int) -> None:
    if count * states**3 > _MOST_WORK:
        raise InputError(f"{count} vertices of {states} states", where="system.vertices", expected="fewer: too many")


def _read_feedback(table: Mapping[str, Any], bounded: bool) -> Loops:
    no_other(table, ["vertices", "gain", "sample_time"], "system")
    time = not_negative(get(table, "sample_time", "system"), "system.sample_time")
    gain = read_matrix(get(table, "gain", "system"), "system.gain")
    listed = sequence(get(table, "vertices", "system"), "system.vertices")
    if not listed or not gain or not gain[0]:
        raise InputError("no vertex, or an empty gain", where="system", expected="at least one vertex, control, state")
    k, n = len(gain), len(gain[0])
    expect_shape(gain, k, n, "system.gain")
    _limit_work(len(listed), n)
    F = _dense(gain, k, n)
    loops, sizes = [], set()
    for i, item in enumerate(listed):
        where = f"system.vertices[{i}]"
        part = mapping(item, where)
        no_other(part, ["A", "B", "C", "D"], where)
        matrices = {key: read_matrix(get(part, key, where), f"{where}.{key}")
                    for key in ("A", "B", *(key for key in "CD" if "C" in part or "D" in part or bounded))}
        m, p = len(matrices["B"][0]) if matrices["B"] else 0, len(matrices.get("C", ()))
        sizes.add((m, p))
        for key, rows, columns in (("A", n, n), ("B", n, m), ("C", p, n), ("D", p, m)):
            if key in matrices:
                expect_shape(matrices[key], rows, columns, f"{where}.{key}")
        if len(sizes) > 1 or m < k or (bounded and (m == k or p == 0)):
            raise InputError(f"{m} inputs and {p} outputs", where=where,
                             expected=f"the same at every vertex, {k} inputs for control"
                                      + (", a disturbance and a performance output" if bounded else ""))
        loops.append(_fed_back(matrices, F, m - k, time))
    (m, p), = sizes
    return Loops(tuple(loops), n, m, k, p, 0)


def _fed_back(matrices: Mapping[str, Rows], F: fmpq_mat, w: int, time: fmpq) -> LinearSystem:
    """Return A + B2 F, B1, C + D2 F, D1, exactly; one row and column of zeros where there is no w or z."""
    n = len(matrices["A"])
    B1, B2 = _columns(matrices["B"], w)
    A = _rows(_dense(matrices["A"], n, n) + _dense(B2, n, F.nrows()) * F)
    p = len(matrices.get("C", ()))
    if not w or not p:
        return LinearSystem(A, ((fmpq(0),),) * n, ((fmpq(0),) * n,), ((fmpq(0),),), time)
    D1, D2 = _columns(matrices["D"], w)
    return LinearSystem(A, B1, _rows(_dense(matrices["C"], p, n) + _dense(D2, p, F.nrows()) * F), D1, time)


def _read_scheduled(table: Mapping[str, Any], bounded: bool) -> Loops:
    no_other(table, ["vertices", "controller", "n_meas", "n_ctrl", "sample_time"], "system")
    time = not_negative(get(table, "sample_time", "system"), "system.sample_time")
    plants, controllers = (_read_systems(table, key, time) for key in ("vertices", "controller"))
    if len(plants) != len(controllers):
        raise InputError(f"{len(controllers)} controllers", where="system.controller",
                         expected=f"{len(plants)}, one per vertex")
    plant, controller = plants[0], controllers[0]
    _limit_work(len(plants), plant.states + controller.states)
    q, k = (_count(get(table, key, "system"), most, f"system.{key}")
            for key, most in (("n_meas", plant.outputs), ("n_ctrl", plant.inputs)))
    if (controller.inputs, controller.outputs) != (q, k):
        raise InputError(f"controllers with {controller.inputs} inputs and {controller.outputs} outputs",
                         where="system.controller", expected=f"{q} measurements in, {k} controls out")
    if bounded and (plant.inputs == k or plant.outputs == q):
        raise InputError(f"{plant.inputs} inputs and {plant.outputs} outputs", where="system.vertices",
                         expected="a disturbance and a performance output")
    if why := not_affine(plants, controllers, q, k):
        raise InputError(why, where="system", expected="a loop that is the average of those at the vertices")
    loops = [join_loop(*pair, q, k) for pair in zip(plants, controllers, strict=True)]
    found = tuple(loop for loop in loops if loop is not None)  # never ill-posed: D_K D22 is zero
    return Loops(found, plant.states, plant.inputs, k, plant.outputs, q)


def _read_systems(table: Mapping[str, Any], key: str, time: fmpq) -> list[LinearSystem]:
    found = []
    for i, item in enumerate(sequence(get(table, key, "system"), f"system.{key}")):
        where = f"system.{key}[{i}]"
        part = mapping(item, where)
        no_other(part, ["A", "B", "C", "D"], where)
        found.append(read_realization(part, time, where))
    sizes = {(one.states, one.inputs, one.outputs) for one in found}
    if len(sizes) != 1:
        raise InputError(f"systems of {len(sizes)} different sizes", where=f"system.{key}",
                         expected="the same numbers of states, inputs and outputs at every vertex, at least one vertex")
    return found


def _count(value: Any, most: int, where: str) -> int:
    number = exact(value, where)
    if number.q != 1 or not 1 <= number <= most:
        raise InputError(name_of(value), where=where, expected=f"a whole number from 1 to {most}")
    return int(number.p)


def not_affine(plants: Sequence[LinearSystem], controllers: Sequence[LinearSystem], q: int, k: int) -> str:
    """Return why the loop is not affine in the weights of the vertices, empty where it is.

    The loop holds A, B1, C1, D11, A_K and the products [B2; D12] C_K, B_K [C2 D21], [B2; D12] D_K [C2 D21] and, with
    D_K = 0, B_K D22 C_K: affine where of each product one factor varies at most.
    """
    m, p = plants[0].inputs - k, plants[0].outputs - q
    actuation = _varies([[*(row[m:] for row in one.B), *(row[m:] for row in one.D[:p])] for one in plants])
    sensing = _varies([[*one.C[p:], *(row[:m] for row in one.D[p:])] for one in plants])
    passed = [[row[m:] for row in one.D[p:]] for one in plants]
    varies = {"[B2; D12]": actuation, "[C2 D21]": sensing, "D22": _varies(passed),
              **{f"{key}_K": _varies([getattr(one, key) for one in controllers]) for key in "BCD"}}
    products: list[tuple[str, ...]] = [("[B2; D12]", "C_K"), ("B_K", "[C2 D21]")]
    direct = any(entry != 0 for one in controllers for row in one.D for entry in row)
    if direct:
        products.append(("[B2; D12]", "D_K", "[C2 D21]"))
    if any(entry != 0 for part in passed for row in part for entry in row):
        if direct:
            return "neither D22 nor D_K is zero"
        products.append(("B_K", "D22", "C_K"))
    for factors in products:
        if sum(varies[name] for name in factors) > 1:
            return f"the product {' '.join(factors)} has more than one factor that varies"
    return ""


def _varies(parts: Sequence[Sequence[Sequence[fmpq]]]) -> bool:
    return any([tuple(row) for row in part] != [tuple(row) for row in parts[0]] for part in parts[1:])


def _columns(matrix: Rows, count: int) -> tuple[Rows, Rows]:
    return tuple(row[:count] for row in matrix), tuple(row[count:] for row in matrix)


def _dense(matrix: Rows, rows: int, columns: int) -> fmpq_mat:
    return fmpq_mat(rows, columns, [entry for row in matrix for entry in row])


def _rows(matrix: fmpq_mat) -> Rows:
    return tuple(tuple(row) for row in matrix.tolist())
