"""Current limits over ambient temperature, set-point and load, for the operating manual."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .._fleet import fleet
from ..errors import InputError, Outcome
from ..thermal import System, fold, format_system, steady_state
from ._contraction import Method
from ._limits import CurrentLimit, largest_current
from ._sections import Temperatures

_AXES = ("ambient [K]", "setpoint [K]", "load [W]")
_QUIET = 1e-6  # A: a current this small is none


@dataclass(frozen=True)
class LimitMap:
    """Current limits of a machine over its operating conditions.

    Parameters
    ----------
    data : DataFrame
        A row per condition: "ambient [K]", "setpoint [K]", "load [W]" on every cold face; "needed [A]", the largest
        current, cooling or heating, a module needs to hold it (nan: no equilibrium does); "runaway [A]", the smallest
        I* of the modules; "certified [A]", up to which arbitrary currents are certified; "limit [A]", the smaller of
        the two; "safe", whether the needed current is within the limit.
    certified : CurrentLimit
        The certified limit with its certificate: it holds for every condition whose temperatures stay in its box. Its
        direction is "cooling", or "symmetric" when some condition needs a heating current.
    outcome : Outcome
        How many conditions are safe.
    """

    data: pd.DataFrame
    certified: CurrentLimit
    outcome: Outcome

    def __str__(self) -> str:
        return f"{self.outcome.text}\n{self.data.round(3).to_string(index=False)}"

    def plot(self) -> Any:
        """Plot needed and allowed current over the load, a panel per set-point; returns the array of axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        panels = list(self.data.groupby("setpoint [K]"))
        figure, axes = plt.subplots(1, len(panels), sharey=True, squeeze=False, layout="constrained")
        for ax, (setpoint, panel) in zip(axes[0], panels, strict=True):
            for k, (ambient, part) in enumerate(panel.groupby("ambient [K]")):
                ax.plot(part["load [W]"], part["needed [A]"], f"C{k % 6}o-", ms=3, label=f"{ambient - 273.15:.3g} °C")
                ax.plot(part["load [W]"], part["limit [A]"], f"C{k % 6}--", lw=0.9)
            ax.set(xlabel="load on every cold face [W]", title=f"set-point {setpoint - 273.15:.3g} °C")
        axes[0, 0].set(ylabel="current needed (line), allowed (dashed) [A]")
        lines = [line for line in axes[0, 0].get_lines() if not line.get_label().startswith("_")]
        figure.legend(handles=lines, title="ambient", ncols=6, fontsize="small", loc="outside upper center")
        return axes[0]


def limit_map(system: System, *, ambient: Sequence[float], setpoint: Sequence[float], load: Sequence[float],
              temperature: Temperatures, method: Method = "energy", jobs: int = 2,
              progress: Callable[[int, int], None] = lambda done, total: None,
              store: str | Path | None = None) -> LimitMap:
    """Map the allowed current over ambient temperature, set-point and load.

    A saturated controller runs on a given current, so the limit must pass the contraction certificate; the regulated
    loop must stay below its fold I*. The limit is the smaller of the two. Where a condition needs heating, the
    certificate is for currents of both signs.

    Parameters
    ----------
    system : System
        All of its modules hold their cold faces.
    ambient : sequence of float
        Temperatures of all ambients [K].
    setpoint : sequence of float
        Temperatures of all cold faces [K].
    load : sequence of float
        Heat into every cold face [W].
    temperature : tuple or mapping
        Box of the contraction certificate [K].
    method : {"energy", "sum", "max", "lyapunov"}
        Of the contraction certificate.
    jobs : int
        Processes.
    progress : callable, optional
        Called with the number of ambients and set-points that are done, and how many there are.
    store : str or path, optional
        File that keeps what is done, as in `rt.fleet`: a map that was stopped continues where it was.

    Returns
    -------
    LimitMap

    Raises
    ------
    InputError
        No modules, empty or non-finite axes, Celsius.

    Examples
    --------
    >>> import robthermal as rt
    >>> found = rt.certify.limit_map(rt.systems.two_module(), ambient=[298.15], setpoint=[283.15], load=[1.0, 5.0],
    ...                              temperature=(273.15, 358.15), jobs=1)
    >>> found.data["safe"].tolist()
    [True, False]
    """
    axes = [_axis(values, name) for values, name in zip((ambient, setpoint, load), ("ambient", "setpoint", "load"),
                                                        strict=True)]
    if not isinstance(jobs, int) or isinstance(jobs, bool) or jobs < 1:
        raise InputError(f"jobs = {jobs!r}", where="argument jobs", expected="a whole number, at least 1")
    certified = largest_current(system, temperature=temperature, direction="cooling", method=method)
    points = [{"ambient": T, "setpoint": target, "loads": axes[2]} for T in axes[0] for target in axes[1]]
    run = fleet(partial(_rows, system), points, store=store, setting="" if store is None else format_system(system),
                jobs=jobs, progress=progress)
    data = pd.DataFrame([row for rows in run.results for row in rows])
    if (data.pop("lowest [A]") < 0).any():  # [0, c] proves nothing about the heating current of a warm set-point
        certified = largest_current(system, temperature=temperature, direction="symmetric", method=method)
    data["certified [A]"] = certified.current
    data["limit [A]"] = data[["runaway [A]", "certified [A]"]].min(axis=1)
    data["safe"] = data["needed [A]"] <= data["limit [A]"]
    return LimitMap(data, certified, Outcome(
        certified.outcome.ok, "mapped" if certified.outcome.ok else "not_certified",
        f"{int(data['safe'].sum())} of {len(data)} conditions need no more than the allowed current. "
        f"{certified.outcome.text}"))


def _rows(system: System, point: Mapping[str, Any]) -> list[dict[str, float]]:
    ambient, setpoint, loads = point["ambient"], point["setpoint"], point["loads"]
    surroundings = dict.fromkeys(system.ambient_names, ambient)
    targets = dict.fromkeys(system.module_names, setpoint)
    limit = float(np.min(fold(system, targets, ambient=surroundings).current[-1]))
    rows = []
    for load in loads:
        heat = {module.cold: load for module in system.modules.values()}
        states = steady_state(system, surroundings, setpoint=targets, heat=heat)
        stable = [list(e.currents.values()) for e in states.equilibria if e.stable]
        best = min(stable, key=lambda currents: max(map(abs, currents)), default=[float("nan")])
        rows.append({**dict(zip(_AXES, (ambient, setpoint, load), strict=True)), "needed [A]": max(map(abs, best)),
                     "runaway [A]": limit, "lowest [A]": min([i for i in best if i < -_QUIET], default=0.0)})
    return rows


def _axis(values: Sequence[float], name: str) -> list[float]:
    axis = np.atleast_1d(np.asarray(values, float))
    if axis.ndim != 1 or not axis.size or not np.isfinite(axis).all() or (name != "load" and axis.min() < 150.0):
        raise InputError(f"{values!r}", where=f"argument {name}",
                         expected="a list of finite numbers" + ("" if name == "load" else ", kelvin"))
    return axis.tolist()
