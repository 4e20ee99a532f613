"""Stage 7: is what is left white, and is there no heat left in any lump?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._digits import probability
from ..._distributions import chi2_sf, f_sf
from ..._drawing import axes_for
from ...errors import Outcome
from .._outcomes import DiagnosisCode
from ..fit import Refit, orthonormal
from ..path import N_SPLINES, Linearized
from ._frequency_tails import inflation, relative_degrees_of_freedom

Array = NDArray[np.float64]
_FLAT = 1e-6  # relative size of a direction that counts as none
LAGS = 60
SMALLEST_P = 1e-3


@dataclass(frozen=True)
class Adequacy:
    """Tests of a refit.

    Parameters
    ----------
    sensors : dict
        p-value of Ljung and Box's portmanteau test of every sensor's innovations.
    lumps : dict
        p-value of a spline of extra heat into every lump.
    p_value : float
        Joint: Bonferroni over the portmanteau test of all sensors together, without quantized ones, and the lumps.
    variance : float
        Whitened variance; 1 if the noise levels are right.
    outcome : Outcome
        Code "adequate" or "inadequate" (not ok).
    """

    sensors: dict[str, float]
    lumps: dict[str, float]
    p_value: float
    variance: float
    outcome: Outcome

    def __str__(self) -> str:
        lines = [f"{name:<20} whiteness p {p:.2g}" for name, p in self.sensors.items()]
        lines += [f"{name:<20} extra heat p {p:.2g}" for name, p in self.lumps.items()]
        return "\n".join([*lines, str(self.outcome)])

    def plot(self, ax: Any = None) -> Any:
        """Bars of -log10 p; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        both = {**self.sensors, **self.lumps}
        ax.barh(list(both), [-np.log10(max(p, 1e-300)) for p in both.values()])
        ax.axvline(-np.log10(SMALLEST_P), color="black", linewidth=0.7)
        ax.set(xlabel="-log10 p [-]")
        return ax


def adequacy(fit: Refit) -> Adequacy:
    """Test whether a refit leaves anything.

    Parameters
    ----------
    fit : Refit
        Nominal, or with effects.

    Returns
    -------
    Adequacy

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> heater = np.repeat([4.0, 0.0, 6.0, 2.0], 50)
    >>> drive = rt.Record(sample_time=10.0, inputs=heater, outputs=np.zeros((200, 0)), input_names=["heater"],
    ...                   output_names=[])
    >>> run = rt.thermal.simulate(bar, drive)
    >>> noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> rt.diagnosis.adequacy(rt.diagnosis.refit(bar, noisy)).outcome.code
    'adequate'
    """
    innovations = fit.innovations()
    statistics = {name: _portmanteau([z[:, one.sensors.index(name)] for z, one in
                                      zip(innovations, fit.structure.data, strict=True) if name in one.sensors])
                  for name in fit.floor.noise}
    tested = [statistics[name] for name in statistics if name not in fit.floor.quantized]  # steps are never white
    together = (sum(Q for Q, _ in tested), sum(lags for _, lags in tested))
    lumps = {name: p for name, (_, p) in spline_tests(fit).items()}
    white = float(chi2_sf(*together)) if tested else 1.0
    p = min(1.0, 2.0 * min(white, min(lumps.values()) * len(lumps)))
    ok = p > SMALLEST_P
    outcome = DiagnosisCode.ADEQUATE.outcome(f"Nothing is left to explain ({probability(p)}).") if ok else (
        DiagnosisCode.INADEQUATE.outcome(
            f"Something is left ({probability(p)}): the model with these effects does not explain the records.",
            remedy=""))
    return Adequacy({name: float(chi2_sf(Q, lags)) for name, (Q, lags) in statistics.items()}, lumps, p,
                    fit.variance, outcome)


def _portmanteau(segments: list[Array]) -> tuple[float, int]:
    """Ljung and Box's Q about zero, and its degrees of freedom: a tenth of the samples, with more χ² is too narrow."""
    Q, total = 0.0, 0
    for e in segments:
        n, lags, power = e.size, min(LAGS, e.size // 10), float(e @ e)
        rho = np.array([float(e[lag:] @ e[:-lag]) for lag in range(1, lags + 1)]) / power
        Q += n * (n + 2) * float(np.sum(rho**2 / (n - np.arange(1, lags + 1))))
        total += lags
    return Q, total


def side_by_side(columns: list[Array], paths: Sequence[Linearized]) -> list[Array]:
    """Give every frequency response columns of its own; records share theirs."""
    places, at = [], N_SPLINES if any(path.in_time for path in paths) else 0
    for column, path in zip(columns, paths, strict=True):
        start = 0 if path.in_time else at
        places.append(slice(start, start + column.shape[2]))
        at = max(at, places[-1].stop)
    out = [np.zeros((*column.shape[:2], at)) for column in columns]
    for wide, column, place in zip(out, columns, places, strict=True):
        wide[..., place] = column
    return out


def spline_tests(fit: Refit) -> dict[str, tuple[float, float]]:
    """F statistic and p-value of a spline of extra heat into every lump, after the unknowns of the fit."""
    out = {}
    for i, lump in enumerate(fit.system.lumps):
        J = fit.project(fit.whiten(side_by_side([path.splines(i) for path in fit.paths], fit.paths)))
        out[lump] = f_test(fit, J)
    return out


def f_test(fit: Refit, J: Array) -> tuple[float, float]:
    """F statistic and p-value of projected columns (m, q)."""
    U = orthonormal(J, _FLAT)
    q, nu = U.shape[1], fit.degrees_of_freedom - U.shape[1]
    if not q or nu < 1:
        return 0.0, 1.0
    explained = float(np.sum((U.T @ fit.rest) ** 2))
    F = (explained / q) / (max(float(fit.rest @ fit.rest) - explained, 1e-300) / nu)
    F /= float(np.mean(inflation(fit, U)))
    return F, float(f_sf(F, q * relative_degrees_of_freedom(fit, U), nu))
