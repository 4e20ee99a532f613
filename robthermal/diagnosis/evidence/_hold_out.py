"""Stage 8: records the fit has not seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..._digits import probability
from ..._distributions import f_sf
from ...errors import Diverged, InputError, Outcome
from ...fitting import Start, counted, free_run, refuse_same, rmse
from ...thermal import System
from .._outcomes import DiagnosisCode
from ..data import DataSet, Measured, RecordData, as_measured, records_of, responses_of, without_outliers
from ..fit import Point, Refit, Structure, Whitened, descend, filters, turned
from ..path import Linearized, LinearizedRecord, White, heat_spread, linearized_records

Array = NDArray[np.float64]
Places = NDArray[np.intp]
SMALLEST_P = 1e-4


@dataclass(frozen=True)
class Gap:
    """Root mean square of the free-running residual over all sensors [K]; of responses alone, whitened.

    Parameters
    ----------
    before, after : float
        Nominal system refitted; with the effects.
    noise : float
        What sensor noise and random heat alone would give.
    unit : str
        "K"; "V" where records hold voltages alone; or "standard deviations" of a frequency response's noise where there
        is no record.
    """

    before: float
    after: float
    noise: float
    unit: str = "K"


@dataclass(frozen=True, eq=False)
class ValidationResiduals:
    """Free runs on one validation record, with its own session gains; isolated outliers interpolated.

    Parameters
    ----------
    name : str
        Name of the record.
    time : ndarray, shape (n,)
        Times of the samples [s].
    before, after : dict
        {sensor: measured − modelled (n,)} [K], nominal system refitted and with the effects; NaN if the model runs
        away.
    """

    name: str
    time: Array
    before: dict[str, Array]
    after: dict[str, Array]


@dataclass(frozen=True)
class HoldOut:
    """How the effects do on validation records.

    Parameters
    ----------
    gap : Gap
        Free runs; initial temperatures from the first tenth, or all of the record where that leaves them open.
    variance_before, variance_after : float
        Whitened variance with the trained parameters; 1 if nothing is missing.
    p_value : float
        Of the prediction: chance of a larger misfit if the model, its noise and the trained parameters' covariance are
        right.
    outcome : Outcome
        Code "predicted" or "not_predicted" (not ok).
    residuals : tuple of ValidationResiduals
        The free runs that `gap` is the root mean square of, one per validation record.
    """

    gap: Gap
    variance_before: float
    variance_after: float
    p_value: float
    outcome: Outcome
    residuals: tuple[ValidationResiduals, ...] = ()

    @property
    def excess_ratio(self) -> float:
        """Excess whitened variance after over before [-]; nan if there was none before."""
        excess = self.variance_before - 1.0
        return (self.variance_after - 1.0) / excess if excess > 0.05 else float("nan")

    def __str__(self) -> str:
        return (f"held out: rms {self.gap.before:.4g} before, {self.gap.after:.4g} after, {self.gap.noise:.4g} "
                f"{self.gap.unit} noise; whitened variance {self.variance_before:.3g} before, "
                f"{self.variance_after:.3g} after\n{self.outcome}")


def hold_out(before: Refit, after: Refit, validation: Measured | Sequence[Measured], *,
             operating_point: Mapping[str, float] | None = None) -> HoldOut:
    """Predict validation records with and without the effects.

    Parameters
    ----------
    before : Refit
        Nominal system refitted.
    after : Refit
        With the effects.
    validation : Record, FrequencyResponse, or list of them
        Not among those fitted.
    operating_point : mapping, optional
        Of frequency responses, as in `refit`.

    Returns
    -------
    HoldOut

    Raises
    ------
    InputError
        A validation record that is a training record.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> def measured(seed):
    ...     rng = np.random.default_rng(seed)
    ...     drive = rt.Record(sample_time=10.0, inputs=np.repeat(rng.uniform(0.0, 6.0, 8), 25),
    ...                       outputs=np.zeros((200, 0)), input_names=["heater"], output_names=[])
    ...     run = rt.thermal.simulate(bar, drive)
    ...     return run.with_outputs(run.outputs + 0.05 * rng.standard_normal((200, 1)))
    >>> fit = rt.diagnosis.refit(bar, measured(1))
    >>> rt.diagnosis.hold_out(fit, fit, measured(2)).outcome.code
    'predicted'
    """
    data = validation_data(after, validation, operating_point)
    residuals = _residuals(before, after, records_of(data))
    gap = _validation_gap(before, after, data, residuals)
    variance_before, _ = predicted(before, after, data)
    variance_after, p = predicted(after, after, data)
    ok = p > SMALLEST_P
    outcome = DiagnosisCode.PREDICTED.outcome(
        f"The validation records are predicted as well as the training records are fitted ({probability(p)})."
    ) if ok else DiagnosisCode.NOT_PREDICTED.outcome(
        f"The validation records are not predicted ({probability(p)}): something else is missing, or has changed.")
    return HoldOut(gap, variance_before, variance_after, p, outcome, residuals)


def validation_data(fit: Refit, validation: Measured | Sequence[Measured], operating_point: Mapping[str, float] | None
                ) -> list[DataSet]:
    """Validation data without glitches; refused if the fit has seen them."""
    base = fit.structure.base
    data = without_outliers(base, as_measured(base, validation, "validation", operating_point), fit.floor.noise)
    refuse_seen(fit.structure.data, data)
    return list(data)


def refuse_seen(training: Sequence[DataSet], validation: Sequence[DataSet]) -> None:
    """Data validate nothing that was fitted to them; a record's noise must be known from training records."""
    if not records_of(training) and records_of(validation):
        raise InputError("a record is to validate what only frequency responses taught", where="argument validation",
                         expected="a frequency response", remedy="Estimate one from that record with rt.identify.lpm, "
                         "or train on a record too.")
    refuse_same([*records_of(training)], [*records_of(validation)])
    for new in responses_of(validation):
        for old in responses_of(training):
            if np.array_equal(new.readings, old.readings):
                raise InputError("the validation response is the training response", where="argument validation",
                                 expected="data the fit has not seen", remedy="Estimate it from another record.")


