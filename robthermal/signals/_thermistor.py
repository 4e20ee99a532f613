"""Thermistors: resistance, or the reading of a voltage divider, to temperature; open and shorted ones are told."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from .._celsius import ZERO_CELSIUS

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Thermistor(BaseModel):
    """Characteristic of a thermistor (NTC), and the circuit it is read with.

    Either ``r0`` and ``beta``, 1/T = 1/T0 + ln(R/R0)/beta, or the coefficients of Steinhart and Hart (1968),
    1/T = A + B ln R + C (ln R)³, with T in kelvin and R in ohm.

    Parameters
    ----------
    r0, beta : float, optional
        Resistance at `t0` [Ω], and the constant of the material [K].
    t0 : float
        Temperature at which the resistance is `r0` [°C].
    A, B, C : float, optional
        Coefficients of Steinhart and Hart [1/K].
    divider : float, optional
        Fixed resistor in series [Ω]: the cells are then voltages or counts of the divider, not ohms.
    full_scale : float, optional
        Reading at the voltage that supplies the divider, in the unit of the cells; with `divider`.
    thermistor_at : {"ground", "supply"}
        End of the divider that the thermistor is at.
    range : tuple of float
        Coldest and hottest temperature that can be true [°C]; readings beyond are an open or a shorted thermistor.

    Raises
    ------
    ValidationError
        Not one of the two characteristics, a divider without `full_scale`, a characteristic that does not fall.

    Examples
    --------
    >>> import robthermal as rt
    >>> ntc = rt.signals.Thermistor(r0=10000.0, beta=3950.0)
    >>> float(ntc.temperature(10000.0))
    298.15
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    r0: Positive | None = None
    beta: Positive | None = None
    t0: Annotated[float, Field(gt=-ZERO_CELSIUS, allow_inf_nan=False)] = 25.0
    A: Finite | None = None
    B: Positive | None = None
    C: Annotated[float, Field(ge=0, allow_inf_nan=False)] | None = None
    divider: Positive | None = None
    full_scale: Positive | None = None
    thermistor_at: Literal["ground", "supply"] = "ground"
    range: tuple[Finite, Finite] = (-55.0, 150.0)

    @model_validator(mode="after")
    def _complete(self) -> Thermistor:
        simple, full = (self.r0, self.beta), (self.A, self.B, self.C)
        if (None in simple) == (None in full) or any(v is not None for v in (simple if None in simple else full)):
            raise ValueError("give r0 and beta, or A, B and C")
        if (self.divider is None) != (self.full_scale is None):
            raise ValueError("divider and full_scale belong together: the resistor, and the reading at its supply")
        if not -ZERO_CELSIUS < self.range[0] < self.range[1]:
            raise ValueError("range is the coldest and the hottest temperature in °C")
        return self

    def resistance(self, cells: ArrayLike) -> NDArray[np.float64]:
        """Resistance behind readings.

        Parameters
        ----------
        cells : array_like
            Resistances [Ω], or readings of the divider in the unit of `full_scale`.

        Returns
        -------
        ndarray
            Resistances [Ω]; infinite for an open circuit, 0 or less for a short.

        Examples
        --------
        >>> import robthermal as rt
        >>> ntc = rt.signals.Thermistor(r0=10000.0, beta=3950.0, divider=10000.0, full_scale=1023.0)
        >>> ntc.resistance([341.0, 1023.0]).tolist()
        [5000.0, inf]
        """
        values = np.asarray(cells, dtype=float)
        if self.divider is None or self.full_scale is None:
            return values
        share = values / self.full_scale if self.thermistor_at == "ground" else 1.0 - values / self.full_scale
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(share >= 1.0, np.inf, self.divider * share / (1.0 - share))

    def temperature(self, cells: ArrayLike) -> NDArray[np.float64]:
        """Temperature behind readings.

        Parameters
        ----------
        cells : array_like
            Resistances [Ω], or readings of the divider in the unit of `full_scale`.

        Returns
        -------
        ndarray
            Temperatures [K], not yet compared with `range`: 0 for an open circuit, infinite for a short.

        Examples
        --------
        >>> import robthermal as rt
        >>> ntc = rt.signals.Thermistor(A=1.129241e-3, B=2.341077e-4, C=8.775468e-8)
        >>> [round(float(t), 2) for t in ntc.temperature([32650.8, 10000.0, 3602.7])]
        [273.15, 298.15, 323.15]
        """
        resistance = self.resistance(cells)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            log = np.log(np.where(resistance > 0.0, resistance, np.nan))
            if self.r0 is not None and self.beta is not None:
                inverse = 1.0 / (self.t0 + ZERO_CELSIUS) + (log - np.log(self.r0)) / self.beta
            else:
                assert self.A is not None and self.B is not None and self.C is not None  # by _complete
                inverse = self.A + self.B * log + self.C * log**3
            found = np.where(inverse > 0.0, 1.0 / inverse, np.inf)  # beyond the characteristic: hotter than anything
        return np.where(np.isnan(resistance), np.nan, np.where(resistance > 0.0, found, np.inf))

    def __str__(self) -> str:
        law = (f"beta = {self.beta:g} K, {self.r0:g} Ω at {self.t0:g} °C" if self.beta is not None else
               f"A = {self.A:g}, B = {self.B:g}, C = {self.C:g} 1/K")
        circuit = "" if self.divider is None else (
            f", at the {self.thermistor_at} end of a divider with {self.divider:g} Ω, full scale {self.full_scale:g}")
        return f"thermistor with {law}{circuit}"
