"""A datasheet with one or more hot-side columns, inverted twice; slopes of S, R and K from two columns or more.

Each column gives S, R and K at its own mean temperature T_h - dTmax/2, exactly, also for properties with slopes
(`_rating.py`): from Vmax, S = Vmax/T_h; R = S T_c/Imax; K = S T_c Imax/(2 dTmax). From Qmax, S is not local: Qmax is
rated without a temperature difference, at T_avg = T_h, so that the S of all columns follow together from linear
equations, S(T_h) T_h Imax - ½ R(T_h) Imax² = Qmax, S and R on their lines through the columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from .._pandas import pd
from ..errors import InputError, Outcome
from ._outcomes import ThermalCode
from ._parts import Linear, Module
from ._rating import Properties, Rating, misfit
from ._terms import Array

Basis = Literal["voltage", "heat"]
_APART = 5.0  # K between the mean temperatures of two columns, for slopes
_AGREE = 0.1


@dataclass(frozen=True)
class Inversion:
    """One set of properties from a datasheet.

    Parameters
    ----------
    basis : {"voltage", "heat"}
        Whether they reproduce Vmax, or Qmax; both reproduce Imax and dTmax of one or two columns.
    properties : Properties
        S, R and K.
    predicted : tuple of Rating
        What these properties say at every column.
    misfits : tuple of dict
        For every column: {"v_max", "i_max", "dt_max", "q_max"}, predicted / sheet - 1 [-].
    """

    basis: Basis
    properties: Properties
    predicted: tuple[Rating, ...]
    misfits: tuple[dict[str, float], ...]

    @property
    def largest_misfit(self) -> float:
        """Largest relative misfit of any number of the sheet [-]."""
        return float(np.nanmax([abs(value) for one in self.misfits for value in one.values()]))


@dataclass(frozen=True)
class SheetInversion:
    """A datasheet with all its columns, inverted from Vmax and from Qmax.

    Parameters
    ----------
    ratings : tuple of Rating
        Columns of the sheet, by hot-side temperature.
    voltage : Inversion
        From Vmax, Imax, dTmax: Lineykin and Ben-Yaakov (2007).
    heat : Inversion or None
        From Qmax, Imax, dTmax; None where a column has no Qmax.
    outcome : Outcome
        Whether the sheet agrees with itself.
    """

    ratings: tuple[Rating, ...]
    voltage: Inversion
    heat: Inversion | None
    outcome: Outcome

    def by(self, basis: Basis) -> Inversion:
        """One of the two sets.

        Parameters
        ----------
        basis : {"voltage", "heat"}
            Whether it reproduces Vmax or Qmax.
        """
        if basis not in ("voltage", "heat"):
            raise InputError(f"{basis!r}", where="argument basis", expected='"voltage" or "heat"',
                             remedy="Choose one of them.")
        chosen = self.voltage if basis == "voltage" else self.heat
        if chosen is None:
            raise InputError('"heat" needs Qmax, which this sheet does not give', where="argument basis",
                             remedy='Give Qmax of every column, or take the basis "voltage".')
        return chosen

    def module(self, hot: str, cold: str, *, basis: Basis = "voltage",
               current_limits: tuple[float, float] | None = None) -> Module:
        """Module between two lumps.

        Parameters
        ----------
        hot, cold : str
            Lumps of the two faces.
        basis : {"voltage", "heat"}
            Which set of properties.
        current_limits : tuple of float, optional
            [A]; Imax is where dT is largest, not a limit of damage, so none is set by default.
        """
        p = self.by(basis).properties
        return Module(hot=hot, cold=cold, seebeck=p.seebeck, resistance=p.resistance, conductance=p.conductance,
                      reference_temperature=p.reference_temperature, current_limits=current_limits)

    def table(self) -> pd.DataFrame:
        """Both sets as a table.

        Returns
        -------
        pandas.DataFrame
            Index: basis. Columns: S [V/K], R [Ω], K [W/K], their slopes, Z [1/K] at the reference temperature [K], and
            the largest misfit of any number [%].
        """
        rows = {}
        for one in (self.voltage, self.heat):
            if one is not None:
                p = one.properties
                S, R, K = p.at(p.reference_temperature)
                rows[one.basis] = {"S [V/K]": S, "R [Ω]": R, "K [W/K]": K, "dS/dT [V/K²]": p.seebeck.slope,
                                   "dR/dT [Ω/K]": p.resistance.slope, "dK/dT [W/K²]": p.conductance.slope,
                                   "at [K]": p.reference_temperature, "Z [1/K]": S**2 / (R * K),
                                   "largest misfit [%]": 100 * one.largest_misfit}
        return pd.DataFrame.from_dict(rows, orient="index")

    def misfits(self) -> pd.DataFrame:
        """Misfit of both sets in every number of every column.

        Returns
        -------
        pandas.DataFrame
            Columns: basis, Th [°C], Vmax, Imax, dTmax, Qmax, each predicted / sheet - 1 [%].
        """
        named = {"v_max": "Vmax [%]", "i_max": "Imax [%]", "dt_max": "dTmax [%]", "q_max": "Qmax [%]"}
        return pd.DataFrame([{"basis": one.basis, "Th [°C]": rating.t_hot - 273.15,
                              **{named[name]: 100 * value for name, value in off.items()}}
                             for one in (self.voltage, self.heat) if one is not None
                             for rating, off in zip(self.ratings, one.misfits, strict=True)])

    def __str__(self) -> str:
        return "\n".join([self.table().to_string(float_format="{:.5g}".format),
                          self.misfits().to_string(index=False, float_format="{:+.1f}".format), self.outcome.text])


def invert_datasheet(ratings: Sequence[Rating]) -> SheetInversion:
    """Properties of a single-stage module from the columns of its datasheet.

    Parameters
    ----------
    ratings : sequence of Rating
        Columns at different hot-side temperatures. One gives constant properties; two give their slopes; more give the
        straight lines of least squares.

    Returns
    -------
    SheetInversion

    Raises
    ------
    InputError
        No column; columns closer than 5 K; slopes that make a property negative.

    References
    ----------
    S. Lineykin and S. Ben-Yaakov, IEEE Transactions on Industry Applications 43 (2007) 505.
    Z. Luo, Electronics Cooling 14 (2008) 22.

    Examples
    --------
    >>> import robthermal as rt
    >>> cold = rt.thermal.Rating(t_hot=300.15, v_max=14.3, i_max=4.4, dt_max=60.0, q_max=37.7)
    >>> warm = rt.thermal.Rating(t_hot=323.15, v_max=15.5, i_max=4.3, dt_max=64.0, q_max=40.6)
    >>> found = rt.thermal.invert_datasheet([cold, warm])
    >>> round(found.voltage.properties.resistance.value, 3), round(found.voltage.properties.resistance.slope, 4)
    (2.746, 0.0138)
    >>> found.outcome.code, round(found.voltage.misfits[1]["q_max"], 3)
    ('disagrees', -0.101)
    """
    columns = tuple(sorted(ratings, key=lambda one: one.t_hot))
    if not columns or not all(isinstance(one, Rating) for one in columns):
        raise InputError(f"{len(columns)} columns", where="argument ratings", expected="one or more of class Rating",
                         remedy="rt.thermal.Rating(t_hot=300.15, v_max=…, i_max=…, dt_max=…, q_max=…)")
    close = [b for a, b in zip(columns[:-1], columns[1:], strict=True) if b.t_mean - a.t_mean < _APART]
    if close:
        raise InputError(f"two columns have mean temperatures within {_APART:g} K (hot side {close[0].t_hot:g} K)",
                         where="argument ratings", expected="columns at different hot-side temperatures",
                         remedy="Give one of them: their difference says nothing about slopes.")
    voltage = _inverted("voltage", columns, np.array([one.v_max / one.t_hot for one in columns]))
    heat = None
    if all(one.q_max is not None for one in columns):
        heat = _inverted("heat", columns, _seebeck_from_heat(columns))
    return SheetInversion(columns, voltage, heat, _outcome(voltage, heat))


def _inverted(basis: Basis, columns: tuple[Rating, ...], S: Array) -> Inversion:
    R = np.array([s * one.t_cold / one.i_max for s, one in zip(S, columns, strict=True)])
    K = np.array([s * one.t_cold * one.i_max / (2 * one.dt_max) for s, one in zip(S, columns, strict=True)])
    T = np.array([one.t_mean for one in columns])
    middle = float(T.mean())
    if S.min() <= 0:
        raise InputError(f"Qmax of the columns gives S = {S.min():.3g} V/K", where="argument ratings",
                         expected="a positive Seebeck coefficient", remedy="Check the columns; or use one of them.")
    properties = Properties(_line(T - middle, S), _line(T - middle, R), _line(T - middle, K), middle)
    predicted = tuple(properties.rated(one.t_hot, one.i_max) for one in columns)
    return Inversion(basis, properties, predicted,
                     tuple(misfit(found, one) for found, one in zip(predicted, columns, strict=True)))


def _line(above: Array, values: Array) -> Linear:
    """Straight line through the columns, by least squares; one column has no slope."""
    slope, at = np.polyfit(above, values, 1) if values.size > 1 else (0.0, values[0])
    return Linear(value=float(at), slope=float(slope))


def _seebeck_from_heat(columns: tuple[Rating, ...]) -> Array:
    """S of every column [V/K] from all Qmax: linear, because R of a column is proportional to its S."""
    T = np.array([one.t_mean for one in columns])
    at = np.array([one.t_hot for one in columns])
    degree = min(len(columns) - 1, 1)
    line = np.vander(at - T.mean(), degree + 1) @ np.linalg.pinv(np.vander(T - T.mean(), degree + 1))
    current = np.array([one.i_max for one in columns])
    per_S = np.array([one.t_cold / one.i_max for one in columns])  # R / S
    matrix = (at * current)[:, None] * line - 0.5 * (current**2)[:, None] * line * per_S
    return np.linalg.solve(matrix, np.array([one.q_max for one in columns], float))


def _outcome(voltage: Inversion, heat: Inversion | None) -> Outcome:
    if heat is None:
        return ThermalCode.UNCHECKED.outcome()
    worst = max((abs(one["q_max"]) for one in voltage.misfits), default=0.0)
    if worst <= _AGREE:
        return ThermalCode.AGREES.outcome(f"Vmax and Qmax agree within {worst:.1%}.")
    return ThermalCode.DISAGREES.outcome("The two inversions differ by more than 10 %:")
