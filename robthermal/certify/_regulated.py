"""Contraction of the rest of a network while modules hold their cold faces: the hot side does not run away."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import InputError
from ..thermal import System
from ..verification import Certificate, not_certified
from ._contraction import METHODS, Method, best_certificate
from ._energy import energy_rate
from ._jacobian import BoxJacobian
from ._limits import CurrentLimit, bisect
from ._lyapunov import check_choice, largest_growth
from ._outcomes import CertifyCode
from ._polytope import polytope
from ._regulated_jacobian import regulated_jacobian
from ._sections import (
    Currents,
    Interval,
    Temperatures,
    current_box,
    made_by,
    named_ranges,
    parameter_box,
    refuse_effects,
    system_section,
    temperature_box,
)
from ._weights import has_weights

SetPoints = Mapping[str, float | Interval]
_BACK_OFF = (0.0, 1e-4, 1e-3, 1e-2, 0.05, 0.2)
_MATRIX_BACK_OFF = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4)  # every step may cost seconds


def regulated(system: System, *, setpoint: SetPoints, current: Currents, temperature: Temperatures,
              method: Method = "max", parameters: Mapping[str, Interval] | None = None,
              large: bool = False) -> Certificate:
    """Certify that the rest of a network contracts while modules hold their cold faces exactly at their set-points.

    The current of every module named in `setpoint` is whatever holds its cold lump: the heat loads, ambients and
    set-points are given, and the current answers every change of a temperature that reaches the cold lump. The claim is
    about trajectories on which temperatures and currents stay in their ranges. It fails where the hot side runs away:
    beyond I* of `runaway`.

    Parameters
    ----------
    system : System
        Network with its modules.
    setpoint : mapping
        {module: temperature of its cold lump, or (lower, upper)} [K].
    current : mapping
        {module: (lower, upper)} [A], every module; those that hold nothing vary arbitrarily.
    temperature : tuple or mapping
        (lower, upper) for every lump that is not held, or {lump: (lower, upper)} [K].
    method : {"max", "sum", "energy", "lyapunov"}
        Norm as in `contraction`, over the lumps that are not held.
    parameters : mapping, optional
        Uncertain numbers of the system, as in `contraction`.
    large : bool
        Method "lyapunov": search a dense P for more than 40 lumps too.

    Returns
    -------
    Certificate
        `holds` tells whether it is proven; if not, `reason` tells why.

    Raises
    ------
    InputError
        Ranges that do not fit the system, Celsius, two modules on one cold lump, cascades, unknown method.

    References
    ----------
    Errata of Evers (2021), "Closed loop (cold side linearized)".

    Examples
    --------
    >>> import robthermal as rt
    >>> cert = rt.certify.regulated(rt.systems.two_module(), setpoint={"m1": 278.15, "m2": 278.15},
    ...                             current={"m1": (0.0, 1.2), "m2": (0.0, 1.2)}, temperature=(278.15, 328.15))
    >>> cert.holds, rt.verify(cert).valid
    (True, True)
    """
    _check(system, method, large)
    refuse_effects(system, ("lumps", "sensors", "inputs"))  # the heat of leads differs between two trajectories
    region = _region(system, setpoint, current, temperature, parameters)
    parts: dict[str, Any] = {"system": system_section(system, forcing=True), "region": region}
    box = regulated_jacobian(system, region)
    if box is None:
        return _no_grip(parts, method)
    return best_certificate("regulated", parts, method, box)


def largest_regulated_current(system: System, *, setpoint: SetPoints, temperature: Temperatures, method: Method = "max",
                              current: Currents | None = None, parameters: Mapping[str, Interval] | None = None,
                              large: bool = False) -> CurrentLimit:
    """Find the largest current c for which `regulated` is certified with every holding module in [0, c].

    With a tight box around the operating point it comes close to I* of `runaway`. It lies below the largest I* of the
    modules as long as the temperatures at the fold are in the box.

    Parameters
    ----------
    system : System
        Network with its modules.
    setpoint : mapping
        As in `regulated` [K].
    temperature : tuple or mapping
        As in `regulated` [K].
    method : {"max", "sum", "energy", "lyapunov"}
        As in `regulated`.
    current : mapping, optional
        {module: (lower, upper)} [A] of the modules that hold nothing; default off.
    parameters, large
        As in `regulated`.

    Returns
    -------
    CurrentLimit

    Raises
    ------
    InputError
        As `regulated`.

    Examples
    --------
    >>> import robthermal as rt
    >>> found = rt.certify.largest_regulated_current(rt.systems.two_module(), setpoint={"m1": 278.15, "m2": 278.15},
    ...                                              temperature=(278.15, 328.15))
    >>> 1.3 < found.current < 1.503, found.certificate.holds  # I* is 1.503 A
    (True, True)
    """
    _check(system, method, large)
    given = {name: (0.0, 0.0) for name in system.modules} | dict(current or {})

    def region(c: float) -> dict[str, Any]:
        ranges = given | {name: (0.0, c) for name in setpoint}
        return _region(system, setpoint, ranges, temperature, parameters)

    low, _ = bisect(lambda c: _promising(regulated_jacobian(system, region(c)), method))
    for back_off in _MATRIX_BACK_OFF if method == "lyapunov" else _BACK_OFF:
        c = low * (1 - back_off)
        ranges = given | {name: (0.0, c) for name in setpoint}
        cert = regulated(system, setpoint=setpoint, current=ranges, temperature=temperature, method=method,
                         parameters=parameters, large=large)
        if cert.holds:
            return CurrentLimit(c, "cooling", method, cert, CertifyCode.CERTIFIED.outcome(
                f"Certified for regulated modules up to {c:.4g} A (method {method})."))
    return CurrentLimit(0.0, "cooling", method, cert, CertifyCode.NOT_CERTIFIED.outcome(
        f"Not certified for any current: {cert.reason}", remedy=""))


def _promising(box: BoxJacobian | None, method: str) -> bool:
    """Whether evidence may exist; for a full P only that no frozen matrix of the box is unstable, which is quick."""
    if box is None:
        return False
    if method == "energy":
        return energy_rate(box) > 0
    if method == "lyapunov":
        return largest_growth(polytope(box)) < 0
    return has_weights(box, method)


def _check(system: System, method: str, large: bool) -> None:
    if method not in METHODS:
        raise InputError(f"method = {method!r}", where="argument method",
                         expected='"energy", "sum", "max" or "lyapunov"')
    if method == "lyapunov":
        check_choice(system, "full", large)


def _region(system: System, setpoint: SetPoints, current: Currents, temperature: Temperatures,
            parameters: Mapping[str, Interval] | None) -> dict[str, Any]:
    pairs = {name: pair if isinstance(pair, (tuple, list)) else (pair, pair) for name, pair in setpoint.items()}
    points = named_ranges(pairs, system.module_names, "setpoint", "module", kelvin=True)
    if not points:
        raise InputError("no module is named", where="argument setpoint", remedy='For example {"m1": 278.15}.')
    held = [system.modules[name].cold for name in points]
    if len(set(held)) < len(held):
        raise InputError("two modules hold one cold lump: their currents are not determined",
                         where="argument setpoint", expected="one module per cold lump")
    cascade = [name for name in points if system.modules[name].hot in held]
    if cascade:
        raise InputError(f"the hot lump of {cascade[0]!r} is held by another module", where="argument setpoint",
                         expected="modules whose hot lumps are free (no cascades)")
    free = [name for name in system.lump_names if name not in held]
    region: dict[str, Any] = {"temperature": temperature_box(system, temperature, free), "setpoint": points,
                              "current": current_box(system, current)}
    if ranges := parameter_box(system, parameters or {}, ("lumps", "sensors")):
        region["parameters"] = ranges
    return region


def _no_grip(parts: Mapping[str, Any], method: str) -> Certificate:
    n = len(parts["system"]["lumps"])
    return not_certified("regulated", **parts, evidence={"method": method}, made_by=made_by("none", "not asked"),
                         reason=f"S x_c - R I > 0 fails somewhere in the box of {n} lumps: more current does not take "
                                "more heat there, so no controller holds the cold lump. Narrow the current range.")
