"""What `calibrate` refuses: options, data and parameters that make no sense together."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .._arrays import Floats
from ..errors import InputError
from ..fitting import LOSSES, STARTS, Problem, Ranges, Start
from ..identify import FrequencyResponse
from ..thermal import System
from ._joint import JointProblem

METHODS = ("output_error", "prediction_error")


def check_options(system: System, initial: str, loss: str, max_iterations: int, method: str) -> None:
    """Words and numbers that are none of those allowed."""
    if not isinstance(system, System):
        raise InputError(f"system is a {type(system).__name__}", where="argument system",
                         expected="a robthermal.System", remedy="Read one with rt.read_system(path).")
    for name, value, allowed in (("initial", initial, STARTS), ("loss", loss, LOSSES), ("method", method, METHODS)):
        if value not in allowed:
            raise InputError(f"{name} is {value!r}", where=f"argument {name}", expected="one of " + ", ".join(allowed))
    if isinstance(max_iterations, bool) or not isinstance(max_iterations, int) or max_iterations < 1:
        raise InputError(f"max_iterations is {max_iterations!r}", where="argument max_iterations",
                         expected="a positive whole number")


def refuse_idle_options(records: bool, responses: bool, operating_point: object, initial: str, loss: str,
                         noise: object, method: str) -> None:
    """Options that say nothing about the data at hand."""
    if operating_point is not None and not responses:
        raise InputError("operating_point is given with a record", where="argument operating_point",
                         remedy="Leave it out: a record brings its own inputs.")
    given = {"initial": initial != "free", "loss": loss != "linear", "noise": noise is not None,
             "method": method != "output_error"}
    for name in (name for name, said in given.items() if said and not records):
        raise InputError(f"{name} is given with a frequency response", where=f"argument {name}",
                         expected="parameters, validation, max_iterations and operating_point only",
                         remedy="Leave it out, or calibrate on a record too.")


def refuse_same_response(training: list[FrequencyResponse], validation: list[FrequencyResponse]) -> None:
    """A response validates nothing that it was fitted to."""
    for one in validation:
        for other in training:
            same = one.input_names == other.input_names and one.output_names == other.output_names
            if same and np.array_equal(one.response, other.response, equal_nan=True):
                raise InputError(f"the validation response ({one.method}) is the training response",
                                 where="argument validation", expected="data the fit has not seen",
                                 remedy="Estimate one response from each half of the records.")


def refuse_unknown_noise(levels: Mapping[str, float]) -> None:
    """A filter weighs declared noise."""
    unknown = [name for name, level in levels.items() if not level]
    if unknown:
        raise InputError(f"the noise of sensor {unknown[0]!r} is not declared", where="argument method",
                         expected="declared noise of every sensor: a filter weighs it against the lumps' disturbance",
                         remedy=f'Give `noise` in [sensors.{unknown[0]}], or pass noise={{"{unknown[0]}": 0.1}}.')


def refuse_double_start(ranges: Ranges, initial: Start) -> None:
    """An initial temperature that is both a parameter and free."""
    named = [name for name in ranges.flat if name.startswith("lumps.") and name.endswith(".initial")]
    if named and initial != "system":
        raise InputError(f"{named[0]!r} is a parameter, but initial is {initial!r}", where="argument parameters",
                         remedy='Leave it out (a free start estimates it for every record), or use initial="system".')


def refuse_idle(joint: JointProblem, v: Floats) -> None:
    """A parameter that no reading and no response feels."""
    problem, ranges = joint.records, joint.ranges
    reach = np.zeros(len(ranges.names))
    for run in problem.runs(v):
        reach = np.maximum(reach, np.abs(run.by_parameter).max(axis=(0, 1), initial=0.0))
    for one in joint.responses:
        reach = np.maximum(reach, np.abs(one.jacobian(v[:reach.size])).max(axis=0, initial=0.0))
    idle = np.flatnonzero(reach * ranges.spread < 1e-9)
    if idle.size and not problem.data:
        raise InputError(f"{ranges.names[idle[0]]!r} has no influence on the frequency response", where="argument data",
                         expected="parameters that change the linearization (offsets and temperatures may not)",
                         remedy="Take it out of the parameters, or give a record too.")
    if idle.size:
        name = ranges.names[idle[0]]
        raise InputError(f"{name!r} has no influence on any reading{_why_idle(problem, name)}", where="argument data",
                         expected="data that excite every parameter",
                         remedy="Take it out of the parameters, or use a record that excites it.")


def _why_idle(problem: Problem, name: str) -> str:
    table, _, rest = name.partition(".")
    for source in (*problem.system.input_names, *problem.system.module_names):
        if table in ("inputs", "modules") and rest.startswith(f"{source}.") and not any(
                np.any(one.record[source]) for one in problem.data):
            return f": {'heater' if table == 'inputs' else 'module'} {source!r} is never on"
    return ""
