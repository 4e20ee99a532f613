"""`calibrate`: parameters from records by output-error least squares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, overload

import numpy as np
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from .._arrays import Floats
from ..errors import Diverged, InputError
from ..fitting import (
    LOSSES,
    STARTS,
    Choice,
    Data,
    Loss,
    Problem,
    Ranges,
    Start,
    Weigh,
    as_data,
    chosen_ranges,
    declared_noise,
    estimated_noise,
    free_run,
    initial_of,
    refuse_same,
    refuse_short,
    scaled,
    scipy_loss,
    smallest_noise,
)
from ..identify import FrequencyResponse
from ..signals import Record
from ..thermal import System
from ._covariance import information
from ._directions import in_words, named, weights
from ._estimates import outcome_of
from ._fit import Fit
from ._innovations import has_disturbance, whitener
from ._outcomes import CalibrationCode
from ._response_fit import ResponseFit, calibrate_response
from ._score import score_of
from ._whiteness import whiteness_of

Method = Literal["output_error", "prediction_error"]
METHODS = ("output_error", "prediction_error")
_ROUNDS = 8  # of noise estimation
_SETTLED = 0.01  # relative change of the noise levels
_STILL = 1e-3  # change of the parameters between two filters, in `Ranges.unit`


@overload
def calibrate(system: System, data: FrequencyResponse, *, parameters: Choice = None, max_iterations: int = 50,
              operating_point: Mapping[str, float] | None = None) -> ResponseFit: ...


@overload
def calibrate(system: System, data: Record | Sequence[Record], *, parameters: Choice = None,
              validation: Record | Sequence[Record] | None = None, initial: Start = "free", loss: Loss = "linear",
              noise: Mapping[str, float] | float | None = None, max_iterations: int = 50,
              method: Method = "output_error") -> Fit: ...


@threadpool_limits.wrap(limits=1, user_api="blas")  # products are small: threads only wait for each other
def calibrate(system: System, data: Record | Sequence[Record] | FrequencyResponse, *, parameters: Choice = None,
              validation: Record | Sequence[Record] | None = None, initial: Start = "free", loss: Loss = "linear",
              noise: Mapping[str, float] | float | None = None, max_iterations: int = 50,
              method: Method = "output_error",
              operating_point: Mapping[str, float] | None = None) -> Fit | ResponseFit:
    """Estimate parameters of a system from records (exact derivatives) or a frequency response: least squares.

    Parameters
    ----------
    system : System
        With starting values.
    data : Record, list of Record, or FrequencyResponse
        Measured. Several records share the parameters; each has its own initial temperatures. To a frequency response
        the linearization is fitted, weighted by its covariance, Evers (2.12); then only `parameters`, `max_iterations`
        and `operating_point` apply.
    parameters : iterable of str or mapping, optional
        What may change: names from the system's fit table, or a mapping from name to (lower, upper) or `FitRange`, in
        the unit of the parameter, temperatures in kelvin. A tuple of names as key ties them to one value,
        called "a = b" in the result. Default: the whole fit table.
    validation : Record or list of Record, optional
        Data the fit does not see; free runs on them are scored, with initial temperatures from their first tenth.
    initial : {"free", "measured", "system"}
        Initial lump temperatures: unknown, with a prior of max(5 K, spread of the first readings) around the nearest
        sensor's first reading; fixed to that reading; or fixed to the file's values, where it has them.
    loss : {"linear", "soft_l1", "huber"}
        The last two resist glitches: beyond 1.345 standard deviations a residual counts linearly.
    noise : mapping or float, optional
        Standard deviation of the sensors [K; V of a voltage]. Default: as declared in the system, but not below
        step/√12 of a quantized reading; where the declaration is 0 it is estimated from the residuals.
    max_iterations : int
        Limit of the optimizer's steps.
    method : {"output_error", "prediction_error"}
        What is made small: the residuals of a free run, or the innovations of a Kalman filter, which knows the lumps'
        `disturbance` and the sensors' noise (which must then be declared). Without any disturbance both are the same.
    operating_point : mapping, optional
        For a frequency response of a nonlinear system: heaters [unit], module currents [A] and ambients [K] at whose
        steady state it was measured; default off and nominal.

    Returns
    -------
    Fit or ResponseFit

    Raises
    ------
    InputError
        Nothing to fit, no sensor in a record, unknown names, bounds that exclude the start, a parameter without any
        influence, fewer readings than unknowns, validation on the training data.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.1}})
    >>> heater = np.repeat([4.0, 0.0, 6.0, 2.0], 50)
    >>> empty = rt.Record(sample_time=10.0, inputs=heater, outputs=np.zeros((200, 0)), input_names=["heater"],
    ...                   output_names=[])
    >>> run = rt.thermal.simulate(bar, empty)
    >>> noisy = run.with_outputs(run.outputs + 0.1 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> start = bar.with_parameters({"lumps.bar.capacity": 60.0, "links.bar-room.conductance": 1.0})
    >>> fit = rt.calibrate(start, noisy, parameters={"lumps.bar.capacity": (10.0, 500.0),
    ...                                              "links.bar-room.conductance": (0.1, 5.0)})
    >>> round(fit.parameters["lumps.bar.capacity"]), fit.outcome.code
    (100, 'converged')
    >>> low, high = fit.ranges(0.95)["lumps.bar.capacity"]
    >>> low < 100.0 < high < 101.0
    True
    """
    _check_options(system, initial, loss, max_iterations, method)
    if isinstance(data, FrequencyResponse):
        _refuse_time_options(validation, initial, loss, noise, method)
        return calibrate_response(system, data, parameters, operating_point or {}, max_iterations)
    if operating_point is not None:
        raise InputError("operating_point is given with a record", where="argument operating_point",
                         remedy="Leave it out: a record brings its own inputs.")
    ranges = chosen_ranges(system, parameters)
    training = as_data(system, data, "data")
    held_out = as_data(system, validation, "validation") if validation is not None else []
    refuse_same(training, held_out)
    _refuse_double_start(ranges, initial)
    starts = [initial_of(system, one, initial) for one in training]
    refuse_short(training, len(ranges.names))
    problem = Problem(system, training, ranges, starts)
    levels = declared_noise(system, training, noise)
    filtered = method == "prediction_error" and has_disturbance(system)
    if filtered:
        _refuse_unknown_noise(levels)
    solution = _solve(problem, levels, loss, max_iterations, filtered)
    return _result(problem, solution, held_out, initial, loss)


@dataclass(frozen=True)
class Solution:
    """Where the optimizer ended: unknowns, noise levels, its status and iterations."""

    v: Floats
    noise: dict[str, float]
    converged: bool
    iterations: int


def _solve(problem: Problem, declared: dict[str, float], loss: Loss, max_iterations: int, filtered: bool) -> Solution:
    """Minimize; weights that depend on the fit (an undeclared noise, a filter) are renewed and the fit repeated."""
    unknown = [name for name, level in declared.items() if not level]
    v = problem.v0
    noise = dict(declared) | _levels(problem, v, unknown, loss)
    _refuse_idle(problem, v)
    left, enough = max_iterations, min(1e-6, 0.01 / problem.n_readings)  # of the cost: a small part of its own scatter
    for _ in range(_ROUNDS):
        problem.weigh = _weights(problem, v, noise, filtered)
        run = least_squares(problem.vector, v, problem.jacobian, bounds=problem.bounds, x_scale="jac",
                            loss=scipy_loss(loss, problem.n_readings), max_nfev=left, ftol=enough, xtol=1e-9, gtol=1e-9)
        moved = np.abs(run.x - v)[:len(problem.ranges.names)] / problem.ranges.unit
        v, left = run.x, left - run.nfev
        new = _levels(problem, v, unknown, loss)
        settled = all(abs(new[name] / noise[name] - 1.0) < _SETTLED for name in unknown)
        settled = settled and not (filtered and moved.max() > _STILL)
        if settled or left < 1 or run.status == 0:
            break
        noise |= new
    return Solution(v, noise, run.status > 0 and settled, max_iterations - left)


def _weights(problem: Problem, v: Floats, noise: dict[str, float], filtered: bool) -> list[Weigh]:
    levels = [np.array([noise[name] for name in one.sensors]) for one in problem.data]
    if not filtered:
        return [scaled(level) for level in levels]
    systems = problem.systems(v)
    return [whitener(system, one, level) for system, one, level in zip(systems, problem.data, levels, strict=True)]


def _levels(problem: Problem, v: Floats, unknown: list[str], loss: Loss) -> dict[str, float]:
    try:
        residuals = problem.residuals(v)
    except Diverged as error:
        raise InputError(f"the model runs away at the starting values: {error}", where="argument system",
                         remedy="Start closer to the truth: system.with_parameters({...}).") from None
    return {name: estimated_noise(problem.data, residuals, name, loss, smallest_noise(problem.system, name))
            for name in unknown}


def _result(problem: Problem, solution: Solution, held_out: list[Data], initial: Start, loss: Loss) -> Fit:
    ranges, v = problem.ranges, solution.v
    values = problem.parameters(v)
    known = information(problem, v, loss)
    slopes = ranges.slopes(values)
    residuals = problem.residuals(v)
    system = problem.system.with_parameters(ranges.assigned(values))
    checks = [free_run(system, one, initial, solution.noise) for one in held_out]
    fit = Fit(
        system=system,
        parameters=dict(zip(ranges.names, values.tolist(), strict=True)),
        start=dict(zip(ranges.names, ranges.start.tolist(), strict=True)),
        lower=ranges.lower, upper=ranges.upper, sigma=ranges.sigma, at_bound=ranges.at_bound(values),
        covariance=known.covariance * np.outer(slopes, slopes),
        undetermined=in_words(ranges, known.undetermined),
        undetermined_parameters=named(ranges, known.undetermined), bounded=weights(ranges, known.bounded),
        logarithmic=ranges.logarithmic, degrees_of_freedom=known.degrees_of_freedom, covariance_scale=known.scale,
        noise=solution.noise,
        data=tuple(one.record for one in problem.data),
        validation_data=tuple(one.record for one in held_out),
        residuals=tuple(_by_sensor(one, r) for one, r in zip(problem.data, residuals, strict=True)),
        validation_residuals=tuple(run.by_sensor for run in checks),
        initial_temperatures=tuple(_by_lump(system, T) for T in problem.temperatures(v)),
        validation_temperatures=tuple(_by_lump(system, run.initial_temperatures) for run in checks),
        train=tuple(score_of(one, r) for one, r in zip(problem.data, residuals, strict=True)),
        validation=tuple(score_of(run.one, run.residual) for run in checks),
        whiteness={name: whiteness_of([weigh(r)[:, one.sensors.index(name)] for one, r, weigh
                                       in zip(problem.data, residuals, problem.weigh, strict=True)
                                       if name in one.sensors])
                   for name in solution.noise},
        iterations=solution.iterations,
        outcome=CalibrationCode.CONVERGED.outcome(),
    )
    return replace(fit, outcome=outcome_of(fit, solution.converged))


def _by_sensor(one: Data, values: Floats) -> dict[str, Floats]:
    return {name: values[:, i] for i, name in enumerate(one.sensors)}


def _by_lump(system: System, temperatures: Floats) -> dict[str, float]:
    return dict(zip(system.lump_names, temperatures.tolist(), strict=True))


def _check_options(system: System, initial: str, loss: str, max_iterations: int, method: str) -> None:
    if not isinstance(system, System):
        raise InputError(f"system is a {type(system).__name__}", where="argument system",
                         expected="a robthermal.System", remedy="Read one with rt.read_system(path).")
    for name, value, allowed in (("initial", initial, STARTS), ("loss", loss, LOSSES), ("method", method, METHODS)):
        if value not in allowed:
            raise InputError(f"{name} is {value!r}", where=f"argument {name}", expected="one of " + ", ".join(allowed))
    if isinstance(max_iterations, bool) or not isinstance(max_iterations, int) or max_iterations < 1:
        raise InputError(f"max_iterations is {max_iterations!r}", where="argument max_iterations",
                         expected="a positive whole number")


def _refuse_time_options(validation: object, initial: str, loss: str, noise: object, method: str) -> None:
    given = {"validation": validation is not None, "initial": initial != "free", "loss": loss != "linear",
             "noise": noise is not None, "method": method != "output_error"}
    for name in (name for name, said in given.items() if said):
        raise InputError(f"{name} is given with a frequency response", where=f"argument {name}",
                         expected="parameters, max_iterations and operating_point only",
                         remedy="Leave it out, or calibrate on the record itself.")


def _refuse_unknown_noise(levels: Mapping[str, float]) -> None:
    unknown = [name for name, level in levels.items() if not level]
    if unknown:
        raise InputError(f"the noise of sensor {unknown[0]!r} is not declared", where="argument method",
                         expected="declared noise of every sensor: a filter weighs it against the lumps' disturbance",
                         remedy=f'Give `noise` in [sensors.{unknown[0]}], or pass noise={{"{unknown[0]}": 0.1}}.')


def _refuse_double_start(ranges: Ranges, initial: Start) -> None:
    named = [name for name in ranges.flat if name.startswith("lumps.") and name.endswith(".initial")]
    if named and initial != "system":
        raise InputError(f"{named[0]!r} is a parameter, but initial is {initial!r}", where="argument parameters",
                         remedy='Leave it out (a free start estimates it for every record), or use initial="system".')


def _refuse_idle(problem: Problem, v: Floats) -> None:
    """A parameter that no reading feels."""
    ranges = problem.ranges
    reach = np.zeros(len(ranges.names))
    for run in problem.runs(v):
        reach = np.maximum(reach, np.abs(run.by_parameter).max(axis=(0, 1), initial=0.0))
    idle = np.flatnonzero(reach * ranges.spread < 1e-9)
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
