"""Current limits over ambient temperature, set-point and load, for the operating manual."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._celsius import ZERO_CELSIUS
from .._fleet import fleet
from .._pandas import pd
from ..errors import InputError, Outcome
from ..thermal import System, format_system, steady_state
from ._contraction import Method
from ._outcomes import CertifyCode
from ._sections import Interval, Temperatures, parameter_box, system_section
from ._usable import box_bound, headline, question_of
from ._usable_bounds import Lower, Question, contraction_bound, rating_bound
from ._usable_result import CurrentBound, UsableCurrent
from ._usable_runaway import OF_FOLD, fold_current

_AXES = ("ambient [K]", "setpoint [K]", "load [W]")
_QUIET = 1e-6  # A: a current this small is none


@dataclass(frozen=True)
class LimitMap:
    """Usable currents of a machine over its operating conditions.

    Parameters
    ----------
    data : DataFrame
        A row per condition: "ambient [K]", "setpoint [K]", "load [W]" on every cold face; "needed [A]", the current of
        the module that needs most to hold it, negative if it heats (nan: no equilibrium does); "runaway [A]", the
        smallest I* of the modules; "contraction [A]", the contraction limit inside the stated box, which is not a limit
        for use; "usable [A]", the usable current: the smallest of 0.98 I*, contraction, invariant box and rating;
        "allowed", whether the needed current is within the usable one; "direction", "cooling" where currents in [0, c]
        hold the condition, "symmetric" where a module must heat: [-c, c].
    contraction : dict
        Direction to the contraction limit inside the stated box; not a limit for use.
    boxes : dict
        (ambient [K], load [W], direction) to the largest `UsableCurrent` of its conditions, with the box that is never
        left and its two certificates.
    outcome : Outcome
        How many conditions are allowed.
    """

    data: pd.DataFrame
    contraction: dict[str, CurrentBound]
    boxes: dict[tuple[float, float, str], UsableCurrent]
    outcome: Outcome

    def __str__(self) -> str:
        return f"{self.outcome.text}\n{self.data.round(3).to_string(index=False)}"

    def plot(self) -> NDArray[Any]:
        """Plot needed and usable current over the load, a panel per set-point; returns the array of axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        panels = list(self.data.groupby("setpoint [K]"))
        figure, axes = plt.subplots(1, len(panels), sharey=True, squeeze=False, layout="constrained")
        for ax, (setpoint, panel) in zip(axes[0], panels, strict=True):
            for k, (ambient, part) in enumerate(panel.groupby("ambient [K]")):
                ax.plot(part["load [W]"], part["needed [A]"], f"C{k % 6}o-", ms=3,
                        label=f"{ambient - ZERO_CELSIUS:.3g} °C")
                usable = part["usable [A]"].where(part["direction"] == "cooling", -part["usable [A]"])
                ax.plot(part["load [W]"], usable, f"C{k % 6}--", lw=0.9)
            ax.set(xlabel="load on every cold face [W]", title=f"set-point {setpoint - ZERO_CELSIUS:.3g} °C")
        axes[0, 0].set(ylabel="current needed (line), usable (dashed) [A]")
        lines = [line for line in axes[0, 0].get_lines() if not line.get_label().startswith("_")]
        figure.legend(handles=lines, title="ambient", ncols=6, fontsize="small", loc="outside upper center")
        return axes[0]


