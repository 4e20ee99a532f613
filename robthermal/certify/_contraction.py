"""Contraction of the network with given currents, in a box: one norm in which any two trajectories approach."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..thermal import System
from ..verification import Certificate, establish, not_certified
from ._energy import energy_rate
from ._heaters import following
from ._jacobian import BoxJacobian, box_jacobian
from ._lyapunov import Structure, best_matrix, block_pattern, check_choice, short_matrices
from ._polytope import MOST
from ._sections import JACOBIAN, Currents, Interval, Temperatures, made_by, region_section, system_section
from ._weights import best_weights

Method = Literal["energy", "sum", "max", "lyapunov"]
METHODS = ("energy", "sum", "max", "lyapunov")
_SLACK = (0.1, 0.2, 0.35, 0.5, 0.8)  # share of the rate given up, so that the claim survives small errors of the
# parameters; tried in turn where a proof fails
_SMALLEST = 1e-12  # 1/s: a rate below this is not claimed
_SOLVERS = {"energy": "LAPACK eigenvalues at the vertices", "sum": "Noda iteration, sparse solves",
            "max": "Noda iteration, sparse solves", "lyapunov": "Clarabel semidefinite program, cutting planes"}
_Found = tuple[float, Iterator[dict[str, Any]]]  # rate, and ever more accurate evidence for it


def contraction(system: System, *, current: Currents, temperature: Temperatures, method: Method = "energy",
                parameters: Mapping[str, Interval] | None = None, structure: Structure = "full",
                large: bool = False) -> Certificate:
    """Certify that a network contracts for every temperature and current in a box.

    Heaters whose power follows temperature (`power_slope`) may have any power within their declared limits.

    Parameters
    ----------
    system : System
        Network with its modules.
    current : mapping
        {module: (lower, upper)} [A], every module; modules vary independently.
    temperature : tuple or mapping
        (lower, upper) for every lump independently, or {lump: (lower, upper)} [K].
    method : {"energy", "sum", "max", "lyapunov"}
        Norm: V = eᵀEe, weighted l₁ (cᵀJ < 0), weighted l∞ (J d < 0), V = eᵀPe.
    parameters : mapping, optional
        Uncertain numbers of the system, {parameter name: (lower, upper)} in their own units: capacities of lumps,
        conductances of links, values and slopes of modules, slopes of the powers of heaters. The claim then covers
        every combination.
    structure : {"full", "block"}
        Method "lyapunov": any P, or one without entries between hot side, cold side and the faces of the modules,
        Evers (2021), (5.20).
    large : bool
        Method "lyapunov": search a dense P for more than 40 lumps too, which may take hours.

    Returns
    -------
    Certificate
        `holds` tells whether it is proven; if not, `reason` tells why. "Not certified" is a result, not an error.

    Raises
    ------
    InputError
        Boxes that do not fit the system, Celsius, unknown method or parameter, a large system with method "lyapunov", a
        heater whose power follows temperature and that has no limits.

    References
    ----------
    Lohmiller and Slotine, "On contraction analysis for nonlinear systems", Automatica 34 (1998); errata of Evers
    (2021), "Thermal runaway".

    Examples
    --------
    >>> import robthermal as rt
    >>> box = {"m1": (-1.0, 1.5), "m2": (-1.0, 1.5)}
    >>> cert = rt.certify.contraction(rt.systems.two_module(), current=box, temperature=(278.15, 358.15), method="sum")
    >>> cert.holds, rt.verify(cert).valid
    (True, True)
    """
    if method not in METHODS:
        raise InputError(f"method = {method!r}", where="argument method",
                         expected='"energy", "sum", "max" or "lyapunov"')
    system_part = system_section(system, forcing=True, heaters=following(system, parameters))
    region = region_section(system, current, temperature, parameters, (*JACOBIAN, "inputs"))
    parts: dict[str, Any] = {"system": system_part, "region": region}
    if method == "lyapunov":
        check_choice(system, structure, large)
    box = box_jacobian(system, region, hull=method == "lyapunov")
    pattern = block_pattern(system, structure) if method == "lyapunov" else None
    return best_certificate("contraction", parts, method, box, pattern)


def best_certificate(kind: str, parts: Mapping[str, Any], method: str, box: BoxJacobian,
                     pattern: NDArray[np.bool_] | None = None) -> Certificate:
    """Certificate with the best evidence that is found for a Jacobian over a box, and proven.

    Parameters
    ----------
    kind : str
        "contraction" or "regulated".
    parts : mapping
        Sections system and region.
    method : str
        Norm in which trajectories approach each other: "energy", "sum", "max" or "lyapunov".
    box : BoxJacobian
        What to find evidence for; with ``hull=True`` for "lyapunov".
    pattern : ndarray of bool, optional
        Entries of P that may differ from zero, for "lyapunov"; default all.

    Returns
    -------
    Certificate
    """
    rate, evidence = _with_matrix(box, pattern) if method == "lyapunov" else _with_weights(box, method)
    if not rate > _SMALLEST:
        return not_certified(kind, **parts, evidence={"method": method},
                             made_by=made_by(_SOLVERS[method], "none"), reason=_why_not(kind, method, rate))
    for slack, found in zip(_SLACK, evidence, strict=False):
        cert = establish(kind, **parts, made_by=made_by(_SOLVERS[method], _status(slack)),
                         evidence={"method": method, "rate": _short(rate * (1 - slack), digits=2), **found})
        if cert.holds:
            return cert
    return cert


def _with_weights(box: BoxJacobian, method: str) -> _Found:
    if method == "energy":
        return energy_rate(box), ({} for _ in _SLACK)
    found = best_weights(box, method)
    if found is None:
        return -np.inf, iter(())
    weights, rate = found
    return rate, ({"weights": [_short(w) for w in weights / weights.max()]} for _ in _SLACK)


def _with_matrix(box: BoxJacobian, pattern: NDArray[np.bool_] | None) -> _Found:
    found = best_matrix(box, pattern)
    if found is None:
        return np.nan, iter(())
    return found.rate, ({"matrix": matrix} for matrix in short_matrices(found.matrix))


def _status(slack: float) -> str:
    return f"found; {100 * slack:g} % of the rate given up for errors of the parameters and the proof"


def _why_not(kind: str, method: str, rate: float) -> str:
    search = "largest_current" if kind == "contraction" else "largest_regulated_current"
    narrow = f"Narrow the current or temperature range (rt.certify.{search} tells how far)"
    if method == "energy":
        return (f"at some vertex of the box the symmetric part of the Jacobian grows at {-rate:.3g} 1/s: V = eᵀEe does "
                f"not decay there. {narrow}.")
    if method == "lyapunov":
        if np.isnan(rate):
            return f"more than {MOST} joint vertices: too many for one matrix inequality; use energy, sum or max."
        return f"no matrix P was found for which V = eᵀPe decays at every vertex of the box. {narrow}."
    norm = "column" if method == "sum" else "row"
    return (f"there are no positive weights for which every {norm} sum is negative over the box. "
            f"{narrow}, or try another method.")


def _short(value: float, digits: int = 11) -> float:
    """A few digits, rounded towards zero: short to read, and slack is not eaten by the rounding."""
    if value == 0.0:
        return 0.0
    shift = digits - int(np.floor(np.log10(abs(value)))) - 1
    return float(np.trunc(value * 10.0**shift) / 10.0**shift) if abs(shift) < 300 else value
