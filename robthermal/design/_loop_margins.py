"""Margins of every loop of a design, for the nominal plant and the worst corner of parameter ranges."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._pandas import pd
from ..errors import InputError, Outcome
from ._controller import Controller
from ._corner_values import Corner, Ranges, checked_ranges, corners
from ._linearization import FeedbackLinearization
from ._margin_plots import plot_bode, plot_nyquist
from ._margins import KEYS, UNITS, UNSTABLE, Margins, disk, frequencies, margins
from ._modules import Array
from ._numbers import expect
from ._observer import GainObserver
from ._operated_plants import OperatedPlant, Operation
from ._outcomes import DesignCode
from ._regulated_points import Regulate
from ._sampled_loop import LoopParts


@dataclass(frozen=True)
class PlantMargins:
    """Margins of all loops with one plant.

    Parameters
    ----------
    corner : dict
        Parameters that differ from the nominal plant.
    margins : dict
        Loop to its margins, the others closed.
    response : ndarray, shape (n_loops, n_frequencies)
        Loop transfers L, the others closed.
    disk : float
        Disk margin of all loops at once.
    held : bool
        Whether the plant can hold the set-points within the limits; margins are of an unstable loop if not.
    """

    corner: Corner
    margins: dict[str, Margins]
    response: np.ndarray
    disk: float
    held: bool


@dataclass(frozen=True)
class LoopMargins:
    """Margins of every loop, nominal and worst over the corner plants; build it with `loop_margins`.

    A loop is named by its module and opened at the heat that its controller asks for, all others closed.

    Parameters
    ----------
    loops : tuple of str
        Modules, in the order of the law.
    frequency : ndarray
        Angular frequencies up to half the sampling rate [rad/s].
    nominal : PlantMargins
        With the parameters as they stand.
    corners : tuple of PlantMargins
        With parameters at the ends of their ranges.
    total : int
        How many corners the ranges have; more than were computed where they are many.
    outcome : Outcome
        "margins", or which plant is not stable or cannot hold the set-points.
    """

    loops: tuple[str, ...]
    frequency: Array
    nominal: PlantMargins
    corners: tuple[PlantMargins, ...]
    total: int
    outcome: Outcome

    @property
    def plants(self) -> tuple[PlantMargins, ...]:
        """The nominal plant and the corners."""
        return self.nominal, *self.corners

    def worst(self, loop: str) -> Margins:
        """Smallest of every margin over all plants; each may be of another plant.

        Parameters
        ----------
        loop : str
            Name of the module.
        """
        every = [plant.margins[loop] for plant in self.plants]
        least = {key: min(getattr(one, key) for one in every) for key in KEYS}
        return Margins(**least, crossover=min(every, key=lambda one: one.phase).crossover,
                       stable=all(one.stable for one in every))

    def worst_plant(self, loop: str, margin: str = "modulus") -> PlantMargins:
        """Plant for which a margin of a loop is smallest.

        Parameters
        ----------
        loop : str
            Name of the module.
        margin : str
            "gain", "phase", "modulus" or "delay".
        """
        return min(self.plants, key=lambda plant: getattr(plant.margins[loop], margin))

    def missed(self, wanted: Mapping[str, float]) -> tuple[str, ...]:
        """Margins that are not kept for all plants, in words; empty where all are kept.

        Parameters
        ----------
        wanted : mapping
            Least "gain" [-], "phase" [deg], "modulus" [-], "delay" [s]; some of them.
        """
        said = []
        for loop in self.loops:
            for key, least in wanted.items():
                plant = self.worst_plant(loop, key)
                value = getattr(plant.margins[loop], key)
                if value < least * (1 - 1e-9):
                    at = ", ".join(f"{name} = {number:.6g}" for name, number in plant.corner.items())
                    said.append(f"the {key} margin of {loop} is {value:.3g}{UNITS[key]}, not {least:g}{UNITS[key]}"
                                + (f", with {at}" if at else ""))
        return tuple(said)

    @property
    def disk(self) -> float:
        """Smallest disk margin of all loops at once: each may be multiplied by (1 + e/2)/(1 - e/2), abs(e) below it."""
        return min(plant.disk for plant in self.plants)

    def table(self) -> pd.DataFrame:
        """Margins of every loop: nominal, and the worst over all plants."""
        rows = [{"loop": loop, "plant": plant, "gain [-]": m.gain, "phase [deg]": m.phase, "modulus [-]": m.modulus,
                 "delay [s]": m.delay, "crossover [rad/s]": m.crossover, "stable": m.stable}
                for loop in self.loops for plant, m in self._rows(loop)]
        return pd.DataFrame(rows)

    def _rows(self, loop: str) -> Iterator[tuple[str, Margins]]:
        yield "nominal", self.nominal.margins[loop]
        if self.corners:
            yield f"worst of {len(self.corners)} corners", self.worst(loop)

    def to_dict(self) -> dict[str, Any]:
        """{loop: margins, with those of the worst plants under "worst"}; None where a margin is infinite."""
        return {loop: {**self.nominal.margins[loop].to_dict(), "worst": self.worst(loop).to_dict()}
                for loop in self.loops}

    def __str__(self) -> str:
        return f"{self.table().round(4).to_string(index=False)}\n{self.outcome.text}"

    def plot_bode(self, loop: str) -> NDArray[Any]:
        """Plot gain and phase of a loop with its margins, all corner plants behind; two matplotlib axes.

        Parameters
        ----------
        loop : str
            Name of the module.
        """
        return plot_bode(self.frequency, *self._curves(loop), self.nominal.margins[loop], self._color(loop))

    def plot_nyquist(self, loop: str, ax: Any = None) -> Any:
        """Plot a loop in the complex plane with the circle of its modulus margin, all corners behind; one axes.

        Parameters
        ----------
        loop : str
            Name of the module.
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        return plot_nyquist(*self._curves(loop), self.worst(loop).modulus, ax, self._color(loop))

    def plot(self) -> NDArray[Any]:
        """Plot gain and phase of the first loop; returns two matplotlib axes."""
        return self.plot_bode(self.loops[0])

    def _color(self, loop: str) -> str:
        return f"C{self.loops.index(loop)}"

    def _curves(self, loop: str) -> tuple[np.ndarray, list[np.ndarray]]:
        if loop not in self.loops:
            raise InputError(f"there is no loop {loop!r}", where="argument loop",
                             expected="one of " + ", ".join(self.loops))
        i = self.loops.index(loop)
        return self.nominal.response[i], [plant.response[i] for plant in self.corners if plant.held]


