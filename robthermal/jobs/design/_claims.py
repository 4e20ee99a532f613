"""What is claimed of a design: contraction, the box that is never left, the observer; nominal and for the ranges."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ...certify import CurrentLimit, Runaway, RunawayFree
from ...design import GainObserver, observer
from ...errors import InputError
from ...report import Parameters
from ...thermal import System
from ...verification import Certificate, not_certified, verify
from ..claims import Certification, Checked
from ..request import Boxes
from ._limits import Pairs, coldest_faces, contain, contract
from ._request import DesignRequest

OBSERVER_RANGES = "observer_ranges"
_TITLES = {"contraction": "Contraction at the current limits", "box": "The box is never left",
           "box_contraction": "Contraction in the box that is never left", "observer": "The observer's error shrinks"}


def certified_design(system: System, request: DesignRequest, pairs: Pairs, watcher: GainObserver | None,
                     seen: Certificate | None, fold: Runaway,
                     certified: tuple[CurrentLimit, CurrentLimit]) -> tuple[Certification, RunawayFree | None]:
    """All claims, verified, and the box that is never left for the parameter ranges, where there are some."""
    safe = contain(system, request, pairs)
    found = list(_required(contract(system, request, pairs), safe, seen, ""))
    robust = None
    if request.parameters:
        robust = contain(system, request, pairs, request.parameters)
        more = _required(contract(system, request, pairs, request.parameters), robust, None, "_ranges")
        by_key = {one.key.removesuffix("_ranges"): one for one in more}
        if watcher is not None:
            by_key["observer"] = _robust_observer(watcher, request, pairs)
        found = [one for nominal in found for one in (nominal, by_key.get(nominal.key)) if one is not None]
    found += [Checked(f"limit_{one.method}_{one.direction}", f"Contraction limit, {one.direction}: not a limit for use",
                      one.certificate, None, False) for one in certified if one.certificate.holds]
    found += [Checked(f"runaway_{name}", f"Closed form of {name}, constant properties (not the network)", cert, None,
                      False) for name, cert in fold.certificates.items()]
    checked = tuple(replace(one, verdict=verify(one.certificate) if one.certificate.holds else None) for one in found)
    boxes = Boxes(request.temperature, request.ambient, pairs, request.heat, coldest_faces(system, request),
                  request.method)
    return Certification(system, boxes, checked, certified, fold, safe, (), request.parameters), robust


def _required(box: Certificate, safe: RunawayFree, seen: Certificate | None, ending: str) -> Iterator[Checked]:
    found = {"contraction": box, "box": safe.invariance}
    if safe.contraction is not safe.invariance:
        found["box_contraction"] = safe.contraction
    if seen is not None:
        found["observer"] = seen
    which: Parameters = "ranges" if ending else "nominal"
    for key, certificate in found.items():
        yield Checked(key + ending, _TITLES[key], certificate, None, True, which)


def _robust_observer(watcher: GainObserver, request: DesignRequest, pairs: Pairs) -> Checked:
    """The observer for the parameter ranges; required unless no certificate covers such ranges, and it says so."""
    system = watcher.model.system
    unread = tuple(f"sensors.{name}." for name in system.sensors if name not in watcher.sensors)
    own = {name: pair for name, pair in (request.parameters or {}).items() if not name.startswith(unread)}
    required = True
    try:
        found = watcher.certify(pairs, request.temperature, own)
    except InputError as refusal:
        required = False
        found = not_certified("observer", system={}, region={"current": pairs}, evidence={}, reason=str(refusal),
                              made_by={}, claim=f"The error of the observer of {system.name} shrinks for all "
                              "parameters in their ranges.")
    return Checked(OBSERVER_RANGES, _TITLES["observer"], found, None, required, "ranges")


def certified_observer(kalman: GainObserver | None, request: DesignRequest,
                       pairs: Pairs) -> tuple[GainObserver | None, Certificate | None]:
    """The Kalman gain; the positive gain where only that one is certified."""
    if kalman is None:
        return None, None
    certificate = kalman.certify(pairs, request.temperature)
    system = kalman.model.system
    nonlinear = any(link.natural is not None or link.radiation is not None for link in system.links)
    if certificate.holds or nonlinear:  # a positive gain needs linear links
        return kalman, certificate
    other = observer(system, request.sensors, sample_time=request.sample_time, method="positive", current=pairs,
                     temperature=request.temperature)
    assert isinstance(other, GainObserver)
    second = other.certify(pairs, request.temperature)
    return (other, second) if second.holds else (kalman, certificate)
