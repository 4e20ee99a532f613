"""Which sensors an observer needs: the smallest set with a certificate over a box of temperatures and currents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, islice
from math import comb
from typing import Any, Literal

from .._drawing import axes_for
from .._pandas import pd
from ..errors import InputError, Outcome
from ..thermal import System
from ..verification import Certificate
from ._covariances import Noise
from ._error_box import Interval, Temperatures, check_box
from ._modules import check_system
from ._observer import GainObserver, without_advice
from ._observer_model import unobservable
from ._outcomes import DesignCode

_MOST = 2000  # sets of one size that are all tried; beyond, the best smaller set is extended
_METHODS = ("kalman", "positive", "lmi")
_TRIED = 3  # of a size are put to the certifier


@dataclass(frozen=True)
class Placement:
    """Sensor sets by size.

    Parameters
    ----------
    sensors : tuple of str
        Smallest set found whose observer is certified; empty if none is.
    observer : GainObserver or None
        Observer that reads these sensors.
    certificate : Certificate or None
        Certificate of that observer's decay.
    best : dict
        Number of sensors to (sensors, spectral radius of the frozen error over the box) of the best set of that size.
    outcome : Outcome
        "found" or "none".
    """

    sensors: tuple[str, ...]
    observer: GainObserver | None
    certificate: Certificate | None
    best: dict[int, tuple[tuple[str, ...], float]]
    outcome: Outcome

    def to_frame(self) -> pd.DataFrame:
        """Best set of every size."""
        return pd.DataFrame([{"sensors": len(names), "set": ", ".join(names), "spectral radius": radius}
                             for names, radius in self.best.values()])

    def __str__(self) -> str:
        return f"{self.to_frame().to_string(index=False)}\n{self.outcome.text}"

    def plot(self, ax: Any = None) -> Any:
        """Plot the slowest decay against the number of sensors; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        sizes = list(self.best)
        ax.plot(sizes, [radius for _, radius in self.best.values()], "o-")
        for size, (names, radius) in self.best.items():
            ax.annotate(" ".join(names), (size, radius), (0, 6), textcoords="offset points", ha="center",
                        fontsize="small")
        ax.margins(x=0.15, y=0.1)  # room for the names
        ax.axhline(1.0, color="k", lw=0.8, ls="--")
        ax.set(xlabel="number of sensors [-]", ylabel="spectral radius of the error, worst corner [-]", xticks=sizes)
        return ax


def place_sensors(system: System, *, current: Mapping[str, Interval], temperature: Temperatures,
                  candidates: Sequence[str] | None = None, sample_time: float = 1.0, largest: int = 3,
                  method: Literal["kalman", "positive", "lmi"] = "kalman", process_noise: Noise = None,
                  keep: Sequence[str] = ()) -> Placement:
    """Find the smallest sensor set whose observer is certified over a box.

    Parameters
    ----------
    system : System
        Its sensors are the candidates.
    current : mapping of module to (lower, upper)
        [A], every module named.
    temperature : (lower, upper) or mapping of lump to (lower, upper)
        Temperature range of all lumps, or of each [K].
    candidates : sequence of str, optional
        Sensors to choose from; default all that are faster than a sample.
    sample_time : float, optional
        Time between two samples [s].
    largest : int, optional
        Largest set to look at; all sizes up to it are tabulated for the trade-off.
    method, process_noise
        As in `observer`; "lmi" finds the smallest sets and takes half a second for each that it looks at.
    keep : sequence of str, optional
        Sensors that are there already: only sets with all of them are looked at.

    Returns
    -------
    Placement
        Sets are screened by the spectral radius of the frozen error, which is necessary; the three best of a size are
        put to `rt.certify.observer`. All sets of a size are screened up to 2000 of them, beyond that the best smaller
        set is extended: a smaller certified set may then exist.

    Raises
    ------
    InputError
        Unknown candidates, a size that is not possible.

    Examples
    --------
    >>> import robthermal as rt
    >>> found = rt.design.place_sensors(rt.systems.two_module(), temperature=(278.15, 358.15), largest=2,
    ...                                 current={"m1": (0.0, 1.5), "m2": (0.0, 1.5)})
    >>> len(found.sensors), found.certificate.holds
    (1, True)
    """
    check_system(system)
    quick = (name for name, sensor in system.thermometers.items() if sensor.time_constant + sensor.delay <= sample_time)
    names = tuple(dict.fromkeys([*keep, *(quick if candidates is None else candidates)]))
    for name in names:
        system.thermometer(name, "argument candidates")
    least = max(len(set(keep)), 1)
    if not isinstance(largest, int) or not least <= largest <= len(names):
        raise InputError(f"largest = {largest!r}", where="argument largest", expected=f"{least} to {len(names)}")
    if method not in _METHODS:
        raise InputError(f"method = {method!r}", where="argument method", expected="one of " + ", ".join(_METHODS))
    check_box(system, current, temperature)
    best: dict[int, tuple[tuple[str, ...], float]] = {}
    proven: tuple[GainObserver, Certificate] | None = None
    for size in range(least, largest + 1):
        screened = []
        for tried in _sets(names, tuple(keep), size, best):
            if unobservable(system, tried) or len({system.sensors[name].lump for name in tried}) < size:
                continue
            found = without_advice(system, tried, sample_time, method, process_noise, None, current, temperature, None)
            screened.append((found.spectral_radius(current, temperature), found))
        if not screened:
            continue
        screened.sort(key=lambda pair: pair[0])
        best[size] = (screened[0][1].sensors, screened[0][0])
        if proven is None:
            proven = _first_certified([found for radius, found in screened if radius < 1], current, temperature)
    if proven is None:
        return Placement((), None, None, best, DesignCode.NONE.outcome(
            f"No set of up to {largest} sensors was certified over this box:"))
    return Placement(proven[0].sensors, *proven, best, DesignCode.FOUND.outcome(
        f"{', '.join(proven[0].sensors)}: {proven[1].claim}"))


def _first_certified(found: list[GainObserver], current: Mapping[str, Interval],
                     temperature: Temperatures) -> tuple[GainObserver, Certificate] | None:
    for obs in found[:_TRIED]:
        certificate = obs.certify(current, temperature)
        if certificate.holds:
            return obs, certificate
    return None


def _sets(names: tuple[str, ...], keep: tuple[str, ...], size: int,
          best: dict[int, tuple[tuple[str, ...], float]]) -> list[tuple[str, ...]]:
    """Sets of one size to try, sensors in the order of the candidates."""
    free = [name for name in names if name not in keep]
    kept = set(keep)
    if comb(len(free), size - len(kept)) <= _MOST or size - 1 not in best:
        chosen = [kept.union(more) for more in islice(combinations(free, size - len(kept)), _MOST)]
    else:
        smaller = set(best[size - 1][0])
        chosen = [smaller | {more} for more in free if more not in smaller]
    return [tuple(name for name in names if name in some) for some in chosen]
