"""All claims about one system: its boxes certified, its limits found, every certificate verified."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..certify import (
    CurrentLimit,
    Runaway,
    RunawayFree,
    contraction,
    heater_heat,
    largest_current,
    largest_regulated_current,
    runaway,
    runaway_free,
)
from ..errors import InputError
from ..thermal import System
from ..verification import Certificate, Verdict, not_certified, verify
from ._schema import DIRECTIONS, METHODS, Boxes, Method


@dataclass(frozen=True)
class Checked:
    """A certificate with its independent check.

    Parameters
    ----------
    key : str
        File name without ending.
    title : str
        For people.
    certificate : Certificate
        What is claimed.
    verdict : Verdict or None
        Of `rt.verify`; None if there is nothing to verify because the claim does not hold.
    required : bool
        Whether the job's answer is no without it.
    """

    key: str
    title: str
    certificate: Certificate
    verdict: Verdict | None
    required: bool

    @property
    def good(self) -> bool:
        """Holds and is verified."""
        return self.certificate.holds and self.verdict is not None and self.verdict.valid


@dataclass(frozen=True)
class Certification:
    """Everything that was certified about a system.

    Parameters
    ----------
    system : System
        About which.
    boxes : Boxes
        For which ranges.
    checked : tuple of Checked
        Certificates with verdicts; the required ones first.
    limits : tuple of CurrentLimit
        By method and direction.
    runaway : Runaway or None
        None without set-points.
    safe : RunawayFree
        The claim of no thermal runaway.
    """

    system: System
    boxes: Boxes
    checked: tuple[Checked, ...]
    limits: tuple[CurrentLimit, ...]
    runaway: Runaway | None
    safe: RunawayFree

    @property
    def holds(self) -> bool:
        """Whether everything required holds and is verified."""
        return all(c.good for c in self.checked if c.required)


def certify_system(system: System, boxes: Boxes, progress: Callable[[str], None] = lambda stage: None) -> Certification:
    """Certify a system in its boxes and verify every certificate.

    Parameters
    ----------
    system : System
        Whose.
    boxes : Boxes
        Ranges of the claims.
    progress : callable, optional
        Called with a sentence before every stage.

    Returns
    -------
    Certification

    Raises
    ------
    InputError
        Ranges that do not fit the system, a module or heater without a range.

    Examples
    --------
    >>> import robthermal as rt
    >>> done = rt.project.certify_system(rt.systems.two_module(), rt.project.Boxes(
    ...     current={"m1": (0.0, 1.0), "m2": (0.0, 1.0)}))
    >>> done.holds
    True
    """
    current = _currents(system, boxes)
    heat = heater_heat(system) if boxes.heat is None else boxes.heat
    progress("certifying the temperature box")
    norm: dict[str, Any] = {"method": boxes.method, "structure": boxes.structure, "large": boxes.large}
    box = contraction(system, current=current, temperature=boxes.temperature, **norm)
    progress("certifying that no trajectory leaves its box")
    safe = runaway_free(system, current=current, ambient=boxes.ambient, heat=heat, **norm)
    found = [("contraction", "Contraction in the stated box", box, True),
             ("box", "The box is never left", safe.invariance, True)]
    if safe.contraction is not safe.invariance:
        found.append(("box_contraction", "Contraction in the box that is never left", safe.contraction, True))
    limits = []
    for method in _limit_methods(boxes) if system.modules else ():
        for direction in DIRECTIONS:
            progress(f"searching the largest {direction} current, method {method}")
            limit = largest_current(system, temperature=boxes.temperature, direction=direction,
                                    **{**norm, "method": method})
            limits.append(limit)
            if limit.certificate.holds:
                found.append((f"limit_{method}_{direction}", f"Largest {direction} current, method {method}",
                              limit.certificate, False))
    limit_of_load = None
    if boxes.setpoint:
        progress("searching the runaway limit")
        limit_of_load = runaway(system, setpoint=boxes.setpoint)
        found += [(f"runaway_{name}", f"Closed form of {name}, constant properties (not the network)", cert, False)
                  for name, cert in limit_of_load.certificates.items()]
        progress("searching the largest current while the cold faces are held")
        found.append(("regulated", "Largest current while the cold faces are held", _held(system, boxes), False))
    progress("verifying every certificate")
    checked = tuple(Checked(key, title, cert, verify(cert) if cert.holds else None, required)
                    for key, title, cert, required in found)
    return Certification(system, boxes, checked, tuple(limits), limit_of_load, safe)


def _held(system: System, boxes: Boxes) -> Certificate:
    """Certificate of the regulated network at its largest current; for what it does not cover, one that says so."""
    setpoint = boxes.setpoint or {}
    try:
        return largest_regulated_current(system, setpoint=setpoint, temperature=boxes.temperature).certificate
    except InputError as refusal:
        return not_certified("regulated", system={}, region={"setpoint": setpoint}, evidence={}, reason=str(refusal),
                             made_by={}, claim="While its cold faces are held, the rest of the network contracts.")


def _limit_methods(boxes: Boxes) -> tuple[Method, ...]:
    """Methods whose limits are searched: with a full P, which may take minutes, only where it is asked for."""
    return METHODS if boxes.method == "lyapunov" else tuple(method for method in METHODS if method != "lyapunov")


def _currents(system: System, boxes: Boxes) -> dict[str, tuple[float, float]]:
    if boxes.current is not None:
        return boxes.current
    ranges = {}
    for name, module in system.modules.items():
        if module.current_limits is None:
            raise InputError(f"module {name!r} has no current range", where=f"[modules.{name}] current_limits",
                             remedy="Declare current_limits, or give the range to certify.")
        ranges[name] = module.current_limits
    return ranges
