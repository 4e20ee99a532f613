"""State feedback of the currents of thermoelectric modules, with the set of starts from which it is proven to work."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._celsius import ZERO_CELSIUS
from .._checks import finite_number, positive_number, quoted
from .._control import control
from .._drawing import axes_for
from ..certify import scheduled
from ..errors import InputError, Outcome
from ..export import Program
from ..synthesis import FeedbackDesign, RobustAgainst, SynthesisCode
from ..thermal import System, steady_state
from ..verification import Certificate
from ._export_currents import currents_program
from ._modules import Array
from ._numbers import numbers
from ._tem_hull import TemHull, read_box, tem_hull
from ._tem_program import Ellipsoid, largest_ball, most_of_any_form

_QUARTERS, _HALVINGS = 7, 4  # of the rate, where the one asked for is not reached
_SHARES = (1.0, 0.5, 0.25, 0.1)  # of the room of the currents: samples may need smaller gains
_FASTER = (1.1, 1.5, 2.5)  # times the rate asked for, of the feedback without samples
_METHOD = "state feedback over a box of temperatures and currents (matrix inequalities)"


@dataclass(frozen=True)
class TemFeedback(FeedbackDesign):
    """A current law I = I0 + F (x - x0), proven for the nonlinear set-up from an ellipsoid of starts.

    Parameters
    ----------
    controller : control.StateSpace
        F as a system from x - x0 [K] to I - I0 [A]; zero where none was found.
    value : float
        Minus the proven rate [1/s]; infinity where nothing is proven.
    lower : float
        Always -infinity: no bound on what other laws reach.
    closed_loop : control.StateSpace
        Loop at the operating point, from what is added to the currents to the temperatures, in floats.
    certificates : list of Certificate
        Kind "scheduled", about the system, the box and F; `rt.verify` checks it again.
    robust_against : RobustAgainst
        What the claim covers.
    outcome : Outcome
        How it ended; its text is the remedy.
    method : str
        Program that gave the gain.
    solver : str
        What solved it.
    solve_time : float
        Time of the whole synthesis with its proof [s].
    iterations : int
        Programs that were solved.
    plant : GeneralizedPlant or None
        Always None: the plant is not linear.
    gain : ndarray, shape (n_modules, n_lumps)
        Feedback F of the currents [A/K].
    matrix : ndarray, shape (n_lumps, n_lumps)
        P of V = (x - x0)'P(x - x0) [1/K²].
    rate : float
        Proven rate: V of the distance to the equilibrium falls at least as exp(-2 rate t) [1/s].
    plants : tuple of control.StateSpace
        Linear plant at the operating point.
    level : float
        Largest V of a start [-]; 0 where nothing is proven.
    operating_temperatures, operating_current : mapping
        {lump: temperature} x0 [K], {module: current} I0 [A].
    temperature, current_limits : mapping
        Box of the claim: {lump: (lower, upper)} [K], {module: (lower, upper)} [A].
    sample_time : float
        Time between two readings of the temperatures, the currents held in between [s]; 0: at every moment.
    """

    level: float = 0.0
    operating_temperatures: Mapping[str, float] = field(default_factory=dict)
    operating_current: Mapping[str, float] = field(default_factory=dict)
    temperature: Mapping[str, tuple[float, float]] = field(default_factory=dict, repr=False)
    current_limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    sample_time: float = 0.0

    @cached_property
    def semi_axes(self) -> Array:
        """Semi-axes of the ellipsoid of starts, rising [K]."""
        found: Array = np.sqrt(self.level / np.linalg.eigvalsh(self.matrix)[::-1])
        return found

    def current(self, temperatures: ArrayLike | Mapping[str, float]) -> Array:
        """Return the currents of the law, limited to their ranges [A].

        Parameters
        ----------
        temperatures : array_like or mapping
            Lump temperatures, (..., n_lumps) in the order of the system, or {lump: temperature} [K].

        Returns
        -------
        ndarray, shape (..., n_modules)

        Raises
        ------
        InputError
            Other names or another number of temperatures.
        """
        names = list(self.operating_temperatures)
        if isinstance(temperatures, Mapping):
            missing = [name for name in names if name not in temperatures]
            if missing:
                raise InputError(f"lump {missing[0]!r} has no temperature", where="argument temperatures",
                                 expected=f"all of {', '.join(names)}")
            temperatures = [temperatures[name] for name in names]
        x = numbers(temperatures, "temperatures")
        if x.ndim == 0 or x.shape[-1] != len(names):
            raise InputError(f"temperatures of shape {x.shape}", where="argument temperatures",
                             expected=f"{len(names)} in the last axis: {', '.join(names)}")
        low, high = np.array(list(self.current_limits.values())).T
        wanted = np.array(list(self.operating_current.values())) + (x - list(self.operating_temperatures.values())
                                                                    ) @ self.gain.T
        return np.clip(wanted, low, high)

    @property
    def has_source(self) -> bool:
        """Whether `export` writes C source: of a law whose proof covers samples."""
        return bool(self.holds and self.sample_time)

    @property
    def _no_source(self) -> str:
        return ("C source runs in samples, which this proof does not cover: design with sample_time=." if self.holds
                else "No law was proven, and none is written.")

    def _source(self, name: str) -> Program:
        return currents_program(self.gain, self.operating_temperatures, self.operating_current, self.current_limits,
                                self.temperature, self.sample_time, name, self._said)

    def _facts(self) -> dict[str, Any]:
        return super()._facts() | {"level": self.level, "operating_temperatures": dict(self.operating_temperatures),
                                   "operating_current": dict(self.operating_current), "sample_time": self.sample_time,
                                   "current_limits": dict(self.current_limits), "temperature": dict(self.temperature)}

    def __str__(self) -> str:
        words = super().__str__()
        if not self.holds:
            return words
        rest = ", ".join(f"{name} {value - ZERO_CELSIUS:.2f} °C" for name, value in self.operating_temperatures.items())
        amperes = ", ".join(f"{name} {value:.4g} A" for name, value in self.operating_current.items())
        axes = f"semi-axes {self.semi_axes[0]:.4g} to {self.semi_axes[-1]:.4g} K"
        return (f"{words}\n  starts          ellipsoid around the operating point, {axes}\n"
                f"  operating       {amperes}; {rest}")

    def plot(self, ax: Any = None) -> Any:
        """Draw, lump by lump, the box, the operating temperature and how far the ellipsoid of starts reaches.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.

        Returns
        -------
        matplotlib.axes.Axes
        """
        ax = axes_for(ax)
        names = list(self.operating_temperatures)
        places, x0 = np.arange(len(names)), np.array([self.operating_temperatures[name] for name in names])
        low, high = np.array([self.temperature[name] for name in names]).T
        ax.vlines(places, low - ZERO_CELSIUS, high - ZERO_CELSIUS, color="0.8", linewidth=8, label="box")
        reach = np.sqrt(self.level * np.diag(np.linalg.inv(self.matrix)))
        ax.errorbar(places, x0 - ZERO_CELSIUS, reach, fmt="o", capsize=3, label="operating point, starts")
        ax.set_xticks(places, names, rotation=90)
        ax.set_ylabel("temperature [°C]")
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
        return ax


def tem_feedback(system: System, *, temperature: Any, current: Any, operating: Any, rate: float,
                 method: str = "quadratic", covariance: Any = None, probability: float = 0.95,
                 ambient: Mapping[str, tuple[float, float]] | None = None,
                 heat: Mapping[str, tuple[float, float]] | None = None,
                 sample_time: float | None = None) -> TemFeedback:
    """Design one current law I = I0 + F (x - x0) for a whole box of temperatures and currents, and prove it.

    Among the feedbacks that make V = (x - x0)'P(x - x0) fall with the rate at every temperature and current of the box,
    that with the largest ball of starts from which the box and the ranges of the currents are never left. The proof is
    about the nonlinear network.

    Parameters
    ----------
    system : System
        Network with at least one module.
    temperature : tuple or mapping
        Box [K]: (lower, upper) for all lumps, or {lump: (lower, upper)}.
    current : tuple or mapping
        (lower, upper) for every module, or {module: (lower, upper)} [A].
    operating : float or mapping
        Current of all modules at the operating point, or {module: current} [A].
    rate : float
        Rate that is asked for: V falls at least as exp(-2 rate t) [1/s].
    method : {"quadratic", "parameter_dependent"}
        Both return one quadratic form for the whole box. The second also states the largest ball of starts that a form
        varying with the temperatures could keep, which is the reason why none is designed (docs, "State feedback of
        modules").
    covariance : Estimates or mapping, optional
        Result of a calibration, whose joint ranges at `probability` are covered, or {parameter: (lower, upper)}; links
        and modules only.
    probability : float
        Probability of the ranges of a calibration [-].
    ambient : mapping, optional
        {ambient: (lower, upper)} [K], constant or not; default its nominal temperature.
    heat : mapping, optional
        {lump: (lower, upper)} heat loads and heaters [W], constant or not; default none.
    sample_time : float, optional
        Time between two readings of the temperatures, the currents held in between [s]; the rate is then proven from
        sample to sample, the box for all times. Default: the currents follow at every moment.

    Returns
    -------
    TemFeedback
        `holds` is False, with the largest rate that was reached, where nothing is proven.

    Raises
    ------
    InputError
        Boxes that do not fit the system, Celsius, an operating point without a steady state or outside of the box,
        effects that no certificate covers.

    References
    ----------
    Boyd, El Ghaoui, Feron and Balakrishnan (1994), sections 5.2.2 and 7.2; proof: docs, "State feedback of modules".

    Examples
    --------
    >>> import robthermal as rt
    >>> stage = rt.System(ambients={"room": {"temperature": 298.0}},
    ...     lumps={"plate": {"capacity": 60.0}, "module": {"capacity": 12.0}, "sink": {"capacity": 90.0}},
    ...     links=[{"between": ("plate", "module"), "conductance": 5.0},
    ...            {"between": ("sink", "room"), "conductance": 4.0},
    ...            {"between": ("plate", "room"), "conductance": 0.15}],
    ...     modules={"m": {"hot": "sink", "cold": "module", "seebeck": {"value": 0.052}, "resistance": {"value": 2.1},
    ...              "conductance": {"value": 0.5}, "reference_temperature": 298.0}})
    >>> d = rt.design.tem_feedback(stage, temperature=(265.0, 335.0), current=(0.2, 1.8), operating=1.0, rate=0.012)
    >>> d.holds, bool(d.semi_axes[0] > 9.7), rt.verify(d.certificates[0]).valid
    (True, True, True)
    """
    start = time.perf_counter()
    if method not in ("quadratic", "parameter_dependent"):
        raise InputError(f"method = {quoted(method)}", where="argument method",
                         expected='"quadratic" or "parameter_dependent"')
    asked = positive_number(rate, "rate", "1/s")
    box = read_box(system, temperature, current, covariance, probability, ambient)
    point = _operating(system, operating, box, heat)
    x0, I0 = (np.array(list(part.values())) for part in point)
    room, current_room = (np.minimum(at - low, high - at) for at, (low, high) in (
        (x0, np.array(list(box["temperature"].values())).T), (I0, np.array(list(box["current"].values())).T)))
    hull = tem_hull(system, box)
    held = None if sample_time is None else positive_number(sample_time, "sample_time", "s")

    def proven(found: Ellipsoid, rate: float) -> Certificate:
        return scheduled(system, gain=found.F, matrix=np.linalg.inv(found.W), level=1.0, rate=rate,
                         operating_temperatures=point[0], operating_current=point[1], current=_pairs(box["current"]),
                         temperature=temperature, ambient=ambient, heat=heat, parameters=_pairs(box["parameters"]),
                         sample_time=held, sampled_rate=None if held is None else asked)

    found = largest_ball(hull, asked, room, current_room)
    cert = None if found is None or held is not None else proven(found, asked)
    if found is not None and held is not None:
        found, cert = _sampled(found, hull, asked, room, current_room, proven)
    outcome = _outcome(found, cert, asked, hull, room, current_room)
    if method == "parameter_dependent" and held is None and outcome.ok and found is not None:
        most = most_of_any_form(hull, asked, room, current_room, found)
        outcome = replace(outcome, text=(
            f"{outcome.text} The form is the same at all temperatures: one that varies with them keeps at most "
            f"{most:.4g} K (estimated from one corner of the box alone), this one {found.semi_axis:.4g} K."))
    return _design(system, box, point, found, cert, asked, outcome, held or 0.0,
                   time.perf_counter() - start)


def _sampled(found: Ellipsoid, hull: TemHull, asked: float, room: Array, current_room: Array,
             proven: Callable[[Ellipsoid, float], Certificate]) -> tuple[Ellipsoid, Certificate]:
    """Of feedbacks that are faster than asked for, with less current, that of the largest ball that bears the samples.
    """
    best: tuple[Ellipsoid, Certificate] | None = None
    for share, factor in product(_SHARES, _FASTER):
        other = largest_ball(hull, factor * asked, room, share * current_room)
        if other is None or (best is not None and other.semi_axis <= best[0].semi_axis):
            continue
        tried = proven(other, factor * asked)
        if tried.holds:
            best = other, tried
    return (found, proven(found, asked)) if best is None else best  # the latter says what is missing


def _operating(system: System, operating: Any, box: Mapping[str, Any], heat: Mapping[str, tuple[float, float]] | None
               ) -> tuple[dict[str, float], dict[str, float]]:
    """Steady state at the operating currents, in the middle of the ranges of ambients and loads."""
    names = system.module_names
    if isinstance(operating, Mapping):
        if set(operating) != set(names):
            raise InputError(f"operating = {quoted(dict(operating))}", where="argument operating",
                             expected=f"a current for each of {', '.join(names)}")
        currents = {name: finite_number(operating[name], f"operating[{name!r}]", "A") for name in names}
    else:
        currents = dict.fromkeys(names, finite_number(operating, "operating", "A"))
    for name, value in currents.items():
        low, high = box["current"][name]
        if not low < value < high:
            raise InputError(f"{value:g} A in module {name!r} is not inside of its range ({low:g}, {high:g})",
                             where="argument operating", expected="a current between the ends, with room on both sides")
    middle = {name: (low + high) / 2 for name, (low, high) in box["ambient"].items()}
    loads = {name: (low + high) / 2 for name, (low, high) in (heat or {}).items()}
    rest = steady_state(system, {**currents, **middle}, heat=loads)
    if not rest.equilibria:
        raise InputError(f"no steady state at these currents: {rest.outcome.text}", where="argument operating",
                         expected="currents with a steady state")
    inside = [one for one in rest.equilibria if all(low < one.temperatures[name] < high
                                                    for name, (low, high) in box["temperature"].items())]
    if not inside:
        first = rest.equilibria[0].temperatures
        name, value = next((name, first[name]) for name, (low, high) in box["temperature"].items()
                           if not low < first[name] < high)
        ends = tuple(box["temperature"][name])
        raise InputError(f"at rest lump {name!r} is at {value:.2f} K, outside of the box {ends}",
                         where="argument temperature", expected="a box around the operating point",
                         remedy="Widen the box, or operate with other currents.")
    return {name: float(inside[0].temperatures[name]) for name in system.lump_names}, currents


def _outcome(found: Ellipsoid | None, cert: Certificate | None, asked: float, hull: TemHull, room: Array,
             current_room: Array) -> Outcome:
    if found is not None and cert is not None:
        if cert.holds:
            return SynthesisCode.CERTIFIED.outcome(
                f"Certified for the nonlinear network: from every start in the ellipsoid (smallest semi-axis "
                f"{found.semi_axis:.3g} K) temperatures and currents stay in the box, and the distance to the "
                f"equilibrium decays with {asked:g} 1/s or faster.")
        return SynthesisCode.NOT_CERTIFIED.outcome(f"A gain was computed, but not proven: {cert.reason}.",
                                                   remedy="Ask for a lower rate, a smaller box, narrower ranges or "
                                                          "shorter samples.")
    def reached(rate: float) -> bool:
        return largest_ball(hull, rate, room, current_room) is not None

    low = next((asked / 4**k for k in range(1, _QUARTERS) if reached(asked / 4**k)), 0.0)
    if not low:
        return SynthesisCode.INFEASIBLE.outcome(
            "No feedback with one quadratic form for the whole box was found, at a rate of "
            f"{asked / 4 ** (_QUARTERS - 1):.3g} 1/s or above.",
            remedy="Take a smaller box of temperatures or currents.")
    high = 4 * low
    for _ in range(_HALVINGS):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if reached(middle) else (low, middle)
    return SynthesisCode.INFEASIBLE.outcome(
        f"rate = {asked:g}: the best achievable with one quadratic form for the whole box is about {low:.3g} 1/s.",
        remedy="Ask for less, or take a smaller box.")


def _design(system: System, box: Mapping[str, Any], point: tuple[dict[str, float], dict[str, float]],
            found: Ellipsoid | None, cert: Certificate | None, asked: float, outcome: Outcome, held: float,
            seconds: float) -> TemFeedback:
    lumps, modules = list(system.lump_names), list(system.module_names)
    n, m, ok = len(lumps), len(modules), outcome.ok
    F = np.zeros((m, n)) if found is None else found.F
    here = {key: {name: (value, value) for name, value in part.items()}
            for key, part in zip(("temperature", "current"), point, strict=True)}
    (A,), (B,) = tem_hull(system, {**here, "ambient": box["ambient"], "parameters": {}}).at(np.zeros(1, int))
    plant = control.ss(A, B, np.eye(n), np.zeros((n, m)), states=lumps, inputs=modules, outputs=lumps)
    loop = control.ss(A + B @ F, B, np.eye(n), np.zeros((n, m)), inputs=modules, outputs=lumps)
    controller = control.ss([], [], [], F, inputs=lumps, outputs=modules)
    words = "Nothing is proven."
    if ok:
        ranges = f", {len(box['parameters'])} uncertain parameters in their ranges" if box["parameters"] else ""
        words = ("Proven for the nonlinear network, from every start in the ellipsoid, for every temperature and "
                 f"current on the way{ranges}.")
    P = np.eye(n) if found is None else np.linalg.inv(found.W)
    return TemFeedback(controller, -asked if ok else np.inf, -np.inf, loop, [cert] if ok and cert is not None else [],
                       RobustAgainst(words, {"parameters": float(len(box["parameters"]))}), outcome, _METHOD,
                       "Clarabel", seconds, 0 if found is None else found.solves, None, F, (P + P.T) / 2,
                       asked if ok else 0.0, (plant,), float(ok), *point, _pairs(box["temperature"]),
                       _pairs(box["current"]), held)


def _pairs(ranges: Mapping[str, Sequence[float]]) -> dict[str, tuple[float, float]]:
    return {name: (float(low), float(high)) for name, (low, high) in ranges.items()}
