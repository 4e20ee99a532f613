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
_APART = 1.0  # K between the faces, below which neither S nor K shows


@dataclass(frozen=True, eq=False)
class ModuleProperties:
    """What steps of current say about a module.

    Parameters
    ----------
    seebeck, resistance : Linear
        S [V/K, V/K²] and R [Ω, Ω/K] about the reference temperature.
    conductance : float
        K [W/K], mean over the steady states.
    reference_temperature : float
        Temperature about which S and R are linear [K].
    std : dict
        Standard deviations from the scatter of the points: "seebeck.value", "seebeck.slope", "resistance.value",
        "resistance.slope", "conductance".
    steps, steady : pandas.DataFrame
        Per step of current: "temperature" [K], "resistance" [Ω]. Per steady state: "temperature" [K], "seebeck" [V/K],
        "conductance" [W/K].
    """

    seebeck: Linear
    resistance: Linear
    conductance: float
    reference_temperature: float
    std: dict[str, float]
    steps: pd.DataFrame
    steady: pd.DataFrame

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
    ratios = np.array([(V[k] - V[k - 1]) / (i_all[k] - i_all[k - 1]) for k in jumps])
    R, R_std = _line(at - reference_temperature, ratios)
    steady = [p for p in levels if _is_steady(p, Th, Tc)]
    if len(steady) < 3:
        raise InputError(f"{len(steady)} plateaus are steady with {_APART} K or more between the faces",
                         where="argument record", expected="at least 3",
                         remedy="Wait longer at every step, or use larger currents.")
    i, v, h, c = (np.array([p.tail(signal).mean() for p in steady]) for signal in (i_all, V, Th, Tc))
    T = (h + c) / 2
    own = R[0] + R[1] * (T - reference_temperature)
    seebeck = (v - own * i) / (h - c)
    K = (seebeck * c * i - own * i**2 / 2 - load) / (h - c)
    S, S_std = _line(T - reference_temperature, seebeck)
    return ModuleProperties(
        seebeck=_linear(S, "seebeck"), resistance=_linear(R, "resistance"), conductance=float(K.mean()),
        reference_temperature=reference_temperature,
        std={"seebeck.value": S_std[0], "seebeck.slope": S_std[1], "resistance.value": R_std[0],
             "resistance.slope": R_std[1], "conductance": float(K.std(ddof=1) / np.sqrt(K.size))},
        steps=pd.DataFrame({"temperature": at, "resistance": ratios}),
        steady=pd.DataFrame({"temperature": T, "seebeck": seebeck, "conductance": K}))


def _is_steady(plateau: Plateau, hot: Floats, cold: Floats) -> bool:
    apart = abs(float(plateau.tail(hot).mean() - plateau.tail(cold).mean()))
    return apart >= _APART and max(abs(plateau.drift(hot)), abs(plateau.drift(cold))) < _SETTLED


def _line(x: Floats, y: Floats) -> tuple[Floats, list[float]]:
    """Straight line by least squares, and standard deviations of its value at 0 and its slope."""
    X = np.column_stack([np.ones_like(x), x])
    found, _, rank, _ = np.linalg.lstsq(X, y, rcond=None)
    beta = np.asarray(found, np.float64)
    if rank < 2:
        raise InputError("all steps are at one mean temperature", where="argument record",
                         expected="a range of mean temperatures", remedy="Use currents of several sizes.")
    variance = float(np.sum((y - X @ beta) ** 2)) / max(x.size - 2, 1)
    return beta, np.sqrt(variance * np.diag(np.linalg.inv(X.T @ X))).tolist()


def _linear(line: Floats, name: str) -> Linear:
    if line[0] <= 0:
        raise InputError(f"the {name} comes out as {line[0]:.4g} at the reference temperature", where="argument record",
                         expected="a positive value", remedy="Check the signs of current, voltage, hot and cold.")
    return Linear(value=float(line[0]), slope=float(line[1]))
