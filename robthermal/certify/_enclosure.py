"""Boxes that a machine cannot leave, and the claim "no thermal runaway" made of two certificates.

In the box the network contracts; the box is never left; so every trajectory that starts in it forgets its start and
stays in it, whatever the currents, heaters and ambients do within their ranges.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
import pandas as pd
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import spsolve

from ..errors import InputError, Outcome
from ..thermal import Equations, System
from ..verification import Certificate, not_certified
from ._contraction import Method, contraction
from ._invariance import invariance
from ._lyapunov import Structure
from ._sections import (
    Currents,
    Interval,
    current_box,
    made_by,
    named_ranges,
    region_section,
    system_section,
)

_HOTTEST = 1000.0  # K
_COLDEST = 60.0
_MARGIN = 1e-3  # W of inward heat left on every face of the box
_ITERATIONS = 400
_STEP = 0.01  # K, for the slope of a loss


@dataclass(frozen=True)
class RunawayFree:
    """The claim that a machine cannot run away thermally.

    Parameters
    ----------
    temperature : dict
        Lump to [lower, upper] [K]: the box; empty if none was found.
    invariance, contraction : Certificate
        The box is never left; in it the network contracts.
    outcome : Outcome
        "certified", or which of the two is missing and why.
    """

    temperature: dict[str, Interval]
    invariance: Certificate
    contraction: Certificate
    outcome: Outcome

    @property
    def holds(self) -> bool:
        """Whether both certificates hold."""
        return self.invariance.holds and self.contraction.holds

    def table(self) -> pd.DataFrame:
        """The box, °C."""
        return pd.DataFrame({name: np.array(pair) - 273.15 for name, pair in self.temperature.items()},
                            index=["lowest [°C]", "highest [°C]"]).T

    def __str__(self) -> str:
        return self.outcome.text


def runaway_free(system: System, *, current: Currents, ambient: Mapping[str, Interval] | None = None,
                 heat: Mapping[str, Interval] | None = None, method: Method = "energy", structure: Structure = "full",
                 large: bool = False) -> RunawayFree:
    """Certify that a machine cannot run away thermally.

    Parameters
    ----------
    system : System
        Network with its modules.
    current : mapping
        {module: (lower, upper)} [A], every module, independently and arbitrarily in time.
    ambient : mapping, optional
        {ambient: (lower, upper)} [K]; default nominal.
    heat : mapping, optional
        {lump: (lower, upper)} [W], heaters and loads; default the declared limits of the heaters.
    method : {"energy", "sum", "max", "lyapunov"}
        Norm of the contraction.
    structure, large
        As in `contraction`.

    Returns
    -------
    RunawayFree

    Raises
    ------
    InputError
        Ranges that do not fit the system; a heater without limits when `heat` is not given.

    Examples
    --------
    >>> import robthermal as rt
    >>> safe = rt.certify.runaway_free(rt.systems.two_module(), current={"m1": (0.0, 1.0), "m2": (0.0, 1.0)})
    >>> safe.holds
    True
    """
    system_section(system)  # refuses effects before they meet the box
    currents = current_box(system, current)
    heat = heater_heat(system) if heat is None else heat
    box = invariant_box(system, currents, ambient or {}, heat)
    if box is None:
        region = region_section(system, current, (_COLDEST + 200, _HOTTEST))
        reason = ("no box was found that these currents and heats cannot leave: the heat balance of some lump "
                  "diverges. Narrow the currents, or improve the heat sink.")
        refused = not_certified("invariance", system=system_section(system), region=region, evidence={}, reason=reason,
                                made_by=made_by("monotone iteration", "none"))
        return RunawayFree({}, refused, refused, Outcome(False, "not_certified", f"Not certified: {reason}"))
    stays = invariance(system, current=current, temperature=box, ambient=ambient, heat=heat or None)
    shrinks = contraction(system, current=current, temperature=box, method=method, structure=structure, large=large)
    return RunawayFree(box, stays, shrinks, _outcome(stays, shrinks, box))


def heater_heat(system: System) -> dict[str, Interval]:
    """Heat range of every heated lump from the declared limits of the heaters.

    Parameters
    ----------
    system : System
        Whose heaters.

    Returns
    -------
    dict
        {lump: (lower, upper)} [W]; heaters on one lump add up.

    Raises
    ------
    InputError
        A heater without limits.

    Examples
    --------
    >>> import robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 50.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}],
    ...                 inputs={"foil": {"lump": "bar", "gain": 2.0, "limits": (0.0, 10.0)}})
    >>> rt.certify.heater_heat(bar)
    {'bar': (0.0, 20.0)}
    """
    heat: dict[str, Interval] = {}
    for name, heater in system.inputs.items():
        if heater.limits is None:
            raise InputError(f"heater {name!r} has no limits", where=f"[inputs.{name}] limits",
                             remedy="Give limits = [lower, upper], or pass heat={lump: (lower, upper)}.")
        ends = sorted(heater.gain * limit for limit in heater.limits)
        low, high = heat.get(heater.lump, (0.0, 0.0))
        heat[heater.lump] = (low + ends[0], high + ends[1])
    return heat


def invariant_box(system: System, currents: Mapping[str, list[float]], ambient: Mapping[str, Interval],
                  heat: Mapping[str, Interval]) -> dict[str, Interval] | None:
    """Smallest box by monotone iteration from the ambient range, with heat to spare; None if it diverges.

    Parameters
    ----------
    system : System
        Whose.
    currents, ambient, heat : mapping
        Ranges by name [A], [K], [W].

    Returns
    -------
    dict or None
        {lump: (lower, upper)} [K].
    """
    eq = Equations(system)
    ranges = named_ranges(ambient, system.ambient_names, "ambient", "ambient", kelvin=True)
    around = np.array([ranges.get(name, [a.temperature] * 2) for name, a in system.ambients.items()], float).T
    loads = np.zeros((2, len(system.lumps)))
    for name, pair in named_ranges(heat, system.lump_names, "heat", "lump").items():
        loads[:, system.lump_names.index(name)] = pair
    loads += np.array([[-_MARGIN], [_MARGIN]])  # so that heat flows strictly inwards on every face
    limits = np.array([currents[name] for name in system.modules], float).reshape(-1, 2).T
    box = np.array([np.full(len(system.lumps), around[0].min()), np.full(len(system.lumps), around[1].max())])
    for _ in range(_ITERATIONS):
        outward = [_outward(eq, box, box[side], side, around, loads, limits) for side in (0, 1)]
        if max(heat.max() for heat in outward) <= 0.5 * _MARGIN:
            return {name: (float(a), float(b)) for name, a, b in zip(system.lumps, *np.round(box, 6), strict=True)}
        # Newton in each lump's own face, which a loss bends: the matrix stays an M-matrix, so that no face moves in.
        for side, sign in ((0, -1), (1, 1)):
            moved = _outward(eq, box, box[side] + sign * _STEP, side, around, loads, limits)
            steeper = np.maximum(0.0, (outward[side] - moved) / _STEP + eq.A.diagonal())
            step = spsolve(csc_array(diags_array(steeper) - eq.A), np.maximum(outward[side], 0.0))
            box[side] += sign * step
        if not np.isfinite(box).all() or box[1].max() > _HOTTEST or box[0].min() < _COLDEST:
            return None
    return None


def _outward(eq: Equations, box: np.ndarray, face: np.ndarray, side: int, around: np.ndarray, loads: np.ndarray,
             limits: np.ndarray) -> np.ndarray:
    """Largest heat into every lump that pushes it out of its lower (0) or upper (1) face [W].

    The lump is at ``face``, all others anywhere in the box; linear links are taken at the same side.
    """
    n, na, sign = len(eq.capacity), around.shape[1], (-1, 1)[side]
    own_heat = eq.A.diagonal() * (face - box[side])
    extreme = sign * (eq.A @ box[side] + own_heat + loads[side] + eq.B[:, eq.B.shape[1] - na:] @ around[side])
    nodes, faces = np.concatenate([box, around], axis=1), np.concatenate([face, around[side]])
    for term in eq.terms:
        count = len(term.a)
        grid = np.linspace(limits[0], limits[1], 9) if limits.shape[1] == count and _is_module(term, eq) else None
        currents = grid if grid is not None else np.zeros((1, 0))
        for own, other, which in ((term.a, term.b, 0), (term.b, term.a, 1)):
            best = np.full(count, -np.inf)
            for current, far in product(currents, nodes[:, other]):
                first, second = (faces[own], far) if which == 0 else (far, faces[own])
                best = np.maximum(best, sign * term.heat(first, second, current)[which])
            inside = own < n
            np.add.at(extreme, own[inside], best[inside])
    return np.asarray(extreme)


def _is_module(term: object, eq: Equations) -> bool:
    return bool(eq.system.modules) and term is eq.terms[0]


def _outcome(stays: Certificate, shrinks: Certificate, box: dict[str, Interval]) -> Outcome:
    low, high = min(p[0] for p in box.values()) - 273.15, max(p[1] for p in box.values()) - 273.15
    if stays.holds and shrinks.holds:
        return Outcome(True, "certified", "Certified: no thermal runaway. Every lump stays in its range (overall "
                       f"{low:.1f} to {high:.1f} °C), in which the network contracts.")
    missing = shrinks if stays.holds else stays
    what = "the network contracts in the box" if stays.holds else "the box is never left"
    return Outcome(False, "not_certified", f"Not certified: it is not shown that {what}: {missing.reason}")
