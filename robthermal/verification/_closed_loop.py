"""Kind "closed_loop": what a controller reaches with a generalized plant, the loop formed here, in rational numbers.

The plant maps (w, u) to (z, y), controls last among its inputs and measurements last among its outputs; u = +K y. The
file holds plant and controller as they were returned, never their loop: a loop rounded to floats is another loop.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flint import fmpq, fmpq_mat

from robthermal.errors import InputError

from . import _hinf, _peak, _stability
from ._closed_loop_measures import Region, prove_h2, prove_region
from ._fields import get, mapping, no_other, not_negative, positive, sequence
from ._kind import Kind, Proof
from ._lti import LinearSystem, Rows, expect_shape, read_matrix, read_realization
from ._numbers import decimal, exact, name_of

_METHODS = {"stability": ("lyapunov", "polynomial"), "hinf": ("bounded_real", "polynomial"), "h2": ("lyapunov",),
            "peak": ("ellipsoid",), "region": ("lyapunov",)}
_REGION = ("decay", "damping", "radius")
_KEYS = {"stability": ["rate"], "region": list(_REGION), **dict.fromkeys(("hinf", "h2", "peak"), ["bound", "channels"])}


@dataclass(frozen=True)
class Channels:
    """Which performance outputs and which disturbances a bound is about; ``all_of``: every one of them."""

    outputs: tuple[int, ...]
    inputs: tuple[int, ...]
    all_of: bool


@dataclass(frozen=True)
class ClosedLoop:
    """The exact problem of one certificate of a closed loop."""

    plant: LinearSystem
    controller: LinearSystem
    n_meas: int
    n_ctrl: int
    measure: str
    bound: fmpq
    rate: fmpq
    poles: Region
    channels: Channels
    method: str
    matrix: Rows
    decay: fmpq
    share: fmpq

    @property
    def states(self) -> int:
        return self.plant.states + self.controller.states


def read(system: Any, region: Any, evidence: Any, margin: Any) -> ClosedLoop:
    """Return the exact problem, or raise InputError."""
    table, asked, found = mapping(system, "system"), mapping(region, "region"), mapping(evidence, "evidence")
    plant, controller, n_meas, n_ctrl = _read_system(table)
    no_other(mapping(margin, "margin"), [], "margin")
    measure = get(asked, "measure", "region")
    if not isinstance(measure, str) or measure not in _KEYS:
        raise InputError(f"measure {name_of(measure)}", where="region.measure", expected=f"one of {list(_KEYS)}")
    no_other(asked, ["measure", *_KEYS[measure]], "region")
    bounded = "bound" in _KEYS[measure]
    if bounded and (plant.inputs == n_ctrl or plant.outputs == n_meas):
        raise InputError(f"measure {name_of(measure)} of a plant without disturbance or performance output",
                         where="region.measure", expected="at least one of each")
    rate = not_negative(asked.get("rate", 0), "region.rate")
    if plant.discrete and rate >= 1:
        raise InputError("rate of 1 or more", where="region.rate", expected="below 1 for a sampled system")
    method = get(found, "method", "evidence")
    if method not in _METHODS[measure]:
        raise InputError(f"method {name_of(method)}", where="evidence.method",
                         expected=f"one of {list(_METHODS[measure])}")
    matrix: Rows = ()
    if method != "polynomial":
        matrix = read_matrix(get(found, "matrix", "evidence"), "evidence.matrix")
        states = plant.states + controller.states
        expect_shape(matrix, states, states, "evidence.matrix")
    decay, share = ((exact(get(found, key, "evidence"), f"evidence.{key}") for key in ("decay", "share"))
                    if method == "ellipsoid" else (fmpq(0), fmpq(0)))
    return ClosedLoop(plant, controller, n_meas, n_ctrl, measure,
                      positive(get(asked, "bound", "region"), "region.bound") if bounded else fmpq(0), rate,
                      _read_region(asked, plant) if measure == "region" else Region(None, None, None),
                      _read_channels(asked.get("channels"), plant.outputs - n_meas, plant.inputs - n_ctrl), method,
                      matrix, decay, share)


def _read_system(table: Mapping[str, Any]) -> tuple[LinearSystem, LinearSystem, int, int]:
    """Return plant, controller, and how many measurements and controls there are."""
    no_other(table, ["plant", "controller", "n_meas", "n_ctrl", "sample_time"], "system")
    time = not_negative(get(table, "sample_time", "system"), "system.sample_time")
    parts = []
    for name in ("plant", "controller"):
        part = mapping(get(table, name, "system"), f"system.{name}")
        no_other(part, ["A", "B", "C", "D"], f"system.{name}")
        parts.append(read_realization(part, time, f"system.{name}"))
    plant, controller = parts
    n_meas = _count(get(table, "n_meas", "system"), plant.outputs, "system.n_meas", "outputs")
    n_ctrl = _count(get(table, "n_ctrl", "system"), plant.inputs, "system.n_ctrl", "inputs")
    if (controller.inputs, controller.outputs) != (n_meas, n_ctrl):
        raise InputError(f"a controller with {controller.inputs} inputs and {controller.outputs} outputs",
                         where="system.controller.D", expected=f"{n_meas} measurements in, {n_ctrl} controls out")
    return plant, controller, n_meas, n_ctrl


def _count(value: Any, most: int, where: str, what: str) -> int:
    number = exact(value, where)
    if number.q != 1 or not 1 <= number <= most:
        raise InputError(f"{name_of(value)}: the plant has {most} {what}", where=where,
                         expected=f"a whole number from 1 to {most}")
    return int(number.p)


def _read_channels(value: Any, outputs: int, inputs: int) -> Channels:
    if value is None:
        return Channels(tuple(range(outputs)), tuple(range(inputs)), True)
    table = mapping(value, "region.channels")
    no_other(table, ["outputs", "inputs"], "region.channels")
    chosen = []
    for key, count in (("outputs", outputs), ("inputs", inputs)):
        where = f"region.channels.{key}"
        items = [exact(item, f"{where}[{k}]") for k, item in enumerate(sequence(get(table, key, "region.channels"),
                                                                               where))]
        if not items or any(item.q != 1 or not 0 <= item < count for item in items) or len(set(items)) < len(items):
            raise InputError("an empty list, a number twice or out of range", where=where,
                             expected=f"different whole numbers from 0 to {count - 1}")
        chosen.append(tuple(int(item.p) for item in items))
    return Channels(chosen[0], chosen[1], False)


def _read_region(table: Mapping[str, Any], plant: LinearSystem) -> Region:
    known = {key: positive(table[key], f"region.{key}") for key in _REGION if key in table}
    if not known or ("damping" in known and known["damping"] >= 1):
        raise InputError("no decay, damping or radius, or a damping ratio of 1 or more", where="region",
                         expected="at least one of them, the damping ratio below 1")
    if plant.discrete and (set(known) != {"radius"} or known["radius"] > 1):
        raise InputError("a region of a sampled loop", where="region", expected="a radius of at most 1, nothing else")
    if not plant.discrete and "decay" not in known and "damping" not in known:
        raise InputError("a radius alone, which does not make a loop stable", where="region",
                         expected="also a decay or a damping ratio")
    return Region(known.get("decay"), known.get("damping"), known.get("radius"))


def claim(problem: ClosedLoop, machine: str) -> str:
    """Return the one sentence the data give."""
    plant, controller = problem.plant, problem.controller
    time = f"sampled at {decimal(plant.sample_time)} s" if plant.discrete else "continuous"
    sizes = (f"{_plural(plant.states, 'state')}, {_plural(plant.inputs, 'input')}, the last {problem.n_ctrl} for "
             f"control, {_plural(plant.outputs, 'output')}, the last {problem.n_meas} measured")
    return (f"The closed loop u = K y, {time}, of the plant as given ({sizes}) and the controller as given "
            f"({_plural(controller.states, 'state')}) (machine {machine}), nominal parameters, is well-posed and "
            f"{_say_measure(problem)}.")


def _say_measure(problem: ClosedLoop) -> str:
    if problem.measure == "stability":
        if problem.plant.discrete:
            modes = f"absolute values below {decimal(1 - problem.rate)}"
        else:
            modes = f"real parts below {decimal(-problem.rate)}{' 1/s' if problem.rate else ''}"
        return f"asymptotically stable: all its eigenvalues have {modes}"
    if problem.measure == "region":
        decay, damping, radius = problem.poles.decay, problem.poles.damping, problem.poles.radius
        words = [f"real parts below {decimal(-decay)} 1/s"] if decay is not None else []
        words += [f"damping ratios above {decimal(damping)}"] if damping is not None else []
        unit = "" if problem.plant.discrete else " 1/s"
        words += [f"absolute values below {decimal(radius)}{unit}"] if radius is not None else []
        return f"asymptotically stable: all its eigenvalues have {' and '.join(words)}"
    chosen, bound = problem.channels, decimal(problem.bound)
    w = "all disturbances" if chosen.all_of else f"disturbances {', '.join(map(str, chosen.inputs))}"
    z = "all performance outputs" if chosen.all_of else f"performance outputs {', '.join(map(str, chosen.outputs))}"
    if problem.measure == "peak":
        return (f"stable, and from zero state the Euclidean norm of {z} never exceeds {bound} times the largest "
                f"Euclidean norm of {w}")
    name = "H-infinity" if problem.measure == "hinf" else "H2"
    return f"stable, and its {name} norm from {w} to {z} is below {bound}"


def _plural(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"


def prove(problem: ClosedLoop) -> Proof:
    """Form the loop exactly, then prove the measure as the kinds of linear systems do."""
    loop = form_loop(problem)
    if loop is None:
        return Proof(False, "the loop is not well-posed: det(1 - D_K D22) is zero")
    if problem.measure == "stability":
        proof = _stability.prove(_stability.Stability(loop, problem.rate, problem.method, problem.matrix))
    elif problem.measure == "hinf":
        proof = _hinf.prove(_hinf.Hinf(loop, problem.bound, None, None, problem.method, problem.matrix, ""))
    elif problem.measure == "h2":
        proof = prove_h2(loop, problem.bound, problem.matrix)
    elif problem.measure == "peak":
        proof = _peak.prove(_peak.Peak(loop, problem.bound, problem.method, problem.matrix, problem.decay,
                                       problem.share))
    else:
        proof = prove_region(loop, problem.poles, problem.matrix)
    return Proof(proof.valid, f"loop well-posed; {proof.reason}" if proof.valid else proof.reason)


def form_loop(problem: ClosedLoop) -> LinearSystem | None:
    """Return the loop from the chosen disturbances to the chosen outputs, exactly; None where it is not well-posed."""
    loop = join_loop(problem.plant, problem.controller, problem.n_meas, problem.n_ctrl)
    if loop is None or problem.measure in ("stability", "region"):  # no disturbance is needed
        return loop
    chosen = problem.channels
    return LinearSystem(loop.A, tuple(tuple(row[j] for j in chosen.inputs) for row in loop.B),
                        tuple(loop.C[i] for i in chosen.outputs),
                        tuple(tuple(loop.D[i][j] for j in chosen.inputs) for i in chosen.outputs), loop.sample_time)


def join_loop(p: LinearSystem, k: LinearSystem, n_meas: int, n_ctrl: int) -> LinearSystem | None:
    """Return the loop of a plant and u = +K y from w to z, exactly; None where it is not well-posed.

    With E = (1 - D_K D22)⁻¹: u = E (D_K C2 x + C_K x_K + D_K D21 w), y = C2 x + D21 w + D22 u. One row and one column
    of zeros stand where there is no w or z.
    """
    n, m, q = p.states, p.inputs - n_ctrl, p.outputs - n_meas
    B1, B2 = _part(p.B, range(n), range(m)), _part(p.B, range(n), range(m, p.inputs))
    C1, C2 = _part(p.C, range(q), range(n)), _part(p.C, range(q, p.outputs), range(n))
    D11, D12 = _part(p.D, range(q), range(m)), _part(p.D, range(q), range(m, p.inputs))
    D21, D22 = _part(p.D, range(q, p.outputs), range(m)), _part(p.D, range(q, p.outputs), range(m, p.inputs))
    A, AK, BK = _part(p.A, range(n), range(n)), _whole(k.A, k.states), _whole(k.B, k.inputs)
    CK, DK = _whole(k.C, k.states), _whole(k.D, k.inputs)
    open_loop = _identity(n_ctrl) - DK * D22
    if open_loop.det() == 0:
        return None
    E = open_loop.inv()
    ux, uk, uw = E * DK * C2, E * CK, E * DK * D21
    yx, yk, yw = C2 + D22 * ux, D22 * uk, D21 + D22 * uw
    A_loop = _join([[A + B2 * ux, B2 * uk], [BK * yx, AK + BK * yk]])
    if not m or not q:
        size = n + k.states
        return LinearSystem(A_loop, ((fmpq(0),),) * size, ((fmpq(0),) * size,), ((fmpq(0),),), p.sample_time)
    return LinearSystem(A_loop, _join([[B1 + B2 * uw], [BK * yw]]), _join([[C1 + D12 * ux, D12 * uk]]),
                        _join([[D11 + D12 * uw]]), p.sample_time)


def _part(matrix: Rows, rows: range, columns: range) -> fmpq_mat:
    return fmpq_mat(len(rows), len(columns), [matrix[i][j] for i in rows for j in columns])


def _whole(matrix: Rows, columns: int) -> fmpq_mat:
    return fmpq_mat(len(matrix), columns, [entry for row in matrix for entry in row])


def _identity(size: int) -> fmpq_mat:
    return fmpq_mat(size, size, [fmpq(int(i == j)) for i in range(size) for j in range(size)])


def _join(blocks: list[list[fmpq_mat]]) -> Rows:
    rows: list[tuple[fmpq, ...]] = []
    for line in blocks:
        tables = [block.tolist() for block in line]
        rows += [tuple(entry for table in tables for entry in table[i]) for i in range(line[0].nrows())]
    return tuple(rows)


def find_margin(problem: ClosedLoop) -> dict[str, float]:
    """Return no margin: the bound is the claim."""
    return {}


CLOSED_LOOP = Kind("closed_loop", read, claim, prove, find_margin)