def _validation_gap(before: Refit, after: Refit, data: Sequence[DataSet],
                residuals: Sequence[ValidationResiduals]) -> Gap:
    if not residuals:
        return Gap(response_rms(before, data), response_rms(after, data), 1.0, "standard deviations")
    records = records_of(data)
    every = [name for one in records for name in one.sensors]
    kept = [name for name, own in zip(every, counted(after.system, every, every), strict=True) if own]
    before_them = rmse(e for one in residuals for name, e in one.before.items() if name in kept)
    after_them = rmse(e for one in residuals for name, e in one.after.items() if name in kept)
    unit = "K" if any(name in after.system.thermometers for name in kept) else "V"
    return Gap(before_them, after_them, expected_rms(after, records), unit)


def _residuals(before: Refit, after: Refit, records: Sequence[RecordData]) -> tuple[ValidationResiduals, ...]:
    runs = (_free_runs(fit, records) for fit in (before, after))
    return tuple(ValidationResiduals(one.label, one.record.time, old, new)
                 for one, old, new in zip(records, *runs, strict=True))


def _free_runs(fit: Refit, records: Sequence[RecordData]) -> list[dict[str, Array]]:
    """Residuals of every record by sensor; NaN where the model runs away."""
    try:
        systems = _session_systems(fit, records)
    except Diverged:
        return [_ran_away(one) for one in records]
    return [_one_run(fit, system, one) for system, one in zip(systems, records, strict=True)]


def _one_run(fit: Refit, system: System, one: RecordData) -> dict[str, Array]:
    try:
        return free_run(system, one, "free", fit.floor.noise).by_sensor
    except Diverged:
        return _ran_away(one)


def _ran_away(one: RecordData) -> dict[str, Array]:
    return dict.fromkeys(one.sensors, np.full(len(one.readings), np.nan))


