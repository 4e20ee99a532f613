"""Feedback linearization, Evers (5.15)-(5.18) corrected: the current that puts a wanted heat into the cold lump."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..certify import UsableCurrent
from ..errors import InputError
from ..thermal import System, drivable_range
from ..verification import Certificate
from ._authority import proven_currents
from ._export_law import export
from ._modules import Array, ModuleSet, Properties

Limits = Mapping[str, tuple[float, float]] | tuple[float, float] | None
Temperatures = ArrayLike | Mapping[str, ArrayLike]


class Bounds(NamedTuple):
    """What a module can do at given temperatures, each (..., n_modules).

    Parameters
    ----------
    heat : ndarray
        Lower bound on v, Evers (5.17): the most it can cool [W].
    current : ndarray
        Optimal current S x_c/R, Evers (5.18): it *maximizes cooling*; more current cools less [A].
    """

    heat: Array
    current: Array


class Reach(NamedTuple):
    """Heat that the limits of a feedback law allow at given temperatures, each (..., n_modules) [W].

    Parameters
    ----------
    lowest, highest : ndarray
        Most cooling and most heating.
    """

    lowest: Array
    highest: Array


@dataclass(frozen=True)
class Command:
    """What the feedback law sends to the modules, and what becomes of the wanted heat.

    Parameters
    ----------
    current, voltage : ndarray, shape (..., n_modules)
        [A], [V]: one of them goes to the driver.
    heat : ndarray, shape (..., n_modules)
        Heat that the cold lumps get with it [W]; equal to what was asked unless a limit is active. Back-calculation
        anti-windup feeds on the difference.
    limit : ndarray of str, shape (..., n_modules)
        Active limit: "" (none), "optimum", "current", "voltage" or "slew".
    """

    current: Array
    voltage: Array
    heat: Array
    limit: np.ndarray

    @property
    def saturated(self) -> np.ndarray:
        """Whether a limit is active, per module."""
        return self.limit != ""


@dataclass(frozen=True)
class FeedbackLinearization:
    """The feedback law I = Psi(v, x) for several modules at once; build it with `feedback_linearization`.

    Parameters
    ----------
    modules : ModuleSet
        Driven modules; `names` gives their order.
    current_low, current_high, voltage_low, voltage_high : ndarray, shape (n_modules,)
        Limits [A], [V]; infinite where there are none.
    slew : ndarray, shape (n_modules,)
        Largest change of current [A/s].
    """

    modules: ModuleSet
    current_low: Array
    current_high: Array
    voltage_low: Array
    voltage_high: Array
    slew: Array

    @property
    def system(self) -> System:
        """The system it was built for."""
        return self.modules.system

    @property
    def names(self) -> tuple[str, ...]:
        """Modules, in the order of v and of the currents."""
        return self.modules.names

    def current(self, v: ArrayLike | Mapping[str, ArrayLike], temperatures: Temperatures) -> Array:
        """Current for a wanted heat, inside all limits but slew.

        Parameters
        ----------
        v : array_like, shape (..., n_modules), mapping, or one number for all
            Heat from the module into its cold lump [W]; negative cools.
        temperatures : array_like, shape (..., n_lumps), or mapping of lump to temperature
            Temperatures of all lumps [K].

        Returns
        -------
        ndarray, shape (..., n_modules)
            [A]; at and beyond the bound (5.17) the optimal current (5.18), never more.
        """
        return self.command(v, temperatures).current

    def command(self, v: ArrayLike | Mapping[str, ArrayLike], temperatures: Temperatures, *,
                previous: ArrayLike | None = None, sample_time: float | None = None) -> Command:
        """Current and voltage for a wanted heat, the active limits, and the heat achieved.

        Parameters
        ----------
        v, temperatures
            As in `current`.
        previous : array_like, shape (..., n_modules), optional
            Current of the sample before [A]; the slew limit counts from it.
        sample_time : float, optional
            [s]; needed with `previous`.

        Returns
        -------
        Command
        """
        wanted = self.modules.vector(v, "v", "W")
        p = self.modules.properties(temperatures)
        asked, least_heat = _stable_root(wanted - p.K * (p.hot - p.cold), p), _bounds(p).heat
        current, limit = asked, np.where(wanted < least_heat, "optimum", np.full(asked.shape, "", dtype="<U7"))
        low, high = self._slew_range(previous, sample_time, asked.shape)
        # in this order: a later limit is the harder one, and wins
        for name, least, most in (("slew", low, high), ("optimum", -np.inf, p.S * p.cold / p.R),
                                  ("voltage", *self._voltage_range(p)),
                                  ("current", self.current_low, self.current_high)):
            clipped = np.minimum(np.maximum(current, least), most)  # np.clip, four times as fast
            limit = np.where(clipped != current, name, limit)
            current = clipped
        heat = np.where(current == asked, np.maximum(wanted, least_heat), _heat(current, p))
        return Command(current, p.S * (p.hot - p.cold) + p.R * current, heat, np.where(heat == wanted, "", limit))

    def heat(self, current: ArrayLike | Mapping[str, ArrayLike], temperatures: Temperatures) -> Array:
        """Heat from the modules into their cold lumps, Evers (5.15), the inverse of the feedback law.

        Parameters
        ----------
        current : array_like, shape (..., n_modules), mapping, or one number for all
            Currents of the modules [A].
        temperatures : array_like, shape (..., n_lumps), or mapping of lump to temperature
            Temperatures of all lumps [K].

        Returns
        -------
        ndarray, shape (..., n_modules)
            v = K (x_h - x_c) + ½ R I² - S x_c I [W].
        """
        return _heat(self.modules.vector(current, "current", "A"), self.modules.properties(temperatures))

    def bounds(self, temperatures: Temperatures) -> Bounds:
        """Lower bound on the heat (5.17) and the current that reaches it (5.18), without the limits of the law.

        Parameters
        ----------
        temperatures : array_like, shape (..., n_lumps), or mapping of lump to temperature
            Temperatures of all lumps [K].

        Returns
        -------
        Bounds
        """
        return _bounds(self.modules.properties(temperatures))

    def reach(self, temperatures: Temperatures) -> Reach:
        """Heat that the limits allow at given temperatures, slew apart.

        Parameters
        ----------
        temperatures : array_like, shape (..., n_lumps), or mapping of lump to temperature
            Temperatures of all lumps [K].

        Returns
        -------
        Reach
            `highest` is infinite where nothing limits heating.
        """
        p = self.modules.properties(temperatures)
        least, most = self._voltage_range(p)
        most = np.minimum(np.minimum(most, p.S * p.cold / p.R), self.current_high)
        least = np.maximum(np.minimum(least, most), self.current_low)
        return Reach(_heat(np.maximum(most, self.current_low), p), np.where(np.isfinite(least), _heat(
            np.where(np.isfinite(least), least, 0.0), p), np.inf))

    def gain(self, current: ArrayLike | Mapping[str, ArrayLike], temperatures: Temperatures) -> Array:
        """Slope -dI/dv = 1/(S x_c - R I) of the feedback law; it diverges at the optimal current.

        Parameters
        ----------
        current : array_like, shape (..., n_modules), mapping, or one number for all
            Currents of the modules [A].
        temperatures : array_like, shape (..., n_lumps), or mapping of lump to temperature
            Temperatures of all lumps [K].

        Returns
        -------
        ndarray, shape (..., n_modules)
            [A/W]; infinite at and beyond the optimum.
        """
        p = self.modules.properties(temperatures)
        left = p.S * p.cold - p.R * self.modules.vector(current, "current", "A")
        return np.where(left > 0, 1.0 / np.where(left > 0, left, 1.0), np.inf)

    def current_from_voltage(self, voltage: ArrayLike | Mapping[str, ArrayLike], temperatures: Temperatures) -> Array:
        """Current that flows under voltage drive.

        Parameters
        ----------
        voltage : array_like, shape (..., n_modules), mapping, or one number for all
            Voltages across the modules [V].
        temperatures : array_like, shape (..., n_lumps), or mapping of lump to temperature
            Temperatures of all lumps [K].

        Returns
        -------
        ndarray, shape (..., n_modules)
            (V - S (x_h - x_c))/R [A].
        """
        p = self.modules.properties(temperatures)
        return (self.modules.vector(voltage, "voltage", "V") - p.S * (p.hot - p.cold)) / p.R

    def export(self, path: str | Path, name: str = "law") -> None:
        """Write the feedback law for another program: C99 (.c, .h), MATLAB (.mat) or JSON (.json).

        C gets a step function in double that computes to the last bit what `command` computes, with a test vector;
        MATLAB and JSON get the numbers of the modules and the limits.

        Parameters
        ----------
        path : str or path
            File to write, replaced in one step; its ending says which.
        name : str
            Name of the design; in C the prefix of every identifier.

        Raises
        ------
        InputError
            For another ending, or when the file cannot be written.
        """
        export(self, path, name)

    def _voltage_range(self, p: Properties) -> tuple[Array, Array]:
        """Voltage limits as currents [A]."""
        own = p.S * (p.hot - p.cold)
        return (self.voltage_low - own) / p.R, (self.voltage_high - own) / p.R

    def _slew_range(self, previous: ArrayLike | None, sample_time: float | None,
                    shape: tuple[int, ...]) -> tuple[Array, Array]:
        if previous is None or not np.isfinite(self.slew).any():
            return np.full(shape, -np.inf), np.full(shape, np.inf)
        if sample_time is None or not (np.isfinite(sample_time) and sample_time > 0):
            raise InputError(f"sample_time = {sample_time}", where="argument sample_time",
                             expected="a positive number [s]: the slew limit counts from the previous current")
        last, step = self.modules.vector(previous, "previous", "A"), self.slew * sample_time
        return np.broadcast_to(last - step, shape), np.broadcast_to(last + step, shape)


def feedback_linearization(system: System, modules: Iterable[str] | str | None = None, *,
                           current_limits: Limits = None, voltage_limits: Limits = None,
                           slew: float | Mapping[str, float] | None = None,
                           certificate: Certificate | UsableCurrent | None = None) -> FeedbackLinearization:
    """Law that makes the cold side linear in v, the heat from each module into its cold lump.

    Parameters
    ----------
    system : System
        With its modules.
    modules : iterable of str, optional
        Modules to drive; default all.
    current_limits : mapping of module to (lower, upper), or one pair for all, optional
        [A]; default the certificate's, else the ranges of the system file. Within them also where these are given.
    voltage_limits : mapping of module to (lower, upper), or one pair for all, optional
        Lowest and highest voltage across each module [V].
    slew : float or mapping of module to float, optional
        Largest change of current [A/s].
    certificate : UsableCurrent or Certificate, optional
        What `certify.usable_current` returned, or a contraction certificate: its current range is the default, and
        limits beyond it are refused. It is proven again, and must be of exactly this system. The range of a contraction
        certificate is a contraction limit inside the box; not a limit for use: currents within it can overheat the
        machine.

    Returns
    -------
    FeedbackLinearization

    Raises
    ------
    InputError
        Unknown modules; limits that exclude zero, or exceed the system file's or the certificate's; a certificate that
        is not valid or is another system's.

    Warns
    -----
    UserWarning
        The certificate is one of contraction alone.

    References
    ----------
    Evers (2021), (5.15)-(5.18), with the errata: right root, mean temperature, and what (5.18) maximizes.

    Examples
    --------
    >>> import robthermal as rt
    >>> law = rt.design.feedback_linearization(rt.systems.two_module())
    >>> at = {"x9": 298.15, "x11": 278.15, "x10": 298.15, "x12": 278.15}
    >>> current = law.current([-4.0, 2.0], at)  # cool with m1, heat with m2 [W]
    >>> law.heat(current, at).round(12).tolist()
    [-4.0, 2.0]
    >>> law.command(-30.0, at).limit.tolist()  # more cooling than a module can give
    ['current', 'current']
    """
    chosen = ModuleSet.of(system, modules)
    _refuse_effects(chosen)
    declared = {name: drivable_range(system.modules[name]) for name in chosen.names}
    own = chosen.ranges({name: (one.low, one.high) for name, one in declared.items()}, "system", "A")
    widest, source = own, "the range in the system file"
    if certificate is not None:
        proven = proven_currents(chosen, certificate)
        widest, source = (np.maximum(own[0], proven[0]), np.minimum(own[1], proven[1])), "the certified range"
    low, high = (np.asarray(a) for a in chosen.ranges(current_limits, "current_limits", "A"))
    for i, name in enumerate(chosen.names):
        if current_limits is not None and np.isfinite(high[i]) and (low[i] < widest[0][i] or high[i] > widest[1][i]):
            raise InputError(f"({low[i]:g}, {high[i]:g}) A exceeds {source}, ({widest[0][i]:g}, {widest[1][i]:g}) A",
                             where=f"argument current_limits[{name!r}]", expected="limits inside it",
                             remedy="Lower them; rt.certify.usable_current tells how much the machine can have.")
    slews = np.full(len(chosen.names), np.inf) if slew is None else chosen.vector(slew, "slew", "A/s")
    if not (slews > 0).all():
        raise InputError(f"slew = {slews.min():g} A/s", where="argument slew", expected="positive numbers [A/s]")
    return FeedbackLinearization(chosen, np.maximum(low, widest[0]), np.minimum(high, widest[1]),
                                 *chosen.ranges(voltage_limits, "voltage_limits", "V"), slews)


def _refuse_effects(modules: ModuleSet) -> None:
    """The feedback law inverts S, R and K; it knows no other heat of a module, no current but its own."""
    following = tuple(f"links.{link.name}.follow." for link in modules.system.links
                      if link.follow is not None and link.follow.column in modules.names)
    for name in modules.system.effects:
        if name.startswith((*(f"modules.{module}." for module in modules.names), *following)):
            raise InputError(f"{name} = {modules.system.parameter(name):g} is not part of the feedback law",
                             where="argument system",
                             expected="modules with Seebeck, Joule and conducted heat only, links that follow none",
                             remedy="Set it to 0 for the feedback law; what it adds is then a disturbance of v.")


def _stable_root(q: Array, p: Properties) -> Array:
    """Smallest-|I| root of ½RI² - S x_c I = q without cancellation; the optimum where there is none."""
    a = p.S * p.cold / p.R
    share = np.maximum(2.0 * q / p.R, -a * a)
    return -share / (a + np.sqrt(a * a + share))


def _heat(current: Array, p: Properties) -> Array:
    return p.K * (p.hot - p.cold) + 0.5 * p.R * current * current - p.S * p.cold * current


def _bounds(p: Properties) -> Bounds:
    current = p.S * p.cold / p.R
    return Bounds(p.K * (p.hot - p.cold) - 0.5 * p.S * p.cold * current, current)
