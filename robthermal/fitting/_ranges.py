"""Which parameters may change, within which bounds, with which prior; and the coordinates the optimizer works in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from ..errors import InputError
from ..thermal import FitRange, System

Key = str | tuple[str, ...]
Limits = tuple[float, float] | FitRange
Choice = Iterable[str] | Mapping[Key, Limits] | Mapping[str, Limits] | None


@dataclass(frozen=True)
class Ranges:
    """Parameters to estimate; positive ones are optimized by their logarithm.

    Parameters
    ----------
    names : tuple of str
        Parameter names; of tied parameters all names with " = " between.
    members : tuple of tuple of str
        The system's parameters behind each: one, or several that share one value.
    start, lower, upper : ndarray, shape (p,)
        Starting values and bounds, in the unit of each parameter.
    sigma : ndarray, shape (p,)
        Prior standard deviation around the starting value; infinite without a prior.
    logarithmic : ndarray of bool, shape (p,)
        Whether the coordinate is log(value).
    """

    names: tuple[str, ...]
    members: tuple[tuple[str, ...], ...]
    start: Floats
    lower: Floats
    upper: Floats
    sigma: Floats
    logarithmic: NDArray[np.bool_]

    def coordinates(self, values: Floats) -> Floats:
        """Optimizer's coordinates of parameter values."""
        return np.where(self.logarithmic, np.log(np.where(self.logarithmic, values, 1.0)), values)

    def values(self, coordinates: Floats) -> Floats:
        """Parameter values at optimizer's coordinates."""
        return np.where(self.logarithmic, np.exp(np.where(self.logarithmic, coordinates, 0.0)), coordinates)

    def slopes(self, values: Floats) -> Floats:
        """Derivative of the values with respect to the coordinates."""
        return np.where(self.logarithmic, values, 1.0)

    @property
    def flat(self) -> list[str]:
        """The system's parameters, in order."""
        return [name for group in self.members for name in group]

    def assigned(self, values: Floats) -> dict[str, float]:
        """What the system's parameters become."""
        return {name: float(value) for group, value in zip(self.members, values, strict=True) for name in group}

    def applied(self, system: System, coordinates: Floats) -> System:
        """The system at these coordinates, within the bounds in spite of rounding."""
        return system.with_parameters(self.assigned(np.clip(self.values(coordinates), self.lower, self.upper)))

    def joined(self, sensitivity: Floats) -> Floats:
        """Derivative (..., p) by each estimated value, from that (..., len(flat)) by every member."""
        owner = np.repeat(np.arange(len(self.members)), [len(group) for group in self.members])
        return sensitivity @ (owner[:, None] == np.arange(len(self.members))).astype(float)

    def prior(self, values: Floats) -> Floats:
        """Distance from the priors' centers, of the parameters that have one, in standard deviations."""
        known = np.isfinite(self.sigma)
        return (values - self.start)[known] / self.sigma[known]

    def prior_slopes(self, values: Floats) -> Floats:
        """Derivative of `prior` by the coordinates, (p,); 0 without a prior."""
        return self.slopes(values) / self.sigma

    @property
    def unit(self) -> Floats:
        """What counts as one plausible step of each coordinate: a factor e, or a uniform spread over the bounds."""
        return np.where(self.logarithmic, 1.0, self.spread)

    @property
    def spread(self) -> Floats:
        """Standard deviation of each coordinate if it were uniform between its bounds."""
        return (self.coordinates(self.upper) - self.coordinates(self.lower)) / math.sqrt(12.0)

    def at_bound(self, values: Floats) -> NDArray[np.bool_]:
        """Whether each value has run into a bound (within 1e-4 of the range, in coordinates)."""
        q, low, high = (self.coordinates(v) for v in (values, self.lower, self.upper))
        near = 1e-4 * (high - low)
        return (q - low < near) | (high - q < near)


NONE = Ranges((), (), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0, np.bool_))


def chosen_ranges(system: System, parameters: Choice) -> Ranges:
    """Ranges of a calibration: the system's fit table, some names of it, or a mapping from names to (lower, upper)."""
    table = _table(system, parameters)
    members = tuple(key if isinstance(key, tuple) else (key,) for key in table)
    for group, limits in zip(members, table.values(), strict=True):
        for name in group:
            _check(system, name, limits)
        _check_tied(system, group)
    _refuse_twice([name for group in members for name in group])
    start = np.array([system.parameter(group[0]) for group in members])
    lower = np.array([limits.lower for limits in table.values()])
    upper = np.array([limits.upper for limits in table.values()])
    sigma = np.array([limits.sigma or np.inf for limits in table.values()])
    temperature = np.array([group[0].endswith((".temperature", ".initial")) for group in members])
    names = tuple(" = ".join(group) for group in members)
    return Ranges(names, members, start, lower, upper, sigma, (lower > 0) & ~temperature)


