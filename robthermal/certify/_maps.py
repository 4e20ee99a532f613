"""Current limits over ambient temperature, set-point and load, for the operating manual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from joblib import Parallel, delayed

from ..errors import InputError, Outcome
from ..thermal import System, fold, steady_state
from ._contraction import Method
from ._limits import CurrentLimit, largest_current
from ._sections import Temperatures

_AXES = ("ambient [K]", "setpoint [K]", "load [W]")


@dataclass(frozen=True)
class LimitMap:
    """Current limits of a machine over its operating conditions.

    Parameters
    ----------
    data : DataFrame
        A row per condition: "ambient [K]", "setpoint [K]", "load [W]" on every cold face; "needed [A]", the largest
        current a module needs to hold it (nan: no equilibrium does); "runaway [A]", the smallest I* of the modules;
        "certified [A]", up to which arbitrary currents are certified; "limit [A]", the smaller of the two; "safe",
        whether the needed current is within the limit.
    certified : CurrentLimit
        The certified limit with its certificate: it holds for every condition whose temperatures stay in its box.
    outcome : Outcome
        How many conditions are safe.
    """

    data: pd.DataFrame
    certified: CurrentLimit
    outcome: Outcome

    def __str__(self) -> str:
        return f"{self.outcome.text}\n{self.data.round(3).to_string(index=False)}"

    def plot(self) -> Any:
        """Plot limit and needed current over the load, a colour per ambient and set-point; returns the axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        _, ax = plt.subplots(layout="constrained")
        for k, ((ambient, setpoint), part) in enumerate(self.data.groupby(list(_AXES[:2]))):
            label = f"ambient {ambient - 273.15:.3g} °C, set-point {setpoint - 273.15:.3g} °C"
            ax.plot(part[_AXES[2]], part["needed [A]"], f"C{k}o-", label=label)
            ax.plot(part[_AXES[2]], part["limit [A]"], f"C{k}--")
        ax.set(xlabel="load on every cold face [W]", ylabel="current [A]",
               title="current needed (line) and allowed (dashed)")
        ax.legend(fontsize="small")
        return ax


def limit_map(system: System, *, ambient: Sequence[float], setpoint: Sequence[float], load: Sequence[float],
              temperature: Temperatures, method: Method = "energy", jobs: int = 2) -> LimitMap:
    """Map the allowed current over ambient temperature, set-point and load.

    A saturated controller runs on a given current, so the limit must pass the contraction certificate; the regulated
    loop must stay below its fold I*. The limit is the smaller of the two.

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
    points = [(T, target) for T in axes[0] for target in axes[1]]
    found = Parallel(n_jobs=jobs)(delayed(_rows)(system, T, target, axes[2]) for T, target in points)
    data = pd.DataFrame([row for rows in found for row in rows])
    data["certified [A]"] = certified.current
    data["limit [A]"] = data[["runaway [A]", "certified [A]"]].min(axis=1)
    data["safe"] = data["needed [A]"] <= data["limit [A]"]
    return LimitMap(data, certified, Outcome(
        certified.outcome.ok, "mapped" if certified.outcome.ok else "not_certified",
        f"{int(data['safe'].sum())} of {len(data)} conditions need no more than the allowed current. "
        f"{certified.outcome.text}"))


def _rows(system: System, ambient: float, setpoint: float, loads: Sequence[float]) -> list[dict[str, float]]:
    surroundings = dict.fromkeys(system.ambient_names, ambient)
    targets = dict.fromkeys(system.module_names, setpoint)
    limit = float(np.min(fold(system, targets, ambient=surroundings).current[-1]))
    rows = []
    for load in loads:
        heat = {module.cold: load for module in system.modules.values()}
        states = steady_state(system, surroundings, setpoint=targets, heat=heat)
        stable = [max(abs(current) for current in e.currents.values()) for e in states.equilibria if e.stable]
        rows.append({**dict(zip(_AXES, (ambient, setpoint, load), strict=True)),
                     "needed [A]": min(stable, default=float("nan")), "runaway [A]": limit})
    return rows


def _axis(values: Sequence[float], name: str) -> list[float]:
    axis = np.atleast_1d(np.asarray(values, float))
    if axis.ndim != 1 or not axis.size or not np.isfinite(axis).all() or (name != "load" and axis.min() < 150.0):
        raise InputError(f"{values!r}", where=f"argument {name}",
                         expected="a list of finite numbers" + ("" if name == "load" else ", kelvin"))
    return axis.tolist()
