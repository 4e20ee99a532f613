"""Convection coefficient as a function of the temperature difference, from a staircase of heat. Evers (2.13)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from .._arrays import Floats
from .._pandas import pd
from ..errors import InputError, Outcome
from ..signals import Record
from ._outcomes import CalibrationCode
from ._plateaus import Plateau, column, plateaus

_SETTLED = 0.01  # drift over the tail, as a part of the temperature difference, up to which a plateau counts as steady
_UNKNOWN = 3


@dataclass(frozen=True, eq=False)
class ConvectionLaw:
    """h(ΔT) = a + b ΔT^c.

    Parameters
    ----------
    a, b, c : float
        Coefficients of the law: at rest [W/(m² K)], its rise [W/(m² K^(1+c))], exponent [-].
    covariance : ndarray, shape (3, 3)
        Of (a, b, c), from the scatter of the points; infinite with three points.
    area : float
        Surface that loses the heat [m²].
    points : pandas.DataFrame
        Per steady plateau: "difference" ΔT [K], "coefficient" h [W/(m² K)], "heat" [W].
    outcome : Outcome
        Codes "fitted", or "undetermined" (not ok) where the points do not determine all three.
    """

    a: float
    b: float
    c: float
    covariance: Floats
    area: float
    points: pd.DataFrame
    outcome: Outcome

    def coefficient(self, difference: Any) -> Floats:
        """The law at some temperature differences.

        Parameters
        ----------
        difference : array_like
            Between body and air [K].

        Returns
        -------
        ndarray
            h [W/(m² K)].
        """
        return _law(np.array([self.a, self.b, self.c]), np.abs(np.asarray(difference, np.float64)))

    def link(self) -> dict[str, Any]:
        """The law as keys of a system's link: conductance [W/K] and natural convection."""
        return {"conductance": self.a * self.area, "natural": {"gain": self.b * self.area, "exponent": self.c}}

    def __str__(self) -> str:
        names = zip("abc", (self.a, self.b, self.c), np.sqrt(np.diag(self.covariance)), strict=True)
        return "\n".join([*(f"{name}  {value:.4g} ± {std:.2g}" for name, value, std in names), str(self.outcome)])


def convection_law(record: Record, *, heater: str, sensor: str, ambient: str, area: float,
                   gain: float = 1.0) -> ConvectionLaw:
    """Convection law of a body of uniform temperature, from the steady states of a staircase of heat.

    At every steady plateau all heat leaves through the surface: h = gain · u / (area ΔT). Plateaus without heat, and
    those that still drift by more than 1 % of ΔT over their last fifth, are left out.

    Parameters
    ----------
    record : Record
        Measured staircase of heat.
    heater, sensor, ambient : str
        Columns: heat [unit], temperature of the body [K], temperature of the air [K].
    area : float
        Surface that loses the heat [m²].
    gain : float
        Of the heater [W per unit].

    Returns
    -------
    ConvectionLaw

    Raises
    ------
    InputError
        Unknown columns, a heater that is no staircase, fewer than three steady plateaus, an area that is not positive.

    References
    ----------
    Evers (2021), Sec. 2.4.3, (2.13).

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> law = {"conductance": 0.05, "natural": {"gain": 0.02, "exponent": 0.25}}
    >>> body = rt.System(ambients={"air": {"temperature": 295.0}}, lumps={"x": {"capacity": 5.0}},
    ...                  links=[{"between": ("x", "air"), **law}], inputs={"q": {"lump": "x"}},
    ...                  sensors={"T": {"lump": "x"}})
    >>> heat = np.repeat([0.5, 1.0, 2.0, 4.0, 8.0], 100)
    >>> empty = rt.Record(sample_time=20.0, inputs=np.column_stack([heat, np.full(500, 295.0)]),
    ...                   outputs=np.zeros((500, 0)), input_names=["q", "air"], output_names=[])
    >>> found = rt.calibration.convection_law(rt.thermal.simulate(body, empty), heater="q", sensor="T", ambient="air",
    ...                                       area=0.01)
    >>> round(found.a, 2), round(found.b, 2), round(found.c, 3)
    (5.0, 2.0, 0.25)
    """
    for name, value in (("area", area), ("gain", gain)):
        if not (math.isfinite(value) and value > 0):
            raise InputError(f"{name} = {value!r}", where=f"argument {name}", expected="a positive number")
    difference = column(record, sensor) - column(record, ambient)
    steady = [p for p in plateaus(record, heater, _UNKNOWN) if p.level > 0 and _is_steady(p, difference)]
    if len(steady) < _UNKNOWN:
        raise InputError(f"{len(steady)} plateaus of {heater!r} are warm and steady", where="argument record",
                         expected=f"at least {_UNKNOWN}",
                         remedy="Wait longer at every step: five of the slowest time constants.")
    excess = np.array([p.tail(difference).mean() for p in steady])
    heat = gain * np.array([p.level for p in steady])
    return _fitted(excess, heat, area)


def _is_steady(plateau: Plateau, difference: Floats) -> bool:
    mean = float(plateau.tail(difference).mean())
    return mean > 0 and abs(plateau.drift(difference)) < _SETTLED * mean


def _law(p: Floats, excess: Floats) -> Floats:
    return np.asarray(p[0] + p[1] * excess ** p[2], np.float64)


def _fitted(excess: Floats, heat: Floats, area: float) -> ConvectionLaw:
    h = heat / (area * excess)
    scale = float(h.mean())
    run = scipy.optimize.least_squares(
        lambda p: (_law(p, excess) - h) / scale, [scale / 2, scale / 2 / excess.mean() ** 0.25, 0.25],
        bounds=([0.0, 0.0, 0.01], [np.inf, np.inf, 1.0]), x_scale=[scale, scale, 1.0], xtol=1e-12, ftol=1e-12,
        gtol=1e-12)
    spare = h.size - _UNKNOWN
    variance = 2.0 * float(run.cost) / spare if spare else math.inf
    information = run.jac.T @ run.jac
    size = np.sqrt(np.diag(information))
    flat = not size.all() or np.linalg.cond(information / np.outer(size, size)) > 1e12
    covariance = np.full((3, 3), math.inf) if flat or not spare else variance * np.linalg.inv(information)
    points = pd.DataFrame({"difference": excess, "coefficient": h, "heat": heat})
    outcome = CalibrationCode.FITTED.outcome(f"Fitted to {h.size} steady plateaus.")
    if flat or np.any(run.active_mask):
        outcome = CalibrationCode.UNDETERMINED.outcome(
            "The plateaus do not determine a, b and c together, or one of them is at its bound (a, b ≥ 0, "
            "0.01 ≤ c ≤ 1).", remedy="Use steps over a wider range of temperatures.")
    a, b, c = run.x.tolist()
    return ConvectionLaw(a, b, c, covariance, area, points, outcome)
