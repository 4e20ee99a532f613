"""Mutated certificates of every kind: one random change each, judged by the checker and by an independent falsifier.

A falsifier works in floats on samples (vertices, trajectories, dense grids) and never calls the checker. A certificate
that the checker accepts and a sample shows to be false is the worst bug there is.
"""

from __future__ import annotations

import copy
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import certificate_truth as truth
import numpy as np

from robthermal.errors import InputError
from robthermal.verification import Certificate, claim_sentence, establish, verify

Document = dict[str, Any]
SECTIONS = ("system", "region", "evidence")
FALSE, CLAIM = "ACCEPTED THOUGH FALSE", "ACCEPTED WITH A WRONG SENTENCE"
ALARMS = (FALSE, CLAIM)


@dataclass(frozen=True)
class Subject:
    """One kind of certificate: how to make one that just holds, and how far samples violate it (above 0: false)."""

    kind: str
    make: Callable[[np.random.Generator], Document]
    violation: Callable[[Document, np.random.Generator], float]
    share: float = 1.0  # of the mutants of the run
    tolerance: float = 1e-9  # rounding of the falsifier
    edges: tuple[int, ...] = (4, 9)  # which of ten mutants are bisected to the edge of what the checker accepts


def holds(kind: str, document: Document) -> bool:
    """Whether the checker accepts a document as it is."""
    return establish(kind, **{key: document[key] for key in SECTIONS}, made_by={}, margin={}).holds


def run(subject: Subject, rng: np.random.Generator, count: int, per_document: int = 10,
        edges: tuple[int, ...] | None = None) -> Counter[str]:
    """Judge ``count`` mutants of one kind; ``edges``: which of those of one document are pushed, else the subject's."""
    edges = subject.edges if edges is None else edges
    table: Counter[str] = Counter()
    for k in range(count):
        if k % per_document == 0:
            document = {"margin": {}, **subject.make(rng)}
        changed = document if k % per_document == 0 else (
            pushed(subject, document, rng) if k % per_document in edges else mutate(document, rng))
        table[judge(subject, changed, rng)] += 1
    return table


def pushed(subject: Subject, document: Document, rng: np.random.Generator) -> Document:
    """Return a copy with one number as far away as the checker still accepts, to 1e-6 of the way."""
    path = _pick(_numeric(document), rng)
    start = truth.number(_at(document, path))
    way = float(rng.choice([-1, 1])) * 10 ** float(rng.uniform(-3, 1)) * (abs(start) or 1.0)

    def at(share: float) -> Document:
        return _set(copy.deepcopy(document), path, start + share * way)

    low, high = 0.0, 1.0
    if _accepted(subject.kind, at(high)):
        return at(high)
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _accepted(subject.kind, at(middle)) else (low, middle)
    return at(low)


def _accepted(kind: str, document: Document) -> bool:
    try:
        return holds(kind, document)
    except InputError:
        return False


def judge(subject: Subject, document: Document, rng: np.random.Generator) -> str:
    """Return what the checker says and what the samples say."""
    parts = {key: document[key] for key in (*SECTIONS, "margin")}
    try:
        sentence = claim_sentence(subject.kind, document["system"], document["region"], document["evidence"])
        certificate = Certificate(kind=subject.kind, claim=sentence, made_by={}, **parts)
        valid = verify(certificate).valid
        if rng.random() < 0.05 and verify(_reworded(certificate, rng)).valid:
            return CLAIM
    except InputError:
        return "refused as malformed"
    if valid:
        false = subject.violation(document, rng) > subject.tolerance
        return FALSE if false else "accepted, no sample violates it"
    if rng.random() < 0.8:  # only to see how sharp the falsifier is
        return "rejected, not sampled"
    try:
        false = subject.violation(document, rng) > 0
    except (ArithmeticError, LookupError, StopIteration, ValueError, np.linalg.LinAlgError):
        false = True  # nonsense that no sample can be taken of
    return "rejected, a sample violates it" if false else "rejected, no sample violates it"


def mutate(document: Document, rng: np.random.Generator) -> Document:
    """Return a copy with one random change; not all of them can still be read."""
    change = _CHANGES[int(rng.integers(len(_CHANGES)))]
    changed = change(copy.deepcopy(document), rng)
    return mutate(document, rng) if changed is None else changed


def _reworded(certificate: Certificate, rng: np.random.Generator) -> Certificate:
    """Another sentence: a digit changed, or a character lost."""
    text = certificate.claim
    places = [k for k, letter in enumerate(text) if letter in "0123456789"]
    k = int(rng.choice(places)) if places and rng.random() < 0.7 else int(rng.integers(len(text)))
    other = str((int(text[k]) + 1) % 10) if k in places else ""
    return Certificate(**{**vars(certificate), "claim": text[:k] + other + text[k + 1:]})


def _numeric(document: Document, sections: tuple[str, ...] = SECTIONS) -> list[tuple]:
    return [path for section in sections for path in truth.leaves(document[section], (section,))
            if _is_number(_at(document, path))]


