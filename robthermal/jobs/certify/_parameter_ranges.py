"""Ranges of the parameters for which claims are made, and which parameter breaks a claim."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Literal

from ...calibration import CalibrationCode, Estimates
from ...errors import InputError
from ..request import Boxes

Ranges = Mapping[str, tuple[float, float]]
_MOST = 40  # parameters that are tried one by one


def claim_ranges(boxes: Boxes, fit: Estimates | None) -> Ranges | None:
    """Parameter ranges of the claims; None: the parameters as they stand.

    Parameters
    ----------
    boxes : Boxes
        With the choice and the confidence.
    fit : Estimates or None
        Calibration of the system; None if nothing was calibrated. One that did not converge has no ranges.
    """
    if not isinstance(boxes.parameters, str):
        return dict(boxes.parameters) or None
    if boxes.parameters == "none" or fit is None or not converged(fit):
        return None
    return dict(fit.ranges(boxes.confidence, set=boxes.set)) or None


def converged(fit: Estimates | None) -> bool:
    """Whether parameters are estimates: of no calibration they are given numbers.

    Parameters
    ----------
    fit : Estimates or None
        Calibration of the system; None if nothing was calibrated.
    """
    return fit is None or fit.outcome.code != CalibrationCode.NOT_CONVERGED.code


def breaking(ranges: Ranges, holds: Callable[[Ranges], bool]) -> str:
    """Which parameter breaks a claim that fails for all ranges together, in words.

    Parameters
    ----------
    ranges : mapping
        For which the claim fails.
    holds : callable
        Whether the claim holds for other ranges.
    """
    if len(ranges) > _MOST:
        return ""
    names = list(ranges)
    for what, trial in (("without the range of {} it holds", lambda name: {n: ranges[n] for n in names if n != name}),
                        ("the range of {} alone breaks it", lambda name: {name: ranges[name]})):
        wanted = what.startswith("without")
        for name in names:
            if _answer(holds, trial(name)) is wanted:
                return what.format(name)
    return "it takes several parameters together: " + ", ".join(names)


def _answer(holds: Callable[[Ranges], bool], ranges: Ranges) -> bool:
    try:
        return holds(ranges)
    except InputError:
        return False


Doubt = tuple[Literal["undetermined", "bound"], str, Ranges]


def doubted(fit: Estimates) -> Iterable[Doubt]:
    """Parameters the data do not determine, and those at a bound, each with its whole [fit] range.

    Parameters
    ----------
    fit : Estimates
        Calibration of the system.
    """
    whole = dict(zip(fit.parameters, zip(fit.lower.tolist(), fit.upper.tolist(), strict=True), strict=True))
    for name in fit.undetermined_parameters:
        yield "undetermined", name, {name: whole[name]}
    for name, at in zip(fit.parameters, fit.at_bound, strict=True):
        if at and name not in fit.undetermined_parameters:
            yield "bound", name, {name: whole[name]}
