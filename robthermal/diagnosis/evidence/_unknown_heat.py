"""When no name fits: the heat into one lump that would explain the residual, smoothed, with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from ...errors import Diverged, InputError, Outcome
from ...signals import Record
from ...thermal import Input
from .._outcomes import DiagnosisCode
from ..data import DataSet, RecordData, records_of
from ..fit import Refit, Whitened, filters, turned
from ..path import LinearizedRecord
from ._locate import locate

Array = NDArray[np.float64]
_PROBE = "extra heat"
_ROUNDS = 8
_CLOSE = 0.1  # standard deviations
_MOST_KNOTS = 80  # per record
_SAMPLES_PER_KNOT = 4  # at least
_RATES = np.geomspace(1e-3, 1e3, 61)  # times the rate at which the heat is barely seen
_BAND = 1.959963984540054  # standard deviations, 95 %


@dataclass(frozen=True, eq=False)
class UnknownHeat:
    """Posterior of an extra heat into one lump, given the records.

    Parameters
    ----------
    lump : str
        Lump that the heat enters.
    time : tuple of ndarray, shape (n_knots,)
        Times of the knots of every record [s]; between them the heat is linear.
    heat, std : tuple of ndarray, shape (n_knots,)
        Posterior mean and standard deviation at the knots [W].
    rate : float
        Of the random walk, by marginal likelihood [W/√s].
    gain : float
        Log of the marginal likelihood, above that of no extra heat [-].
    outcome : Outcome
        Code "found" or "none" (the records are as likely without any extra heat).
    """

    lump: str
    time: tuple[Array, ...]
    heat: tuple[Array, ...]
    std: tuple[Array, ...]
    rate: float
    gain: float
    outcome: Outcome

    def __str__(self) -> str:
        lines = [f"extra heat into {self.lump}: random walk of {self.rate:.3g} W/√s, log likelihood + {self.gain:.4g}"]
        for number, (heat, std) in enumerate(zip(self.heat, self.std, strict=True), start=1):
            lines.append(f"record {number}: {heat.min():.4g} to {heat.max():.4g} W, standard deviation "
                         f"{np.median(std):.2g} W")
        return "\n".join([*lines, str(self.outcome)])

    def plot(self) -> NDArray[Any]:
        """Mean and 95 % band [W] against time, one axis per record; returns the matplotlib axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        _, axes = plt.subplots(len(self.time), 1, squeeze=False, layout="constrained")
        for ax, t, heat, std in zip(axes[:, 0], self.time, self.heat, self.std, strict=True):
            ax.fill_between(t, heat - _BAND * std, heat + _BAND * std, alpha=0.3, linewidth=0, label="95 %")
            ax.plot(t, heat, label="mean")
            ax.axhline(0.0, color="black", linewidth=0.7)
            ax.set(ylabel=f"extra heat into {self.lump} [W]")
            ax.legend(fontsize="small")
        axes[-1, 0].set(xlabel="time [s]")
        return axes[:, 0]

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, for ``diagnosis.json``.

        Returns
        -------
        dict
        """
        return {"lump": self.lump, "rate": self.rate, "gain": self.gain, "outcome": vars(self.outcome),
                "records": [{"time": t.tolist(), "heat": heat.tolist(), "std": std.tolist()}
                            for t, heat, std in zip(self.time, self.heat, self.std, strict=True)]}


def unknown_heat(fit: Refit, lump: str | None = None) -> UnknownHeat:
    """Smooth an unknown heat into one lump out of the records.

    A Gaussian process with the covariance of a random walk is the prior; parameters, initial temperatures and session
    gains of the fit are unknowns beside it, with their own priors. The posterior is that of the linearization at its
    own mean.

    Parameters
    ----------
    fit : Refit
        Nominal, or with effects.
    lump : str, optional
        Where; default the lump that `locate` finds most suspect.

    Returns
    -------
    UnknownHeat

    Raises
    ------
    InputError
        An unknown lump; no record (a frequency response has no time).

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> hidden = np.where(np.arange(200) < 100, 0.0, 1.0)
    >>> drive = rt.Record(sample_time=10.0, inputs=3.0 + hidden, outputs=np.zeros((200, 0)), input_names=["heater"],
    ...                   output_names=[])
    >>> y = rt.thermal.simulate(bar, drive).outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1))
    >>> seen = rt.Record(sample_time=10.0, inputs=np.full(200, 3.0), outputs=y, input_names=["heater"],
    ...                  output_names=["T"])
    >>> found = rt.diagnosis.unknown_heat(rt.diagnosis.refit(bar, seen))
    >>> found.lump, bool(abs(found.heat[0][5]) < 0.3), bool(abs(found.heat[0][-5] - 1.0) < 0.3)
    ('bar', True, True)
    """
    if not fit.records:
        raise InputError("there is no record", where="argument fit", expected="a refit of records",
                         remedy="A frequency response has no time: see `located` of its diagnosis.")
    if lump is None:
        lump = locate(fit).lump
    if lump not in fit.system.lumps:
        raise InputError(f"there is no lump {lump!r}", where="argument lump",
                         expected="one of " + ", ".join(fit.system.lump_names))
    knots = [_knots(path.time) for path in fit.records]
    K = block_diag(*[_walk(t) for t in knots])
    root = np.linalg.cholesky(K + 1e-12 * np.trace(K) / len(K) * np.eye(len(K)))
    here, heat = fit, np.zeros(len(K))
    for _ in range(_ROUNDS):  # Gauss-Newton on parameters and heat together: the fit without heat may be far off
        H = _whitened_response(here, here.system.lump_names.index(lump), knots)
        seen = here.z + H @ heat
        rows, small = turned(here.project(H) @ root, here.project(seen))  # as many rows as knots, and one
        U, s, Vt = np.linalg.svd(rows, full_matrices=False)
        a = U.T @ small
        rate, gain = _most_likely(s, a)
        found = _posterior(lump, knots, root @ Vt.T, s, a, rate, gain)
        new = np.concatenate(found.heat)
        step = np.linalg.lstsq(here.J, seen - H @ new, rcond=None)[0]
        if np.all(np.abs(new - heat) <= _CLOSE * np.concatenate(found.std)):
            break
        heat = new
        try:
            here = _heated(fit, np.clip(here.v + step, *fit.structure.bounds), lump, knots, found.heat)
        except (Diverged, InputError):  # far outside what the linearization knows: stay with the last answer
            break
    return found


def _heated(fit: Refit, v: Array, lump: str, knots: list[Array], heat: tuple[Array, ...]) -> Refit:
    """The fit at other unknowns and with an extra heat into one lump, as one more input of every record."""
    base = fit.structure.base
    base = base.model_copy(update={"inputs": {**base.inputs, _PROBE: Input(lump=lump)}})
    driven = {id(one): _driven(one, t, q)
              for one, t, q in zip(records_of(fit.structure.data), knots, heat, strict=True)}
    data = [driven.get(id(one), one) for one in fit.structure.data]
    structure = replace(fit.structure, base=base, data=tuple(data))
    paths, whiteners = filters(structure, v, fit.floor, fit.levels)
    z = Whitened(structure, whiteners).residual(v)
    return replace(fit, structure=structure, v=v, paths=paths, whiteners=whiteners, z=z)


def _driven(one: RecordData, knots: Array, heat: Array) -> DataSet:
    """The record with the extra heat as one more input: held, its mean over every sample."""
    middle = one.record.time + 0.5 * one.record.sample_time
    q = np.interp(middle, knots, heat)
    record = Record(sample_time=one.record.sample_time, inputs=np.column_stack([one.record.inputs, q]),
                    outputs=one.record.outputs, input_names=[*one.record.input_names, _PROBE],
                    output_names=one.record.output_names, start_time=one.record.start_time,
                    averaged=one.record.averaged, ripple=one.record.ripple)
    return replace(one, record=record)


def _knots(time: Array) -> Array:
    """Samples evenly over a record: between samples the heat is then linear."""
    count = int(np.clip(time.size // _SAMPLES_PER_KNOT, 4, _MOST_KNOTS))
    return np.asarray(time[np.round(np.linspace(0, time.size - 1, count)).astype(int)], np.float64)


def _walk(t: Array) -> Array:
    """Covariance of a random walk of unit rate; its start is as uncertain as its end would be from a known start."""
    since = t - t[0]
    return np.asarray(np.minimum(since[:, None], since) + since[-1], np.float64)


def _whitened_response(fit: Refit, lump: int, knots: list[Array]) -> Array:
    """Whitened readings to one watt at every knot (m, k)."""
    ends = np.cumsum([t.size for t in knots])
    own = {id(path): (t, int(end)) for path, t, end in zip(fit.records, knots, ends, strict=True)}
    records = {id(path): path for path in fit.records}
    columns = []
    for path in fit.paths:
        out = np.zeros((*path.one.readings.shape, int(ends[-1])))
        if (record := records.get(id(path))) is not None:
            t, end = own[id(path)]
            out[..., end - t.size:end] = _response(record, lump, t)
        columns.append(out)
    return fit.whiten(columns)


def _response(path: LinearizedRecord, lump: int, knots: Array) -> Array:
    """Readings (n, n_sensors, k) to heat that is linear between knots, one watt at one of them."""
    now = np.column_stack([np.interp(path.time, knots, unit) for unit in np.eye(knots.size)])
    start = np.zeros((*path.x.shape, knots.size))
    end = np.zeros_like(start)
    start[:, lump], end[:, lump] = now, np.concatenate([now[1:], now[-1:]])
    return path.answer(start, end)


def _most_likely(s: Array, a: Array) -> tuple[float, float]:
    """Rate of the walk with the largest marginal likelihood, and its logarithm above that of no heat.

    With z = H d + e, d = rate · root · w and w, e white, in the singular directions of H · root the data a have the
    variance 1 + rate² s². Noise levels are those of the fit.
    """
    seen = s[s > 1e-9 * s.max()] if s.size and s.max() > 0 else np.zeros(0)
    if not seen.size:
        return 0.0, 0.0
    rates = _RATES / seen.max()
    variance = 1.0 + (rates[:, None] * s) ** 2
    gains = 0.5 * np.sum(a**2 * (1.0 - 1.0 / variance) - np.log(variance), axis=1)
    best = int(np.argmax(gains))
    return (float(rates[best]), float(gains[best])) if gains[best] > 0 else (0.0, 0.0)


def _posterior(lump: str, knots: list[Array], modes: Array, s: Array, a: Array, rate: float, gain: float
               ) -> UnknownHeat:
    """Mean and standard deviation at the knots: in every mode, the prior shrunk by 1/(1 + rate² s²)."""
    shrunk = rate**2 / (1.0 + (rate * s) ** 2)
    mean = modes @ (shrunk * s * a)
    std = np.sqrt((modes**2) @ shrunk)
    ends = np.cumsum([t.size for t in knots])[:-1]
    outcome = DiagnosisCode.FOUND.outcome(
        f"This heat into {lump} would explain the residual; it is located, not named."
    ) if gain > 0 else DiagnosisCode.NONE.outcome(
        f"The records are as likely without any extra heat into {lump}.", remedy="")
    return UnknownHeat(lump, tuple(knots), tuple(np.split(mean, ends)), tuple(np.split(std, ends)), rate, gain,
                       outcome)