def _is_number(value: Any) -> bool:
    try:
        truth.number(value)
    except (TypeError, ValueError):
        return False
    return not isinstance(value, bool)


def _at(document: Document, path: tuple) -> Any:
    for key in path:
        document = document[key]
    return document


def _set(document: Document, path: tuple, value: Any) -> Document:
    _at(document, path[:-1])[path[-1]] = value
    return document


def _pick(items: list, rng: np.random.Generator) -> Any:
    return items[int(rng.integers(len(items)))] if items else None


def _one_digit(document: Document, rng: np.random.Generator) -> Document:
    path = _pick(_numeric(document), rng)
    return _set(document, path, truth.digit(_at(document, path), rng))


def _factor(document: Document, rng: np.random.Generator) -> Document:
    path = _pick(_numeric(document), rng)
    near = 1 + float(rng.choice([-1, 1])) * 10 ** float(rng.uniform(-7, -1))
    factor = float(rng.choice([-1.0, 0.0, 0.1, 0.5, 0.9, 1.1, 2.0, 10.0, 1e6, near, near, near]))
    return _set(document, path, truth.number(_at(document, path)) * factor)


def _claimed_more(document: Document, rng: np.random.Generator) -> Document | None:
    """A rate, a bound, a contraction, a limit or a gain nearly or far beyond what is true."""
    path = _pick([path for path in _numeric(document, ("region", "evidence"))
                  if not {"weights", "matrix", "sizes"} & set(path)], rng)
    factor = 1 + float(rng.choice([-1, 1])) * 10 ** float(rng.uniform(-4, 0.3))
    return None if path is None else _set(document, path, truth.number(_at(document, path)) * factor)


def _lost_digits(document: Document, rng: np.random.Generator) -> Document | None:
    path = _pick(_numeric(document), rng)
    text = str(_at(document, path))
    return _set(document, path, text[:max(1, len(text) - int(rng.integers(1, 6)))])


def _swapped(document: Document, rng: np.random.Generator) -> Document | None:
    """Two numbers of one list or object change places."""
    path = _pick(_numeric(document), rng)
    siblings = [other for other in _numeric(document) if other[:-1] == path[:-1] and other != path]
    other = _pick(siblings, rng)
    if other is None:
        return None
    first, second = _at(document, path), _at(document, other)
    return _set(_set(document, path, second), other, first)


def _cut(document: Document, rng: np.random.Generator) -> Document | None:
    """A list or object loses one item."""
    path = _pick([path for section in SECTIONS for path in truth.leaves(document[section], (section,))
                  if len(path) > 2], rng)
    if path is None:
        return None
    del _at(document, path[:-1])[path[-1]]
    return document


def _wider(document: Document, rng: np.random.Generator) -> Document | None:
    """A range of the region becomes wider."""
    pairs = sorted({path[:-1] for path in _numeric(document, ("region",)) if path[-1] == 1
                    and len(_at(document, path[:-1])) == 2 and _is_number(_at(document, path[:-1])[0])}, key=str)
    path = _pick(pairs, rng)
    if path is None:
        return None
    low, high = (truth.number(value) for value in _at(document, path))
    more = (high - low + 1e-3 * abs(high)) * 10 ** float(rng.uniform(-4, 0.5))
    return _set(document, path, [low - more * float(rng.random() < 0.5), high + more])


def _renamed(document: Document, rng: np.random.Generator) -> Document | None:
    """A name of a lump, ambient, module or method in the place of another."""
    texts = [path for section in SECTIONS for path in truth.leaves(document[section], (section,))
             if isinstance(_at(document, path), str) and not _is_number(_at(document, path))]
    path = _pick(texts, rng)
    names = [*document["system"].get("lumps", {}), *document["system"].get("ambients", []),
             *(_at(document, other) for other in texts)]
    return None if path is None else _set(document, path, _pick(names, rng))


def _other_form(document: Document, rng: np.random.Generator) -> Document:
    """All numbers that are floats as decimal or hexadecimal text: the same claim."""
    form = (repr, float.hex)[int(rng.integers(2))]
    for path in _numeric(document):
        value = _at(document, path)
        if isinstance(value, float):
            _set(document, path, form(value))
    return document


def _with_margin(document: Document, rng: np.random.Generator) -> Document | None:
    """A stored margin, small or too large."""
    key = MARGINS.get(document.get("kind", ""))
    if key is None:
        return None
    document["margin"] = {key: float(10 ** rng.uniform(-8, 1)) * float(rng.choice([-1, 1, 1]))}
    return document


MARGINS = {"contraction": "rate", "regulated": "rate", "network": "rate", "invariance": "heat",
           "observer": "contraction", "loop": "contraction"}
_CHANGES = (_one_digit, _one_digit, _factor, _factor, _claimed_more, _claimed_more, _lost_digits, _swapped, _swapped,
            _cut, _wider, _wider, _renamed, _other_form, _with_margin)
