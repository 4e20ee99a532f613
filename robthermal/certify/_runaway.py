"""Thermal runaway of modules that regulate their cold face: I*, q*, checked against the closed form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from .._pandas import pd
from ..errors import Outcome
from ..thermal import LoadCurve, System, fold
from ..verification import Certificate, establish
from ._outcomes import CertifyCode
from ._sections import Interval, made_by, parameter_box, system_section

_SLACKS = (0.01, 0.05, 0.2)  # share of the spread over the corners of the constants added to it, tried in turn


@dataclass(frozen=True)
class Runaway:
    """Limits of a machine whose modules hold their cold faces.

    Parameters
    ----------
    current : dict
        Module to I* [A]: beyond it more current takes less heat, and the hot side runs away.
    load : dict
        Module to q* [W]: heat taken from the cold lump there; no equilibrium takes more.
    closed_form : dict
        Module to the root of the cubic for constant S, R, K and the module's own effective heat sink [A].
    curve : LoadCurve
        Equilibria on the way to the fold.
    certificates : dict
        Module to the certificate of its closed form; none for a module whose hot face another module holds.
    outcome : Outcome
        How the two agree.
    """

    current: dict[str, float]
    load: dict[str, float]
    closed_form: dict[str, float]
    curve: LoadCurve
    certificates: dict[str, Certificate]
    outcome: Outcome

    def table(self) -> pd.DataFrame:
        """I* [A], q* [W] and the closed form of every module."""
        return pd.DataFrame({"I* [A]": self.current, "q* [W]": self.load, "closed form I* [A]": self.closed_form})

    def __str__(self) -> str:
        return self.table().round(3).to_string()

    def plot(self, ax: Any = None) -> Any:
        """Plot the load curve with its fold; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = self.curve.plot(ax)
        for i, (name, current) in enumerate(self.current.items()):
            label = f"{name}: fold at {current:.3g} A, {self.load[name]:.3g} W"
            ax.plot(current, self.load[name], "o", color=f"C{i}", label=label)
        ax.legend()
        return ax


def runaway(system: System, *, setpoint: Mapping[str, float], ambient: Mapping[str, float] | None = None,
            parameters: Mapping[str, Interval] | None = None) -> Runaway:
    """Find the current and load at which modules that hold their cold face run away.

    Parameters
    ----------
    system : System
        With its modules; those not named are off.
    setpoint : mapping
        {module: temperature of its cold face} [K].
    ambient : mapping, optional
        Ambient temperatures [K]; default nominal.
    parameters : mapping, optional
        Uncertain numbers of the system as in `contraction`. The network's fold is found for each end of each of them;
        what that does to S, R, K and the heat sink, added up, are the ranges of the closed form's certificates. How the
        constants follow from the parameters is computed, not proven; for all constants in these ranges the claim is.

    Returns
    -------
    Runaway

    Raises
    ------
    InputError
        Unknown modules or parameters, Celsius.

    References
    ----------
    Errata of Evers (2021), "Thermal runaway: what the thesis lacks".

    Examples
    --------
    >>> import robthermal as rt
    >>> limit = rt.certify.runaway(rt.systems.two_module(), setpoint={"m1": 278.15, "m2": 278.15})
    >>> round(limit.load["m1"], 2)
    3.75
    """
    system_section(system)  # refuses effects that the closed form leaves out
    curve = fold(system, setpoint, ambient=ambient)
    current = dict(zip(setpoint, curve.current[-1].tolist(), strict=True))
    load = dict(zip(setpoint, curve.load[-1].tolist(), strict=True))
    numbers = {name: _constants(curve, i, name) for i, name in enumerate(setpoint)}
    closed = {name: smallest_root(n) for name, n in numbers.items()}
    box = parameter_box(system, parameters or {})
    ends = [fold(system.with_parameters({key: end}), setpoint, ambient=ambient) for key, pair in box.items()
            for end in pair]
    certificates = {name: _certify(system, name, n, _ranges(n, [_constants(c, i, name) for c in ends]))
                    for i, (name, n) in enumerate(numbers.items()) if 0 < n["sink_conductance"] < np.inf}
    worst = max(abs(closed[name] / current[name] - 1) for name in setpoint)
    sloped = any(m.seebeck.slope or m.resistance.slope or m.conductance.slope for m in system.modules.values())
    why = " (their S, R, K vary with temperature, the closed form's do not)" if sloped else ""
    return Runaway(current, load, closed, curve, certificates, CertifyCode.FOUND.outcome(
        f"The network's fold and the closed form differ by at most {100 * worst:.2g} %{why}."))


