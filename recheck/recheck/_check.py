"""Check one certificate: its form, that its sentence is the one its data give, and the inequality of its kind."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from . import (
    _contraction,
    _ellipsoid,
    _gain,
    _invariance,
    _network,
    _network_peak,
    _observer,
    _polytope,
    _runaway,
    _scheduled,
    _stability,
)
from ._document import Unreadable, load, sections
from ._exact import Malformed, NotCovered, short
from ._result import NOT_COVERED, NOT_VALID, VALID, Answer
from ._sentences import sentence

Kind = tuple[Callable[[Mapping[str, Mapping[str, Any]]], Any], Callable[[Any], Answer]]
KINDS: dict[str, Kind] = {
    "contraction": (_contraction.read, _contraction.check), "invariance": (_invariance.read, _invariance.check),
    "runaway": (_runaway.read, _runaway.check), "network": (_network.read, _network.check),
    "stability": (_stability.read, _stability.check), "gain": (_gain.read, _gain.check),
    "observer": (_observer.read, _observer.check), "polytope": (_polytope.read, _polytope.check),
    "ellipsoid": (_ellipsoid.read, _ellipsoid.check),
    "scheduled": (_scheduled.read, _scheduled.check),
    "network_peak": (_network_peak.read, _network_peak.check)}
OTHERS = ("regulated", "loop", "hinf", "peak", "frequency", "closed_loop")


@dataclass(frozen=True)
class Result:
    """What this checker found.

    Parameters
    ----------
    status : str
        "valid", "not valid" or "not covered".
    reason : str
        The inequality that decided it, or why it is not decided; never empty.
    claim : str
        The sentence of the certificate, as it stands in the file; empty where there is none.
    """

    status: str
    reason: str
    claim: str = ""

    def __bool__(self) -> bool:
        return self.status == VALID

    def __str__(self) -> str:
        return f"{self.status}: {self.reason}"


def check(document: Mapping[str, Any] | str | os.PathLike[str]) -> Result:
    """Check a certificate.

    Parameters
    ----------
    document : mapping or path
        Content of a certificate file, or where it is.

    Returns
    -------
    Result
        "valid": every inequality is proven. "not valid": the file breaks the format, or an inequality is violated for
        certain. "not covered": of a kind that this checker does not know, or neither proven nor refuted.

    Raises
    ------
    Unreadable
        If there is no such file.
    """
    claim = ""
    try:
        content = document if isinstance(document, Mapping) else load(document)
        kind, claim, parts = sections(content)
        if kind not in KINDS:
            if kind not in OTHERS:
                raise Malformed(f"kind {short(kind)} is unknown")
            raise NotCovered(f"kind {kind!r}")
        read, decide = KINDS[kind]
        problem = read(parts)
        expected = sentence(kind, problem, parts)
        if claim != expected:
            raise Malformed(f"the claim is not the one the data give, which is: {expected}")
        answer = decide(problem)
    except Malformed as error:
        answer = Answer(NOT_VALID, str(error))
    except NotCovered as error:
        answer = Answer(NOT_COVERED, str(error))
    except RecursionError:
        answer = Answer(NOT_VALID, "nested too deeply")
    return Result(answer.status, answer.reason, claim)


__all__ = ["Result", "Unreadable", "check"]