def limit_map(system: System, *, ambient: Sequence[float], setpoint: Sequence[float], load: Sequence[float],
              temperature: Temperatures, method: Method = "energy", jobs: int = 2,
              progress: Callable[[int, int], None] = lambda done, total: None,
              store: str | Path | None = None, parameters: Mapping[str, Interval] | None = None,
              lower: Lower = "reported") -> LimitMap:
    """Map the usable current over ambient temperature, set-point and load.

    For every ambient and load the bounds of `usable_current` are found: contraction in the stated box, the invariant
    box inside it, the rating; and for every ambient and set-point I* of the network, of which 0.98 are used. Where a
    condition needs heating, they are for currents of both signs.

    Parameters
    ----------
    system : System
        All of its modules hold their cold faces.
    ambient : sequence of float
        Temperatures of all ambients [K].
    setpoint : sequence of float
        Temperatures of all cold faces [K].
    load : sequence of float
        Heat into every cold face [W], the only heat beside what modules and ambients give: the heaters are off.
    temperature : tuple or mapping
        The stated box, which the machine must not leave [K].
    method : {"energy", "sum", "max", "lyapunov"}
        Of the contraction certificates.
    jobs : int
        Number of parallel processes.
    progress : callable, optional
        Called with the number of ambients and set-points that are done, and how many there are.
    store : str or path, optional
        File that keeps what is done, as in `rt.fleet`: a map that was stopped continues where it was.
    parameters : mapping, optional
        Ranges of uncertain numbers of the system as in `usable_current`; the needed current is the nominal one.
    lower : {"reported", "inside"}
        Whether the lower ends of the boxes must lie inside the stated one, as in `usable_current`.

    Returns
    -------
    LimitMap

    Raises
    ------
    InputError
        No modules, a cascade, empty or non-finite axes, Celsius, a stated box that excludes an ambient.

    Examples
    --------
    >>> import robthermal as rt
    >>> found = rt.certify.limit_map(rt.systems.two_module(), ambient=[298.15], setpoint=[283.15], load=[1.0, 5.0],
    ...                              temperature=(273.15, 358.15), jobs=1)
    >>> found.data["allowed"].tolist()
    [True, False]
    """
    axes = [_axis(values, name) for values, name in zip((ambient, setpoint, load), ("ambient", "setpoint", "load"),
                                                        strict=True)]
    if not isinstance(jobs, int) or isinstance(jobs, bool) or jobs < 1:
        raise InputError(f"jobs = {jobs!r}", where="argument jobs", expected="a whole number, at least 1")
    if system.cascade:
        raise InputError(f"a cascade: {system.cascade}", where="argument system",
                         expected="modules side by side: a map has one set-point and one load for all cold faces",
                         remedy="Use rt.certify.usable_current with a set-point for every stage.")
    system_section(system)  # refuses heats of its own: the loads of the map would stand in their place
    ranges = parameter_box(system, parameters or {})
    nominal = question_of(system, temperature=temperature, parameters=parameters, lower=lower, method=method, heat={},
                          ambient=dict.fromkeys(system.ambient_names, (min(axes[0]), max(axes[0]))))
    points = [{"ambient": T, "setpoint": target, "loads": axes[2]} for T in axes[0] for target in axes[1]]
    setting = "" if store is None else f"{format_system(system)}{sorted(ranges.items())}"
    run = fleet(partial(_rows, nominal), points, store=store, setting=setting, jobs=jobs, progress=progress)
    data = pd.DataFrame([row for rows in run.results for row in rows])
    contraction: dict[str, CurrentBound] = {}
    boxes = {}
    for (T, watts, direction), part in data.groupby(["ambient [K]", "load [W]", "direction"]):
        condition = replace(nominal, direction=direction, ambient=dict.fromkeys(system.ambient_names, (T, T)),
                            heat={module.cold: (watts, watts) for module in system.modules.values()})
        if direction not in contraction:
            contraction[direction] = contraction_bound(condition)
        highest = CurrentBound(OF_FOLD * float(part["runaway [A]"].max()), None, "computed",
                               "0.98 I*, the fold of the network, at the set-point of the map where it is largest.")
        boxes[T, watts, direction] = headline(condition, {
            "contraction": contraction[direction], "box": box_bound(condition), "runaway": highest,
            "rating": rating_bound(condition)})
    data["contraction [A]"] = [contraction[direction].current for direction in data["direction"]]
    keys = zip(data["ambient [K]"], data["load [W]"], data["direction"], strict=True)
    data["usable [A]"] = np.minimum(OF_FOLD * data["runaway [A]"], [boxes[key].current for key in keys])
    data["allowed"] = data["needed [A]"].abs() <= data["usable [A]"]
    data["direction"] = data.pop("direction")  # to the end
    allowed = int(data["allowed"].sum())
    code = CertifyCode.MAPPED if allowed else CertifyCode.NONE
    return LimitMap(data, contraction, boxes, code.outcome(
        f"{allowed} of {len(data)} conditions need no more than the usable current.", remedy=""))


def _rows(question: Question, point: Mapping[str, Any]) -> list[dict[str, Any]]:
    system, ambient, setpoint, loads = question.system, point["ambient"], point["setpoint"], point["loads"]
    surroundings, targets = dict.fromkeys(system.ambient_names, ambient), dict.fromkeys(system.module_names, setpoint)
    limit = fold_current(replace(question, ambient={name: (T, T) for name, T in surroundings.items()}), targets)
    rows = []
    for load in loads:
        heat = {module.cold: load for module in system.modules.values()}
        states = steady_state(system, surroundings, setpoint=targets, heat=heat)
        stable = [list(e.currents.values()) for e in states.equilibria if e.stable]
        best = min(stable, key=lambda currents: max(map(abs, currents)), default=[float("nan")])
        rows.append({**dict(zip(_AXES, (ambient, setpoint, load), strict=True)), "needed [A]": max(best, key=abs),
                     "runaway [A]": limit, "direction": "symmetric" if min(best) < -_QUIET else "cooling"})
    return rows


def _axis(values: Sequence[float], name: str) -> list[float]:
    axis = np.atleast_1d(np.asarray(values, float))
    if axis.ndim != 1 or not axis.size or not np.isfinite(axis).all() or (name != "load" and axis.min() < 150.0):
        raise InputError(f"{values!r}", where=f"argument {name}",
                         expected="a list of finite numbers" + ("" if name == "load" else ", kelvin"))
    return axis.tolist()
