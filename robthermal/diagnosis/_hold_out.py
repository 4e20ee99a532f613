"""Stage 8: records the fit has not seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

from ..calibration._data import Data, as_data, refuse_same
from ..calibration._score import validate
from ..calibration._start import initial_of
from ..errors import Diverged, Outcome
from ..signals import Record
from ._descent import descend
from ._refit import Refit, filters, whitened
from ._whitening import gathered

Array = NDArray[np.float64]
SMALLEST_P = 1e-4


@dataclass(frozen=True)
class Gap:
    """Root mean square of the free-running residual over all sensors [K].

    Parameters
    ----------
    before, after : float
        Nominal system refitted; with the effects.
    noise : float
        What sensor noise and random heat alone would give.
    """

    before: float
    after: float
    noise: float


@dataclass(frozen=True)
class HoldOut:
    """How the effects do on unseen records.

    Parameters
    ----------
    gap : Gap
        Free runs; initial temperatures from the first tenth.
    variance_before, variance_after : float
        Whitened variance with the trained parameters; 1 if nothing is missing.
    p_value : float
        Of the prediction: chance of a larger misfit if the model, its noise and the trained parameters' covariance are
        right.
    outcome : Outcome
        Code "predicted" or "not_predicted" (not ok).
    """

    gap: Gap
    variance_before: float
    variance_after: float
    p_value: float
    outcome: Outcome

    @property
    def excess_ratio(self) -> float:
        """Excess whitened variance after over before [-]; nan if there was none before."""
        excess = self.variance_before - 1.0
        return (self.variance_after - 1.0) / excess if excess > 0.05 else float("nan")

    def __str__(self) -> str:
        return (f"held out: rms {self.gap.before:.4g} K before, {self.gap.after:.4g} K after, {self.gap.noise:.4g} K "
                f"noise; whitened variance {self.variance_before:.3g} before, {self.variance_after:.3g} after\n"
                f"{self.outcome}")


def hold_out(before: Refit, after: Refit, validation: Record | Sequence[Record]) -> HoldOut:
    """Predict unseen records with and without the effects.

    Parameters
    ----------
    before : Refit
        Nominal.
    after : Refit
        With the effects.
    validation : Record or list of Record
        Not among the records fitted.

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
    data = as_data(after.structure.base, validation, "validation")
    refuse_same(list(after.structure.data), data)
    gap = Gap(_free_run(before, data), _free_run(after, data), expected_rms(after, data))
    variance_before, _ = predicted(before, after, data)
    variance_after, p = predicted(after, after, data)
    ok = p > SMALLEST_P
    text = (f"The unseen records are predicted as well as the training records are fitted (p = {p:.2g})." if ok else
            f"The unseen records are not predicted (p = {p:.1e}): something else is missing, or has changed.")
    return HoldOut(gap, variance_before, variance_after, p, Outcome(ok, "predicted" if ok else "not_predicted", text))


def _free_run(fit: Refit, data: list[Data]) -> float:
    noise = fit.floor.noise
    try:
        residuals = [validate(fit.system, one, "free", noise)[1] for one in data]
    except Diverged:
        return float("inf")
    return float(np.sqrt(np.mean(np.concatenate([r.ravel() for r in residuals]) ** 2)))


def predicted(fit: Refit, reference: Refit, data: list[Data]) -> tuple[float, float]:
    """Whitened variance with trained parameters, and the p-value of the prediction, with the noise of `reference`.

    The trained parameters enter as a prior with the covariance of their training, the initial temperatures with theirs;
    at the optimum the sum of squares is χ² with as many degrees of freedom as there are readings.
    """
    starts = tuple(initial_of(fit.system, one, "free") for one in data)
    structure = replace(fit.structure, data=tuple(data), starts=starts)
    p = fit.structure.n_parameters + fit.structure.n_effects
    trained = fit.v[:p]
    v = np.concatenate([trained, np.zeros(sum(start.n_free for start in starts))])
    R = _information_root(fit.J, p)
    fixed = np.zeros(v.size, bool)
    fixed[:p] = True
    try:
        _, whiteners = filters(structure, v, reference.floor, reference.levels)
        n, n_known = structure.n_readings, int(np.isfinite(structure.ranges.sigma).sum())

        def evaluate(v: Array) -> tuple[Array, Array]:
            z, J = whitened(structure, v, whiteners)
            prior = np.zeros((len(R), v.size))
            prior[:, :p] = R
            keep = np.r_[0:n, n + n_known:z.size]  # the parameters' own priors are in R already
            return np.concatenate([z[keep], -R @ (v[:p] - trained)]), np.concatenate([J[keep], prior])

        low, high = (bound.copy() for bound in structure.bounds)
        low[:p], high[:p] = trained, trained
        only = descend(evaluate, v, (low, high), 20, 1e-4)
    except Diverged:
        return float("inf"), 0.0
    # the trained parameters move by a standard deviation or so: one linear step is their optimum
    left = only.z - only.J @ np.linalg.lstsq(only.J, only.z, rcond=None)[0]
    rss = float(left @ left) / max(reference.variance, 1e-12)
    return float(only.z @ only.z) / n, float(f_distribution.sf(rss / n, n, reference.degrees_of_freedom))


def _information_root(J: Array, p: int) -> Array:
    """R with RᵀR the information on the first p unknowns, the others marginalised."""
    rest = J.shape[1] - p
    R: Array = np.asarray(np.linalg.qr(np.concatenate([J[:, p:], J[:, :p]], axis=1)).R, np.float64)
    return R[rest:, rest:]


def expected_rms(fit: Refit, data: Sequence[Data] | None = None) -> float:
    """Free-run rms that sensor noise and random heat alone would give [K]."""
    structure = fit.structure
    paths = fit.paths
    if data is not None:
        starts = tuple(initial_of(fit.system, one, "measured") for one in data)
        structure = replace(structure, data=tuple(data), starts=starts)
        paths, _ = filters(structure, fit.v[:structure.n_parameters + structure.n_effects], fit.floor, fit.levels)
    total, count = 0.0, 0
    for path in paths:
        noise, disturbance = fit.levels.of(path, fit.floor)
        A, P = path.steps[0], np.zeros(path.M.shape[1:])
        Q = gathered(path, disturbance)
        for k in range(len(A)):
            total += float(np.trace(path.C @ P @ path.C.T)) + float(noise @ noise)
            P = A[k] @ P @ A[k].T + Q[k]
        count += path.one.readings.size
    return float(np.sqrt(total / count))
