"""What a calibration takes for granted about its records, and how much of the parameters hangs on it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from .._celsius import ZERO_CELSIUS
from ..fitting import FreeRun, read_while_changing, rmse, within_steps
from ..thermal import System, parameter_in_words, trajectory
from ._joint import JointProblem

_SAMPLES = 10  # of a mean, for the example
_LITTLE = 5e-4  # relative change of a parameter that is not worth a word
_MISSED = 5.0  # times the residual of the records fitted, and the noise: a validation record that is another matter
_FAR = 3.0  # residuals of so many times the declared noise are more than a declaration somewhat too low


def remarks_of(joint: JointProblem, v: Floats) -> Iterator[str]:
    """What was taken for granted, what follows for the parameters, and what to do, a sentence or three each.

    Parameters
    ----------
    joint : JointProblem
        Problem as weighed last.
    v : ndarray
        Unknowns of its solution.
    """
    problem, ranges = joint.records, joint.ranges
    system, records = problem.system, [one.record for one in problem.data]
    yield from read_while_changing(system, problem.data)
    for name in system.ambients:
        number = f"ambients.{name}.temperature"
        lacking = [one.name or "record" for one in records if name not in one.input_names]
        if not lacking or number in ranges.flat:
            continue
        who = "No record holds" if len(lacking) == len(records) else f"{_listed(lacking)} does not hold"
        changes = [np.asarray(trajectory(at, one.record, sensitivities=[number]).sensitivity[:, one.columns, 0])
                   * (name not in one.record.input_names)
                   for at, one in zip(problem.systems(v), problem.data, strict=True)]
        moved = _most_moved(joint, v, changes)
        yield (f"{who} the temperature of {name}: it was taken to be "
               f"{system.ambients[name].temperature - ZERO_CELSIUS:.4g} °C all the time, as the system says."
               + (f" With 1 K more {moved}." if moved else "") + " Record it as a column; or let it be estimated, "
               f'one value for all records: "{number}" under [fit].')
    if any(one.averaged for one in records):
        changes = [np.gradient(trajectory(at, one.record).readings[:, one.columns], axis=0)
                   * (0.5 / _SAMPLES * one.record.averaged)
                   for at, one in zip(problem.systems(v), problem.data, strict=True)]
        moved = _most_moved(joint, v, changes)
        yield ("The records hold means, which are late or early by up to half a sample of the logger; that is not "
               "estimated here." + (f" If they are late and of {_SAMPLES} samples each, {moved} than it is." if moved
                                    else "") + " `robthermal diagnose` estimates it beside the parameters.")
    yield from within_steps(system, problem.data)
    yield from _beyond_noise(joint, v)


def missed(system: System, fitted: Mapping[str, float], checks: Sequence[FreeRun], noise: Mapping[str, float]
           ) -> Iterator[str]:
    """Validation records that the model misses by far more than those it was fitted to, a sentence each.

    Parameters
    ----------
    system : System
        Calibrated model with its sensors.
    fitted : mapping
        Root mean square residual by sensor over the records that were fitted [K or V].
    checks : sequence of FreeRun
        Of the validation records.
    noise : mapping
        Standard deviation of the sensors [K or V].
    """
    for run in checks:
        found = {name: rmse([e]) for name, e in run.by_sensor.items() if name in fitted}
        usual = {name: max(fitted[name], noise.get(name, 0.0)) for name in found}
        far = [name for name in found if usual[name] and found[name] > _MISSED * usual[name]]
        if far:
            worst = max(far, key=lambda name: found[name] / usual[name])
            unit = system.sensors[worst].unit
            yield (f"{worst} of the validation record {run.one.label!r} is {found[worst]:.2g} {unit} rms off the "
                   f"model, of the records that were fitted {fitted[worst]:.2g} {unit}: it holds what the model has "
                   "never seen, the machine has changed, or it is read otherwise: look at the sign, unit and column of "
                   "every input.")


def _beyond_noise(joint: JointProblem, v: Floats) -> Iterator[str]:
    """Residuals far above what the declared noise, and the disturbance where a filter weighs it, explain.

    An undeclared noise is estimated from the residuals and tells nothing about them.
    """
    problem = joint.records
    squares: dict[str, list[Floats]] = {}
    white: dict[str, list[Floats]] = {}
    for one, r, weigh in zip(problem.data, problem.residuals(v), problem.weigh, strict=True):
        whitened = weigh(r)
        for i, name in enumerate(one.sensors):
            squares.setdefault(name, []).append(r[:, i] ** 2)
            white.setdefault(name, []).append(whitened[:, i] ** 2)
    squared = {name: np.concatenate(parts) for name, parts in white.items()}
    times = {name: float(np.sqrt(np.nanmean(one))) for name, one in squared.items()}
    lasting = {name for name, one in squared.items() if np.nanmedian(one) > 1.0}  # of noise and glitches: 0.45
    far = sorted((name for name in lasting if times[name] > _FAR), key=lambda name: -times[name])
    if not far:
        return
    worst, unit = far[0], problem.system.sensor_units.get(far[0], "K")
    left = float(np.sqrt(np.nanmean(np.concatenate(squares[worst]))))
    others = f", and at {_listed(far[1:])}, likewise," if far[1:] else ""
    yield (f"At {worst}{others} the model leaves far more than the declared noise explains: {left:.2g} {unit}, "
           f"{times[worst]:.0f} times as much. It lacks something, which the parameters make up for as far as they "
           "can; their standard deviations do not say by how much. `robthermal diagnose` looks for what is missing; "
           "if nothing is, the noise is declared too low.")


def _most_moved(joint: JointProblem, v: Floats, changes: Sequence[NDArray[Any]]) -> str:
    """What the parameter that moves farthest does where the modelled readings change by so much, to first order."""
    ranges, J = joint.ranges, joint.jacobian(v)
    rows = np.zeros(len(J))
    weighed = [weigh(change).ravel() for weigh, change in zip(joint.records.weigh, changes, strict=True)]
    rows[:sum(map(len, weighed))] = np.concatenate(weighed)
    scale = np.linalg.norm(J, axis=0)
    scale[scale == 0] = 1.0
    moved = (np.linalg.lstsq(J / scale, rows, rcond=1e-9)[0] / scale)[:len(ranges.names)]
    relative = np.where(ranges.logarithmic, np.expm1(moved), 0.0)
    most = int(np.argmax(np.abs(relative)))
    if abs(relative[most]) < _LITTLE:
        return ""
    name = " and ".join(map(parameter_in_words, ranges.members[most]))
    size = min(abs(relative[most]), 1.0)
    return f"{name} comes out {100 * size:.2g} % {'higher' if relative[most] > 0 else 'lower'}"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
