"""Thermoelectric module from the four numbers of a datasheet: both inversions, and how far they disagree."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..errors import InputError, Outcome
from ._outcomes import ThermalCode
from ._parts import Linear, Module
from ._rating import Rating

_AGREE = 0.1  # sheets that disagree with themselves by more are told apart; published rows reach 16 %


@dataclass(frozen=True)
class ModuleParameters:
    """Constant properties of a thermoelectric module.

    Parameters
    ----------
    seebeck : float
        Seebeck coefficient S of the module [V/K].
    resistance : float
        Electrical resistance R of the module [Ω].
    conductance : float
        Thermal conductance K of the module [W/K].

    Examples
    --------
    >>> import robthermal as rt
    >>> round(rt.thermal.ModuleParameters(seebeck=0.05, resistance=2.0, conductance=0.5).figure_of_merit, 6)
    0.0025
    """

    seebeck: float
    resistance: float
    conductance: float

    @property
    def figure_of_merit(self) -> float:
        """Z = S²/(R K) [1/K]."""
        return self.seebeck**2 / (self.resistance * self.conductance)


@dataclass(frozen=True)
class DatasheetFit:
    """A datasheet inverted twice: four rated numbers, three unknowns.

    Parameters
    ----------
    v_max, i_max, dt_max, q_max, t_hot : float
        The sheet [V], [A], [K], [W] or None, [K].
    voltage : ModuleParameters
        From Vmax, Imax, dTmax: Lineykin and Ben-Yaakov (2007).
    heat : ModuleParameters or None
        From Qmax, Imax, dTmax; None without Qmax.
    q_max_misfit : float or None
        Qmax predicted by `voltage`, relative to the sheet [-]: +0.16 says 16 % above.
    v_max_misfit : float or None
        Vmax predicted by `heat`, relative to the sheet [-].
    outcome : Outcome
        Whether the sheet agrees with itself.
    """

    v_max: float
    i_max: float
    dt_max: float
    q_max: float | None
    t_hot: float
    voltage: ModuleParameters
    heat: ModuleParameters | None
    q_max_misfit: float | None
    v_max_misfit: float | None
    outcome: Outcome

    def module(self, hot: str, cold: str, *, basis: Literal["voltage", "heat"] = "voltage",
               current_limits: tuple[float, float] | None = None) -> Module:
        """Module with constant properties between two lumps.

        Parameters
        ----------
        hot, cold : str
            Lumps of the two faces.
        basis : {"voltage", "heat"}
            Which parameter set.
        current_limits : tuple of float, optional
            [A]; Imax is where dT is largest, not a limit of damage, so none is set by default.

        Returns
        -------
        Module

        Raises
        ------
        InputError
            Unknown basis, or "heat" without Qmax.
        """
        if basis not in ("voltage", "heat"):
            raise InputError(f"{basis!r}", where="argument basis", expected='"voltage" or "heat"',
                             remedy="Choose one of them.")
        chosen = self.voltage if basis == "voltage" else self.heat
        if chosen is None:
            raise InputError('"heat" needs Qmax, which this sheet does not give', where="argument basis",
                             remedy='Give q_max, or use basis="voltage".')
        return Module(hot=hot, cold=cold, seebeck=Linear(value=chosen.seebeck),
                      resistance=Linear(value=chosen.resistance), conductance=Linear(value=chosen.conductance),
                      current_limits=current_limits)

    def __str__(self) -> str:
        lines = [f"{'from':8} {'S [V/K]':>10} {'R [Ω]':>10} {'K [W/K]':>10} {'Z [1/K]':>10}   predicts"]
        lines.append(_row("Vmax", self.voltage, "Qmax", self.q_max_misfit))
        if self.heat is not None:
            lines.append(_row("Qmax", self.heat, "Vmax", self.v_max_misfit))
        return "\n".join([*lines, self.outcome.text])


def module_from_datasheet(*, v_max: float, i_max: float, dt_max: float, t_hot: float,
                          q_max: float | None = None) -> DatasheetFit:
    """Invert the rated values of a single-stage thermoelectric module.

    With constant S, R, K the sheet says: at Imax the cold face reaches Th - dTmax without load, Vmax is the voltage
    there, and Qmax is the heat pumped at Imax without temperature difference. Hence, from Vmax (Lineykin and
    Ben-Yaakov), S = Vmax/Th, R = Vmax (Th - dTmax)/(Imax Th), K = Vmax Imax (Th - dTmax)/(2 Th dTmax); from Qmax,
    S = 2 Qmax/(Imax (Th + dTmax)), R = S (Th - dTmax)/Imax, K = S (Th - dTmax) Imax/(2 dTmax).

    Parameters
    ----------
    v_max : float
        Rated voltage at the current of largest temperature difference [V].
    i_max : float
        Rated current of largest temperature difference [A].
    dt_max : float
        Largest temperature difference between the faces [K], without heat load.
    t_hot : float
        Hot-side temperature at which the sheet holds [K]; vendors use 25, 27 or 50 °C.
    q_max : float, optional
        [W]; without it nothing checks the sheet.

    Returns
    -------
    DatasheetFit

    Raises
    ------
    InputError
        A number that is missing, not positive, or by its size in another unit.

    References
    ----------
    S. Lineykin and S. Ben-Yaakov, IEEE Transactions on Industry Applications 43 (2007) 505.
    F. L. Tan and S. C. Fok, Energy Conversion and Management 49 (2008) 1715: good to about two thirds of Imax.

    Examples
    --------
    >>> import robthermal as rt
    >>> print(rt.thermal.module_from_datasheet(v_max=15.4, i_max=6.0, dt_max=67.0, q_max=51.4, t_hot=298.0))
    from        S [V/K]      R [Ω]    K [W/K]    Z [1/K]   predicts
    Vmax        0.05168     1.9896    0.53452   0.002511   Qmax +10.1 %
    Qmax        0.04694     1.8072    0.48552   0.002511   Vmax -9.2 %
    The two inversions differ by more than 10 %: ...
    """
    sheet = Rating(t_hot, v_max, i_max, dt_max, q_max)
    voltage = _parameters(sheet.v_max / sheet.t_hot, sheet)
    if sheet.q_max is None:
        return DatasheetFit(sheet.v_max, sheet.i_max, sheet.dt_max, None, sheet.t_hot, voltage, None, None, None,
                            ThermalCode.UNCHECKED.outcome())
    heat = _parameters(2 * sheet.q_max / (sheet.i_max * (sheet.t_hot + sheet.dt_max)), sheet)
    q_misfit = 0.5 * voltage.seebeck * sheet.i_max * (sheet.t_hot + sheet.dt_max) / sheet.q_max - 1
    v_misfit = heat.seebeck * sheet.t_hot / sheet.v_max - 1
    return DatasheetFit(sheet.v_max, sheet.i_max, sheet.dt_max, sheet.q_max, sheet.t_hot, voltage, heat, q_misfit,
                        v_misfit, _outcome(q_misfit))


def _parameters(S: float, sheet: Rating) -> ModuleParameters:
    """R and K from S: at dTmax the current is optimal, I = S Tc/R, and the heat balance closes without load."""
    return ModuleParameters(S, S * sheet.t_cold / sheet.i_max, S * sheet.t_cold * sheet.i_max / (2 * sheet.dt_max))


def _outcome(misfit: float) -> Outcome:
    if abs(misfit) <= _AGREE:
        return ThermalCode.AGREES.outcome(f"Vmax and Qmax agree within {abs(misfit):.1%}.")
    return ThermalCode.DISAGREES.outcome("The two inversions differ by more than 10 %:")


def _row(name: str, p: ModuleParameters, predicted: str, misfit: float | None) -> str:
    end = "" if misfit is None else f"   {predicted} {misfit * 100:+.1f} %"
    return f"{name:8} {p.seebeck:10.5f} {p.resistance:10.5g} {p.conductance:10.5f} {p.figure_of_merit:10.4g}{end}"
