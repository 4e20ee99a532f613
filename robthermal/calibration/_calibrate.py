"""`calibrate`: parameters from records and frequency responses by weighted least squares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from threadpoolctl import threadpool_limits

from .._arrays import Floats
from ..fitting import (
    Choice,
    Data,
    Loss,
    Measured,
    MeasuredResponse,
    Problem,
    Start,
    as_data,
    chosen_ranges,
    counted,
    declared_noise,
    free_run,
    initial_of,
    measured_of,
    measured_response,
    mended,
    misread,
    refuse_same,
    refuse_short,
    rmse,
    rmse_by_sensor,
    without_steps,
)
from ..signals import Record
from ..thermal import System
from ._directions import in_words, named, weights
from ._estimates import outcome_of
from ._fit import Fit
from ._innovations import has_disturbance
from ._joint import JointProblem
from ._other_optimum import with_exchanged_lags
from ._outcomes import CalibrationCode
from ._refusals import (
    check_options,
    refuse_double_start,
    refuse_idle_options,
    refuse_same_response,
    refuse_unknown_noise,
)
from ._remarks import missed, remarks_of
from ._response_comparison import comparison_of
from ._response_model import ResponseProblem
from ._score import score_of
from ._solution import Solution, from_rest, solve
from ._whiteness import whiteness_of

Method = Literal["output_error", "prediction_error"]


@threadpool_limits.wrap(limits=1, user_api="blas")  # products are small: threads only wait for each other
def calibrate(system: System, data: Measured | Sequence[Measured], *, parameters: Choice = None,
              validation: Measured | Sequence[Measured] | None = None, initial: Start = "free",
              loss: Loss = "linear", noise: Mapping[str, float] | float | None = None, max_iterations: int = 200,
              method: Method = "output_error", operating_point: Mapping[str, float] | None = None) -> Fit:
    """Estimate parameters of a system from records, frequency responses or both: one weighted least squares.

    Parameters
    ----------
    system : System
        With starting values.
    data : Record, FrequencyResponse, or list of them
        Measured; all share the parameters. Every record has its own initial temperatures. To a frequency response the
        linearization is fitted, weighted by its covariance, Evers (2.12). Give a response of other experiments than the
        records: the same readings would count twice.
    parameters : iterable of str or mapping, optional
        What may change: names from the system's fit table, or a mapping from name to (lower, upper) or `FitRange`, in
        the unit of the parameter, temperatures in kelvin. A tuple of names as key ties them to one value,
        called "a = b" in the result. Default: the whole fit table.
    validation : Record, FrequencyResponse, or list of them, optional
        Data the fit does not see. Free runs on records are scored, with initial temperatures from their first tenth, or
        from all of a record where a tenth leaves them open (a body without a thermometer); to responses the misfit is
        given.
    initial : {"free", "measured", "system"}
        Initial lump temperatures: unknown, with a prior of max(5 K, spread of the first readings) around the nearest
        sensor's first reading; fixed to that reading; or fixed to the file's values, where it has them.
    loss : {"linear", "soft_l1", "huber"}
        The last two resist glitches in records: beyond 1.345 standard deviations a residual counts linearly.
    noise : mapping or float, optional
        Standard deviation of the sensors [K; V of a voltage]. Default: as declared in the system, but not below
        step/√12 of a quantized reading; where the declaration is 0 it is estimated from the residuals.
    max_iterations : int
        Limit of the optimizer's steps.
    method : {"output_error", "prediction_error"}
        What is made small: the residuals of a free run, or the innovations of a Kalman filter, which knows the lumps'
        `disturbance` and the sensors' noise (which must then be declared). Without any disturbance both are the same.
    operating_point : mapping, optional
        For frequency responses of a nonlinear system: heaters [unit], module currents [A] and ambients [K] at whose
        steady state they were measured. Default, one by one: `FrequencyResponse.operating_point`, the means of its
        records; else off and nominal.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        Nothing to fit, no sensor in a record, unknown names, bounds that exclude the start, a parameter without any
        influence, fewer readings than unknowns, validation on the training data, a response without covariance, options
        that say nothing about the data given.

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
    check_options(system, initial, loss, max_iterations, method)
    records, responses = measured_of(data, "data")
    beside, responses_beside = measured_of(validation, "validation") if validation is not None else ([], [])
    rows = mended(system, records, beside, lambda held: calibrate(
        system, [*held, *responses], parameters=parameters, initial=initial, loss=loss, noise=noise,
        max_iterations=max_iterations, method=method, operating_point=operating_point).system)
    records, beside = rows.records, rows.validation
    refuse_idle_options(bool(records), bool(responses or responses_beside), operating_point, initial, loss, noise,
                        method)
    ranges = chosen_ranges(system, parameters)
    training = as_data(system, records, "data") if records else []
    held_out = as_data(system, beside, "validation") if beside else []
    refuse_same(training, held_out)
    refuse_same_response(responses, responses_beside)
    refuse_double_start(ranges, initial)
    levels = declared_noise(system, training, noise)
    training, held_out = ([without_steps(system, one, levels) for one in some] for some in (training, held_out))
    starts = [initial_of(system, one, initial) for one in training]
    point = operating_point or {}
    problem = JointProblem(Problem(system, training, ranges, starts), tuple(
        ResponseProblem(system, measured_response(system, G, "data", point, thinned=False), ranges) for G in responses))
    compared = [measured_response(system, G, "validation", point, thinned=False) for G in responses_beside]
    refuse_short(problem.n_numbers, len(ranges.names))
    filtered = method == "prediction_error" and has_disturbance(system)
    if filtered:
        refuse_unknown_noise(levels)
    solution = from_rest(problem, lambda one: solve(one, levels, loss, max_iterations, filtered))
    solution, others, either = with_exchanged_lags(
        solution, loss, lambda one, v: solve(one, levels, loss, max_iterations, filtered, v))
    said = " ".join([*rows.said, *rows.doubted])
    if training and not responses:
        def fitted(others: list[Record]) -> float:
            data = as_data(system, others, "data")
            starts = [initial_of(system, one, initial) for one in data]
            again = JointProblem(Problem(system, data, ranges, starts), ())
            return _rms(from_rest(again, lambda one: solve(one, levels, loss, max_iterations, filtered)))

        left = _rms(solution)
        said = " ".join(filter(None, [said, misread(system, training, left, left, levels, fitted)]))
    return replace(_result(solution, held_out, compared, initial, loss, (said, either)), other_optima=others)


