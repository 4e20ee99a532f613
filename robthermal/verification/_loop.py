"""Kind "loop": a sampled controller with feedback linearisation and limiter makes the nonlinear plant forget its start.

v = C z + D x + (set-points), I = law(v, x) limited to its range and held over the sample,
z+ = A z + B x + windup (achieved - v) + (set-points). One norm e'Pe of the differences in (x, z) shrinks with every
sample, for every limiter active or not, every temperature and current of the box (proof note, loops).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from flint import arb, arb_mat, fmpq

from robthermal.errors import InputError

from ._definite import approximate, is_positive_preconditioned
from ._fields import get, mapping, margin_of, no_other, not_negative, numbers, positive, sequence, text
from ._flow import flow_growth
from ._growth import Growth
from ._kind import Kind, Proof, working_precision
from ._loop_growth import growth
from ._loop_problem import Controller, Loop, Rows
from ._lyapunov import MOST_ROWS, asymmetry
from ._numbers import decimal, exact, name_of, round_down, show
from ._observer import Sensor, read_sensors, say_sensors
from ._system import ThermalSystem, read_region, read_system, say_region
from ._uncertain import Parameters, read_parameters, say_subject, worst_system

_PLANTS = {"continuous": "continuous plant (currents held and temperatures moving continuously in between)",
           "held": "sampled model with held heat (x+ = A_d x + Γ f(x, I), the heat f of the modules held in between)"}
_PIECES = 16


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Loop:
    """Return the exact problem, or raise InputError."""
    nominal = read_system(system)
    box, table, found = read_region(region, nominal), mapping(region, "region"), mapping(evidence, "evidence")
    no_other(table, ("temperature", "current", "sample_time", "plant", "drift", "parameters"), "region")
    parameters = _links_only(read_parameters(region), table.get("plant", "continuous"))
    network = worst_system(nominal, system, parameters)
    if not network.modules:
        raise InputError("no module to drive", where="system.modules", expected="at least one")
    n, m = len(network.lumps), len(network.modules)
    controller = _controller(get(system, "controller", "system"), n, m)
    plant = text(table.get("plant", "continuous"), "region.plant")
    if plant not in _PLANTS:
        raise InputError(f"plant {name_of(plant)}", where="region.plant", expected=f"one of {sorted(_PLANTS)}")
    contraction = positive(get(found, "contraction", "evidence"), "evidence.contraction")
    if contraction > 1:
        raise InputError(f"contraction {show(contraction)}", where="evidence.contraction", expected="at most 1")
    pieces = exact(found.get("pieces", 1), "evidence.pieces")
    if pieces.q != 1 or not 1 <= pieces <= _PIECES:
        raise InputError(f"pieces {show(pieces)}", where="evidence.pieces", expected=f"an integer from 1 to {_PIECES}")
    sensors, gain = _observer(system, nominal)
    start = sequence(found.get("start", []), "evidence.start")
    if sensors is not None and (not start or plant != "continuous" or parameters):
        raise InputError("an observer in the loop", where="system.gain",
                         expected="plant 'continuous', nominal parameters and evidence.start")
    if start and ("drift" in table or plant != "continuous"):
        raise InputError("matrices for the start of a sample", where="evidence.start",
                         expected="only for plant 'continuous', without a drift")
    size = n + len(controller.A) + (n if sensors is not None else 0)
    return Loop(network, box, controller, positive(get(table, "sample_time", "region"), "region.sample_time"), plant,
                not_negative(table["drift"], "region.drift") if "drift" in table else None, contraction,
                margin_of(margin, "contraction"), _matrix(get(found, "matrix", "evidence"), size, size,
                                                          "evidence.matrix"),
                int(pieces.p), _list(found.get("weights", []), "evidence.weights"),
                _list(found.get("sizes", []), "evidence.sizes"), parameters,
                tuple(_matrix(item, size + m, size + m, f"evidence.start[{k}]") for k, item in enumerate(start)),
                sensors, gain)


def _observer(system: Any, network: ThermalSystem) -> tuple[tuple[Sensor, ...] | None, Rows]:
    """Return sensors and gain of the observer whose estimates feedback law and controller use, None without one."""
    if "gain" not in system:
        return None, ()
    sensors = read_sensors(system, network)
    return sensors, _matrix(system["gain"], len(network.lumps), len(sensors), "system.gain")


def _links_only(parameters: Parameters, plant: Any) -> Parameters:
    """Refuse what the proof does not cover: the feedback law knows the modules, the sampled model the network."""
    for name, _ in parameters:
        if not name.startswith("links."):
            raise InputError("only conductances of links can be uncertain in a loop",
                             where=f"region.parameters[{name_of(name)}]", expected="links.NAME.conductance")
    if parameters and plant != "continuous":
        raise InputError("uncertain links need the plant in continuous time", where="region.parameters",
                         expected="plant 'continuous'")
    return parameters


def claim(problem: Loop, machine: str) -> str:
    """Return the one sentence the data give."""
    states = len(problem.controller.A)
    speed = (f"shrinks at least by the factor {decimal(problem.contraction)}² per sample" if problem.contraction < 1
             else "shrinks strictly with every sample")
    moves = ("" if problem.drift is None else
             f" or moves a face of a module by more than {decimal(problem.drift)} K within a sample")
    subject = say_subject(problem.system, problem.parameters, machine, _PLANTS[problem.plant])
    read, stay, differences = "the true temperatures", "no trajectory from this box leaves it", "temperatures"
    if problem.sensors is not None:
        read = ("the estimates of the observer x^+ = A_d x^ + Γ f(x^, I) + L (y - C x^) with sensors "
                f"{say_sensors(problem.sensors, problem.system)}, f held in its model")
        stay = ("temperatures and estimates both stay in this box of temperatures (that they do is not part of this "
                "claim)")
        differences = "temperatures, estimates"
    who = "between any two trajectories under the same set-points, ambients and heat loads"
    return (f"The closed loop of the {subject}, with its controller ({states} state{'' if states == 1 else 's'}) "
            f"sampled every {decimal(problem.sample_time)} s, heats turned into currents by feedback "
            f"linearisation at {read}, contracts for all "
            f"{say_region(problem.system, problem.region)}, the current ranges being its limits: provided that "
            f"{stay}{moves}, e'Pe of the differences in {differences} and controller states {who} {speed}.")


def prove(problem: Loop) -> Proof:
    """Prove the inequality over the box, with the stored margin taken off the contraction."""
    with working_precision():
        found = _growth(problem)
        if isinstance(found, str):
            return Proof(False, found)
        extra = max(problem.margin, fmpq(0))
        failed = _failure(problem, found, problem.contraction - extra)
        if failed is None:
            return Proof(True, f"e+'Pe+ < {decimal(problem.contraction - extra)}² e'Pe at all {found.count} "
                               "combinations of slopes", {"contraction": round_down(extra)})
        if extra > 0 and _failure(problem, found, problem.contraction) is None:
            return Proof(False, f"stored margin {show(extra)} is larger than what can be proven: {failed}")
    return Proof(False, failed)


def find_margin(problem: Loop) -> dict[str, float]:
    """Return how much smaller a contraction the same evidence proves, to a tenth of what is left to 1."""
    with working_precision():
        found = _growth(problem)
        if isinstance(found, str):
            return {"contraction": 0.0}
        found = replace(found, cases=list(found.cases))  # computed once, tested many times
        low, high = 0.0, (1 - round_down(problem.contraction)) or 1e-3
        for _ in range(8):
            middle = (low + high) / 2
            proven = _failure(problem, found, problem.contraction - fmpq(*middle.as_integer_ratio())) is None
            low, high = (middle, high) if proven else (low, middle)
    return {"contraction": float(f"{low * 0.999:.4g}") if low > 0 else 0.0}


def _growth(problem: Loop) -> Growth | str:
    """Return what e'Pe can become after one sample, after all checks that do not depend on the contraction."""
    broken = [asymmetry(matrix) for matrix in (problem.matrix, *problem.start)]
    if any(broken):
        return next(filter(None, broken))
    if len(problem.matrix) > MOST_ROWS:
        return f"a matrix with {len(problem.matrix)} rows is too large to check, at most {MOST_ROWS}"
    P = arb_mat([[arb(entry) for entry in row] for row in problem.matrix])
    if not is_positive_preconditioned(P, approximate(P)):
        return "P > 0 fails or cannot be proven"
    try:
        return flow_growth(problem, P) if problem.start else growth(problem, P)
    except ZeroDivisionError:
        return "a matrix has no inverse, or none can be proven"


