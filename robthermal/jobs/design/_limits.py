"""Current limits of a controller: below the fold, certified, and where possible such that a box is never left."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from math import trunc
from typing import Any

from ...certify import (
    CurrentLimit,
    Runaway,
    RunawayFree,
    UsableCurrent,
    contraction,
    heater_heat,
    largest_current,
    runaway,
    runaway_free,
    usable_current,
)
from ...design import face_ranges, feedback_linearization, reachable
from ...errors import InputError
from ...thermal import System, drivable_range
from ...verification import Certificate
from ..request import Method
from ._request import DesignRequest

Pairs = dict[str, tuple[float, float]]
Ranges = Mapping[str, tuple[float, float]] | None
_BY = {"contraction": "contraction", "box": "the box that is never left", "runaway": "thermal runaway",
       "rating": "the declared rating"}
BELOW_FOLD = 0.98  # of I*: at the fold itself the loop has no gain left
_FINE = 0.01  # of a range


def worst_runaway(system: System, request: DesignRequest) -> Runaway:
    """Runaway limit at the end of the ambient ranges where it is smallest."""
    found = [runaway(system, setpoint=cold_faces(system, request, at), ambient=at) for at in ambient_ends(request)]
    return min(found, key=lambda limit: min(limit.current.values()))


def cold_faces(system: System, request: DesignRequest, ambient: Mapping[str, float]) -> dict[str, float]:
    """Temperatures of the cold faces while the set-points are held in these ambients [K]."""
    if not request.regulate:
        return request.setpoint
    free = feedback_linearization(system)
    return reachable(free, request.setpoint, inputs=ambient, regulate=request.regulate).faces


def held_faces(system: System, request: DesignRequest) -> dict[str, tuple[float, float]]:
    """Range of every cold face while the set-points are held, over ambients, and parameters one by one added up [K]."""
    if not request.regulate:
        return {name: (value, value) for name, value in request.setpoint.items()}
    free = feedback_linearization(system)
    found = [face_ranges(free, request.setpoint, regulate=request.regulate, inputs=at,
                                parameters=request.parameters) for at in ambient_ends(request)]
    return {name: (min(faces[name][0] for faces in found), max(faces[name][1] for faces in found))
            for name in request.setpoint}


def coldest_faces(system: System, request: DesignRequest) -> dict[str, float]:
    """Temperatures of the cold faces where they are coldest [K]."""
    return {name: low for name, (low, _) in held_faces(system, request).items()}


def ambient_ends(request: DesignRequest) -> list[dict[str, float]]:
    """All ambients at the warm and at the cold end of their ranges; nominal without ranges."""
    ranges = request.ambient or {}
    return [{name: pair[end] for name, pair in ranges.items()} for end in ((1, 0) if ranges else (0,))]


def certified_limits(system: System, request: DesignRequest) -> tuple[CurrentLimit, CurrentLimit]:
    """Largest certified cooling and symmetric current."""
    cooling, symmetric = (largest_current(system, temperature=request.temperature, direction=direction,
                                          method=request.method) for direction in ("cooling", "symmetric"))
    return cooling, symmetric


def candidates(system: System, request: DesignRequest, fold: Runaway,
               certified: tuple[CurrentLimit, CurrentLimit]) -> Iterator[Pairs]:
    """Current limits to try, the strongest claim first; those the user gave are kept as they are.

    First the largest for which a box is never left, below the upper end of the temperature box; then the largest
    that contract in the temperature box; then, where nothing is certified, what file and fold allow.
    """
    widest = _widest(system, request, fold, certified)
    if request.parameters:
        most = usable_cooling(system, request).current
        widest = {name: (low, min(high, most)) for name, (low, high) in widest.items()}
    for holds in (lambda pairs: _contained(system, request, pairs), lambda pairs: _contracts(system, request, pairs)):
        found = _largest(widest, request.current or {}, holds)
        if found is not None:
            yield found
    yield {**_scaled(widest, 1.0, 1.0), **(request.current or {})}


def check_given(system: System, request: DesignRequest, fold: Runaway,
                certified: tuple[CurrentLimit, CurrentLimit]) -> None:
    """Refuse limits of the user that are beyond I* or not certified; say what is allowed."""
    allowed = _widest(system, request, fold, certified)
    for name, (low, high) in (request.current or {}).items():
        where, top = f"--current {name}={low:g}:{high:g}", allowed[name][1]
        if high >= fold.current[name]:
            raise InputError(f"{high:g} A is beyond the runaway limit I* = {fold.current[name]:.4g} A at this "
                             "set-point", where=where, expected=f"at most {top:.3g} A",
                             remedy="Leave --current out for the largest certified limits.")
        if not _contracts(system, request, {**dict.fromkeys(system.modules, (0.0, 0.0)), name: (low, high)}):
            raise InputError("the range is not certified in the temperature box", where=where,
                             expected="within the contraction limits, "
                             f"{-certified[1].current:.3g}:{certified[1].current:.3g} (symmetric) or "
                             f"0:{certified[0].current:.3g} (cooling only), and the usable current",
                             remedy="Narrow it, or the box with --temperature.")
    given = {**dict.fromkeys(system.modules, (0.0, 0.0)), **(request.current or {})}
    if request.current and not _contained(system, request, given):
        usable = usable_cooling(system, request)
        name, (low, high) = max(request.current.items(), key=lambda item: max(-item[1][0], item[1][1]))
        raise InputError("with these currents no box below the upper end of the temperature box is proven never to be "
                         "left", where=f"--current {name}={low:g}:{high:g}",
                         expected=f"at most the usable current, {usable.current:.3g} A when cooling, limited by "
                         f"{usable.limited_by}", remedy="Leave --current out for the largest usable limits.")


def usable_cooling(system: System, request: DesignRequest) -> UsableCurrent:
    """Usable cooling current at the set-points, for the parameter ranges where there are some."""
    return usable_current(system, temperature=request.temperature, ambient=request.ambient,
                          heat=heater_heat(system, request.parameters, request.heat),
                          setpoint=held_faces(system, request), lower="reported", method=_fast(request),
                          parameters=request.parameters)


def what_limits(system: System, request: DesignRequest) -> tuple[str, str]:
    """What the current limits come from, and what to do where they are too small; ranges of parameters by name."""
    better = "Move the set-points, or cool the hot side better."
    if not request.parameters:
        return "by runaway limit, certificates and system file", better
    nominal, found = usable_cooling(system, replace(request, parameters=None)), usable_cooling(system, request)
    said = (f"usable for all parameters in their ranges, limited by {_BY[found.limited_by]}; at the parameters as they "
            f"stand {nominal.current:.4g} A")
    if not found.limiting_parameter:
        return said, better
    return said, f"Measure {found.limiting_parameter} better. {better}"


def _fast(request: DesignRequest) -> Method:
    """Norm for searches: a full matrix at every step of a bisection may take hours."""
    return "energy" if request.method == "lyapunov" else request.method


def _widest(system: System, request: DesignRequest, fold: Runaway,
            certified: tuple[CurrentLimit, CurrentLimit]) -> Pairs:
    cooling, symmetric = (limit.current if limit.certificate.holds else float("inf") for limit in certified)
    pairs = {}
    for name, module in system.modules.items():
        declared = drivable_range(module, request.temperature)
        low, high = declared.low, declared.high
        top = min(high, cooling, BELOW_FOLD * fold.current[name])
        # nothing declared and nothing certified: as far as when cooling
        pairs[name] = (max(low, -symmetric, -10 * top), top)
    return pairs


def _largest(widest: Pairs, given: Mapping[str, Any], holds: Callable[[Pairs], bool]) -> Pairs | None:
    """Largest share of the upper limits that holds with no heating, then of the lower ones."""
    def pairs(up: float, down: float) -> Pairs:
        return {**_scaled(widest, up, down), **given}

    if not holds(pairs(0.0, 0.0)):
        return None
    up = _share(lambda share: holds(pairs(share, 0.0)))
    return pairs(up, _share(lambda share: holds(pairs(up, share))))


def _scaled(widest: Pairs, up: float, down: float) -> Pairs:
    return {name: (_short(down * low), _short(up * high)) for name, (low, high) in widest.items()}


def _short(current: float) -> float:
    """Towards zero to 0.1 mA: short to type, and what is proven is this number."""
    return trunc(1e4 * current) / 1e4


def _share(holds: Callable[[float], bool]) -> float:
    """Largest share in [0, 1] that holds, 0 taken for granted."""
    if holds(1.0):
        return 1.0
    low, high = 0.0, 1.0
    while high - low > _FINE:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def contain(system: System, request: DesignRequest, pairs: Pairs, parameters: Ranges = None) -> RunawayFree:
    """The claim that a box is never left with these currents."""
    return runaway_free(system, current=pairs, ambient=request.ambient,
                        heat=heater_heat(system, parameters, request.heat), method=request.method,
                        parameters=parameters)


def contract(system: System, request: DesignRequest, pairs: Pairs, parameters: Ranges = None) -> Certificate:
    """The claim that the network contracts in the temperature box with these currents."""
    return contraction(system, current=pairs, temperature=request.temperature, method=request.method,
                       parameters=parameters)


def hottest(safe: RunawayFree) -> float:
    """Upper end of a box that is never left [K]; infinite where there is none."""
    return max((high for _, high in safe.temperature.values()), default=float("inf"))


def _contained(system: System, request: DesignRequest, pairs: Pairs) -> bool:
    safe = contain(system, request, pairs, request.parameters)
    return safe.holds and hottest(safe) <= request.temperature[1] and _contracts(system, request, pairs)


def _contracts(system: System, request: DesignRequest, pairs: Pairs) -> bool:
    return contract(system, request, pairs, request.parameters).holds
