"""Convection law of a body of several temperatures: its lumped model, a coefficient per plateau, a law over all."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import scipy

from .._arrays import Floats
from .._pandas import pd
from ..errors import InputError
from ..signals import Record
from ..thermal import System
from ._body import Body, Course
from ._convection import BOUNDS, is_flat, outcome_of
from ._convection_law import ConvectionLaw
from ._outcomes import CalibrationCode
from ._plateaus import plateaus

_EXPLAINED = 0.02  # rms of what the model leaves of the readings, as a part of the mean difference to the air
_UNKNOWN = 3
_NUDGE = 1e-5  # of a parameter, in units of its scale, for a difference quotient


def convection_of_body(system: System, record: Record, *, heater: str, ambient: str, film: float) -> ConvectionLaw:
    """Convection law of a body whose temperature is not uniform, from a staircase of heat and a model of the body.

    The procedure of Evers, Sec. 2.4.3: on every plateau the film coefficient is tuned until the simulated body ends at
    the temperatures that were measured; these are the points. The law itself is fitted to the ends (the last fifths) of
    all plateaus at once, with every lump losing heat by the law at its own temperature, because a + b ΔT^c at the mean
    ΔT is not the mean of a + b ΔT^c. Room and heaters are simulated as recorded, so that a moving room does no harm.
    The body is taken to be at the mean of the first readings at the start. Long records are averaged to 1500 steps.

    Parameters
    ----------
    system : System
        Model of the body; its links to the ambient are films of one coefficient, as `thermal.Assembly` makes them.
    record : Record
        Staircase of one heater, and a column for every other input of the system, which may be on. Its thermometers are
        compared with the model's.
    heater : str
        Input with the staircase.
    ambient : str
        The air, measured in the record.
    film : float
        Film coefficient with which the system's links to the ambient were made; it tells their areas [W/(m² K)].

    Returns
    -------
    ConvectionLaw
        Its covariance takes all that one plateau is off by as one disturbance. `ConvectionLaw.applied` puts the law
        into the system.

    Raises
    ------
    InputError
        No thermometer in both, an input without a column, no film, a system that is not linear apart from its films, a
        heater that is no staircase, fewer than three plateaus on which the body is warmed.

    References
    ----------
    Evers (2021), Sec. 2.4.3 and 2.5.2.2; Bergman et al. (2011), Fundamentals of heat and mass transfer, Sec. 9.6.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> def rod(film):
    ...     a = rt.thermal.Assembly()
    ...     a.ambient("room", 295.0)
    ...     names = a.rod("rod", length=0.2, area=5e-4, material="stainless 304", lumps=8, perimeter=0.08,
    ...                   convection=film, ambient="room")
    ...     return a.system(inputs={"q": {"lump": names[0]}}, sensors={"T1": {"lump": names[1]},
    ...                                                                "T2": {"lump": names[6]}})
    >>> heat = np.repeat([0.25, 0.5, 1.0, 2.0, 4.0], 100)
    >>> empty = rt.Record(sample_time=200.0, inputs=np.column_stack([heat, np.full(500, 295.0)]),
    ...                   outputs=np.zeros((500, 0)), input_names=["q", "room"], output_names=[])
    >>> truth = rt.calibration.ConvectionLaw(4.0, 2.0, 0.25, np.zeros((3, 3)), 0.016, None, None)
    >>> record = rt.thermal.simulate(truth.applied(rod(10.0), ambient="room", film=10.0), empty)
    >>> found = rt.calibration.convection_of_body(rod(10.0), record, heater="q", ambient="room", film=10.0)
    >>> round(found.a, 2), round(found.b, 2), round(found.c, 3)
    (4.0, 2.0, 0.25)
    """
    body = Body.of(system, ambient, film, heater, record)
    course = Course.of(body, record)
    warm = [p for p in plateaus(record, heater, _UNKNOWN) if p.level > 0]
    ends = [course.end(plateau) for plateau in warm]
    measured = np.array([course.readings[end].mean(axis=0) for end in ends])
    air = np.array([course.air[end].mean() for end in ends])
    excess = measured.mean(axis=1) - air if len(ends) else np.zeros(0)
    if len(ends) < _UNKNOWN or not (excess > 0).all():
        raise InputError(f"{int((excess > 0).sum())} plateaus of {heater!r} warm the body above the air",
                         where="argument record", expected=f"at least {_UNKNOWN}, and none on which it is colder")
    found = _Fit(body, course, ends, measured, film)
    p = found.law(film, float(excess.mean()))
    states = found.states(p[None])[:, 0]
    tuned = [_tuned(body, course, end, states[course.begin(plateau)], course.begin(plateau), film)
             for plateau, end in zip(warm, ends, strict=True)]
    lumps = np.array([course.between(states)[end].mean(axis=0) for end in ends])
    residuals = found.misses(states[:, None])[0]
    points = pd.DataFrame({
        "difference": np.average(lumps, axis=1, weights=body.surface) - air, "coefficient": tuned,
        "heat": [system.inputs[heater].gain * plateau.level for plateau in warm],
        "spread": np.ptp(lumps[:, body.surface > 0], axis=1), "residual": np.sqrt(np.mean(residuals**2, axis=1))})
    return _judged(p, found.slopes(p), residuals, points, float(body.surface.sum()))


class _Fit:
    """Least squares over the ends of all plateaus."""

    def __init__(self, body: Body, course: Course, ends: list[slice], measured: Floats, film: float) -> None:
        self.body, self.course, self.ends, self.measured = body, course, ends, measured
        self.scale = np.array([film, film, 1.0])
        self._both = lru_cache(maxsize=1)(self._evaluate)

    def states(self, laws: Floats) -> Floats:
        """Temperatures (N + 1, P, n) of the whole record under laws (P, 3)."""
        start = np.full(self.body.surface.size, self.course.readings[0].mean())
        return self.body.run(laws, self.course, 0, self.ends[-1].stop, start)

    def misses(self, states: Floats) -> Floats:
        """Modeled less measured readings at the ends of the plateaus, (P, n_plateaus, n_sensors)."""
        seen = self.body.seen(self.course.between(states))
        return np.stack([seen[end].mean(axis=0) for end in self.ends], axis=1) - self.measured

    def _evaluate(self, p: tuple[float, ...]) -> tuple[Floats, Floats]:
        nudged = np.array(p) + np.vstack([np.zeros(_UNKNOWN), _NUDGE * np.diag(self.scale)])
        misses = self.misses(self.states(nudged))
        slopes = (misses[1:] - misses[0]) / (_NUDGE * self.scale)[:, None, None]
        return misses[0], np.moveaxis(slopes, 0, -1)

    def slopes(self, p: Floats) -> Floats:
        """Derivatives of the misses, (n_plateaus, n_sensors, 3)."""
        return self._both(tuple(p))[1]

    def law(self, film: float, excess: float) -> Floats:
        """The best a, b, c."""
        run = scipy.optimize.least_squares(
            lambda p: self._both(tuple(p))[0].ravel(), [film / 2, film / 2 / excess**0.25, 0.25],
            jac=lambda p: self.slopes(p).reshape(-1, _UNKNOWN), bounds=BOUNDS, x_scale=self.scale, xtol=1e-7)
        return np.asarray(run.x, np.float64)


def _tuned(body: Body, course: Course, end: slice, x: Floats, begin: int, film: float) -> float:
    """The one coefficient with which the body, from x at the begin of a plateau, ends at the readings [W/(m² K)]."""
    def miss(h: Floats) -> Floats:
        states = course.between(body.run(np.array([[h[0], 0.0, 0.25]]), course, begin, end.stop, x))
        return (body.seen(states[end.start - begin:, 0]) - course.readings[end]).mean(axis=0)

    run = scipy.optimize.least_squares(miss, [film], bounds=([1e-6 * film], [np.inf]), x_scale=[film], xtol=1e-5)
    return float(run.x[0])


def _judged(p: Floats, slopes: Floats, residuals: Floats, points: pd.DataFrame, area: float) -> ConvectionLaw:
    n = len(points)
    information = np.einsum("kia,kib->ab", slopes, slopes)
    flat = is_flat(information)
    covariance = np.full((_UNKNOWN, _UNKNOWN), math.inf)
    if not flat and n > _UNKNOWN:
        # Sandwich: the readings of one plateau share its air and are off together.
        scores, inverse = np.einsum("kia,ki->ka", slopes, residuals), np.linalg.inv(information)
        covariance = n / (n - _UNKNOWN) * inverse @ scores.T @ scores @ inverse
    rms = float(np.sqrt(np.mean(residuals**2)))
    part = rms / float(points["difference"].mean())
    low, high = np.array(BOUNDS)
    outcome = outcome_of(n, flat or bool((p <= low * (1 + 1e-6) + 1e-9).any() or (p >= high * (1 - 1e-6)).any()))
    if part > _EXPLAINED:
        covariance = np.full((_UNKNOWN, _UNKNOWN), math.inf)
        outcome = CalibrationCode.NOT_EXPLAINED.outcome(
            f"With the best law the model is still {part:.0%} of the mean difference to the air away from the readings "
            f"(rms {rms:.2g} K).")
    a, b, c = p.tolist()
    return ConvectionLaw(a, b, c, covariance, area, points, outcome)
