"""Convection law of a body of one temperature, from the steady states of a staircase of heat. Evers (2.13)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from .._arrays import Floats
from .._pandas import pd
from ..errors import InputError, Outcome
from ..signals import Record
from ._convection_law import ConvectionLaw, law_at
from ._outcomes import CalibrationCode
from ._plateaus import Plateau, column, plateaus

_SETTLED = 0.01  # drift over the tail, as a part of the temperature difference, up to which a plateau counts as steady
_UNKNOWN = 3
BOUNDS = ([0.0, 0.0, 0.01], [np.inf, np.inf, 1.0])  # of a, b and c
_UNIFORM = 0.1  # spread of the readings, as a part of the temperature difference, up to which a body counts as uniform
_KELVIN = (200.0, 700.0)  # a reading of no stated unit in this range is taken for a temperature


def convection_law(record: Record, *, heater: str, sensor: str | Sequence[str], ambient: str, area: float,
                   gain: float = 1.0) -> ConvectionLaw:
    """Convection law of a body of uniform temperature, from the steady states of a staircase of heat.

    At every steady plateau all heat leaves through the surface: h = gain · u / (area ΔT). Plateaus without heat, and
    those that still drift by more than 1 % of ΔT over their last fifth, are left out.

    A body of several temperatures has no such law: its warm end loses more, its cold end less than this formula says.
    Where the thermometers of the record differ by more than 10 % of ΔT, the outcome is "not_uniform" and the covariance
    infinite; take `convection_of_body`.

    Parameters
    ----------
    record : Record
        Measured staircase of heat.
    heater, ambient : str
        Columns: heat [unit], temperature of the air [K].
    sensor : str or sequence of str
        Columns: temperatures of the body [K]; ΔT is their mean. The other thermometers of the record are compared with
        them; leave out those of other bodies, `record.select(outputs=…)`.
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
    named = [sensor] if isinstance(sensor, str) else list(sensor)
    readings = np.array([column(record, name) for name in named])
    if not len(readings):
        raise InputError("no sensor is named", where="argument sensor", expected="one or more columns")
    difference = readings.mean(axis=0) - column(record, ambient)
    steady = warm_and_steady(record, heater, difference)
    excess = np.array([p.tail(difference).mean() for p in steady])
    heat = gain * np.array([p.level for p in steady])
    law = _fitted(excess, heat, area)
    others = [name for name in record.output_names if name not in (*named, ambient) and _is_temperature(record, name)]
    body = np.vstack([readings, *(column(record, name) for name in others)])
    spread = np.array([np.ptp([p.tail(reading).mean() for reading in body]) for p in steady])
    law = replace(law, points=law.points.assign(spread=spread))
    if (spread <= _UNIFORM * excess).all():
        return law
    worst = float((spread / excess).max())
    return replace(law, covariance=np.full((3, 3), math.inf), outcome=CalibrationCode.NOT_UNIFORM.outcome(
        f"The thermometers {', '.join([*named, *others])} differ by up to {worst:.0%} of the mean difference to the "
        f"air: the body has no one temperature, and h is wrong by as much."))


def warm_and_steady(record: Record, heater: str, difference: Floats) -> list[Plateau]:
    """Plateaus with heat at whose end a temperature difference had settled; at least three."""
    steady = [p for p in plateaus(record, heater, _UNKNOWN) if p.level > 0 and _is_steady(p, difference)]
    if len(steady) < _UNKNOWN:
        raise InputError(f"{len(steady)} plateaus of {heater!r} are warm and steady", where="argument record",
                         expected=f"at least {_UNKNOWN}",
                         remedy="Wait longer at every step: five of the slowest time constants.")
    return steady


def _is_temperature(record: Record, name: str) -> bool:
    unit = record.units.get(name)
    median = float(np.median(column(record, name)))
    return unit == "K" or (unit is None and _KELVIN[0] < median < _KELVIN[1])


def _is_steady(plateau: Plateau, difference: Floats) -> bool:
    mean = float(plateau.tail(difference).mean())
    return mean > 0 and abs(plateau.drift(difference)) < _SETTLED * mean


def _fitted(excess: Floats, heat: Floats, area: float) -> ConvectionLaw:
    h = heat / (area * excess)
    scale = float(h.mean())
    run = scipy.optimize.least_squares(
        lambda p: (law_at(p, excess) - h) / scale, [scale / 2, scale / 2 / excess.mean() ** 0.25, 0.25],
        bounds=BOUNDS, x_scale=[scale, scale, 1.0], xtol=1e-12, ftol=1e-12, gtol=1e-12)
    spare = h.size - _UNKNOWN
    variance = 2.0 * float(run.cost) / spare if spare else math.inf
    information = run.jac.T @ run.jac
    flat = is_flat(information)
    covariance = np.full((3, 3), math.inf) if flat or not spare else variance * np.linalg.inv(information)
    points = pd.DataFrame({"difference": excess, "coefficient": h, "heat": heat})
    a, b, c = run.x.tolist()
    return ConvectionLaw(a, b, c, covariance, area, points, outcome_of(h.size, flat or bool(np.any(run.active_mask))))


def is_flat(information: Floats) -> bool:
    """Whether the plateaus leave a direction of (a, b, c) open."""
    size = np.sqrt(np.diag(information))
    return bool(not size.all() or np.linalg.cond(information / np.outer(size, size)) > 1e12)


def outcome_of(n: int, undetermined: bool) -> Outcome:
    """What a fit to n plateaus comes to."""
    if not undetermined:
        return CalibrationCode.FITTED.outcome(f"Fitted to {n} plateaus.")
    return CalibrationCode.UNDETERMINED.outcome(
        "The plateaus do not determine a, b and c together, or one of them is at its bound (a, b ≥ 0, "
        "0.01 ≤ c ≤ 1).", remedy="Use steps over a wider range of temperatures.")