def _result(solution: Solution, held_out: list[Data], compared: list[MeasuredResponse], initial: Start, loss: Loss,
            said: tuple[str, ...]) -> Fit:
    joint, v = solution.problem, solution.v
    problem, ranges = joint.records, joint.ranges
    values = problem.parameters(v)
    known = joint.information(v, loss)
    slopes = ranges.slopes(values)
    residuals = problem.residuals(v)
    system = problem.system.with_parameters(ranges.assigned(values))
    checks = [free_run(system, one, initial, solution.noise) for one in held_out]
    by_sensor = [_by_sensor(one, r) for one, r in zip(problem.data, residuals, strict=True)]
    far = missed(system, rmse_by_sensor(by_sensor), checks, solution.noise)
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
        residuals=tuple(by_sensor),
        validation_residuals=tuple(run.by_sensor for run in checks),
        initial_temperatures=tuple(_by_lump(system, T) for T in problem.temperatures(v)),
        validation_temperatures=tuple(_by_lump(system, run.initial_temperatures) for run in checks),
        train=tuple(score_of(one, r) for one, r in zip(problem.data, residuals, strict=True)),
        validation=tuple(score_of(run.one, run.residual) for run in checks),
        whiteness={name: whiteness_of([weigh(r)[:, one.sensors.index(name)] for one, r, weigh
                                       in zip(problem.data, residuals, problem.weigh, strict=True)
                                       if name in one.sensors])
                   for name in solution.noise},
        responses=tuple(comparison_of(system, part.one) for part in joint.responses),
        validation_responses=tuple(comparison_of(system, one) for one in compared),
        iterations=solution.iterations,
        outcome=CalibrationCode.CONVERGED.outcome(), remarks=(*filter(None, said), *far, *remarks_of(joint, v)),
    )
    return replace(fit, outcome=outcome_of(fit, solution.converged))


def _rms(solution: Solution) -> float:
    """Of the free-run residual of all records, thermometers [K]; voltages where there are none [V]."""
    records = solution.problem.records
    return rmse(r[:, counted(records.system, one.sensors, solution.noise)]
                for one, r in zip(records.data, records.residuals(solution.v), strict=True))


def _by_sensor(one: Data, values: Floats) -> dict[str, Floats]:
    return {name: values[:, i] for i, name in enumerate(one.sensors)}


def _by_lump(system: System, temperatures: Floats) -> dict[str, float]:
    return dict(zip(system.lump_names, temperatures.tolist(), strict=False))  # lagged thermometers come behind