def _table(system: System, parameters: Choice) -> dict[Key, FitRange]:
    if parameters is None:
        if not system.fit:
            raise InputError("nothing to calibrate: the system has no fit table", where="argument parameters",
                             remedy="Add [fit] to the system file, or pass a mapping, "
                                    'parameters={"links.a-b.conductance": (0.1, 10.0)}.')
        return {name: limits for name, limits in system.fit.items()}
    if isinstance(parameters, str):
        raise InputError(f"parameters is the text {parameters!r}", where="argument parameters",
                         expected="a list of names or a mapping from name to (lower, upper)",
                         remedy="Put it in a list.")
    if isinstance(parameters, Mapping):
        table: dict[Key, FitRange] = {key: _as_range(key, limits) for key, limits in parameters.items()}
    else:
        table = {name: _listed(system, name) for name in parameters}
    if not table:
        raise InputError("parameters is empty", where="argument parameters", remedy="Name at least one parameter.")
    return table


def _listed(system: System, name: str) -> FitRange:
    if not isinstance(name, str):
        raise InputError(f"parameters lists {name!r}", where="argument parameters", expected="names",
                         remedy='Tie parameters in a mapping with their common bounds: {("a", "b"): (lower, upper)}.')
    if name not in system.fit:
        system.parameter(name)  # an unknown name is the better message
        raise InputError(f"{name!r} has no range in the fit table", where="argument parameters",
                         expected="names from the fit table, here " + (", ".join(system.fit) or "empty"),
                         remedy=f'Pass a mapping with its bounds: {{"{name}": (lower, upper)}}.')
    return system.fit[name]


def _as_range(name: Key, limits: Limits) -> FitRange:
    if isinstance(limits, FitRange):
        return limits
    try:
        lower, upper = (float(value) for value in limits)
    except (TypeError, ValueError):
        raise InputError(f"the range of {name!r} is {limits!r}", where="argument parameters",
                         expected="(lower, upper) or a FitRange") from None
    if not (math.isfinite(lower) and math.isfinite(upper) and lower < upper):
        raise InputError(f"the range of {name!r} is ({lower}, {upper})", where="argument parameters",
                         expected="finite bounds with lower < upper")
    return FitRange(lower=lower, upper=upper)


def _check_tied(system: System, group: Key) -> None:
    if not group:
        raise InputError("an empty tuple is tied", where="argument parameters", expected="names of parameters")
    values = {name: system.parameter(name) for name in group}
    if len({name.rpartition(".")[2] for name in group}) > 1:
        raise InputError(f"{' and '.join(map(repr, group))} are tied, but are not the same kind of quantity",
                         where="argument parameters", expected="one kind, for example two conductances")
    if len(set(values.values())) > 1:
        listed = ", ".join(f"{name} = {value:.6g}" for name, value in values.items())
        raise InputError(f"tied parameters start at different values: {listed}", where="argument parameters",
                         remedy="Give them one value first: system.with_parameters({...}).")


def _refuse_twice(names: list[str]) -> None:
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        raise InputError(f"{twice[0]!r} is named twice", where="argument parameters",
                         remedy="A parameter is either free or tied to others, once.")


def _check(system: System, name: str, limits: FitRange) -> None:
    value = system.parameter(name)
    if name.endswith((".noise", ".disturbance", ".exponent", ".reference_temperature")):
        raise InputError(f"{name!r} cannot be calibrated", where="argument parameters",
                         expected="a capacity, conductance, gain, offset, lag, delay, temperature or module property",
                         remedy="Noise levels are estimated when they are not declared; the others must be known.")
    if not limits.lower <= value <= limits.upper:
        raise InputError(f"{name!r} starts at {value:.6g}, outside its bounds [{limits.lower:.6g}, {limits.upper:.6g}]",
                         where="argument parameters", remedy="Widen the bounds, or start with system.with_parameters.")
    if name.endswith(".time_constant") and value == 0:
        raise InputError(f"{name!r} starts at 0, where the lag does not exist and has no derivative",
                         where="argument parameters",
                         remedy=f'Start it at what you expect, in the file or by system.with_parameters({{"{name}": '
                                '5.0}); or leave it out of the fit table: rt.diagnose tests for a lag from 0.')
    inside = 1e-9 * (limits.upper - limits.lower)
    for bound in (limits.lower + inside, limits.upper - inside):
        try:
            system.with_parameters({name: bound})
        except InputError as error:
            raise InputError(f"the bounds of {name!r} reach {bound:.6g}, which the system refuses: {error.what}",
                             where="argument parameters", remedy="Narrow the bounds.") from None