def _session_systems(fit: Refit, data: Sequence[RecordData]) -> list[System]:
    """Trained system in every validation session: a new session has a gain of its own, estimated on all of it."""
    sessions = fit.structure.sessions
    if not sessions.inputs:
        return [fit.system] * len(data)
    structure, own, _ = _own_unknowns(fit, data, _filters(fit, fit, data))
    return [sessions.applied(fit.system, g) for g in structure.gains(own.v)]


def predicted(fit: Refit, reference: Refit, data: Sequence[DataSet]) -> tuple[float, float]:
    """Whitened variance with trained parameters, and the p-value of the prediction, with the noise of `reference`.

    The trained parameters enter as a prior with the covariance of their training, what is the records' own (initial
    temperatures, session gains) with theirs; at the optimum the sum of squares is χ² with as many degrees of freedom as
    there are readings, fewer where the noise is itself an estimate.
    """
    try:
        structure, only, n = _own_unknowns(fit, data, _filters(fit, reference, data))
    except Diverged:
        return float("inf"), 0.0
    # the trained parameters move by a standard deviation or so: one linear step is their optimum
    left = only.z - only.J @ np.linalg.lstsq(only.J, only.z, rcond=None)[0]
    rss = float(left @ left) / max(reference.variance, 1e-12)
    known = reference.degrees_of_freedom * reference.structure.certainty
    return float(only.z @ only.z) / n, float(f_sf(rss / n, n * structure.certainty, known))


def negative_log_predictive_density(fits: Sequence[Refit], reference: Refit, data: Sequence[DataSet]) -> list[float]:
    """-2 log predictive densities of validation records given the trained parameters' covariance, but for one constant.

    Linearized as in `predicted`: smallest sum of squares, and the log of by how much the records narrow the unknowns.
    One filter serves all fits, with the noise of `reference` and along the first model that survives the records; for
    a fit that does not it is infinite.
    """
    whiteners = next((found for fit in (reference, *fits) if (found := _surviving(fit, reference, data))), None)
    return [float("inf") if whiteners is None else _negative_log_density(fit, whiteners, reference, data)
            for fit in fits]


def _surviving(fit: Refit, reference: Refit, data: Sequence[DataSet]) -> tuple[White, ...] | None:
    try:
        return _filters(fit, reference, data)
    except Diverged:
        return None


def _negative_log_density(fit: Refit, whiteners: Sequence[White], reference: Refit, data: Sequence[DataSet]) -> float:
    try:
        _, only, n = _own_unknowns(fit, data, whiteners)
    except Diverged:
        return float("inf")
    left = only.z - only.J @ np.linalg.lstsq(only.J, only.z, rcond=None)[0]
    scale = np.linalg.norm(only.J, axis=0)
    J = only.J / np.where(scale > 0, scale, 1.0)
    narrowed = _log_volume(J) - _log_volume(J[n:])
    return float(left @ left) / max(reference.variance, 1e-12) + narrowed


def _log_volume(J: Array) -> float:
    """log det JᵀJ; directions that nothing determines count as much with as without data."""
    s = np.linalg.svd(J, compute_uv=False)
    return 2.0 * float(np.sum(np.log(np.maximum(s, 1e-9))))


def _over(fit: Refit, data: Sequence[DataSet], start: Start = "free") -> tuple[Structure, Array]:
    """The structure over validation data, and its unknowns: those trained, the data's own at zero."""
    starts = tuple(one.initial(fit.system, start) for one in data)
    structure = replace(fit.structure, data=tuple(data), starts=starts, coarse=())
    p = structure.n_common
    plain = np.concatenate([fit.v[:p], np.zeros(structure.n_own)])
    if not fit.structure.coarse:
        return structure, plain
    coarse = tuple(path.coarse_columns(structure.base) for path in structure.paths(plain))
    return (replace(structure, coarse=coarse),
            np.concatenate([fit.v[:fit.structure.n_common], np.zeros(structure.n_own)]))


def _filters(fit: Refit, reference: Refit, data: Sequence[DataSet]) -> tuple[White, ...]:
    """Whiteners of validation data along the trained model, with the noise of `reference`."""
    return filters(*_over(fit, data), reference.floor, reference.levels)[1]