def _constants(curve: LoadCurve, i: int, name: str) -> dict[str, float]:
    """Constants of the closed form at the fold: S, R, K at T_avg and the effective heat sink of one module.

    The sink is the line through the hot face's temperature and rejected heat at rest and at the fold.
    """
    module = curve.system.modules[name]
    hot = curve.temperatures[:, curve.system.lump_names.index(module.hot)]
    cold = curve.setpoint[name]
    dT = 0.5 * (hot + cold) - module.reference_temperature
    S, R, K = (getattr(module, key).value + getattr(module, key).slope * dT for key in
               ("seebeck", "resistance", "conductance"))
    current = curve.current[:, i]
    rejected = curve.load[:, i] + R * current**2 + S * (hot - cold) * current
    if _hot_is_held(curve, name):  # by the module that it stands on: a heat sink without a limit
        return {"seebeck": float(S[-1]), "resistance": float(R[-1]), "conductance": float(K[-1]),
                "sink_conductance": float("inf"), "sink_temperature": float(hot[-1]), "setpoint": float(cold)}
    g = (rejected[-1] - rejected[0]) / (hot[-1] - hot[0])
    w = hot[-1] - rejected[-1] / g
    return {"seebeck": float(S[-1]), "resistance": float(R[-1]), "conductance": float(K[-1]),
            "sink_conductance": float(g), "sink_temperature": float(w), "setpoint": float(cold)}


def _hot_is_held(curve: LoadCurve, name: str) -> bool:
    """Whether the hot face of a module is the cold face of another that holds it, as in a cascade."""
    modules = curve.system.modules
    return modules[name].hot in {modules[other].cold for other in curve.setpoint}


def smallest_root(n: Mapping[str, float]) -> float:
    """Smallest positive root I* of the cubic of the errata [A]; nan if there is none.

    Where the hot face is held the sink conductance is infinite, and the cubic becomes S x = R I.
    """
    S, R, K = n["seebeck"], n["resistance"], n["conductance"]
    g, w, x = n["sink_conductance"], n["sink_temperature"], n["setpoint"]
    if np.isinf(g):
        return S * x / R
    roots = np.roots([-2 * R * S**2, S * (5 * K * R + 4 * g * R + 2 * S**2 * x),
                      -2 * (K + g) * (2 * K * R + g * R + 2 * S**2 * x), 2 * g * S * ((g + 2 * K) * x - K * w)])
    real = roots.real[(np.abs(roots.imag) < 1e-9 * np.abs(roots)) & (roots.real > 0)]
    return float(real.min(initial=np.inf)) if real.size else float("nan")


def load_at(n: Mapping[str, float], current: float) -> float:
    """Load q(I) of the closed form [W]."""
    S, R, K = n["seebeck"], n["resistance"], n["conductance"]
    g, w, x, I = n["sink_conductance"], n["sink_temperature"], n["setpoint"], current  # noqa: E741 - I is the current
    top = g * K * (x - w) + g * S * x * I - (g * R / 2 + K * R + S**2 * x) * I**2 + S * R * I**3 / 2
    return top / (g + K - S * I)


def _ranges(numbers: Mapping[str, float], ends: Sequence[Mapping[str, float]]) -> dict[str, list[float]]:
    """Ranges of the constants that change: the changes at the lower and upper end of every parameter added up."""
    found = {}
    for key, value in numbers.items():
        changes = np.array([end[key] - value for end in ends]).reshape(-1, 2)
        low, high = changes.min(axis=1, initial=0.0).sum(), changes.max(axis=1, initial=0.0).sum()
        if low < 0 or high > 0:
            found[key] = [float(value + low), float(value + high)]
    return found


def _certify(system: System, name: str, numbers: dict[str, float], ranges: Mapping[str, list[float]]) -> Certificate:
    corners = [{**numbers, **dict(zip(ranges, chosen, strict=True))} for chosen in product(*ranges.values())]
    currents = np.array([smallest_root(corner) for corner in corners])
    heats = np.array([load_at(corner, current) for corner, current in zip(corners, currents, strict=True)])
    for slack in _SLACKS:
        width = slack * np.ptp(currents) + 1e-6 * currents.max()
        spread = slack * np.ptp(heats) + 1e-6 * max(np.abs(heats).max(), 1.0)
        evidence = {"current": [currents.min() - width, currents.max() + width],
                    "load": [heats.min() - spread, heats.max() + spread]}
        cert = establish("runaway", system={"name": f"{system.name}, module {name}", **numbers},
                         region={"parameters": ranges} if ranges else {}, evidence=evidence,
                         made_by=made_by("numpy.roots", "found"))
        if cert.holds:
            break
    return cert