def _failure(problem: Loop, found: Growth, contraction: fmpq) -> str | None:
    if contraction <= 0:
        return f"contraction {show(contraction)} is not positive"
    limit = arb_mat([[arb(entry * contraction**2) for entry in row] for row in problem.matrix])
    for after, where in found.cases:
        rest = limit - after
        if not is_positive_preconditioned(rest, approximate(rest)):
            return f"e+'Pe+ < {show(contraction)}² e'Pe fails or cannot be proven with {where}"
    return None


def _controller(value: Any, n: int, m: int) -> Controller:
    table, where = mapping(value, "system.controller"), "system.controller"
    no_other(table, ("A", "B", "C", "D", "windup"), where)
    q = len(sequence(get(table, "A", where), f"{where}.A"))
    shapes = {"A": (q, q), "B": (q, n), "C": (m, q), "D": (m, n), "windup": (q, m)}
    return Controller(**{key: _matrix(get(table, key, where), *shape, f"{where}.{key}")
                         for key, shape in shapes.items()})


def _matrix(value: Any, rows: int, columns: int, where: str) -> Rows:
    found = sequence(value, where)
    if len(found) != rows:
        raise InputError(f"{len(found)} rows", where=where, expected=f"{rows}")
    return tuple(tuple(numbers(row, columns, f"{where}[{k}]")) for k, row in enumerate(found))


def _list(value: Any, where: str) -> tuple[fmpq, ...]:
    items: Sequence[Any] = sequence(value, where)
    return tuple(exact(item, f"{where}[{k}]") for k, item in enumerate(items))


LOOP = Kind("loop", read, claim, prove, find_margin)
