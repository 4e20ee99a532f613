"""S(T), R(T) and K of a module from steps of current in two time scales. Evers, Algorithm 1, with R = V/δI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import Floats
from .._pandas import pd
from ..errors import InputError
from ..signals import Record
from ..thermal import Linear, Module
from ._plateaus import Plateau, column, plateaus

_SETTLED = 0.02  # K: drift of a face over the end of a plateau up to which it counts as steady
PROPERTIES = ("seebeck.value", "seebeck.slope", "resistance.value", "resistance.slope", "conductance")
_APART = 1.0  # K between the faces, below which neither S nor K shows


@dataclass(frozen=True, eq=False)
class ModuleProperties:
    """What steps of current say about a module.

    Parameters
    ----------
    seebeck, resistance : Linear
        S [V/K, V/K²] and R [Ω, Ω/K] about the reference temperature.
    conductance : float
        K [W/K], by least squares over the balances of the steady states.
    reference_temperature : float
        Temperature about which S and R are linear [K].
    covariance : ndarray, shape (5, 5)
        Of "seebeck.value", "seebeck.slope", "resistance.value", "resistance.slope", "conductance", in this order: from
        the scatter of the points, with what the uncertainty of R does to S and K.
    steps, steady : pandas.DataFrame
        Per step of current: "temperature" [K], "resistance" [Ω]. Per steady state: "temperature" [K], "seebeck" [V/K],
        "conductance" [W/K].
    """

    seebeck: Linear
    resistance: Linear
    conductance: float
    reference_temperature: float
    covariance: Floats
    steps: pd.DataFrame
    steady: pd.DataFrame

    @property
    def values(self) -> dict[str, float]:
        """The five numbers by name, as a system names them: "seebeck.value" [V/K], "seebeck.slope" [V/K²] …"""
        found = (self.seebeck.value, self.seebeck.slope, self.resistance.value, self.resistance.slope, self.conductance)
        return dict(zip(PROPERTIES, found, strict=True))

    @property
    def std(self) -> dict[str, float]:
        """Standard deviations of the five numbers, in the units of `values`."""
        return dict(zip(PROPERTIES, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    def module(self, hot: str, cold: str) -> Module:
        """A module with these properties for a system.

        Parameters
        ----------
        hot, cold : str
            Lumps of its two faces.

        Returns
        -------
        Module
        """
        return Module(hot=hot, cold=cold, seebeck=self.seebeck, resistance=self.resistance,
                      conductance=Linear(value=self.conductance), reference_temperature=self.reference_temperature)


def module_properties(record: Record, *, current: str, voltage: str, hot: str, cold: str, load: float = 0.0,
                      reference_temperature: float = 298.15) -> ModuleProperties:
    """Module properties from a staircase of current with measured voltage and face temperatures.

    Fast: in the sample after a step of current the temperatures have not moved yet, so the jump of the voltage is that
    of the resistance, R(T_avg) = δV/δI (the thesis prints the inverse). Slow: once steady, S = (V - R I)/(T_h - T_c),
    and the balance of the cold face, 0 = -S T_c I + ½ R I² + K (T_h - T_c) + load, gives K.

    Parameters
    ----------
    record : Record
        Sampled much faster than the faces move; the voltage read just after the current was set.
    current, voltage, hot, cold : str
        Columns of the current [A], the voltage [V], and the temperatures of the hot and cold face [K].
    load : float
        Heat that flows into the cold face from elsewhere when steady [W]; 0 if it is insulated.
    reference_temperature : float
        About which S and R are linear [K].

    Returns
    -------
    ModuleProperties

    Raises
    ------
    InputError
        Unknown columns, fewer than four plateaus or three steady ones with a temperature difference.

    References
    ----------
    Evers (2021), Algorithm 1, corrected.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> I = np.repeat([0.0, 0.3, 0.6, 0.9], 50)
    >>> Th, Tc = 298.0 + 2.0 * I, 298.0 - 30.0 * I         # faces at rest at every current, moving only later
    >>> Th, Tc = np.roll(Th, 5), np.roll(Tc, 5)
    >>> Th[:5], Tc[:5] = 298.0, 298.0
    >>> record = rt.Record(sample_time=1.0, inputs=I, outputs=np.column_stack([Th, Tc, 0.05 * (Th - Tc) + 4.0 * I]),
    ...                    input_names=["m"], output_names=["Th", "Tc", "V"])
    >>> found = rt.calibration.module_properties(record, current="m", voltage="V", hot="Th", cold="Tc")
    >>> round(found.seebeck.value, 4), round(found.resistance.value, 4)
    (0.05, 4.0)
    """
    i_all, V = column(record, current), column(record, voltage)
    Th, Tc = column(record, hot), column(record, cold)
    levels = plateaus(record, current, 4)
    mean = (Th + Tc) / 2
    jumps = [p.start for p in levels if p.start]
    at = np.array([mean[k - 1] for k in jumps])
    dI, dV = (np.array([signal[k] - signal[k - 1] for k in jumps]) for signal in (i_all, V))
    X = dI[:, None] * _line(at - reference_temperature)  # in volts every jump is read equally well
    R = np.linalg.lstsq(X, dV)[0]
    steady = [p for p in levels if _is_steady(p, Th, Tc)]
    if len(steady) < 3:
        raise InputError(f"{len(steady)} plateaus are steady with {_APART} K or more between the faces",
                         where="argument record", expected="at least 3",
                         remedy="Wait longer at every step, or use larger currents.")
    i, v, h, c = (np.array([p.tail(signal).mean() for p in steady]) for signal in (i_all, V, Th, Tc))
    line, apart = _line((h + c) / 2 - reference_temperature), h - c
    emf = v - line @ R * i
    back = emf / apart * c * i - line @ R * i**2 / 2 - load  # conducted back from the hot face [W]
    Z = apart[:, None] * line
    S, K = np.linalg.lstsq(Z, emf)[0], float(apart @ back / (apart @ apart))
    by_R = np.array([-i, -c * i**2 / apart - i**2 / 2])[:, :, None] * line  # derivatives of emf and back by R
    return ModuleProperties(
        seebeck=_linear(S, "seebeck"), resistance=_linear(R, "resistance"), conductance=K,
        reference_temperature=reference_temperature,
        covariance=_covariance(X, dV - X @ R, Z, np.column_stack([emf - Z @ S, back - K * apart]), by_R),
        steps=pd.DataFrame({"temperature": at, "resistance": dV / dI}),
        steady=pd.DataFrame({"temperature": (h + c) / 2, "seebeck": emf / apart, "conductance": back / apart}))


def _covariance(X: Floats, off: Floats, Z: Floats, scatter: Floats, by_R: Floats) -> Floats:
    """Covariance (5, 5) of S, R and K from what is left of the jumps [V], of the emf [V] and of the balances [W].

    X (n, 2), Z (m, 2) are the regressors of R and S, `off` (n,) and `scatter` (m, 2) the residuals, `by_R` (2, m, 2)
    the derivatives of emf and balance by the line of R.
    """
    of_R = np.linalg.inv(X.T @ X) * (off @ off) / max(len(off) - 2, 1)
    m, apart = len(Z), Z[:, 0]
    own = scatter.T @ scatter / np.array([[m - 2, m - 2], [m - 2, m - 1]])
    weights = [np.linalg.pinv(Z), apart[None, :] / (apart @ apart)]  # the estimates of S and of K, as sums over points
    alone = np.block([[own[a, b] * weights[a] @ weights[b].T for b in (0, 1)] for a in (0, 1)])
    through = np.vstack([weight @ each for weight, each in zip(weights, by_R, strict=True)])
    total = np.block([[alone + through @ of_R @ through.T, through @ of_R], [of_R @ through.T, of_R]])
    order = [0, 1, 3, 4, 2]  # S, K, R -> S, R, K
    return total[np.ix_(order, order)]


def _is_steady(plateau: Plateau, hot: Floats, cold: Floats) -> bool:
    apart = abs(float(plateau.tail(hot).mean() - plateau.tail(cold).mean()))
    return apart >= _APART and max(abs(plateau.drift(hot)), abs(plateau.drift(cold))) < _SETTLED


def _line(x: Floats) -> Floats:
    """Regressors of a straight line."""
    if np.ptp(x) < 1e-9:
        raise InputError("all steps are at one mean temperature", where="argument record",
                         expected="a range of mean temperatures", remedy="Use currents of several sizes.")
    return np.column_stack([np.ones_like(x), x])


def _linear(line: Floats, name: str) -> Linear:
    if line[0] <= 0:
        raise InputError(f"the {name} comes out as {line[0]:.4g} at the reference temperature", where="argument record",
                         expected="a positive value", remedy="Check the signs of current, voltage, hot and cold.")
    return Linear(value=float(line[0]), slope=float(line[1]))