def loop_margins(law: FeedbackLinearization, controller: Controller, setpoint: Mapping[str, float] | float, *,
                 regulate: Regulate = None, observer: GainObserver | None = None, parameters: Ranges | None = None,
                 inputs: Mapping[str, float] | None = None) -> LoopMargins:
    """Margins of the loop as it is implemented, at a set-point, for the nominal and all corner plants.

    The loop is sampled: currents are held over a sample, a law acts on temperatures that are measured or estimated by
    an observer, which is part of the loop; sensors lag and delay. Every corner plant is taken at its own steady state
    at the set-points, while law, observer and controller keep the nominal parameters.

    Parameters
    ----------
    law : FeedbackLinearization
        Of the nominal model.
    controller : Controller
        Linear, from `pid`, `linear_controller`, `state_feedback`, `feed_forward` or `disturbance_observer`.
    setpoint : mapping of module to float, or one number for all
        What is held [K].
    regulate : mapping of module to str, optional
        Sensor or lump that a module regulates; default its cold face.
    observer : GainObserver, optional
        Whose estimates law and controller take; default every lump is measured.
    parameters : mapping, optional
        {parameter name: (lower, upper)} of the plant. With more than 64 corners those are taken at which every margin
        should be smallest by the effects of single parameters, and others at random: the outcome says so.
    inputs : mapping, optional
        Ambients [K] and heaters [unit]; default nominal and off.

    Returns
    -------
    LoopMargins

    Raises
    ------
    InputError
        Set-points that the nominal plant cannot hold, unknown names, an observer without constant gain.

    Examples
    --------
    >>> import robthermal as rt
    >>> law = rt.design.feedback_linearization(rt.systems.two_module())
    >>> pi = rt.design.pid(rt.design.cold_side(law), bandwidth=0.02, sample_time=1.0)
    >>> found = rt.design.loop_margins(law, pi, 288.15)
    >>> found.nominal.margins["m1"].phase > 60.0, found.nominal.margins["m1"].modulus > 0.8
    (True, True)
    """
    expect(law, FeedbackLinearization, "law", "rt.design.feedback_linearization")
    parts = LoopParts.of(law, controller, observer, regulate)
    operation = Operation.of(law, setpoint, regulate, inputs)
    return margins_of(operation, parts, checked_ranges(law.system, parameters))


