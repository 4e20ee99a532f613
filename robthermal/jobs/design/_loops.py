"""The loops of a design: bandwidth as asked or tuned, margins of all plants, what is missed and what would keep it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...design import (
    PID,
    FeedbackLinearization,
    GainObserver,
    LoopMargins,
    cold_side,
    loop_margins,
    pid,
    tune_pi,
)
from ...errors import InputError
from ._request import DesignRequest

BANDWIDTH = 0.02  # rad/s, where neither a bandwidth nor margins are asked for


@dataclass(frozen=True)
class Loops:
    """Controller with its margins.

    Parameters
    ----------
    controller : PID
        One PI per module.
    bandwidth : float
        Crossover of the loops [rad/s].
    margins : LoopMargins
        For the nominal and all corner plants.
    missed : tuple of str
        Margins that were asked for and are not kept.
    tuning : str
        How the bandwidth was found, where it was tuned.
    """

    controller: PID
    bandwidth: float
    margins: LoopMargins
    missed: tuple[str, ...]
    tuning: str


def tuned_loops(law: FeedbackLinearization, request: DesignRequest, watcher: GainObserver | None) -> Loops:
    """PI per module with the bandwidth that was asked for, or the largest that keeps the margins."""
    common: dict[str, Any] = {"regulate": request.regulate, "observer": watcher, "parameters": request.parameters}
    if request.margins is not None and request.bandwidth is None:
        found = tune_pi(law, request.setpoint, margins=request.margins, sample_time=request.sample_time, **common)
        if found.controller is None or found.margins is None:
            raise InputError(found.outcome.text, where="margins",
                             remedy="Ask for less margin, or narrow what limits the loop.")
        return Loops(found.controller, found.bandwidth, found.margins, (), found.outcome.text)
    bandwidth = BANDWIDTH if request.bandwidth is None else request.bandwidth
    controller = pid(cold_side(law, regulate=request.regulate), bandwidth=bandwidth, sample_time=request.sample_time)
    margins = loop_margins(law, controller, request.setpoint, **common)
    missed = margins.missed(request.margins or {})
    if missed:
        best = tune_pi(law, request.setpoint, margins=request.margins or {}, sample_time=request.sample_time, **common)
        missed = (*missed, best.outcome.text)
    return Loops(controller, bandwidth, margins, missed, "")
