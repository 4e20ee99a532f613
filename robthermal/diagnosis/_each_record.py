"""Whether records differ from each other in the numbers of the machine, where a common fit to all does not reach noise.

No effect of the catalog is what conductances do from day to day; a common fit leaves it, and one effect or another may
take some of it away. What is not needed in any record by itself is no name; what a record by itself names, and the
others predict, is one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..errors import Diverged, InputError
from ..fitting import Choice
from ..thermal import System
from ._differing import Differing
from ._found import Found
from ._judge import Judged
from ._outcomes import DiagnosisCode
from ._with_names import with_fitted
from .diagnosis import Diagnosis
from .evidence import expected_rms, square_beyond_noise
from .fit import Refit

Fits = Callable[[System, Choice], Sequence[Refit]]
_HALF = 0.5  # of the error beyond noise that the common fit leaves: more of it, and records hardly differ


def asked_of_each(judged: Judged, found: Diagnosis, concluded: Callable[[Judged], Diagnosis], system: System,
                  parameters: Choice, fits: Fits, alone: Callable[[], Diagnosis]) -> Diagnosis:
    """The answer; where the common fit does not end in noise, records are asked by themselves.

    Parameters
    ----------
    judged : Judged
        Answer for the common fit.
    found : Diagnosis
        The same in words.
    concluded : callable
        ``concluded(judged)`` puts an answer into words.
    system, parameters, fits
        As of `differing`.
    alone : callable
        ``alone()`` diagnoses the first record, with all others as validation.
    """
    differ = None if found.verdict in ("consistent", "named") else differing(found, system, parameters, fits)
    if differ is None:
        return found
    if not differ.needed:
        found = concluded(without_names(judged))
    if found.verdict != "unexplained":
        return found
    try:
        return by_itself(found, differ, alone())
    except (Diverged, InputError):  # the first record by itself cannot be diagnosed: too quiet, or one of the others
        return by_itself(found, differ, None)


def differing(found: Diagnosis, system: System, parameters: Choice, fits: Fits) -> Differing | None:
    """How much less every record leaves by itself than all of them together; None if a common fit is about as good.

    What all together leave must be more than noise, too.

    Parameters
    ----------
    found : Diagnosis
        Answer for the common fit, with what it names, or what came nearest.
    system : System
        Nominal system that was diagnosed.
    parameters : iterable or mapping, optional
        Nominal parameters that were refitted.
    fits : callable
        ``fits(system, parameters)`` fits a system to every record by itself.
    """
    if not square_beyond_noise(found.fit) > expected_rms(found.fit) ** 2:  # nothing to speak of is left
        return None
    together = math.sqrt(square_beyond_noise(found.fit))
    for effects in ((), found.provisional)[:1 + bool(found.provisional)]:
        alone = _pooled(system, effects, parameters, fits)
        if alone < _HALF * together:
            return Differing(alone, together, needed=bool(effects))
    return None


def without_names(judged: Judged) -> Judged:
    """The answer "unexplained" in the place of names that no record by itself needs.

    Parameters
    ----------
    judged : Judged
        Answer for the common fit.
    """
    return replace(judged, verdict="unexplained", evidence=(), plain=None, why="no record by itself needs it",
                   outcome=DiagnosisCode.UNEXPLAINED.outcome(
                       "No name: what all records together do not explain, each by itself does without any effect.",
                       remedy="Diagnose days against each other with reference records."))


def by_itself(found: Diagnosis, differ: Differing, alone: Diagnosis | None) -> Diagnosis:
    """The answer of the first record, which the others test, if it has a name; else the one for all records.

    Parameters
    ----------
    found : Diagnosis
        Answer for the common fit.
    differ : Differing
        How records differ.
    alone : Diagnosis or None
        Answer for the first record, with all others as validation; None if it cannot be diagnosed.
    """
    if alone is not None and alone.verdict in ("named", "named_with_remainder"):
        text = f"{differ} So the first record is diagnosed by itself, and the others test what it names."
        return replace(alone, differing=differ, caveats=(*alone.caveats, text),
                       outcome=replace(alone.outcome, text=f"{alone.outcome.text} {text}"))
    text = f"{differ} The first record by itself names nothing that predicts the others."
    return replace(found, differing=differ, outcome=replace(found.outcome, text=f"{found.outcome.text} {text}"))


def _pooled(system: System, effects: Sequence[Found], parameters: Choice, fits: Fits) -> float:
    """Error beyond noise of fits to every record by itself [K]; infinite where one cannot be fitted."""
    try:
        each = fits(*with_fitted(system, effects, parameters))
    except (Diverged, InputError):  # also of a drift of an ambient, which no system has
        return math.inf
    weights = [fit.n_readings for fit in each]
    return math.sqrt(float(np.average(list(map(square_beyond_noise, each)), weights=weights)))