def margins_of(operation: Operation, parts: LoopParts, ranges: Ranges) -> LoopMargins:
    """Margins of a loop for the nominal and all corner plants.

    Parameters
    ----------
    operation : Operation
        Where the plants are operated.
    parts : LoopParts
        Law, controller and observer.
    ranges : mapping
        {parameter name: (lower, upper)}, checked.
    """
    frequency = frequencies(operation.nominal.loop(parts))

    def at(corner: Corner) -> PlantMargins:
        return analyzed(operation.at(corner), corner, parts, frequency)

    first = at({})
    mattering = operation.relevant(ranges, parts)
    chosen, total = corners(mattering, lambda single: _worst_ends(first, [at(corner) for corner in single]))
    found = tuple(map(at, chosen))
    return LoopMargins(parts.law.names, frequency, first, found, total if mattering else 0,
                       _outcome(first, found, total))


def analyzed(plant: OperatedPlant | None, corner: Corner, parts: LoopParts, frequency: Array) -> PlantMargins:
    """Margins of all loops with a plant; none where it cannot hold the set-points.

    Parameters
    ----------
    plant : OperatedPlant or None
        None where it cannot hold the set-points.
    corner : dict
        Parameters that differ from the nominal plant.
    parts : LoopParts
        Law, controller and observer.
    frequency : ndarray
        Angular frequencies of the responses [rad/s].
    """
    names = parts.law.names
    if plant is None:
        nothing = np.full((len(names), len(frequency)), np.nan, complex)
        return PlantMargins(corner, dict.fromkeys(names, UNSTABLE), nothing, 0.0, False)
    loop = plant.loop(parts)
    stable = bool(np.abs(loop.poles).max() < 1)
    singles = [loop.single(i) for i in range(len(names))]
    curves = np.array([single.response(frequency)[:, 0, 0] for single in singles])
    found = {name: margins(single, frequency, curve) if stable else UNSTABLE
             for name, single, curve in zip(names, singles, curves, strict=True)}
    return PlantMargins(corner, found, curves, disk(loop.response(frequency)) if stable else 0.0, True)


def _worst_ends(nominal: PlantMargins, single: Sequence[PlantMargins]) -> list[list[int]]:
    """For every margin of every loop the end of every parameter that makes it smaller."""
    pairs = list(zip(single[::2], single[1::2], strict=True))
    return [[int(getattr(high.margins[loop], key) < getattr(low.margins[loop], key)) for low, high in pairs]
            for loop in nominal.margins for key in KEYS]


def _outcome(nominal: PlantMargins, found: Sequence[PlantMargins], total: int) -> Outcome:
    which = f"{len(found)} of {total} corners" if total > len(found) else f"all {len(found)} corners"
    over = f" Over {which} of the parameter ranges, each at its own steady state." if found else ""
    for plant in (nominal, *found):
        at = ", ".join(f"{name} = {value:.6g}" for name, value in plant.corner.items()) or "the nominal plant"
        if not plant.held:
            return DesignCode.NOT_HELD.outcome(f"The set-points cannot be held within the limits at {at}.{over}")
        if not all(one.stable for one in plant.margins.values()):
            return DesignCode.UNSTABLE.outcome(f"The linearized loop is unstable at {at}.{over}")
    several = " Each loop is opened with the others closed." if len(nominal.margins) > 1 else ""
    return DesignCode.MARGINS.outcome(
        f"The linearized sampled loop is stable; its margins are computed.{over}{several}")