@dataclass(frozen=True, eq=False)
class _Validation:
    """Whitened residuals of validation data, and what training says about the first unknowns: R (v - trained)."""

    of: Whitened
    R: Array
    trained: Array

    @property
    def _kept(self) -> Places:
        """All rows but the priors of what is common, which are in R already."""
        structure = self.of.structure
        n = structure.n_readings
        own = n + structure.n_priors + structure.n_coarse
        return np.r_[0:n, own:own + structure.n_own]

    def residual(self, v: Array) -> Array:
        """As `Problem.residual`."""
        return np.concatenate([self.of.residual(v)[self._kept], -self.R @ (v[:self.trained.size] - self.trained)])

    def slopes(self, v: Array) -> Array:
        """As `Problem.slopes`."""
        prior = np.zeros((len(self.R), v.size))
        prior[:, :self.trained.size] = self.R
        return np.concatenate([self.of.slopes(v)[self._kept], prior])


def _own_unknowns(fit: Refit, data: Sequence[DataSet], whiteners: Sequence[White]
                  ) -> tuple[Structure, Point, int]:
    """Initial temperatures and session gains on validation data, the trained parameters fixed; also the readings."""
    structure, v = _over(fit, data)
    p = structure.n_common
    trained = fit.v[:p]
    low, high = (bound.copy() for bound in structure.bounds)
    low[:p], high[:p] = trained, trained
    problem = _Validation(Whitened(structure, whiteners), _information_root(fit, p), trained)
    return structure, descend(problem, v, (low, high), 20, 1e-4).at, structure.n_readings


def _information_root(fit: Refit, p: int) -> Array:
    """R with RᵀR the information on the first p unknowns, the others marginalized."""
    rest = fit.v.size - p
    R = turned(np.concatenate([fit.J[:, p:], fit.J[:, :p]], axis=1), fit.z)[0]
    return R[rest:-1, rest:]


def response_rms(fit: Refit, data: Sequence[DataSet]) -> float:
    """Whitened root mean square on frequency responses the fit has not seen [standard deviations of their noise].

    Parameters
    ----------
    fit : Refit
        Fit to the training data.
    data : sequence of DataSet
        Validation data; records among them are left out.
    """
    own = responses_of(data)
    structure, v = _over(fit, own)
    z = Whitened(structure, [one.white for one in own]).residual(v)
    return rmse([z[:structure.n_readings]])


def expected_rms(fit: Refit, data: Sequence[RecordData] | None = None) -> float:
    """Free-run rms that sensor noise and random heat alone would give [K]; 1 of frequency responses alone."""
    paths: Sequence[Linearized] = fit.paths
    if data is not None:
        structure, v = _over(fit, data, "measured")
        paths = structure.paths(v)
    total, count = 0.0, 0
    every = [name for path in linearized_records(paths) for name in path.one.sensors]
    for path in linearized_records(paths):
        own = counted(fit.system, path.one.sensors, every)
        total += len(path.one.readings) * float(expected_squares(fit, path)[own].sum())
        count += len(path.one.readings) * int(own.sum())
    return float(np.sqrt(total / count)) if count else 1.0


def square_beyond_noise(fit: Refit) -> float:
    """Mean square of the free-run residual beyond what sensor noise and random heat alone would give [K²]."""
    return max(fit.rms**2 - expected_rms(fit) ** 2, 0.0)


def expected_squares(fit: Refit, path: LinearizedRecord) -> Array:
    """Mean squares of the free-run residual of a record that its noise alone would give, (n_sensors,) [K²].

    A level that the fit has raised beyond what is declared, and beyond what the readings show from one to the next,
    holds what is not explained: that is no noise.
    """
    noise, disturbance = fit.levels.of(path, fit.floor)
    shown = [max(fit.floor.noise[name], fit.floor.rough.get(name, 0.0)) for name in path.one.sensors]
    noise = np.minimum(noise, shown)
    slow = fit.levels.slow(path, fit.floor)
    squares = noise**2 if slow is None else noise**2 + slow.std**2
    return np.asarray(heat_spread(path, disturbance, fit.levels.wandering(path)) + squares, np.float64)
