"""Both checkers on one document: they may differ in what they decide, never in what they say."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from mutants import Subject, mutate, pushed

import recheck
from robthermal.errors import InputError
from robthermal.verification import Certificate, claim_sentence, verify

Document = dict[str, Any]
SECTIONS = ("system", "region", "evidence", "margin")


@dataclass(frozen=True)
class Pair:
    """What both checkers say about one document, and how long each took [s]."""

    first: bool
    second: str
    reasons: tuple[str, str]
    seconds: tuple[float, float]

    @property
    def disagree(self) -> bool:
        """Whether one accepts what the other rejects."""
        return self.second == ("not valid" if self.first else "valid")


def both(kind: str, document: Document) -> Pair:
    """Let both checkers judge the same file; its sentence is the one its data give, where they give one."""
    parts = {key: document.get(key, {}) for key in SECTIONS}
    sentence = "no sentence"
    with contextlib.suppress(InputError):
        sentence = claim_sentence(kind, parts["system"], parts["region"], parts["evidence"])
    content = {"format": "robthermal-certificate/1", "kind": kind, "claim": sentence, "made_by": {}, **parts}
    return judge(json.loads(json.dumps(content, default=_plain)))


def judge(content: Document) -> Pair:
    """Let both checkers judge the content of a file."""
    start = time.perf_counter()
    try:
        verdict = verify(Certificate(**{"reason": "", "holds": True, **content}))
        first, reason = verdict.valid, verdict.reason
    except InputError as error:
        first, reason = False, str(error)
    middle = time.perf_counter()
    found = recheck.check(content)
    return Pair(first, found.status, (reason, found.reason), (middle - start, time.perf_counter() - middle))


def cases(subject: Subject, rng: np.random.Generator, count: int, per_document: int = 12) -> Iterator[Document]:
    """Yield certificates of one kind and mutants of them; two of twelve moved to the edge of what is accepted."""
    edges = (4, 9) if subject.kind not in ("observer", "loop", "regulated") else ()
    document: Document = {}
    for k in range(count):
        if k % per_document == 0:
            document = {"margin": {}, **subject.make(rng)}
            yield document
        else:
            yield pushed(subject, document, rng) if k % per_document in edges else mutate(document, rng)


def _plain(value: Any) -> Any:
    return value.tolist()
